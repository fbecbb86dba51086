"""
An outside judge for many configurations: coal, asked only where boxes do not settle it.

The kinematics, the spheres and the boxes are of this file; nothing of the certifier is used but
the shapes of robot and scene.
"""

from typing import NamedTuple

import coal
from coal_judge import shape
import numpy as np

from trajectory_guard.cell.robot import JointType
from trajectory_guard.result import Status

CHUNK = 1024


class Counts(NamedTuple):
    """
    What a sweep saw.

    :param samples: configurations in tubes of free intervals.
    :param queries: distances that coal computed for them.
    :param violations: configurations that are not farther than the clearance.
    :param nearest: smallest distance beyond the clearance [m].
    :param hits: configurations in collision intervals.
    :param missed: those of them where nothing overlaps.
    """

    samples: int = 0
    queries: int = 0
    violations: int = 0
    nearest: float = np.inf
    hits: int = 0
    missed: int = 0

    def plus(self, other):
        """Return the sum."""
        return Counts(
            *(
                min(a, b) if name == 'nearest' else a + b
                for name, a, b in zip(self._fields, self, other, strict=True)
            )
        )


class Box(NamedTuple):
    """A box around a body: axes as columns, centre, half sides; and a sphere's radius [m]."""

    axes: np.ndarray
    center: np.ndarray
    half: np.ndarray
    radius: float


def box_around(body):
    """Return the smaller of two boxes that contain a body, and the sphere about its centre."""
    best = None
    frames = [np.eye(3)]
    if len(body.vertices) > 3:
        frames.append(np.linalg.svd(body.vertices - body.vertices.mean(axis=0))[2].T)
    for R in frames:
        local = body.vertices @ R
        reach = body.disc_radius + body.ball
        low, high = local.min(axis=0) - reach, local.max(axis=0) + reach
        half = 0.5 * (high - low) * (1.0 + 1e-12)
        if best is None or half.prod() < best.half.prod():
            center = R @ (0.5 * (low + high))
            radius = np.linalg.norm(body.vertices - center, axis=1).max() + reach
            best = Box(R, center, half, radius * (1.0 + 1e-12))
    return best


class Sweep:
    """Distances between the links and obstacles of a workcell at many configurations."""

    def __init__(self, cell):
        self.robot = cell.robot
        self.names, links = [], []
        for name in cell.robot.collision_links:
            for body in cell.robot.bodies(name):
                self.names.append(name)
                links.append(body)
        obstacles = [body for obstacle in cell.scene.obstacles for body in obstacle.bodies]
        self.link_boxes = [box_around(body) for body in links]
        self.boxes = [box_around(body) for body in obstacles]
        shapes, others = [shape(body) for body in links], [shape(body) for body in obstacles]
        self.shift = [T for _, T, _ in shapes]
        self.fixed = [coal.Transform3s(T[:3, :3], T[:3, 3]) for _, T, _ in others]
        self.balls = np.array([[a[2] + b[2] for b in others] for a in shapes])
        self.shapes = shapes, others  # the functions below point to them
        self.distance = [[coal.ComputeDistance(a[0], b[0]) for b in others] for a in shapes]
        self.request = coal.DistanceRequest()
        self.request.gjk_tolerance = 1e-10

    def poses(self, q):
        """
        Return rotations (N, 3, 3) and origins (N, 3) of every link.

        :param q: (N, n) movable joints.
        """
        value = dict(zip((joint.name for joint in self.robot.movable), q.T, strict=True))
        R = {self.robot.root: np.broadcast_to(np.eye(3), (len(q), 3, 3))}
        t = {self.robot.root: np.zeros((len(q), 3))}
        for joint in self.robot.joints:
            fixed = joint.T_parent_joint
            up = R[joint.parent]
            t[joint.child] = t[joint.parent] + up @ fixed[:3, 3]
            R[joint.child] = up @ fixed[:3, :3]
            if joint.type is JointType.FIXED:
                continue
            x, y, z = joint.axis
            if joint.type is JointType.PRISMATIC:
                along = R[joint.child] @ joint.axis
                t[joint.child] = t[joint.child] + along * value[joint.name][:, None]
                continue
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            s, c = np.sin(value[joint.name]), np.cos(value[joint.name])
            turn = np.eye(3) + s[:, None, None] * K + (1.0 - c)[:, None, None] * (K @ K)
            R[joint.child] = R[joint.child] @ turn
        return R, t

    def gaps(self, q, moved, within):
        """
        Return the smallest distance of every configuration, exact where it is at most `within`.

        :param q: (N, n) movable joints.
        :param moved: names of the links that count.
        :param within: distances above it need not be computed [m].
        :returns: (N,) distances [m], inf where spheres and boxes show that all are larger, and how
            many coal computed.
        """
        best, queries = np.full(len(q), np.inf), 0
        bodies = [i for i, name in enumerate(self.names) if name in moved]
        for first in range(0, len(q), CHUNK):
            some = q[first : first + CHUNK]
            R, t = self.poses(some)
            for i in bodies:
                name, box = self.names[i], self.link_boxes[i]
                center = t[name] + R[name] @ box.center
                for o, other in enumerate(self.boxes):
                    local = (center - other.center) @ other.axes
                    outside = np.maximum(np.abs(local) - other.half, 0.0)
                    square = np.einsum('ni,ni->n', outside, outside)
                    near = np.flatnonzero(square <= (within + box.radius) ** 2)
                    if len(near):
                        near = near[self._boxes_near(R[name][near], local[near], i, o, within)]
                    if len(near):
                        d = self._ask(R[name][near], t[name][near], i, o)
                        best[first + near] = np.minimum(best[first + near], d)
                        queries += len(near)
        return best, queries

    def _boxes_near(self, R, local, i, o, within):
        """Say for which places no face of either box separates by more than `within`."""
        box, other = self.link_boxes[i], self.boxes[o]
        M = other.axes.T @ R @ box.axes
        size = np.abs(M)
        theirs = np.abs(local) - other.half - size @ box.half
        ours = np.abs(np.einsum('nrc,nr->nc', M, local)) - box.half
        ours -= np.einsum('nrc,r->nc', size, other.half)
        return np.maximum(theirs.max(axis=1), ours.max(axis=1)) <= within

    def _ask(self, R, t, i, o):
        """Return coal's distances of a link's places to an obstacle [m]."""
        function, fixed, request = self.distance[i][o], self.fixed[o], self.request
        shift, result, placed = self.shift[i], coal.DistanceResult(), coal.Transform3s()
        turned = R @ shift[:3, :3]
        moved = t + R @ shift[:3, 3]
        found = np.empty(len(R))
        for k in range(len(R)):
            placed.setRotation(turned[k])
            placed.setTranslation(moved[k])
            result.clear()
            found[k] = function(placed, fixed, request, result)
        return found - self.balls[i, o]


