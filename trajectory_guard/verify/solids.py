"""Convex solids in balls, and the bodies of the robot during a piece."""

from collections.abc import Mapping, Sequence

from flint import arb, arb_mat

from trajectory_guard.shapes.body import ConvexBody
from trajectory_guard.verify.levers import Levers
from trajectory_guard.verify.motion import Arm, Piece
from trajectory_guard.verify.vector import largest, least, length, Vector


class Solid:
    """
    The solid conv(vertices) (+) disc (+) ball, and a polytope inside what it stands for.

    :param body: the same in doubles.
    """

    def __init__(self, body: ConvexBody) -> None:
        points = body.vertices.tolist()
        self.vertices = arb_mat([[*point, 1] for point in points]).transpose()
        self.ball, self.disc = arb(body.ball), arb(body.disc_radius)
        self.axis = [arb(x) for x in body.disc_axis.tolist()]
        self.center: list[float] = body.center.tolist()
        away = [[arb(x) - c for x, c in zip(p, self.center, strict=True)] for p in points]
        self.sphere = largest([length(offset) for offset in away]) + self.disc + self.ball
        self.faces = [[arb(x) for x in face] for face in body.faces.tolist()]

    def rim(self, g: Vector) -> arb:
        """Return an upper bound of the disc's support R |g - (g.a) a / (a.a)|."""
        if self.disc == 0:
            return self.disc
        a = self.axis
        share = sum((x * y for x, y in zip(g, a, strict=True)), arb(0)) / sum(y * y for y in a)
        return self.disc * length([x - share * y for x, y in zip(g, a, strict=True)])

    def highest(self, normal: Vector) -> arb:
        """Return an upper bound of normal.x over the solid."""
        values = (arb_mat(1, 4, [*normal, 0]) * self.vertices).entries()
        return largest(values) + self.rim(normal) + length(normal) * self.ball

    def depth(self, places: list[Vector]) -> arb:
        """Return how deep the shallowest of some places lies in the polytope, < 0 outside [m]."""
        if not self.faces:
            return arb(-1)
        return least(
            [
                (d - nx * x - ny * y - nz * z) / (nx * nx + ny * ny + nz * nz).sqrt()
                for nx, ny, nz, d in self.faces
                for x, y, z in places
            ]
        )


class Box:
    """
    A box in doubles that roughly contains an obstacle; it only proposes directions.

    :param body: the obstacle.
    :param frame: rows of a rotation whose columns are the axes of the box, as nine numbers.
    """

    def __init__(self, body: ConvexBody, frame: Sequence[float]) -> None:
        self._axes = [[frame[k], frame[3 + k], frame[6 + k]] for k in range(3)]
        self._sides = []
        for axis in self._axes:
            along = body.vertices @ axis
            a = body.disc_axis
            across = sum((x - y * (a @ axis)) ** 2 for x, y in zip(axis, a, strict=True)) ** 0.5
            reach = body.disc_radius * across
            self._sides.append((float(along.min() - reach), float(along.max() + reach)))

    def direction(self, x: float, y: float, z: float) -> Vector | None:
        """Return the direction from the nearest point of the box to a place, None inside."""
        off = []
        for (a, b, c), (low, high) in zip(self._axes, self._sides, strict=True):
            at = a * x + b * y + c * z
            off.append(at - min(max(at, low), high))
        size = sum(value * value for value in off) ** 0.5
        if not 0.0 < size < 1e12:
            return None
        rows = zip(*self._axes, strict=True)
        return [arb(sum(u * v for u, v in zip(off, row, strict=True)) / size) for row in rows]


class Link:
    """
    A body of the robot.

    :param arm: the robot.
    :param name: link that carries the body.
    :param body: the body in that link's frame.
    """

    def __init__(self, arm: Arm, name: str, body: ConvexBody) -> None:
        self.name, self.solid, self.levers = name, Solid(body), Levers(arm, name, body)


class Moved:
    """
    A body of the robot during a piece.

    :param link: the body.
    :param piece: the piece.
    :param tolerance: tracking tolerance per movable joint [rad or m].
    """

    def __init__(self, link: Link, piece: Piece, tolerance: Mapping[str, arb]) -> None:
        self.solid, self.controls = link.solid, piece.controls(link.name)
        self.slack = link.levers.slack(piece, tolerance)
        self.centers = self.controls * placed([*self.solid.center, 1.0])
        self._pose = piece.pose(link.name)
        self._poses: dict[int, list[list[float]]] = {}

    def place(self, tau: int, point: Sequence[float]) -> list[float]:
        """Return roughly where a point of the body is at an instant of the piece."""
        if tau not in self._poses:
            self._poses[tau] = [[float(p(tau).mid()) for p in row] for row in self._pose]
        x, y, z = point
        return [a * x + b * y + c * z + d for a, b, c, d in self._poses[tau]]


def placed(point: Sequence[float | arb]) -> arb_mat:
    """Return the matrix (12, 3) that takes rows of a pose to the place of (x, y, z, 1)."""
    return arb_mat([[point[i % 4] if i // 4 == r else 0 for r in range(3)] for i in range(12)])
