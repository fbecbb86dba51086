"""Hermite interpolation of knots, with a bound on what rounding does to it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Power coefficients c_1 .. c_5 on s in [0, 1] from the differences x = (d, a, b, A, B):
# d = q1 - q0, a = h v0, b = h v1, A = h^2 a0, B = h^2 a1; c_0 = q0. They solve p(1) = q1,
# p'(0) = a, p'(1) = b, p''(0) = A, p''(1) = B as far as the degree has room for it.
_LINEAR = np.zeros((5, 5))
_LINEAR[0, 0] = 1.0
_CUBIC = np.zeros((5, 5))
_CUBIC[:3, :3] = [[0, 3, -2], [1, -2, 1], [0, -1, 1]]
_QUINTIC = np.array(
    [
        [0, 0, 10, -15, 6],
        [1, 0, -6, 8, -3],
        [0, 0, -4, 7, -3],
        [0, 0.5, -1.5, 1.5, -0.5],
        [0, 0, 0.5, -1, 0.5],
    ]
)
_WEIGHTS = {1: _LINEAR, 3: _CUBIC, 5: _QUINTIC}

_UNIT = 2.0**-53

# Relative to sum_j |weights_jk| |x_j|, with (1 + theta_n) for n roundings: h from integer
# nanoseconds is theta_2 (conversion, division by 1e9), so d is theta_1, a and b theta_3, A and B
# theta_6 (twice h, the square, the product); a weight and four sums add 5, in any order and with
# or without fused operations: 11 u. The rest of 16 u covers |x| being computed, and this bound.
_ROUNDING = 16 * _UNIT

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

    W = (31, 18, 14, 4, 2) for degree 5, (5, 4, 2) for degree 3, (1) for degree 1. An error e of
    the first position enters c_0 once and d: it adds (1 + W_0) e to the first segment. A joint
    that does not move is exact.

    :param knots: the data; overflow is not treated here and shows as inf or NaN.
    :returns: coefficients (K - 1, n, 6), power basis on s in [0, 1], and the bound (K - 1, n)
        [rad or m].
    """
    q, v, a = knots.positions, knots.velocities, knots.accelerations
    segments, joints = len(q) - 1, q.shape[1]
    h = ((knots.times_ns[1:] - knots.times_ns[:-1]) / 1e9)[:, None]
    terms = np.stack([q[1:] - q[:-1], v[:-1], v[1:], a[:-1], a[1:]])
    moves = terms.any(axis=0)
    terms[1:3] *= h
    terms[3:] *= h * h
    coefficients = np.zeros((segments, joints, 6))
    coefficients[..., 0] = q[:-1]
    error = np.where(moves, _UNDERFLOW, 0.0)
    degree = degrees(knots)
    for choice, weights in _WEIGHTS.items():
        rows = degree == choice
        if rows.any():
            some = terms[:, rows].reshape(5, -1)
            total = np.abs(weights).sum(axis=1)
            coefficients[rows, :, 1:] = (some.T @ weights).reshape(-1, joints, 5)
            error[rows] += _ROUNDING * (total @ np.abs(some)).reshape(-1, joints)
            if rows[0]:
                error[0] += (1.0 + total[0]) * knots.start_error
    return coefficients, error
