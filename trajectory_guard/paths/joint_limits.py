"""Position limits against the whole curve, not against its points."""

from __future__ import annotations

from functools import lru_cache
import math
from typing import NamedTuple

import numpy as np

# Control points b_0 .. b_5 of p - c_0 from the power coefficients c_0 .. c_5:
# b_i = sum_{k>0} C(i, k) / C(5, k) c_k; zero times c_0 is a zero, which rounds nothing.
_BERNSTEIN = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1 / 5, 0.0, 0.0, 0.0, 0.0],
        [0.0, 2 / 5, 1 / 10, 0.0, 0.0, 0.0],
        [0.0, 3 / 5, 3 / 10, 1 / 10, 0.0, 0.0],
        [0.0, 4 / 5, 6 / 10, 4 / 10, 1 / 5, 0.0],
        [0.0, 1.0, 1.0, 1.0, 1.0, 1.0],
    ]
)

# Of p - c_0 and of c_0 - p.
_CONTROL = np.concatenate([_BERNSTEIN, -_BERNSTEIN])
_SIGNS = np.array([1.0, -1.0])[:, None, None]

# De Casteljau at 1/2: control points of the left half; the right half is its mirror image.
_LEFT = (
    np.array(
        [
            [32, 16, 8, 4, 2, 1],
            [0, 16, 16, 12, 8, 5],
            [0, 0, 8, 12, 12, 10],
            [0, 0, 0, 4, 8, 10],
            [0, 0, 0, 0, 2, 5],
            [0, 0, 0, 0, 0, 1],
        ]
    )
    / 32
)
_RIGHT = _LEFT[::-1, ::-1].copy()

_UNIT = 2.0**-53

# Halvings. Control point i lies at most i (5 - i) / 2 <= 3 second differences off the chord of the
# ends; these are at most 4 max |b_i| <= 4 sum |c_k| and fall by 4 a halving. So a peak is at most
# 12 * 4^-k sum |c_k| above the higher end, below _ROUNDING sum |c_k| from k = 25 on.
_DEPTH = 28

# Error of a control point, relative to sum_{k>0} |c_k|: 7 roundings in the change of basis, then
# 6 a halving, as the weights of either are non-negative and sum to at most 1; at most
# 7 + 6 * 28 = 175 u together, and the rest of 256 u is for the comparisons.
_ROUNDING = 256 * _UNIT
_MOVING = np.array([0.0, 1.0, 1.0, 1.0, 1.0, 1.0])


class LimitExcess(NamedTuple):
    """
    A place where a curve leaves its limits.

    :param segment: index of the segment.
    :param joint: index of the joint.
    :param s: parameter in [0, 1] of the extremum on that segment.
    :param value: the extremum [rad or m].
    :param limit: the limit it exceeds [rad or m].
    """

    segment: int
    joint: int
    s: float
    value: float
    limit: float


