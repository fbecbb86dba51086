"""Metric data of a plane, the hyperboloid that bounds its orbit, and the projection onto it."""

from dataclasses import dataclass

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.shapes.body import read_only
from trajectory_guard.toleranced.displacement_ball import DisplacementBall
from trajectory_guard.toleranced.polygon import plane_axes


@dataclass(frozen=True, slots=True, eq=False)
class PlaneMetric:
    """
    A plane's image under g, rho^2(g^-1(a + s b_1 + t b_2)) = rho_0^2 + s^2/nu_1^2 + t^2/nu_2^2.

    [SW, (7)]. With C a basis of the plane's directions that g maps to orthonormal ones,
    rho^2(x_0 + C u) = 1/|mu| + |v + V u|^2, v = F^-1 (x_0 - bar), V = F^-1 C. The least place is
    u_0 = -(V^T V)^-1 V^T v, and the eigenvectors of V^T V are b_1, b_2 in that basis, with
    eigenvalues 1 / nu_i^2. For g = id these are the paper's.

    :param foot: a, (3,) in the world frame [m].
    :param axes: b_1, b_2, b_1 x b_2 as columns, (3, 3).
    :param rho_0: least distortion rate.
    :param nu: nu_1 >= nu_2, (2,).
    """

    foot: np.ndarray
    axes: np.ndarray
    rho_0: float
    nu: np.ndarray

    @classmethod
    def of(cls, ball: DisplacementBall, point: np.ndarray, normal: np.ndarray) -> 'PlaneMetric':
        """
        Return the data of the plane through a point, to rounding.

        :param ball: metric and centre; the radius is not used.
        :param point: (3,) in the body's frame [m].
        :param normal: unit normal, (3,) in the body's frame.
        :raises RequestError: INVALID_PARAMETER, g flattens the plane.
        """
        metric, A = ball.distribution, ball.center[:, :3]
        basis = plane_axes(normal)
        image, triangle = np.linalg.qr(A @ basis)
        sizes = np.abs(np.diag(triangle))
        if not sizes.min() > 2.0**-40 * np.abs(A).max():
            raise RequestError(
                Reason.INVALID_PARAMETER, f'center flattens the plane: {ball.center.tolist()}'
            )
        C = basis @ np.linalg.inv(triangle)
        v, V = metric.inverse @ (point - metric.barycenter), metric.inverse @ C
        u, *_ = np.linalg.lstsq(V, -v, rcond=None)
        rho_0 = np.sqrt(1.0 / metric.mass + ((v + V @ u) ** 2).sum())
        rates, turn = np.linalg.eigh(V.T @ V)
        b = image @ turn
        axes = np.column_stack((b, np.cross(b[:, 0], b[:, 1])))
        foot = ball.images(point + C @ u)
        return cls(read_only(foot), read_only(axes), float(rho_0), read_only(rates**-0.5))

    def coordinates(self, p: np.ndarray) -> np.ndarray:
        """Return (x, y, z) of points in the frame of foot and axes, (..., 3) [m]."""
        coordinates: np.ndarray = (p - self.foot) @ self.axes
        return coordinates

    def hyperboloid(self, R: float, p: np.ndarray) -> np.ndarray:
        """
        Return x^2/(1-(nu_1/R)^2) + y^2/(1-(nu_2/R)^2) + z^2 - R^2 rho_0^2, [SW, (8)].

        It is <= 0 in the plane's orbit, for the same reason as in `LineMetric.hyperboloid`, in
        both directions at once. For R >= min nu the orbit is all of space.

        :param R: 0 < R < min(nu_1, nu_2).
        :param p: (..., 3) in the world frame [m].
        """
        squares = self.coordinates(p) ** 2
        factors = np.append(1.0 / (1.0 - (self.nu / R) ** 2), 1.0)
        value: np.ndarray = squares @ factors - (R * self.rho_0) ** 2
        return value

    def sigma(self, R: float) -> np.ndarray:
        """
        Return the factors of the scaling sigma, (2,) [SW, (9)].

        The envelope of the balls round (s, t, 0) of radius r(s, t) touches that ball where the
        derivatives of |p - (s, t, 0)|^2 - r^2 vanish: x = s - r r_s, y = t - r r_t, and
        r r_s = R^2 s / nu_1^2. So x = (1 - R^2/nu_1^2) s: this is the foot of the surface's normal
        through (s, t, 0). In (10), Psi divided by R^2 rho_0^2 = c^2 has
        a^2 = ((nu_1/R)^2 - 1) c^2, hence a^2 / (a^2 + c^2) = 1 - R^2/nu_1^2: Proposition 1. The
        face's patch lies over sigma(P), and a point (x, y, z) over it comes from sigma^-1(x, y).

        :param R: 0 <= R < min(nu_1, nu_2).
        """
        factors: np.ndarray = 1.0 - (R / self.nu) ** 2
        return factors

    def project(self, R: float, x: np.ndarray, side: float) -> np.ndarray:
        """
        Return the points of Psi whose normals pass through points of the plane.

        The height is sqrt(r^2 - (r r_s)^2 - (r r_t)^2).

        :param R: 0 <= R < min(nu_1, nu_2).
        :param x: (..., 3) in the image plane, world frame [m].
        :param side: 1 for the sheet over the plane, -1 for the one below.
        :returns: (..., 3) in the world frame [m].
        """
        st = self.coordinates(x)[..., :2]
        rates = R**2 * st / self.nu**2
        squares = R**2 * (self.rho_0**2 + ((st / self.nu) ** 2).sum(axis=-1))
        height = np.sqrt(squares - (rates**2).sum(axis=-1))
        foot = st * self.sigma(R)
        local = np.concatenate((foot, side * height[..., None]), axis=-1)
        projected: np.ndarray = self.foot + local @ self.axes.T
        return projected

    def slope(self, R: float, x: np.ndarray) -> np.ndarray:
        """Return the gradient of r = R rho at points of the image plane, (..., 3), no unit."""
        st = self.coordinates(x)[..., :2]
        radius = R * np.sqrt(self.rho_0**2 + ((st / self.nu) ** 2).sum(axis=-1))
        slope: np.ndarray = (R**2 * st / self.nu**2 / radius[..., None]) @ self.axes[:, :2].T
        return slope
