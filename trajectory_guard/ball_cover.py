"""
Cover a path by balls of displacements [Schroecker & Weber 2014], not by hulls of control points.

Each body that moves is a polyhedron under its own rational motion, with what that may be off as
thickness; the obstacles are polyhedra, as few as their rounding radii allow. An interval is free
where every pair is; collisions are not proved.
"""

from dataclasses import dataclass
import math
import time
from typing import NamedTuple

import numpy as np

from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.errors import RequestError
from trajectory_guard.kernels import layout
from trajectory_guard.kernels.cover import Covered
from trajectory_guard.motions.floating import stretch
from trajectory_guard.motions.link_motion import Builder, rational_motion
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.free_path import FreePath
from trajectory_guard.paths.joint_path import JointPath
from trajectory_guard.settings import Scope, Settings
from trajectory_guard.shapes.body import ConvexBody, U
from trajectory_guard.shapes.facets import Faceted, faceted, joined
from trajectory_guard.shapes.polyhedron import Polyhedron
from trajectory_guard.toleranced.collision import collisions
from trajectory_guard.toleranced.pair import Pair, pair_of
from trajectory_guard.toleranced.suspect import Suspect, Why

# Obstacles whose balls are rounding, below this part of their size, count as one polyhedron.
ROUNDING = 2.0**-30

# A motion off by more than this part of the tolerance is built anew for shorter pieces, if that
# may help; below the deepest it does not.
WORTH = 0.125
DEEPEST_MOTION = 14

DEEPEST = 48  # times are exact in a double up to here

# Tests that count as one piece of the budget.
TESTS = 64

_REASON = {
    Why.EPSILON: layout.BY_TOLERANCE,
    Why.DEPTH: layout.BY_DEPTH,
    Why.BUDGET: layout.BY_BUDGET,
    Why.STOPPED: layout.BY_STOP,
    Why.CONTAINED: layout.BY_ENCLOSURE,
}


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """
    Obstacles as one polyhedron.

    :param polyhedron: all of them.
    :param ball: within which it contains them [m].
    :param owner: (F,) obstacle of each face.
    """

    polyhedron: Polyhedron
    ball: float
    owner: np.ndarray


class BallCell:
    """
    The bodies of a workcell as polyhedra; a pair is prepared when it is first asked for.

    :param links: bodies in their nodes' frames.
    :param obstacles: bodies in the root frame.
    """

    def __init__(self, links: tuple[ConvexBody, ...], obstacles: tuple[ConvexBody, ...]) -> None:
        self._links = links
        self._faceted: dict[int, Faceted] = {}
        self._pairs: dict[tuple[int, int], Pair] = {}
        self.targets = _grouped([faceted(body) for body in obstacles])

    def link_ball(self, body: int) -> float:
        """Return the ball within which a body's polyhedron contains it [m]."""
        return self._link(body).ball

    def pair(self, body: int, target: int) -> Pair:
        """Return a body and its targets, prepared."""
        key = body, target
        if key not in self._pairs:
            targets = self.targets[target]
            self._pairs[key] = pair_of(
                self._link(body).polyhedron, targets.polyhedron, solids=targets.owner
            )
        return self._pairs[key]

    def _link(self, body: int) -> Faceted:
        if body not in self._faceted:
            self._faceted[body] = faceted(self._links[body])
        return self._faceted[body]


def _grouped(obstacles: list[Faceted]) -> tuple[Targets, ...]:
    """Return the obstacles in few polyhedra: solids and surfaces apart, and each large ball."""
    groups: dict[tuple[bool, float], list[int]] = {}
    for o, (polyhedron, ball) in enumerate(obstacles):
        exact = ball <= ROUNDING * float(np.ptp(polyhedron.vertices, axis=0).max())
        groups.setdefault((polyhedron.watertight, 0.0 if exact else ball), []).append(o)
    targets = []
    for members in groups.values():
        polyhedron, owner = joined([obstacles[o].polyhedron for o in members])
        ball = max(obstacles[o].ball for o in members)
        targets.append(Targets(polyhedron, ball, np.array(members)[owner]))
    return tuple(targets)


class _Part(NamedTuple):
    """
    A motion of a body on a piece of a segment.

    :param motion: the motion, None if no bound for it is known.
    :param numerator: place of the piece.
    :param level: its power of two.
    :param ball: the ball around the body's polyhedron, as large as the motion may make it [m].
    """

    motion: RationalMotion | None
    numerator: int
    level: int
    ball: float


