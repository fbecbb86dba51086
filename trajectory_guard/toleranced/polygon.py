"""Simple polygons in space, as triangles."""

from dataclasses import dataclass, field

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.shapes.body import LARGEST_COORDINATE, read_only

# Rounded corners leave the plane and cross products their sign by a few units of rounding; a
# polygon worse than this, as a fraction of its size, is not meant to be flat.
PLANAR = 1e-6
ROUNDING = 2.0**-44


@dataclass(frozen=True, slots=True, eq=False)
class Polygon:
    """
    A flat polygon without self-intersections, convex or not.

    The point set it stands for is the union of its n - 2 triangles, exactly, also where rounding
    bends the plane of the corners a little. No corner is dropped: a straight angle is a triangle
    without area.

    :param vertices: (n, 3), in order [m].
    :param triangles: (n - 2, 3) indices, wound like the polygon.
    :param normal: unit normal, seen from whose tip the polygon turns left, (3,).
    :raises RequestError: INVALID_PARAMETER, the corners are fewer than three, not finite,
        repeated, not in a plane, or their polygon has no area or intersects itself.
    """

    vertices: np.ndarray
    triangles: np.ndarray = field(init=False)
    normal: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Check the corners and cut the polygon into triangles."""
        vertices = read_only(self.vertices)
        object.__setattr__(self, 'vertices', vertices)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or len(vertices) < 3:
            raise _invalid(f'must have shape (n, 3), n >= 3, got {vertices.shape}')
        if not np.abs(vertices).max() <= LARGEST_COORDINATE:
            raise _invalid(f'one is not finite or too far: {vertices.tolist()}')
        x = vertices - vertices[0]
        size = np.linalg.norm(x, axis=1).max()
        sides = np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1)
        if not sides.min() > 0.0:
            raise _invalid(f'vertex {sides.argmin()} is repeated: {vertices[sides.argmin()]}')
        # Newell's normal: the mean of all the corners' turns, twice the area long.
        area = np.cross(x, np.roll(x, -1, axis=0)).sum(axis=0)
        doubled = np.linalg.norm(area)
        if not doubled > ROUNDING * size * size:
            raise _invalid(f'the polygon has no area: {vertices.tolist()}')
        normal = area / doubled
        heights = x @ normal
        if not np.ptp(heights) <= PLANAR * size:
            raise _invalid(f'they are {np.ptp(heights):.3g} m off a plane: {vertices.tolist()}')
        triangles = _ears(x @ plane_axes(normal), ROUNDING * size * size)
        if triangles is None:
            raise _invalid(f'the polygon intersects itself: {vertices.tolist()}')
        triangles.flags.writeable = False
        object.__setattr__(self, 'triangles', triangles)
        object.__setattr__(self, 'normal', read_only(normal))

    @property
    def corners(self) -> np.ndarray:
        """Corners of the triangles, (n - 2, 3, 3) [m]."""
        corners: np.ndarray = self.vertices[self.triangles]
        return corners

    @property
    def edges(self) -> np.ndarray:
        """Ends of the edges, in order, (n, 2, 3) [m]."""
        return np.stack((self.vertices, np.roll(self.vertices, -1, axis=0)), axis=1)


def plane_axes(normal: np.ndarray) -> np.ndarray:
    """
    Return orthonormal b1, b2 with b1 x b2 = normal as columns, (3, 2).

    :param normal: unit vector, (3,).
    """
    b1 = np.zeros(3)
    b1[np.abs(normal).argmin()] = 1.0
    b1 -= normal * (normal @ b1)
    b1 /= np.linalg.norm(b1)
    return np.column_stack((b1, np.cross(normal, b1)))


def _ears(points: np.ndarray, area: float) -> np.ndarray | None:
    """
    Cut a polygon into triangles, ear by ear [Meisters 1975].

    An ear is a corner that turns left (or not at all) and whose triangle holds no other corner; a
    simple polygon has one. If all triangles turn left and their areas add up to that of the
    polygon, whose boundary they have, they overlap nowhere.

    :param points: (n, 2), counter-clockwise.
    :param area: what counts as no area.
    :returns: (n - 2, 3) indices; None if the polygon intersects itself.
    """
    if _crosses_itself(points, area):
        return None
    left = list(range(len(points)))
    triangles: list[tuple[int, ...]] = []
    while len(left) > 3:
        ears = (k for k in range(len(left)) if _is_ear(points, left, k, area))
        k = next(ears, None)
        if k is None:
            return None
        triangles.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        del left[k]
    triangles.append(tuple(left))
    return np.array(triangles)


def _is_ear(points: np.ndarray, left: list[int], k: int, area: float) -> bool:
    a, b, c = (points[left[i % len(left)]] for i in (k - 1, k, k + 1))
    turn = _turn(a, b, c)
    if turn < -area:
        return False
    used = {left[i % len(left)] for i in (k - 1, k, k + 1)}
    others = points[[i for i in left if i not in used]]
    if turn <= area:
        # A straight angle, or a spike of no width; a corner on it would be a crossing.
        return bool((a - b) @ (c - b) < 0.0)
    inside = np.ones(len(others), dtype=bool)
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= _turn(p, q, others) >= -area
    return not inside.any()


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return twice the signed areas of triangles a, b, c, each (2,) or (n, 2)."""
    side, away = b - a, c - a
    turn: np.ndarray = side[..., 0] * away[..., 1] - side[..., 1] * away[..., 0]
    return turn


def _crosses_itself(points: np.ndarray, area: float) -> bool:
    """Say whether two edges without a common corner meet, or two neighbours fold back."""
    n = len(points)
    ends = np.roll(points, -1, axis=0)
    for i in range(n):
        a, b, after = points[i], ends[i], ends[(i + 1) % n]
        if abs(_turn(a, b, after)) <= area and (a - b) @ (after - b) > 0.0:
            return True
        others = slice(i + 2, n if i else n - 1)
        c, d = points[others], ends[others]
        # Both ends of neither edge are on one side of the other, and their boxes meet.
        meet = np.ones(len(c), dtype=bool)
        for sides in ((_turn(a, b, c), _turn(a, b, d)), (_turn(c, d, a), _turn(c, d, b))):
            meet &= (np.minimum(*sides) <= area) & (np.maximum(*sides) >= -area)
        meet &= (np.maximum(a, b) >= np.minimum(c, d)).all(axis=1)
        meet &= (np.maximum(c, d) >= np.minimum(a, b)).all(axis=1)
        if meet.any():
            return True
    return False


def _invalid(message: str) -> RequestError:
    return RequestError(Reason.INVALID_PARAMETER, f'vertices: {message}')
