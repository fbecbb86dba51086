"""The object-oriented metric of affine displacements that a mass distribution induces."""

from dataclasses import dataclass, field
import math

import numpy as np
from numpy.typing import ArrayLike

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.shapes.body import LARGEST_COORDINATE, read_only, U, UNDERFLOW
from trajectory_guard.toleranced.moments import (
    Moments,
    point_moments,
    solid_moments,
    surface_samples,
)

# A body thinner than this fraction of its size counts as flat: the metric hardly resists motions
# across it, and the off-plane part of what counts as its thickness may be rounding.
FLAT = 2.0**-30

# How far over a flat body its additional feature point lies, as a fraction of the diameter.
OFF_PLANE = 2.0**-4


@dataclass(frozen=True, slots=True, eq=False)
class MassDistribution:
    """
    Total mass, barycentre and central inertia: all that the metric knows of a distribution.

    For a displacement (difference) D: x -> A x + t the integral of |D(x)|^2 is, with x = b + y and
    the integral of y being zero, |D|^2 = |mu| |A b + t|^2 + tr(A J A^T); J is the integral of
    y y^T, *central* and linear in the weights [SW, sec. 2, corrected: the print has w_i^2 and
    moments about the origin]. With G the 4x4 matrix of second moments of [x; 1] this is
    ||D G^(1/2)||_F^2.

    The three numbers as doubles, with J = F F^T exactly, *define* the metric here; how well they
    round that of the feature points changes no proof, since distances and distortion rates are
    both taken from them.

    :param mass: total mass |mu|, in any unit.
    :param barycenter: b, (3,), in the body's frame [m].
    :param factor: F, (3, 3), lower triangular with a positive diagonal.
    :raises RequestError: INVALID_PARAMETER, a number is not finite or out of range, or the body is
        flat or collinear, so that its inertia is (nearly) singular; see `thickened`.
    """

    mass: float
    barycenter: np.ndarray
    factor: np.ndarray
    # W, nearly F^-1, and s with |F^-1 y| <= s |W y| for every y.
    inverse: np.ndarray = field(init=False)
    stretch: float = field(init=False)

    def __post_init__(self) -> None:
        """Check the numbers; invert the factor with a bound on the error."""
        object.__setattr__(self, 'mass', float(self.mass))
        for name, shape in (('barycenter', (3,)), ('factor', (3, 3))):
            array = read_only(getattr(self, name))
            if array.shape != shape or not np.isfinite(array).all():
                raise _invalid(f'{name} must be finite and of shape {shape}, got {array.tolist()}')
            object.__setattr__(self, name, array)
        if not UNDERFLOW < self.mass < 1.0 / UNDERFLOW:
            raise _invalid(f'mass must be positive and finite, got {self.mass}')
        if not np.abs(self.barycenter).max() <= LARGEST_COORDINATE:
            raise _invalid(f'barycenter exceeds {LARGEST_COORDINATE:g} m: {self.barycenter}')
        F = self.factor
        if np.triu(F, 1).any():
            raise _invalid(f'factor must be lower triangular, got {F.tolist()}')
        sizes = np.linalg.svd(F, compute_uv=False)
        if not (np.diag(F).min() > UNDERFLOW and sizes[2] > FLAT * sizes[0]):
            raise _invalid(
                'the mass distribution is flat or collinear, its inertia is singular '
                f'(factor {F.tolist()}); add a feature point off the plane (thickened)'
            )
        W = np.linalg.inv(F)
        object.__setattr__(self, 'inverse', read_only(W))
        object.__setattr__(self, 'stretch', stretch_bound(W, F))

    @classmethod
    def of_points(cls, points: ArrayLike, weights: ArrayLike | None = None) -> 'MassDistribution':
        """
        Return the distribution of feature points.

        :param points: (n, 3) [m].
        :param weights: (n,) positive; equal ones of total mass 1 if None.
        :raises RequestError: INVALID_PARAMETER, as for the class; also for a single point.
        """
        points, weights = feature_points(points, weights)
        if len(points) < 4:
            raise _invalid(
                f'{len(points)} feature points lie in a plane, so their inertia is singular: '
                f'{points.tolist()}; add a feature point off the plane (thickened)'
            )
        mass, b, _ = point_moments(points, weights)
        # Not by way of J: squaring would lose half of the digits of a thin body.
        upper = np.linalg.qr(np.sqrt(weights)[:, None] * (points - b), mode='r')
        signs = np.where(np.diag(upper) < 0.0, -1.0, 1.0)
        return cls(mass, b, np.tril((signs[:, None] * upper).T))

    @classmethod
    def of_moments(cls, moments: Moments) -> 'MassDistribution':
        """
        Return the distribution with given mass, barycentre and central inertia.

        :raises RequestError: INVALID_PARAMETER, as for the class.
        """
        mass, b, J = moments
        try:
            factor = np.linalg.cholesky(J)
        except np.linalg.LinAlgError as error:
            raise _invalid(
                f'inertia is singular or not positive: {np.asarray(J).tolist()}'
            ) from error
        return cls(mass, b, factor)

    @classmethod
    def of_surface(cls, vertices: ArrayLike, triangles: ArrayLike) -> 'MassDistribution':
        """
        Return the distribution of a triangle mesh's area, mass density 1 [1 / m^2].

        :param vertices: (n, 3) [m].
        :param triangles: (m, 3) indices.
        :raises RequestError: INVALID_PARAMETER, as for the class; also if the area is zero.
        """
        return cls.of_points(*surface_samples(vertices, triangles))

    @classmethod
    def of_solid(cls, vertices: ArrayLike, triangles: ArrayLike) -> 'MassDistribution':
        """
        Return the distribution of a closed triangle mesh's volume, mass density 1 [1 / m^3].

        :param vertices: (n, 3) [m].
        :param triangles: (m, 3) indices, counter-clockwise seen from outside.
        :raises RequestError: INVALID_PARAMETER, as for the class; also if the mesh is open or
            its volume not positive.
        """
        return cls.of_moments(solid_moments(vertices, triangles))

    @classmethod
    def thickened(
        cls, points: ArrayLike, weights: ArrayLike | None = None, height: float | None = None
    ) -> 'MassDistribution':
        """
        Return the distribution of a flat or collinear body, with feature points off its hull.

        For every direction in which the body has no extent a point is added over the barycentre,
        with the mean weight [SW, sec. 7.1]. The total mass stays as it is.

        :param points: (n, 3), at least two different ones [m].
        :param weights: (n,) positive; equal ones of total mass 1 if None.
        :param height: distance of the points from the barycentre; 1/16 of the diameter if None
            [m].
        :raises RequestError: INVALID_PARAMETER, as for the class; also if all points are one or
            the height is not positive.
        """
        points, weights = feature_points(points, weights)
        mass, b, _ = point_moments(points, weights)
        diameter = 2.0 * np.linalg.norm(points - b, axis=1).max()
        if not diameter > U * np.abs(points).max() or not diameter > UNDERFLOW:
            raise _invalid(f'all feature points are one: {points[0].tolist()}')
        height = OFF_PLANE * diameter if height is None else float(height)
        if not UNDERFLOW < height <= LARGEST_COORDINATE:
            raise _invalid(f'height must be positive and finite, got {height}')
        _, sizes, axes = np.linalg.svd(points - b)
        sizes = np.pad(sizes, (0, 3 - len(sizes)))
        # What is thinner than the height is thickened to it, rounding included.
        thin = axes[sizes / math.sqrt(len(points)) < min(FLAT * diameter, height)]
        grown = np.concatenate((points, b + height * thin))
        added = np.full(len(thin), mass / len(points))
        all_weights = np.concatenate((weights, added))
        return cls.of_points(grown, all_weights * (mass / all_weights.sum()))

    @classmethod
    def of_polygon(cls, vertices: ArrayLike, height: float | None = None) -> 'MassDistribution':
        """
        Return equal masses in a polygon's corners and in a point over their barycentre.

        :param vertices: (n, 3) [m].
        :param height: distance of that point from the plane; 1/16 of the diameter if None [m].
        :raises RequestError: INVALID_PARAMETER, as for `thickened`.
        """
        return cls.thickened(vertices, None, height)

    @property
    def inertia(self) -> np.ndarray:
        """Central inertia J = F F^T, rounded, (3, 3)."""
        return self.factor @ self.factor.T

    @property
    def G(self) -> np.ndarray:
        """Second moments of [x; 1], rounded, (4, 4)."""
        G = np.zeros((4, 4))
        G[:3, :3] = self.inertia
        lifted = np.append(self.barycenter, 1.0)
        return G + self.mass * np.outer(lifted, lifted)

    def six_points(self) -> np.ndarray:
        """
        Return six points that, each with mass |mu| / 6, induce the same metric, (6, 3) [m].

        With J = sum lambda_k e_k e_k^T the points b +- s_k e_k have the inertia
        2 |mu| / 6 sum s_k^2 e_k e_k^T, so s_k^2 = 3 lambda_k / |mu|. They are the vertices of the
        ellipsoid (x - b)^T J^-1 (x - b) = 3 / |mu|, a level set of the distortion rate
        [SW, end of sec. 2, corrected: the print has J for its inverse].
        """
        axes, sizes, _ = np.linalg.svd(self.factor)
        offsets = (axes * sizes * math.sqrt(3.0 / self.mass)).T
        return np.concatenate((self.barycenter + offsets, self.barycenter - offsets))

    def coordinates(self, displacements: ArrayLike) -> np.ndarray:
        """
        Return isometric coordinates of displacements, to rounding, in R^12.

        [sqrt(|mu|) (A b + t) | A F], row by row; their Euclidean distances are the metric's.

        :param displacements: (..., 3, 4) [m].
        :returns: (..., 12).
        """
        D = np.asarray(displacements, dtype=np.float64)
        A, t = D[..., :3], D[..., 3]
        moved = math.sqrt(self.mass) * (A @ self.barycenter + t)
        both = np.concatenate((moved[..., None], A @ self.factor), axis=-1)
        return both.reshape(*D.shape[:-2], 12)

    def inner(self, alpha: ArrayLike, beta: ArrayLike) -> float:
        """
        Return the scalar product of two displacements [SW, (1)], to rounding.

        :param alpha: (3, 4) [m].
        :param beta: (3, 4) [m].
        """
        return float(self.coordinates(alpha) @ self.coordinates(beta))

    def distance(self, alpha: ArrayLike, beta: ArrayLike) -> float:
        """
        Return the distance of two displacements [SW, (2)], to rounding.

        :param alpha: (3, 4) [m].
        :param beta: (3, 4) [m].
        """
        difference = np.asarray(alpha, dtype=np.float64) - np.asarray(beta, dtype=np.float64)
        return float(np.linalg.norm(self.coordinates(difference)))

    def distance_bound(self, alpha: ArrayLike, beta: ArrayLike) -> np.ndarray:
        """
        Return upper bounds of the distances of pairs of displacements.

        An entry of alpha - beta is rounded once; A b + t and an entry of A F are sums of at most
        four products, so what is computed for |D| is within `slack`, 8 U times the same with all
        numbers absolute (U is the unit roundoff); squares, sums and roots add less than 16 U.

        :param alpha: (..., 3, 4) [m].
        :param beta: (..., 3, 4) [m].
        :returns: (...,); NaN or inf if a number is not finite.
        """
        D = np.asarray(alpha, dtype=np.float64) - np.asarray(beta, dtype=np.float64)
        length = np.linalg.norm(self.coordinates(D), axis=-1)
        bound: np.ndarray = (length + 8.0 * U * self.size_bound(D)) * (1.0 + 32.0 * U) + UNDERFLOW
        return bound

    def size_bound(self, displacements: np.ndarray) -> np.ndarray:
        """
        Return upper bounds of |D| for every D whose entries are at most so large, (...,).

        :param displacements: (..., 3, 4), the absolute values count [m].
        """
        D = np.abs(displacements)
        b, F = np.abs(self.barycenter), np.abs(self.factor)
        moved = math.sqrt(self.mass) * np.linalg.norm(D[..., :3] @ b + D[..., 3], axis=-1)
        turned = np.linalg.norm(D[..., :3] @ F, axis=(-2, -1))
        bound: np.ndarray = (moved + turned) * (1.0 + 32.0 * U) + UNDERFLOW
        return bound

    def rho(self, x: ArrayLike) -> np.ndarray:
        """
        Return the distortion rate at points, to rounding: rho^2 = 1/|mu| + (x-b)^T J^-1 (x-b).

        The largest |D(x)| among the D with |D| <= R is R rho(x) [SW, (4)]: D(x) = D [x; 1] =
        (D G^(1/2)) (G^(-1/2) [x; 1]), a matrix of Frobenius norm at most R times a vector of
        length rho(x), rho^2 = [x; 1]^T G^-1 [x; 1]; any matrix is possible, so it is attained.
        In coordinates about b, G is diag(J, |mu|), which gives the formula.

        :param x: (..., 3) [m].
        :returns: (...,) in 1 / sqrt(unit of mass).
        """
        y = np.asarray(x, dtype=np.float64) - self.barycenter
        rho: np.ndarray = np.sqrt(1.0 / self.mass + ((y @ self.inverse.T) ** 2).sum(axis=-1))
        return rho

    def rho_bound(self, x: ArrayLike) -> np.ndarray:
        """
        Return upper bounds of the distortion rate at points, (...,).

        An entry of W (x - b) is three products, their sums and a difference: within 6 U of the
        same with all numbers absolute. rho^2 <= s^2 (1/|mu| + |W y|^2), since s >= 1;
        division, squares, sums and the root add less than 8 U.

        :param x: (..., 3) [m].
        """
        y = np.asarray(x, dtype=np.float64) - self.barycenter
        W = self.inverse.T
        entries = np.abs(y @ W) + 6.0 * U * (np.abs(y) @ np.abs(W))
        squares = 1.0 / self.mass + (entries**2).sum(axis=-1)
        bound: np.ndarray = self.stretch * np.sqrt(squares) * (1.0 + 16.0 * U)
        return bound

    def bound(self, R: float, x: ArrayLike) -> np.ndarray:
        """
        Return upper bounds of |D(x)| for all D with |D| <= R, (...,) [m].

        :param R: bound on the metric's norm; NaN if it is negative or NaN.
        :param x: (..., 3) [m].
        """
        R = float(R) if R >= 0.0 else math.nan
        bound: np.ndarray = R * self.rho_bound(x) * (1.0 + 2.0 * U) + UNDERFLOW
        return bound


