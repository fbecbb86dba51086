"""
Bounds on the length and the curvature of a rational Bezier curve from its control points.

Let c = P / w of degree n, control points y_i in R^12 (isometric coordinates of displacements),
weights w_i > 0.
"""

import math
from typing import Protocol

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.shapes.body import U, UNDERFLOW
from trajectory_guard.toleranced.metric import MassDistribution


class RationalCurve(Protocol):
    """
    A rational Bezier motion on [0, 1].

    `control_points`: (K, 3, 4) affine displacements, already divided by their weights [m];
    `weights`: (K,) positive plain Bernstein weights.
    """

    @property
    def control_points(self) -> np.ndarray:
        """Affine displacements, (K, 3, 4)."""

    @property
    def weights(self) -> np.ndarray:
        """Bernstein weights, (K,)."""


def checked(motion: RationalCurve) -> tuple[np.ndarray, np.ndarray]:
    """
    Return control points and weights of a motion.

    :param motion: the motion.
    :raises RequestError: INVALID_PARAMETER, a shape is wrong, a number not finite or a weight not
        positive.
    """
    points = np.asarray(motion.control_points, dtype=np.float64)
    weights = np.asarray(motion.weights, dtype=np.float64)
    if points.ndim != 3 or points.shape[1:] != (3, 4) or not len(points):
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'control_points must have shape (K, 3, 4), got {points.shape}',
        )
    if not np.isfinite(points).all():
        raise RequestError(Reason.INVALID_PARAMETER, 'control_points: a number is not finite')
    if weights.shape != (len(points),):
        raise RequestError(
            Reason.INVALID_PARAMETER, f'weights must be {len(points)}, got shape {weights.shape}'
        )
    for i, weight in enumerate(weights):
        if not 0.0 < weight < math.inf:
            raise RequestError(
                Reason.INVALID_PARAMETER, f'weight {i} must be positive and finite, got {weight}'
            )
    return points, weights


def length_bound(motion: RationalCurve, metric: MassDistribution) -> float:
    """
    Return an upper bound of a motion's length: the length of its control polygon.

    A hyperplane n.y = d meets the curve where sum w_i (n.y_i - d) B_i vanishes, not more often
    than the sequence w_i (n.y_i - d) changes its sign (variation diminishing), hence not more
    often than it meets the control polygon. Averaged over all hyperplanes these numbers are the
    lengths, times one constant (Cauchy, Crofton).

    :param motion: the motion.
    :param metric: the metric.
    :raises RequestError: as `checked`.
    """
    points, _ = checked(motion)
    lengths = metric.distance_bound(points[1:], points[:-1])
    return float(lengths.sum() * (1.0 + 2.0 * len(points) * U))


def curvature_bound(motion: RationalCurve, metric: MassDistribution) -> float:
    """
    Return an upper bound of a motion's curvature; inf if there is none.

    With N = P' w - P w', c' = N / w^2, so c' ^ c'' = N ^ N' / w^4 and
    kappa = |N ^ N'| w^2 / |N|^3 = |N'_perp| w^2 / |N|^2, N'_perp the part of N' normal to N.
      - In powers s^i (1-s)^(n-i), B_p' B_q - B_p B_q' = (p - q) B_p B_q / (s (1-s)), so N has
        degree 2n - 2 and scaled coefficients sum over p + q = k + 1 of (p - q) W_p W_q y_p, with
        W_p = C(n, p) w_p.
      - |N| >= min u.N_k for any unit vector u: the mean of the N_k is taken.
      - |N'_perp| <= |N' - phi N| for any phi, at most its largest control vector; phi is the
        growth along u, so that the mere change of speed does not count.
      - w <= max w_i.

    Rounding: a coefficient N_k is a linear combination of the y_p, at most K + 8 roundings of the
    same with all numbers absolute, on top of the errors of the y_p; differences, elevation and
    phi N add less than 40 to that, and N' - phi N weighs N_k by 2 (2n - 2) + |phi| at most.

    :param motion: the motion.
    :param metric: the metric.
    :raises RequestError: as `checked`.
    """
    points, weights = checked(motion)
    n = len(points) - 1
    if n == 0:
        return math.inf
    D = points - points[n // 2]
    y = metric.coordinates(D)
    sizes = np.linalg.norm(y, axis=1)
    errors = 16.0 * U * (metric.size_bound(D) + sizes) + (n + 64) * U * sizes
    combination = _hodograph(weights / weights.max())
    N, error = combination @ y, float((np.abs(combination) @ errors).max()) * (1.0 + 64.0 * U)
    degree = 2 * n - 2
    mean = N.mean(axis=0)
    length = float(np.linalg.norm(mean))
    if not length > 0.0:
        return math.inf
    u = mean / length
    # u is a unit vector within 4 U; the products along it are 12, counted on |N_k|.
    least = float((N @ u).min()) - 32.0 * U * float(np.linalg.norm(N, axis=1).max()) - error
    if not least > 0.0:
        return math.inf
    if degree == 0:
        return 0.0
    steps = degree * np.diff(N, axis=0)
    share = np.arange(degree + 1)[:, None] / degree
    zero = np.zeros((1, N.shape[1]))
    rise = share * np.concatenate((zero, steps)) + (1.0 - share) * np.concatenate((steps, zero))
    phi = float(steps.mean(axis=0) @ u) / length
    across = float(np.linalg.norm(rise - phi * N, axis=1).max())
    across += (2.0 * degree + abs(phi)) * error + UNDERFLOW
    bound = across / least**2 * (1.0 + 64.0 * U)
    return bound if bound >= 0.0 else math.inf


def _hodograph(weights: np.ndarray) -> np.ndarray:
    """Return the matrix that takes control points to the Bernstein coefficients of N, or -0."""
    n = len(weights) - 1
    scaled = weights * [math.comb(n, p) for p in range(n + 1)]
    matrix = np.zeros((2 * n - 1, n + 1))
    for k in range(2 * n - 1):
        for p in range(max(0, k + 1 - n), min(n, k + 1) + 1):
            q = k + 1 - p
            matrix[k, p] = (p - q) * scaled[p] * scaled[q] / math.comb(2 * n - 2, k)
    return matrix