class _Open(NamedTuple):
    """
    A span of a segment that is not free, in 2^-48 of it.

    :param start: its start.
    :param end: its end.
    :param reason: a leaf's.
    :param body: index of the body.
    :param obstacle: index of the obstacle, -1 if none is known.
    :param place: about where [m].
    """

    start: int
    end: int
    reason: int
    body: int
    obstacle: int
    place: tuple[float, float, float]


def cover_by_balls(
    workcell: Workcell,
    path: JointPath,
    slack: np.ndarray,
    bodies: np.ndarray,
    settings: Settings,
    stop: np.ndarray,
) -> Covered:
    """
    Cover all segments of a path.

    :param workcell: robot and scene.
    :param path: the motion of every movable joint.
    :param slack: (n,) tracking tolerance per movable joint [rad or m].
    :param bodies: (M,) bodies to check against every obstacle.
    :param settings: what is asked.
    :param stop: (1,) int64; another thread sets it non-zero to have the rest given up.
    :returns: leaves in time order, free and suspect; after the first suspect segment none if no
        more was asked for.
    """
    begin = time.perf_counter()
    cell = workcell.ball_cell
    work = _Work(workcell, path, slack, settings, stop, TESTS * settings.max_pieces)
    leaves: list[np.ndarray] = []
    for segment in range(len(path.coefficients)):
        found = [
            span
            for b in bodies.tolist()
            for part in work.parts(cell, b, segment)
            for span in work.opened(cell, b, part)
        ]
        leaves.append(_leaves(segment, found))
        if found and settings.scope is not Scope.ALL:
            break
    none = np.zeros(0)
    return Covered(
        np.concatenate(leaves),
        work.pieces,
        time.perf_counter() - begin,
        none.astype(layout.ENTRY),
        none.astype(layout.PIECE),
        none.astype(layout.OPENED),
        none.astype(layout.WANTED),
    )


