"""Hermite interpolation of knots, with a bound on what rounding does to it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Power coefficients c_0 .. c_5 on s in [0, 1] from the terms x = (q0, d, a, b, A, B): d = q1 - q0,
# a = h v0, b = h v1, A = h^2 a0, B = h^2 a1. They solve p(0) = q0, p(1) = q1, p'(0) = a,
# p'(1) = b, p''(0) = A, p''(1) = B as far as the degree has room; each has the terms it needs.
_WEIGHTS = {
    1: np.array([[1.0, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0]]),
    3: np.array(
        [[1.0, 0, 0, 0, 0, 0], [0, 0, 3, -2, 0, 0], [0, 1, -2, 1, 0, 0], [0, 0, -1, 1, 0, 0]]
    ),
    5: np.array(
        [
            [1, 0, 0, 0, 0, 0],
            [0, 0, 0, 10, -15, 6],
            [0, 1, 0, -6, 8, -3],
            [0, 0, 0, -4, 7, -3],
            [0, 0, 0.5, -1.5, 1.5, -0.5],
            [0, 0, 0, 0.5, -1, 0.5],
        ]
    ),
}

_UNIT = 2.0**-53

# Relative to sum_j |weights_jk| |x_j|, with (1 + theta_n) for n roundings: h from integer
# nanoseconds is theta_2 (conversion, division by 1e9), so d is theta_1, a and b theta_3, A and B
# theta_6 (twice h, the square, the product); a weight and four sums add 5, in any order and with
# or without fused operations: 11 u. The rest of 16 u covers |x| being computed, and this bound.
_ROUNDING = 16 * _UNIT

# W_j, the sum of |weights| of a term; without q0, which enters c_0 as it is.
_TOTALS = {degree: np.abs(weights[1:]).sum(axis=1) for degree, weights in _WEIGHTS.items()}

# A product below the normal range loses at most 2^-1075. Four of them have weights of 38 in all,
# and 25 weighted terms may lose as much again: less than 2^-1069.
_UNDERFLOW = 2.0**-1060


class Knots(NamedTuple):
    """
    What the controller interpolates: K >= 2 knots of n joints.

    :param times_ns: (K,) int64, strictly increasing [ns]; equal only where nothing moves.
    :param positions: (K, n) [rad or m].
    :param velocities: (K, n) [rad/s or m/s], zero where missing.
    :param has_velocities: (K,) bool.
    :param accelerations: (K, n) [rad/s^2 or m/s^2], zero where missing.
    :param has_accelerations: (K,) bool; implies has_velocities.
    :param start_error: (n,) bound on the error of positions[0]; the others are exact [rad or m].
    """

    times_ns: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    has_velocities: np.ndarray
    accelerations: np.ndarray
    has_accelerations: np.ndarray
    start_error: np.ndarray


def degrees(knots: Knots) -> np.ndarray:
    """
    Choose the degree of each segment: a derivative counts if both of its ends carry it.

    :returns: (K - 1,) of 1, 3 and 5.
    """
    cubic = knots.has_velocities[:-1] & knots.has_velocities[1:]
    quintic = cubic & knots.has_accelerations[:-1] & knots.has_accelerations[1:]
    degree: np.ndarray = 1 + 2 * cubic.astype(np.int64) + 2 * quintic
    return degree


def hermite(knots: Knots) -> tuple[np.ndarray, np.ndarray]:
    """
    Interpolate the knots.

    The exact curve is the polynomial whose data are the given floats and whose durations are
    the given integers / 10^9, in real arithmetic. With computed terms x and c_0 = q0 exact,

        sum_k |computed c_k - exact c_k| <= 16 u sum_j W_j |x_j| + 2^-1060,  W_j = sum_k |w_jk|,

    W = (31, 18, 14, 4, 2) for degree 5, (5, 4, 2) for degree 3, (1) for degree 1. A weight of
    zero adds a zero, which rounds nothing, so c_0 is exact and terms without weight do not count.
    An error e of the first position enters c_0 once and d: it adds (1 + W_0) e to the first
    segment. A joint that does not move is exact.

    :param knots: the data; overflow is not treated here and shows as inf or NaN.
    :returns: coefficients (K - 1, n, 6), power basis on s in [0, 1], and the bound (K - 1, n)
        [rad or m].
    """
    q, v, a = knots.positions, knots.velocities, knots.accelerations
    t = knots.times_ns
    segments, joints = len(q) - 1, q.shape[1]
    h = (t[1:] - t[:-1]) / 1e9
    ends = (q[:-1], q[1:], v[:-1], v[1:], a[:-1], a[1:])
    first = _only_degree(knots)
    if first is not None:
        coefficients, error = _interpolate(first, h, ends)
    else:
        coefficients = np.empty((segments, joints, 6))
        error = np.empty((segments, joints))
        chosen = degrees(knots)
        first = int(chosen[0])
        for degree in _WEIGHTS:
            rows = np.flatnonzero(chosen == degree)
            if rows.size:
                some = tuple(end[rows] for end in ends)
                coefficients[rows], error[rows] = _interpolate(degree, h[rows], some)
    if np.count_nonzero(knots.start_error):
        error[0] += (1.0 + _TOTALS[first][0]) * knots.start_error
    return coefficients, error


def _only_degree(knots: Knots) -> int | None:
    """Return the degree of every segment if all knots carry the same, else None."""
    size = len(knots.times_ns)
    velocities = np.count_nonzero(knots.has_velocities)
    if velocities == 0:
        return 1
    if velocities < size:
        return None
    accelerations = np.count_nonzero(knots.has_accelerations)
    if accelerations == 0:
        return 3
    return 5 if accelerations == size else None


def _interpolate(
    degree: int, h: np.ndarray, ends: tuple[np.ndarray, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """
    Interpolate segments of one degree.

    :param degree: 1, 3 or 5.
    :param h: (S,) durations [s].
    :param ends: q0, q1, v0, v1, a0, a1 of the segments, (S, n) each.
    :returns: coefficients (S, n, 6) and the bound (S, n), as `hermite` does.
    """
    q0, q1 = ends[:2]
    weights = _WEIGHTS[degree]
    terms = np.empty((degree + 1, *q0.shape))
    terms[0] = q0
    np.subtract(q1, q0, out=terms[1])
    for k in range(2, degree + 1):
        terms[k] = ends[k]
    moves = np.logical_or.reduce(terms[1:])
    if degree > 1:
        h = h[:, None]
        terms[2:4] *= h
        if degree > 3:
            terms[4:] *= h * h
    flat = terms.reshape(degree + 1, -1)
    coefficients = flat.T.dot(weights).reshape(*q0.shape, 6)
    size = _TOTALS[degree].dot(np.abs(flat[1:])).reshape(q0.shape)
    return coefficients, _ROUNDING * size + _UNDERFLOW * moves
