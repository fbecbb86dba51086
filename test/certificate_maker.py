"""A plain maker of certificates: samples, nearest points, linear programs; no proof."""

from itertools import groupby
import json

import coal
from coal_judge import shape
import numpy as np
from random_robot import link_poses
from scipy.optimize import linprog

from trajectory_guard.verify.document import seal

SAMPLES = 7
FIRST_LEVEL = 2


class Maker:
    """Makes the certificate of a joint path in a cell of robot and scene."""

    def __init__(self, robot, scene, path, clearance=0.0, tolerance=0.0, deepest=7, turning=()):
        self.robot, self.scene, self.path = robot, scene, path
        self.clearance, self.tolerance, self.deepest = clearance, tolerance, deepest
        self.turning = turning
        self.links = [
            (link, body) for link in robot.collision_links for body in robot.bodies(link)
        ]
        self.obstacles = [(o.name, body) for o in scene.obstacles for body in o.bodies]
        self.shapes = [shape(body) for _, body in self.links]
        self.fixed = [shape(body) for _, body in self.obstacles]
        self.pieces, self.leaves = [], []
        self.rows = {'balls': [], 'planes': [], 'turning': [], 'collisions': []}
        moved = set()
        for joint in robot.joints:
            number = {j.name: k for k, j in enumerate(robot.movable)}.get(joint.name)
            if joint.parent in moved or (number is not None and path.in_path[number]):
                moved.add(joint.child)
        bodies = [b for b, (link, _) in enumerate(self.links) if link in moved]
        self.pairs = [(b, o) for b in bodies for o in range(len(self.obstacles))]

    def positions(self, segment, s):
        """Return the joints at a place of a segment."""
        return np.array([np.polyval(c[::-1], s) for c in self.path.coefficients[segment]])

    def cover(self, segment, numerator, level, pairs):
        """Cover a piece; its free pairs are proved on it, the others on its halves."""
        piece, left = self.piece(segment, numerator, level), []
        for pair, proposal in zip(pairs, self.proposals(piece, pairs), strict=True):
            if proposal is None:
                left.append(pair)
            elif proposal[0] == 'balls':
                row = next((r for r in self.rows['balls'] if r[:2] == [piece, pair[0]]), None)
                if row is None:
                    row = [piece, pair[0], []]
                    self.rows['balls'].append(row)
                row[2].append(pair[1])
            else:
                self.rows[proposal[0]].append([piece, *pair, *proposal[1]])
        if not left:
            self.leaves.append((segment, numerator, level, 'free'))
        elif any(self.collides(piece, pair) for pair in left):
            self.leaves.append((segment, numerator, level, 'collision'))
        elif level >= self.deepest:
            self.leaves.append((segment, numerator, level, 'suspect'))
        else:
            for half in (0, 1):
                self.cover(segment, 2 * numerator + half, level + 1, left)

    def piece(self, *place):
        """Return the index of a piece."""
        if list(place) not in self.pieces:
            self.pieces.append(list(place))
        return self.pieces.index(list(place))

    def poses(self, piece):
        """Return the link poses at samples of a piece."""
        segment, numerator, level = self.pieces[piece]
        return [
            link_poses(self.robot, self.positions(segment, (numerator + s) / 2**level))
            for s in np.linspace(0.0, 1.0, SAMPLES)
        ]

    def proposals(self, piece, pairs):
        """Yield what may prove each pair on a piece, or None."""
        poses = self.poses(piece)
        for b, o in pairs:
            link, body = self.links[b]
            _, obstacle = self.obstacles[o]
            slack = self.tolerance * 2.0 * len(self.robot.movable)
            spare = self.clearance + slack + obstacle.ball
            middle = poses[SAMPLES // 2][link]
            center = middle[:3, :3] @ body.center + middle[:3, 3]
            n = center - np.clip(center, obstacle.vertices.min(0), obstacle.vertices.max(0))
            normals = [n / np.linalg.norm(n)] if n.any() else []
            low = [(T[link][:3, :3] @ body.center + T[link][:3, 3]) for T in poses]
            if normals and not obstacle.disc_radius:
                reach = min(x @ n / np.linalg.norm(n) for x in low) - body.radius
                if reach - (obstacle.vertices @ normals[0]).max() > 1.3 * spare + 0.02:
                    yield 'balls', None
                    continue
            yield self.plane(poses, b, o, spare)

    def plane(self, poses, b, o, spare):
        """Return a plane or a turning plane between two bodies, or None."""
        link, body = self.links[b]
        _, obstacle = self.obstacles[o]
        normals = [self.normal(poses[k][link], b, o) for k in (0, SAMPLES // 2, -1)]
        if any(n is None for n in normals):
            return None
        high = support(obstacle, normals[1]) + obstacle.ball
        low = min(-support(body, -T[link][:3, :3].T @ normals[1]) + normals[1] @ T[link][:3, 3]
                  for T in poses) - body.ball  # fmt: skip
        if low - high > spare + 1e-4 and self.obstacles[o][0] not in self.turning:
            offset = 0.5 * (low + high + self.clearance - (spare - self.clearance))
            return 'planes', [*map(float, normals[1]), float(offset)]
        n, m = normals[1], 0.5 * (normals[2] - normals[0])
        k = 0.5 * (normals[0] + normals[2]) - n
        gaps = []
        for s, T in zip(np.linspace(-1.0, 1.0, SAMPLES), poses, strict=True):
            d = n + s * m + s * s * k
            g = T[link][:3, :3].T @ d
            gaps.append(d @ T[link][:3, 3] - support(body, -g) - support(obstacle, d) - body.ball)
        if min(gaps) > spare + 1e-4:
            return 'turning', [*map(float, n), *map(float, m), *map(float, k)]
        return None

    def normal(self, T, b, o):
        """Return the direction between the nearest points, None if they touch."""
        (first, shift, ball), (second, other, margin) = self.shapes[b], self.fixed[o]
        T = T @ shift
        result = coal.DistanceResult()
        distance = coal.distance(
            first, coal.Transform3s(T[:3, :3], T[:3, 3]),
            second, coal.Transform3s(other[:3, :3], other[:3, 3]),
            coal.DistanceRequest(), result,
        )  # fmt: skip
        if distance - ball - margin <= 1e-6:
            return None
        n = result.getNearestPoint1() - result.getNearestPoint2()
        return n / np.linalg.norm(n)

    def collides(self, piece, pair):
        """Try to write down a collision of a pair on a whole piece."""
        (link, body), (_, obstacle) = self.links[pair[0]], self.obstacles[pair[1]]
        poses = self.poses(piece)
        ends = [deepest(body.faces, obstacle.faces, poses[k][link]) for k in (0, -1)]
        if any(end is None or end[1] < 1e-4 for end in ends):
            return False
        for s, T in zip(np.linspace(0.0, 1.0, SAMPLES), poses, strict=True):
            y = (1.0 - s) * ends[0][0] + s * ends[1][0]
            x = T[link][:3, :3] @ y + T[link][:3, 3]
            if (obstacle.faces[:, :3] @ x > obstacle.faces[:, 3] - 1e-5).any():
                return False
        self.rows['collisions'].append([piece, *pair, *ends[0][0].tolist(), *ends[1][0].tolist()])
        return True

    def certificate(self, trajectory, start=None):
        """Return the certificate of the whole path."""
        knots = self.path.knots_ns.tolist()
        for segment in range(len(knots) - 1):
            for numerator in range(2**FIRST_LEVEL):
                self.cover(segment, numerator, FIRST_LEVEL, self.pairs)
        intervals = self.intervals(knots)
        statuses = {row[2] for row in intervals}
        frame = np.eye(3).ravel().tolist()
        return sealed({
            'format': 'trajectory_guard/certificate/1',
            'trajectory': {
                'name': trajectory.name,
                'sha256': trajectory.digest(),
                'interpolation': 'joint_trajectory_controller/jazzy',
                'joint_names': list(trajectory.joint_names),
                'start': start and {
                    'joint_names': list(start.joint_names),
                    'positions': start.positions.tolist(),
                    'velocities': None if start.velocities is None else start.velocities.tolist(),
                },
            },
            'robot': {'sha256': self.robot.digest(), 'links': [name for name, _ in self.links]},
            'scene': {
                'sha256': self.scene.digest,
                'obstacles': [name for name, _ in self.obstacles],
                'frames': [frame] * len(self.obstacles),
            },
            'request': {
                'tolerance': 1e-4,
                'clearance': self.clearance,
                'tracking_tolerance': {
                    joint.name: self.tolerance if inside else 0.0
                    for joint, inside in zip(self.robot.movable, self.path.in_path, strict=True)
                },
            },
            'duration_ns': knots[-1],
            'verdict': min(statuses, key=['collision', 'suspect', 'free'].index),
            'unchecked_pairs': ['links of the robot against each other'],
            'intervals': intervals,
            'pieces': self.pieces,
            **self.rows,
        })  # fmt: skip

    def intervals(self, knots):
        """Return the merged leaves, ends in ns: free shrinks, then collision."""
        first = knots[0]
        rows = [[0, first, 'suspect']] if first else []
        for status, leaves in groupby(self.leaves, key=lambda leaf: leaf[3]):
            *_, (segment, numerator, level, _) = leaves
            step = knots[segment + 1] - knots[segment]
            floor, rest = divmod(step * (numerator + 1), 2**level)
            up = rest and status == 'suspect'
            rows.append([rows[-1][1] if rows else 0, knots[segment] + floor + bool(up), status])
        return rows


def support(body, d):
    """Return the support of a body without its ball."""
    a = body.disc_axis
    return (body.vertices @ d).max() + body.disc_radius * np.linalg.norm(d - (d @ a) * a)


def deepest(faces, others, T):
    """Return the point of the link deepest in both polytopes, and its depth, or None."""
    if not len(faces) or not len(others):
        return None
    turned = others[:, :3] @ T[:3, :3]
    A = np.concatenate([np.c_[faces[:, :3], np.ones(len(faces))],
                        np.c_[turned, np.ones(len(turned))]])  # fmt: skip
    b = np.concatenate([faces[:, 3], others[:, 3] - others[:, :3] @ T[:3, 3]])
    found = linprog([0, 0, 0, -1], A, b, bounds=[(None, None)] * 4)
    return (found.x[:3], found.x[3]) if found.success else None


def sealed(certificate):
    """Return a copy of a certificate with a seal that fits."""
    copy = json.loads(json.dumps(certificate))
    copy['sha256'] = seal(copy)
    return copy
