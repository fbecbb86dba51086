"""Curves of quaternions with positions, and of dual quaternions, as rational motions."""

from typing import NamedTuple

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.motions.floating import HIGHEST_DEGREE, SMALLEST_WEIGHT
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.free_motion.bernstein import elevated, product, product_rounding, U

# A curve whose smallest weight is below this part of its largest is too near to zero.
LEAST_WEIGHT = 1e4 * SMALLEST_WEIGHT

# Where R has + 2 w v_l beside 2 v_i v_k, l the third axis; elsewhere off the diagonal it is -.
_PLUS = {(0, 2), (1, 0), (2, 1)}


class Rigid(NamedTuple):
    """
    A rigid motion and what it may be off, as `FreePath` has it.

    :param motion: the curve.
    :param turn_error: of its linear part [rad].
    :param shift_error: of its translation [m].
    """

    motion: RationalMotion
    turn_error: float
    shift_error: float

    def loosened(self, direction: float, shift: float) -> 'Rigid':
        """
        Return the same motion of a curve whose control values are off.

        :param direction: how far the quaternions' are, over the longest of them. Divided by the
            least length of the curve, which the least weight bounds, it bounds the direction of
            q, and a direction turns by twice as much.
        :param shift: how far the positions' are [m].
        """
        least = float(np.sqrt(self.motion.weights.min()))
        turn = 4.0 * direction / least
        return Rigid(self.motion, self.turn_error + turn, self.shift_error + shift)


