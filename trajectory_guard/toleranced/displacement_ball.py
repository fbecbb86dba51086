"""A ball of affine displacements, and what it does to points, segments and triangles."""

from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.shapes.body import LARGEST_COORDINATE, read_only, U, UNDERFLOW
from trajectory_guard.toleranced.affine import Affine
from trajectory_guard.toleranced.metric import MassDistribution


class Orbit(NamedTuple):
    """
    The orbit of a simplex: the union over x of the balls round image(x), |distortion(x)| wide.

    :param image: x -> g(x), into R^3 [m].
    :param distortion: x -> h(x) in R^4, |h(x)| >= R rho(x) [m].
    """

    image: Affine
    distortion: Affine


@dataclass(frozen=True, slots=True, eq=False)
class DisplacementBall:
    """
    All affine displacements at distance at most R from a centre g.

    :param distribution: the metric.
    :param center: g, (3, 4), any affine map from the body's to the world frame [m].
    :param radius: R >= 0, in metres times the root of the unit of mass.
    :raises RequestError: INVALID_PARAMETER, a value is not finite, negative or too large.
    """

    distribution: MassDistribution
    center: np.ndarray
    radius: float

    def __post_init__(self) -> None:
        """Check the values."""
        object.__setattr__(self, 'center', read_only(self.center))
        object.__setattr__(self, 'radius', float(self.radius))
        center = self.center
        if center.shape != (3, 4) or not np.abs(center).max(initial=0.0) <= LARGEST_COORDINATE:
            raise RequestError(
                Reason.INVALID_PARAMETER,
                f'center must be a finite (3, 4) displacement, got {center.tolist()}',
            )
        if not 0.0 <= self.radius < 1.0 / UNDERFLOW:
            raise RequestError(
                Reason.INVALID_PARAMETER, f'radius must be finite and >= 0, got {self.radius}'
            )

    def contains(self, displacement: np.ndarray) -> bool:
        """
        Say whether a displacement is proved to lie in the ball.

        :param displacement: (3, 4) [m].
        """
        return bool(self.distribution.distance_bound(displacement, self.center) <= self.radius)

    def images(self, points: np.ndarray) -> np.ndarray:
        """
        Return the centre's images of points, to rounding.

        :param points: (..., 3) in the body's frame [m].
        :returns: (..., 3) in the world frame [m].
        """
        images: np.ndarray = points @ self.center[:, :3].T + self.center[:, 3]
        return images

    def orbit(self, corners: np.ndarray) -> Orbit:
        """
        Return the orbit of a simplex.

        :param corners: (d + 1, 3), d <= 2, in the body's frame [m].
        """
        return Orbit(self._image(corners), self._distortion(corners))

    def _image(self, corners: np.ndarray) -> Affine:
        """
        Return x -> g(x): three products and sums an entry of g(x_0), one more difference, 5 U.

        The 1-norms bound the Euclidean ones and leave room for their own rounding.
        """
        A, t = self.center[:, :3], self.center[:, 3]
        sides = (corners[1:] - corners[0]).T
        sizes = np.abs(A) @ np.abs(np.column_stack((corners[0], sides)))
        return Affine(
            A @ corners[0] + t, A @ sides, 8.0 * U * float(sizes.sum() + np.abs(t).sum())
        )

    def _distortion(self, corners: np.ndarray) -> Affine:
        """
        Return x -> R s (1 / sqrt|mu|, W (x - b)), whose length is at least R rho(x).

        rho^2(x) <= s^2 (1/|mu| + |W (x - b)|^2), see `MassDistribution.rho_bound`. An entry is a
        difference, three products and sums, and two more products: below 10 U of the same with all
        numbers absolute; so is the first, with its root.
        """
        metric = self.distribution
        scale = self.radius * metric.stretch
        W = metric.inverse
        sides = (corners[1:] - corners[0]).T
        y = corners[0] - metric.barycenter
        constant = 1.0 / math.sqrt(metric.mass)
        origin = scale * np.append(constant, W @ y)
        directions = scale * np.vstack((np.zeros(sides.shape[1]), W @ sides))
        sizes = np.abs(W) @ np.abs(np.column_stack((y, sides)))
        return Affine(origin, directions, 16.0 * U * scale * float(sizes.sum() + constant))
