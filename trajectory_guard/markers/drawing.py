"""What viewers draw for the collision geometry of a link."""

from typing import NamedTuple

import numpy as np

from trajectory_guard.cell.robot import Collision, Robot
from trajectory_guard.markers.marker import MarkerKind
from trajectory_guard.shapes.body import ConvexBody, read_only
from trajectory_guard.shapes.primitive import Box, Cylinder, Sphere

# A mesh of more triangles is drawn as its hull.
MOST_TRIANGLES = 1_000

ONES = (1.0, 1.0, 1.0)
NO_POINTS = read_only(np.empty((0, 3)))


class Drawing(NamedTuple):
    """
    A geometry as a viewer draws it.

    :param kind: CUBE, SPHERE, CYLINDER or TRIANGLE_LIST.
    :param T: its pose, (4, 4) [m].
    :param scale: as of a marker [m].
    :param points: (3 m, 3) corners of the triangles in its own frame [m].
    """

    kind: MarkerKind
    T: np.ndarray
    scale: tuple[float, float, float] = ONES
    points: np.ndarray = NO_POINTS

    def moved(self, T: np.ndarray) -> 'Drawing':
        """Return the drawing after a motion, (4, 4) [m]; its points stay the same array."""
        return self._replace(T=T @ self.T)


def link_drawings(robot: Robot, link: str) -> tuple[Drawing, ...]:
    """
    Return a drawing for each collision geometry of a link, in the link's frame.

    :param robot: the robot.
    :param link: one of its links.
    :raises RobotError: a mesh is missing or unusable.
    """
    return tuple(
        _drawing(collision, body)
        for collision, body in zip(robot.collisions.get(link, ()), robot.bodies(link), strict=True)
    )


def _drawing(collision: Collision, body: ConvexBody) -> Drawing:
    T = collision.T_link_shape
    match collision.shape:
        case Box(size):
            return Drawing(MarkerKind.CUBE, T, size)
        case Cylinder(radius, length):
            return Drawing(MarkerKind.CYLINDER, T, (2.0 * radius, 2.0 * radius, length))
        case Sphere(radius):
            return Drawing(MarkerKind.SPHERE, T, (2.0 * radius,) * 3)
    # The body is in the link's frame already.
    return Drawing(MarkerKind.TRIANGLE_LIST, np.eye(4), points=read_only(_triangles(body)))


def _triangles(body: ConvexBody) -> np.ndarray:
    """Return the corners of a mesh's triangles, or of its hull's, (3 m, 3)."""
    surface = body.surface
    if surface is not None and len(surface.triangles) <= MOST_TRIANGLES:
        return surface.placed.points[surface.triangles].reshape(-1, 3)
    # Brings scipy.
    from scipy.spatial import ConvexHull, QhullError

    points = body.vertices
    try:
        return points[ConvexHull(points).simplices].reshape(-1, 3)
    except (QhullError, ValueError):
        # A flat one: triangles between its corners that lie in it.
        rows = [(0, k, min(k + 1, len(points) - 1)) for k in range(max(1, len(points) - 1))]
        return points[np.array(rows)].reshape(-1, 3)
