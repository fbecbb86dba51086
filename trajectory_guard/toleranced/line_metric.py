"""Metric data of a line, and the hyperboloid that bounds its orbit."""

from dataclasses import dataclass

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.shapes.body import read_only
from trajectory_guard.toleranced.displacement_ball import DisplacementBall


@dataclass(frozen=True, slots=True, eq=False)
class LineMetric:
    """
    A line's image under g, with rho^2(g^-1(a + t b)) = rho_0^2 + t^2 / nu^2 [SW, (5)].

    On the line x_0 + tau c of the body rho^2 = 1/|mu| + |v + tau w|^2, v = F^-1 (x_0 - bar),
    w = F^-1 c: least at tau_0 = -v.w / |w|^2, and growing from there with (tau - tau_0)^2 |w|^2. g
    maps a length of the line to a fixed multiple l = |A c| of it, so t = l (tau - tau_0) and
    nu = l / |w|. For g = id these are the paper's.

    :param foot: a, (3,) in the world frame [m].
    :param direction: b, unit vector, (3,).
    :param rho_0: least distortion rate.
    :param nu: length scale of its growth.
    """

    foot: np.ndarray
    direction: np.ndarray
    rho_0: float
    nu: float

    @classmethod
    def of(cls, ball: DisplacementBall, start: np.ndarray, end: np.ndarray) -> 'LineMetric':
        """
        Return the data of the line through two points, to rounding.

        :param ball: metric and centre; the radius is not used.
        :param start: (3,) in the body's frame [m].
        :param end: another point, (3,) [m].
        :raises RequestError: INVALID_PARAMETER, the points or their images are one.
        """
        metric, A = ball.distribution, ball.center[:, :3]
        image = A @ (end - start)
        length = float(np.linalg.norm(image))
        if not length > 0.0:
            raise RequestError(
                Reason.INVALID_PARAMETER, f'edge: its ends have one image: {start}, {end}'
            )
        v, w = (metric.inverse @ x for x in (start - metric.barycenter, end - start))
        tau = -float(v @ w) / float(w @ w)
        rho_0 = np.sqrt(1.0 / metric.mass + ((v + tau * w) ** 2).sum())
        foot = ball.images(start + tau * (end - start))
        return cls(
            read_only(foot),
            read_only(image / length),
            float(rho_0),
            length / float(np.linalg.norm(w)),
        )

    def radius(self, R: float, t: np.ndarray) -> np.ndarray:
        """Return r = R rho at parameters t, in their shape [m]."""
        radius: np.ndarray = R * np.sqrt(self.rho_0**2 + (t / self.nu) ** 2)
        return radius

    def hyperboloid(self, R: float, p: np.ndarray) -> np.ndarray:
        """
        Return x^2 / (1 - (nu/R)^2) + y^2 + z^2 - R^2 rho_0^2, [SW, (6)]: <= 0 in the line's orbit.

        For p at x along the line, the square of the distance to the line's point t less r^2 is
        (x - t)^2 + y^2 + z^2 - R^2 (rho_0^2 + t^2 / nu^2); convex in t iff R < nu, least at
        t = x / (1 - (R/nu)^2), where it is the value above. For R >= nu the orbit is all of space.

        :param R: 0 < R < nu.
        :param p: (..., 3) in the world frame [m].
        """
        y = p - self.foot
        x = y @ self.direction
        across = ((y - x[..., None] * self.direction) ** 2).sum(axis=-1)
        value: np.ndarray = x**2 / (1.0 - (self.nu / R) ** 2) + across - (R * self.rho_0) ** 2
        return value