class _Work:
    """A path on its way, and what has been spent on it."""

    def __init__(
        self,
        workcell: Workcell,
        path: JointPath,
        slack: np.ndarray,
        settings: Settings,
        stop: np.ndarray,
        tests: int,
    ) -> None:
        self._workcell, self._path, self._slack = workcell, path, slack
        self._settings, self._stop, self._left = settings, stop, tests
        self.pieces = 0

    def parts(self, cell: BallCell, body: int, segment: int) -> list[_Part]:
        """Return motions of a body that together are a segment, none off by much."""
        free = self._path.floating
        ball = self._ball(cell, body, segment)
        if free is not None and self._carried(body):
            return [_Part(self._given(free, body, segment), 0, 0, ball)]
        done: list[_Part] = []
        waiting = [(0, 0)]
        while waiting:
            numerator, level = waiting.pop()
            motion = self._built(body, segment, numerator, level)
            self._left -= TESTS
            good = motion is not None and motion.error <= WORTH * self._settings.tolerance
            spent = self._stop[0] or self._left <= 0
            if good or spent or level == DEEPEST_MOTION:
                done.append(_Part(motion, numerator, level, ball))
            else:
                waiting += [(2 * numerator + 1, level + 1), (2 * numerator, level + 1)]
        return done

    def _ball(self, cell: BallCell, body: int, segment: int) -> float:
        """
        Bound the ball around a body's polyhedron in a segment [m].

        A rigid motion leaves it as it is. The linear part of an affine one makes no vector longer
        than 1 + stretch times its length, and is itself off by turn_error. The error of a motion
        that is built counts that for the body's own ball already.
        """
        ball = cell.link_ball(body)
        free = self._path.floating
        if free is None:
            return ball
        own = 0.0 if self._carried(body) else float(self._workcell.links.size[body, layout.BALL])
        longer = stretch(free.motions[segment])[0] + float(free.turn_error[segment])
        return (ball + longer * max(0.0, ball - own)) * (1.0 + 8.0 * U)

    def _carried(self, body: int) -> bool:
        """Say whether a body hangs on the floating joint itself."""
        node = int(self._workcell.link_nodes[body])
        return bool(self._workcell.tree.chain.kind[node] == layout.ROTATION)

    def _given(self, free: FreePath, body: int, segment: int) -> RationalMotion:
        """
        Return the given motion in the root frame.

        The product with the fixed pose before the joint rounds each entry by 4 u of the sum of
        its terms.
        """
        workcell = self._workcell
        chain = workcell.tree.chain
        # The translation above the rotation is what the fixed pose is written to.
        fixed = chain.transform[chain.parent[workcell.link_nodes[body]]].reshape(3, 4)
        points = free.motions[segment].control_points
        moved = fixed[:, :3] @ points
        moved[:, :, 3] += fixed[:, 3]
        far = float(workcell.links.size[body, layout.FAR])
        size = float(np.abs(points[:, :, :3]).max() * far + np.abs(points[:, :, 3]).max())
        rounding = 64.0 * U * (size + float(np.abs(fixed[:, 3]).max()))
        error = (free.shift_error[segment] + free.turn_error[segment] * far + rounding) * (
            1.0 + 8.0 * U
        )
        # Turning what the motion has stretched moves it by as much more.
        longest = float(np.linalg.norm(points[:, :, :3], ord=2, axis=(1, 2)).max())
        shift, turn = self._slack[self._path.in_path].tolist()
        inflation = (shift + turn * far * max(1.0, longest)) * (1.0 + 2.0**-40)
        return RationalMotion(moved, free.motions[segment].weights, float(error), inflation)

    def _built(self, body: int, segment: int, numerator: int, level: int) -> RationalMotion | None:
        try:
            return rational_motion(
                self._workcell,
                self._path,
                body,
                segment,
                numerator,
                level,
                self._slack,
                Builder.ECONOMISED,
            )
        except RequestError:
            return None  # it turns too far for one motion

    def opened(self, cell: BallCell, body: int, part: _Part) -> list[_Open]:
        """Return where a body is not proved free on a part of a segment."""
        whole = DEEPEST - part.level
        start = part.numerator << whole
        if part.motion is None or self._stop[0] or self._left <= 0:
            reason = layout.BY_STOP
            if not self._stop[0]:
                reason = layout.BY_DEPTH if part.motion is None else layout.BY_BUDGET
            return [_Open(start, start + (1 << whole), reason, body, -1, (0.0, 0.0, 0.0))]
        found = []
        for target, targets in enumerate(cell.targets):
            answer = collisions(
                cell.pair(body, target),
                part.motion,
                epsilon=0.5 * self._settings.tolerance,
                clearance=(self._settings.clearance + part.ball + targets.ball) * (1.0 + 4.0 * U),
                max_depth=whole,
                max_tests=max(1, self._left),
                stop=self._stop,
            )
            self._left -= answer.polygon_tests + answer.node_tests
            self.pieces += answer.pieces
            found += [_open(suspect, start, whole, body, targets) for suspect in answer.suspect]
        return found


def _open(suspect: Suspect, start: int, whole: int, body: int, targets: Targets) -> _Open:
    obstacle = int(targets.owner[suspect.fixed_face]) if suspect.fixed_face >= 0 else -1
    if obstacle < 0 and len(set(targets.owner.tolist())) == 1:
        obstacle = int(targets.owner[0])
    return _Open(
        start + int(math.ldexp(suspect.start, whole)),
        start + int(math.ldexp(suspect.end, whole)),
        _REASON[suspect.why],
        body,
        obstacle,
        suspect.place or (0.0, 0.0, 0.0),
    )


def _leaves(segment: int, found: list[_Open]) -> np.ndarray:
    """Return leaves that partition a segment, those of open spans as the first of them says."""
    end = 1 << DEEPEST
    cuts = sorted({0, end, *(at for span in found for at in (span.start, span.end))})
    rows = np.zeros(len(cuts) - 1, layout.LEAF)
    rows['segment'], rows['level'] = segment, DEEPEST
    rows['start'], rows['end'] = cuts[:-1], cuts[1:]
    rows['status'] = layout.FREE
    rows['body'] = rows['obstacle'] = -1
    index = {at: i for i, at in enumerate(cuts)}
    for span in reversed(found):
        row = slice(index[span.start], index[span.end])
        rows['status'][row] = layout.SUSPECT
        rows['reason'][row] = span.reason
        known = span.obstacle >= 0
        rows['body'][row] = span.body if known else -1
        rows['obstacle'][row] = span.obstacle
        rows['place'][row] = span.place
        rows['lower'][row], rows['upper'][row] = -np.inf, np.inf
    return rows