def limit_excess(
    coefficients: np.ndarray,
    error: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    tolerance: float,
) -> LimitExcess | None:
    """
    Find the first segment on which a joint leaves its limits by more than the tolerance.

    With p - c_0 in Bernstein form, sup p is at most the largest control point, and at least the
    value at either end; halving brings the two together quadratically. Every comparison adds the
    error of p to the value, so None proves that lower - tolerance <= p <= upper + tolerance for
    all s, and a result is wrong by no more than twice that error. A curve that does not move
    is judged exactly. A joint without a limit on a side cannot leave it there.

    :param coefficients: (S, n, 6) power basis on [0, 1] [rad or m].
    :param error: (S, n) bound on the sum of the errors of the coefficients [rad or m].
    :param lower: (n,) [rad or m]; -inf: none.
    :param upper: (n,) [rad or m]; inf: none.
    :param tolerance: not negative [rad or m].
    :returns: the largest excess on the first segment that has one, or None.
    """
    start = coefficients[..., 0]
    flat = coefficients.reshape(-1, 6)
    limits, allowed, rounding = _allowance(tuple(lower.tolist()), tuple(upper.tolist()), tolerance)
    # Both sides as one upper limit: of p, and of -p.
    control = _CONTROL.dot(flat.T).reshape(2, 6, *start.shape)
    peak = np.maximum.reduce(control, axis=1)
    room = allowed - _SIGNS * start
    margin = error + _ROUNDING * np.abs(flat).dot(_MOVING).reshape(start.shape) + rounding
    # Written so that a NaN counts as an excess.
    inside = peak + margin <= room
    if np.count_nonzero(inside) == inside.size:
        return None
    near = ~inside & (limits != math.inf)
    side, segment, joint = np.nonzero(near)
    sign = np.where(side == 0, 1.0, -1.0)
    out = _exceeds(control[side, :, segment, joint], margin[near], room[near])
    if not out.any():
        return None
    found = []
    first = segment[out].min()
    for i in np.flatnonzero(out & (segment == first)):
        j = joint[i]
        limit = float(upper[j] if side[i] == 0 else lower[j])
        s, value = _maximum(sign[i] * coefficients[first, j])
        found.append(LimitExcess(int(first), int(j), s, float(sign[i]) * value, limit))
    return max(found, key=lambda excess: abs(excess.value - excess.limit))


@lru_cache(maxsize=64)
def _allowance(
    lower: tuple[float, ...], upper: tuple[float, ...], tolerance: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """
    Return what p and -p may reach, and a bound on its rounding.

    :param lower: n lower limits [rad or m].
    :param upper: n upper limits [rad or m].
    :param tolerance: not negative [rad or m].
    :returns: of p and of -p the limits, these with the tolerance, and the bound, (2, 1, n) each.
    """
    limits = np.array((upper, [-limit for limit in lower]))[:, None]
    rounding = 4.0 * _UNIT * (np.abs(limits) + tolerance) if tolerance > 0.0 else 0.0 * _SIGNS
    arrays = limits, limits + tolerance, rounding
    for array in arrays:
        array.setflags(write=False)
    return arrays


def _exceeds(control: np.ndarray, margin: np.ndarray, allowed: np.ndarray) -> np.ndarray:
    """
    Tell which polynomials exceed what is allowed somewhere on [0, 1].

    :param control: (m, 6) control points.
    :param margin: (m,) bound on the error of every value and control point.
    :param allowed: (m,).
    :returns: (m,) bool; False is proved.
    """
    exceeds = np.zeros(len(control), dtype=np.bool_)
    owner = np.arange(len(control))
    for _ in range(_DEPTH):
        ends = np.maximum(control[:, 0], control[:, 5])
        peak = control.max(axis=1)
        beyond = ~(ends + margin[owner] <= allowed[owner])
        unsettled = ~(peak + margin[owner] <= allowed[owner])
        settled_by_rounding = peak - ends <= margin[owner]
        exceeds[owner[unsettled & (beyond | settled_by_rounding)]] = True
        left = unsettled & ~exceeds[owner]
        if not left.any():
            return exceeds
        control = np.concatenate([control[left] @ _LEFT, control[left] @ _RIGHT])
        owner = np.tile(owner[left], 2)
    exceeds[owner] = True
    return exceeds


def _maximum(coefficients: np.ndarray) -> tuple[float, float]:
    """Return where on [0, 1] a polynomial is largest, and the value; for the message only."""
    slope = coefficients[1:] * np.arange(1, 6)
    large = np.flatnonzero(np.abs(slope) > _UNIT * np.abs(slope).max())
    candidates = np.array([0.0, 1.0])
    if large.size and large[-1] > 0:
        roots = np.polynomial.polynomial.polyroots(slope[: large[-1] + 1]).real
        candidates = np.concatenate([candidates, roots[(roots > 0.0) & (roots < 1.0)]])
    values = np.polynomial.polynomial.polyval(candidates, coefficients)
    best = int(np.argmax(values))
    return float(candidates[best]), float(values[best])
