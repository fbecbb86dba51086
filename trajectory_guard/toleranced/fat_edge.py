"""The orbit of an edge: two balls, and between them a hyperboloid of revolution."""

from dataclasses import dataclass, field
import math

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.toleranced.contact import apart
from trajectory_guard.toleranced.displacement_ball import DisplacementBall, Orbit
from trajectory_guard.toleranced.distance import largest_accepted
from trajectory_guard.toleranced.fat_point import feature
from trajectory_guard.toleranced.line_metric import LineMetric
from trajectory_guard.toleranced.patches import (
    across,
    cap,
    circle,
    grid,
    joined,
    Mesh,
    Patch,
    sphere,
)


@dataclass(frozen=True, slots=True, eq=False)
class FatEdge:
    """
    The orbit of a segment under a ball of displacements [SW, sec. 3].

    For R < nu the line's orbit is inside the hyperboloid (6); for R >= nu the segment's is the
    union of the orbits of its ends (Remark 1).

    :param ball: the displacements.
    :param ends: (2, 3) in the body's frame [m].
    :param orbit: the same as a simplex of two corners.
    :raises RequestError: INVALID_PARAMETER, an end is not finite or too far, or both are one.
    """

    ball: DisplacementBall
    ends: np.ndarray
    orbit: Orbit = field(init=False)

    def __post_init__(self) -> None:
        """Check the ends."""
        ends = feature(self.ends, (2, 3), 'edge')
        if (ends[0] == ends[1]).all():
            raise RequestError(Reason.INVALID_PARAMETER, f'edge: both ends are {ends[0]}')
        object.__setattr__(self, 'ends', ends)
        object.__setattr__(self, 'orbit', self.ball.orbit(ends))

    @property
    def line(self) -> LineMetric:
        """Metric data of the edge's line."""
        return LineMetric.of(self.ball, *self.ends)

    def apart(self, segment: np.ndarray, thickness: float = 0.0) -> bool:
        """
        Say whether a segment is proved to be farther than a thickness from the orbit.

        :param segment: ends, (2, 3) in the world frame [m].
        :param thickness: >= 0 [m].
        """
        return apart(feature(segment, (2, 3), 'segment'), self.orbit, thickness)

    def contains(self, p: np.ndarray) -> bool:
        """Say whether a point may lie in the orbit: False is proved. (3,) [m]."""
        return not apart(feature(p, (3,), 'p')[None], self.orbit)

    def distance_bound(self, p: np.ndarray) -> float:
        """
        Return a lower bound of a point's distance to the orbit [m].

        Nearly exact near the orbit; farther off it may lack a part of how R rho differs along the
        feature.

        :param p: (3,) in the world frame [m].
        """
        p = feature(p, (3,), 'p')
        return largest_accepted(
            lambda d: apart(p[None], self.orbit, d), distance_guess(self.ball, self.ends, p)
        )

    def boundary_mesh(self, steps: int = 8) -> Mesh:
        """
        Return the boundary: the band of the hyperboloid and two caps, or two spheres.

        :param steps: parts of the edge, and of a quarter circle.
        """
        R, line = self.ball.radius, self.line
        images = self.ball.images(self.ends)
        t = (images - line.foot) @ line.direction
        if not line.nu > R:
            return joined(
                [
                    sphere(image, float(r), steps)
                    for image, r in zip(images, line.radius(R, t), strict=True)
                ]
            )
        places = np.linspace(t[0], t[1], steps + 1)
        angles = np.linspace(0.0, 2.0 * math.pi, 4 * steps + 1)
        # Left-handed, so that the rows along the edge cross the circles counter-clockwise.
        frame = across(line.direction) * [1.0, -1.0]
        band = circle(line, R, places, frame, np.broadcast_to(angles, (len(places), len(angles))))
        return joined(
            [
                grid(band, Patch.EDGE),
                cap(line, R, float(t[0]), -1.0, steps),
                cap(line, R, float(t[1]), 1.0, steps),
            ]
        )


def distance_guess(ball: DisplacementBall, corners: np.ndarray, p: np.ndarray) -> float:
    """Return about the distance of a point from the balls over the corners, at most [m]."""
    away = np.linalg.norm(ball.images(corners) - p, axis=-1)
    return float((away - ball.radius * ball.distribution.rho(corners)).min())
