"""Weights that make the worst distortion rate on a body as small as it can be."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.toleranced.metric import feature_points, MassDistribution
from trajectory_guard.toleranced.moments import point_moments

# Dimension of the lifted points [x; 1].
D = 4

# Updates of rank one drift, so after so many steps M is inverted anew.
REFRESH = 64

# The iteration converges linearly; a few hundred steps are usual.
STEPS = 10_000


class OptimalWeights(NamedTuple):
    """
    Weights of total mass 1 and how good they are.

    :param weights: (n,), not negative; zero for points that do not matter.
    :param worst: max rho^2 over all points; no weights have less than 4.
    """

    weights: np.ndarray
    worst: float

    @property
    def gap(self) -> float:
        """How far the worst distortion may be from the least possible, relative, squared."""
        return self.worst / D - 1.0


def optimal_weights(points: ArrayLike, gap: float = 1e-6, steps: int = STEPS) -> OptimalWeights:
    """
    Return weights on given points whose largest distortion rate is nearly as small as possible.

    With q_i = [m_i; 1] and M = sum w_i q_i q_i^T, rho^2(m_i) = q_i^T M^-1 q_i, and
    sum w_i rho^2(m_i) = tr(M^-1 M) = 4. So for weights of total mass 1 the mean of rho^2 is 4 and
    its maximum at least 4. The two are equal exactly where det M is largest, since
    d log det M / d w_i = rho^2(m_i) and log det is concave: the equivalence theorem of Kiefer and
    Wolfowitz; rho^2 <= 4 is then the ellipsoid of least volume round the points (John). As
    rho^2 is convex, its maximum over the hull of the points is the one over the points.

    The iteration moves weight towards the point of the largest rho^2 or away from that of the
    least, by the step that maximises det M [Khachiyan 1996; Todd, Yildirim 2007]: with k = rho^2
    and w' = (1 - s) w + s e_j, det M' = (1 - s)^(d-1) (1 - s + s k) det M, largest for
    s = (k - d) / (d (k - 1)).

    :param points: (n, 3), not in a plane [m].
    :param gap: the iteration ends as soon as max rho^2 <= 4 (1 + gap).
    :param steps: most steps; the gap is in the result.
    :raises RequestError: INVALID_PARAMETER, the points lie in a plane or are not finite.
    """
    points, weights = feature_points(points, None)
    MassDistribution.of_points(points)  # refuses a flat body
    _, b, J = point_moments(points, weights)
    # The problem does not change under affine maps; in these coordinates M starts as I.
    centred = np.linalg.solve(np.linalg.cholesky(J), (points - b).T).T
    q = np.column_stack((centred, np.ones(len(points))))
    for step in range(steps):
        if step % REFRESH == 0:
            inverse, rates = _inverse_and_rates(q, weights)
        if rates.max() <= D * (1.0 + gap):
            break
        j, s = _best_step(weights, rates)
        v = (inverse @ q[j]) / (1.0 - s)
        share = s / (1.0 + s * rates[j] / (1.0 - s))
        inverse = inverse / (1.0 - s) - share * np.outer(v, v)
        rates = rates / (1.0 - s) - share * (q @ v) ** 2
        weights *= 1.0 - s
        weights[j] = max(0.0, weights[j] + s)
    weights /= weights.sum()
    worst = _inverse_and_rates(q, weights)[1].max()
    weights.flags.writeable = False
    return OptimalWeights(weights, float(worst))


def _inverse_and_rates(q: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return M^-1, (4, 4), and rho^2 at the lifted points, (n,)."""
    inverse = np.linalg.inv((weights[:, None] * q).T @ q)
    return inverse, np.einsum('ni,ij,nj->n', q, inverse, q)


def _best_step(weights: np.ndarray, rates: np.ndarray) -> tuple[int, float]:
    """Return the point to move weight to (or, with a negative step, from) and the step."""
    high, low = int(rates.argmax()), int(np.where(weights > 0.0, rates, np.inf).argmin())
    if rates[high] - D >= D - rates[low]:
        return high, float((rates[high] - D) / (D * (rates[high] - 1.0)))
    # Not below weight zero; with rho^2 <= 1 det M grows all the way there.
    all_of_it = -weights[low] / (1.0 - weights[low])
    if rates[low] <= 1.0:
        return low, float(all_of_it)
    return low, float(max((rates[low] - D) / (D * (rates[low] - 1.0)), all_of_it))


def least_distortion(points: ArrayLike, gap: float = 1e-6, steps: int = STEPS) -> MassDistribution:
    """
    Return the distribution of mass 1 on given points with nearly the least worst distortion rate.

    :param points: (n, 3), not in a plane [m].
    :param gap: allowed relative excess of max rho^2 over 4.
    :param steps: most steps.
    :raises RequestError: INVALID_PARAMETER, the points lie in a plane or are not finite, or the
        gap was not reached.
    """
    best = optimal_weights(points, gap, steps)
    if not best.gap <= gap * (1.0 + 1e-3) + 1e-12:
        raise RequestError(
            Reason.INVALID_PARAMETER, f'gap {gap} was not reached, only {best.gap:.3g}'
        )
    used = best.weights > 0.0
    return MassDistribution.of_points(np.asarray(points)[used], best.weights[used])