def positions(path, times_ns):
    """Return (N, n) joint values at times [ns]."""
    knots = path.knots_ns
    i = np.clip(np.searchsorted(knots, times_ns, side='right') - 1, 0, len(knots) - 2)
    s = (times_ns - knots[i]) / np.maximum(knots[i + 1] - knots[i], 1)
    q = path.coefficients[i, :, 5]
    for k in range(4, -1, -1):
        q = q * s[:, None] + path.coefficients[i, :, k]
    return q


def instants(rng, rows, count):
    """
    Return times in intervals: anywhere, and near their ends as often [ns].

    :param rows: (K, 2) int64 starts and ends.
    """
    length = (rows[:, 1] - rows[:, 0]).astype(float)
    chosen = rng.choice(len(rows), count, p=(length + 1.0) / (length + 1.0).sum())
    # Every interval has ends, however short it is.
    chosen[1::2] = rng.integers(len(rows), size=len(chosen[1::2]))
    part = rng.random(count)
    part[1::4] = 10.0 ** rng.uniform(-9.0, -1.0, len(part[1::4]))
    part[5::8] = 0.0
    part[3::4] = 1.0 - 10.0 ** rng.uniform(-9.0, -1.0, len(part[3::4]))
    part[7::8] = 1.0
    return np.rint(rows[chosen, 0] + part * length[chosen]).astype(np.int64)


def tubes(rng, count, slack):
    """Return (count, n) offsets within the tracking tolerance: the path, anywhere, corners."""
    off = rng.uniform(-1.0, 1.0, (count, len(slack)))
    off[::3] = np.sign(off[::3])
    off[1::9] = 0.0
    return off * slack


def swept(sweep, moved, path, result, slack, rng, count, error=1e-9):
    """
    Judge a certified path at random configurations.

    :param moved: names of the links that the path moves.
    :param result: what was certified.
    :param slack: (n,) tracking tolerance [rad or m].
    :param count: configurations in the tubes of free intervals; a tenth of them in collisions.
    :param error: what coal may be off by [m].
    """
    counts = Counts()
    spans = {
        status: np.array(
            [(row.start_ns, row.end_ns) for row in result.intervals if row.status == status],
            np.int64,
        ).reshape(-1, 2)
        for status in (Status.FREE, Status.COLLISION)
    }
    if len(spans[Status.FREE]):
        q = positions(path, instants(rng, spans[Status.FREE], count))
        q += tubes(rng, count, slack)
        # A little beyond the clearance, so that what was nearly missed is seen.
        gaps, queries = sweep.gaps(q, moved, result.clearance + 1e-3)
        gaps -= result.clearance
        counts = Counts(count, queries, int((gaps <= -error).sum()), float(gaps.min()))
    if len(spans[Status.COLLISION]):
        some = max(1, count // 10)
        q = positions(path, instants(rng, spans[Status.COLLISION], some))
        gaps, _ = sweep.gaps(q, moved, error)
        counts = counts.plus(Counts(hits=some, missed=int((gaps >= error).sum())))
    return counts