def feature_points(points: ArrayLike, weights: ArrayLike | None) -> tuple[np.ndarray, np.ndarray]:
    """
    Return feature points and weights, checked.

    :param points: (n, 3) [m].
    :param weights: (n,) positive; equal ones of total mass 1 if None.
    :raises RequestError: INVALID_PARAMETER, naming the point or weight.
    """
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise _invalid(f'feature points must have shape (n, 3), got {points.shape}')
    for i, point in enumerate(points):
        if not np.abs(point).max() <= LARGEST_COORDINATE:
            raise _invalid(f'feature point {i} is not finite or too far: {point.tolist()}')
    n = len(points)
    weights = np.full(n, 1.0 / n) if weights is None else np.asarray(weights, dtype=np.float64)
    if weights.shape != (n,):
        raise _invalid(f'{n} feature points need as many weights, got shape {weights.shape}')
    for i, weight in enumerate(weights):
        if not UNDERFLOW < weight < 1.0 / UNDERFLOW:
            raise _invalid(f'weight {i} must be positive and finite, got {weight}')
    return points, weights


def stretch_bound(W: np.ndarray, F: np.ndarray) -> float:
    """
    Return s with |F^-1 y| <= s |W y|: W F = I - E gives F^-1 = (I - E)^-1 W, s = 1 / (1 - |E|).

    An entry of W F - I is three products and four sums, within 4 U of the same with all numbers
    absolute. |F| |W| is at most 9 / FLAT, so |E| is far below 1.

    :param W: (3, 3), nearly the inverse.
    :param F: (3, 3).
    :raises RequestError: INVALID_PARAMETER, it is not.
    """
    E = np.linalg.norm(W @ F - np.eye(3)) * (1.0 + 16.0 * U)
    E += 8.0 * U * np.linalg.norm(np.abs(W) @ np.abs(F) + np.eye(3))
    if not E < 0.5:
        raise _invalid(f'inertia cannot be inverted: factor {F.tolist()}')
    return float((1.0 + 4.0 * U) / (1.0 - E))


def _invalid(message: str) -> RequestError:
    return RequestError(Reason.INVALID_PARAMETER, message)