def rigid_motion(
    quaternions: np.ndarray,
    positions: np.ndarray,
    position_weights: np.ndarray | None = None,
) -> Rigid:
    """
    Return x -> q x q* / |q|^2 + p of Bezier curves q and p, of degree 2 n + m.

    The linear part is N / w, w = |q|^2, N quadratic in q: an exact rotation wherever q is not
    zero. With p = P / v, P = sum_k b_k v_k p_k, all over the weight w v.

    **Rounding.** With Q = max |q_i| an entry of N is a sum of products of coefficients of q whose
    factors add up to 6, (c + 4 u) Q^2 each, c from `product_rounding`; raising it to the degree of
    w v and the product with v round once more each: 6 (3 c' + 4 u) Q^2 V with V = max v and c'
    that of the highest degree. A matrix has three times that; the weight is off by 4 (3 c' + 4 u)
    Q^2 V, and a rotation makes sqrt(3) times as much of it: 28 (3 c' + 4 u) Q^2 V over the least
    weight, and 4 u for the division. A translation has the entries w P, at most Q^2 V max |p|: no
    more than the same times max |p|. The curve is a mean of such quotients, so it is off by no
    more than they are.

    :param quaternions: (n + 1, 4) Bernstein coefficients (x, y, z, w), of any length but 0.
    :param positions: (m + 1, 3) Bernstein coefficients [m].
    :param position_weights: (m + 1,) positive; None: p is polynomial.
    :raises RequestError: naming the argument, for numbers that are not finite or shapes that do
        not fit; if q comes so near to 0 that no degree up to 64 has positive weights.
    """
    q, p = _array(quaternions, 'quaternions', 4), _array(positions, 'positions', 3)
    v = np.ones(len(p)) if position_weights is None else np.array(position_weights, float)
    if v.shape != (len(p),) or not (v > 0.0).all() or not np.isfinite(v).all():
        raise _invalid(f'position_weights must be {len(p)} positive numbers, got {v.tolist()}')
    q = q * unit_scale(q)
    v = np.ldexp(v, -int(np.frexp(v.max())[1]))
    rotation, squared = rotation_over(q)
    degree = _degree(squared, v)
    rise = degree - (len(squared) - 1) - (len(v) - 1)

    def raised(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return product(elevated(a, len(a) - 1 + rise), b)

    weights = raised(squared, v)
    control = np.empty((degree + 1, 3, 4))
    for i in range(3):
        for k in range(3):
            control[:, i, k] = raised(rotation[i][k], v) / weights
        control[:, i, 3] = raised(squared, v * p[:, i]) / weights
    relative = _relative_error(degree, weights)
    far = float(np.sqrt((p * p).sum(axis=1)).max())
    return Rigid(RationalMotion(control, weights), relative, relative * far)


def dual_quaternion_motion(dual_quaternions: np.ndarray) -> Rigid:
    """
    Return the motion of a Bezier curve q + eps d of dual quaternions, of degree 2 n.

    A point x goes to (q x q* + 2 d q*) / |q|^2, vector parts. On Study's quadric, where d q* has
    no real part, this is the displacement that the dual quaternion stands for; off it the real
    part, which has no place in space, is left out, and the image is still a rigid displacement:
    the one of d - (Re(d q*) / |q|^2) q, the nearest on the quadric with this q.

    The rounding is that of `rigid_motion`, with translations of at most 2 max |d| max |q| over the
    least weight.

    :param dual_quaternions: (n + 1, 8) Bernstein coefficients: q (x, y, z, w), then d likewise,
        d = 1/2 p q for a translation by p [m].
    :raises RequestError: as `rigid_motion` does.
    """
    both = _array(dual_quaternions, 'dual_quaternions', 8)
    scale = unit_scale(both[:, :4])
    q, d = both[:, :4] * scale, both[:, 4:] * scale
    rotation, squared = rotation_over(q)
    degree = _degree(squared, np.ones(1))
    weights = elevated(squared, degree)
    control = np.empty((degree + 1, 3, 4))
    for i in range(3):
        for k in range(3):
            control[:, i, k] = elevated(rotation[i][k], degree) / weights
        # The vector part of d q*: -d_w v + q_w e - e x v for q = (v, q_w), d = (e, d_w).
        j, k = (i + 1) % 3, (i + 2) % 3
        vector = (
            product(q[:, 3], d[:, i])
            - product(d[:, 3], q[:, i])
            - (product(d[:, j], q[:, k]) - product(d[:, k], q[:, j]))
        )
        control[:, i, 3] = elevated(2.0 * vector, degree) / weights
    relative = _relative_error(degree, weights)
    far = 2.0 * float(np.sqrt((d * d).sum(axis=1)).max()) / float(weights.min())
    return Rigid(RationalMotion(control, weights), relative, relative * far)


def unit_scale(q: np.ndarray) -> float:
    """Return a power of two that brings the longest of some quaternions below length 1."""
    largest = float(np.sqrt((q * q).sum(axis=1)).max())
    if not largest > 0.0:
        raise _invalid('quaternions are all zero')
    return float(np.ldexp(1.0, -int(np.frexp(largest)[1])))


def rotation_over(q: np.ndarray) -> tuple[list[list[np.ndarray]], np.ndarray]:
    """Return the rows of the numerator of R, and |q|^2, in Bernstein form."""
    pair = {(a, b): product(q[:, a], q[:, b]) for a in range(4) for b in range(a, 4)}
    imaginary = pair[0, 0] + pair[1, 1] + pair[2, 2]

    def entry(i: int, k: int) -> np.ndarray:
        if i == k:
            return pair[3, 3] - imaginary + 2.0 * pair[i, i]
        across = 2.0 * pair[3 - i - k, 3]
        both = 2.0 * pair[min(i, k), max(i, k)]
        return both + across if (i, k) in _PLUS else both - across

    rows = [[entry(i, k) for k in range(3)] for i in range(3)]
    return rows, pair[3, 3] + imaginary


def _relative_error(degree: int, weights: np.ndarray) -> float:
    """Return the bound of `rigid_motion`; quaternions and weights are at most 1 there."""
    each = 3.0 * product_rounding(degree, degree) + 4.0 * U
    return 28.0 * each / float(weights.min()) + 16.0 * U


def _degree(squared: np.ndarray, v: np.ndarray) -> int:
    """Return the least degree, in steps, at which |q|^2 v has no small coefficient."""
    base = len(squared) - 1 + len(v) - 1
    degree = base
    while degree <= HIGHEST_DEGREE:
        weights = product(elevated(squared, len(squared) - 1 + degree - base), v)
        if weights.min() > LEAST_WEIGHT * weights.max():
            return degree
        degree = degree + max(1, degree // 4)
    raise _invalid(
        'the quaternions come too near to zero between their ends: the curve turns too fast for '
        'its length; split it, or let neighbours differ by less'
    )


def _array(values: np.ndarray, name: str, columns: int) -> np.ndarray:
    array = np.array(values, float)
    if array.ndim != 2 or array.shape[1] != columns or not len(array):
        raise _invalid(f'{name} must have shape (K, {columns}), K >= 1, got {array.shape}')
    wrong = ~(np.abs(array) <= 1e9)
    if wrong.any():
        i, k = np.argwhere(wrong)[0].tolist()
        raise _invalid(f'{name}[{i}, {k}] is {array[i, k]}')
    return array


def _invalid(message: str) -> RequestError:
    return RequestError(Reason.INVALID_PARAMETER, message)
