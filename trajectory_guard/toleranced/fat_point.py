"""The orbit of a point: a ball."""

from dataclasses import dataclass, field

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.shapes.body import LARGEST_COORDINATE, read_only
from trajectory_guard.toleranced.contact import apart
from trajectory_guard.toleranced.displacement_ball import DisplacementBall, Orbit
from trajectory_guard.toleranced.distance import largest_accepted
from trajectory_guard.toleranced.patches import Mesh, sphere
from trajectory_guard.toleranced.polygon import Polygon


@dataclass(frozen=True, slots=True, eq=False)
class FatPoint:
    """
    The orbit of a point under a ball of displacements: the ball round g(x) of radius R rho(x).

    :param ball: the displacements.
    :param point: x, (3,) in the body's frame [m].
    :param orbit: the same as a simplex of one corner.
    :raises RequestError: INVALID_PARAMETER, the point is not finite or too far.
    """

    ball: DisplacementBall
    point: np.ndarray
    orbit: Orbit = field(init=False)

    def __post_init__(self) -> None:
        """Check the point."""
        point = feature(self.point, (3,), 'point')
        object.__setattr__(self, 'point', point)
        object.__setattr__(self, 'orbit', self.ball.orbit(point[None]))

    @property
    def center(self) -> np.ndarray:
        """g(x), rounded, (3,) in the world frame [m]."""
        return self.orbit.image.origin

    @property
    def radius(self) -> float:
        """A radius with which the ball round the rounded centre contains the orbit [m]."""
        bound = self.ball.distribution.bound(self.ball.radius, self.point)
        return float(np.nextafter(bound + self.orbit.image.error, np.inf))

    def apart(self, polygon: Polygon, thickness: float = 0.0) -> bool:
        """
        Say whether a polygon is proved to be farther than a thickness from the orbit.

        :param polygon: fixed, in the world frame.
        :param thickness: >= 0 [m].
        """
        return all(apart(corners, self.orbit, thickness) for corners in polygon.corners)

    def contains(self, p: np.ndarray) -> bool:
        """Say whether a point may lie in the orbit: False is proved. (3,) [m]."""
        return not apart(feature(p, (3,), 'p')[None], self.orbit)

    def distance_bound(self, p: np.ndarray) -> float:
        """Return a lower bound of a point's distance to the orbit. (3,) [m]."""
        p = feature(p, (3,), 'p')
        guess = np.linalg.norm(p - self.center) - self.radius
        return largest_accepted(lambda d: apart(p[None], self.orbit, d), float(guess))

    def boundary_mesh(self, steps: int = 8) -> Mesh:
        """Return the sphere, a quarter circle in so many steps."""
        return sphere(self.center, self.radius, steps)


def feature(values: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
    """
    Return the coordinates of a feature, checked and read-only.

    :param values: coordinates [m].
    :param shape: their shape.
    :param name: what a message calls them.
    :raises RequestError: INVALID_PARAMETER, a value is not finite or too far, or the shape wrong.
    """
    array = read_only(values)
    if array.shape != shape:
        raise RequestError(
            Reason.INVALID_PARAMETER, f'{name} must have shape {shape}, got {array.shape}'
        )
    if not np.abs(array).max() <= LARGEST_COORDINATE:
        raise RequestError(
            Reason.INVALID_PARAMETER, f'{name} is not finite or too far: {array.tolist()}'
        )
    return array
