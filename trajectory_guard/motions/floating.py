"""A free path in the kernels' words: one rational curve per segment, and how it may stretch."""

from itertools import accumulate
import math

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.kernels.layout import Floating
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.free_path import FreePath

# Limits of the kernels: see ``floating.hpp``.
HIGHEST_DEGREE = 64
SMALLEST_WEIGHT = 1e-9  # over the largest of the segment
LARGEST_ENTRY = 1e9

# A linear part that is farther from a rotation than this makes no solid's congruent image.
RIGID = 1e-6

_UNIT = 2.0**-53


def floating(path: FreePath) -> Floating:
    """
    Return the curves of a free path as kernel arrays.

    :param path: the motion of a body.
    :raises RequestError: a degree is above 64, the weights of a segment differ by more than 5e8,
        an entry of a control point is larger than 2.5e8 [m], or an error larger than 1e9.
    """
    for i, motion in enumerate(path.motions):
        _check(i, motion)
    for name in ('turn_error', 'shift_error'):
        worst = float(getattr(path, name).max())
        if not worst <= LARGEST_ENTRY:
            raise RequestError(Reason.TOO_LARGE, f'{name} reaches {worst:g}')
    bounds = [
        (turn, shift, *stretch(motion))
        for motion, turn, shift in zip(
            path.motions, path.turn_error.tolist(), path.shift_error.tolist(), strict=True
        )
    ]
    points = np.concatenate([motion.control_points for motion in path.motions])
    control = np.zeros((len(points), 4, 4))
    control[:, :, :3] = points.transpose(0, 2, 1)
    ends = accumulate((len(motion.weights) for motion in path.motions), initial=0)
    return Floating(
        first=np.array(list(ends), np.int64),
        control=control.reshape(-1, 16),
        # The powers of two that weights are divided by leave their ratios exact.
        weight=np.concatenate([_scaled(motion.weights) for motion in path.motions]),
        bounds=np.array(bounds, np.float64),
    )


def stretch(motion: RationalMotion) -> tuple[float, float]:
    """
    Bound how much longer a motion's linear part makes a vector of length 1.

    With N = sum_i b_i w_i M_i and w = sum_i b_i w_i in scaled Bernstein form, b_i = C(n, i), the
    products N^T N and w^2 are convolutions, and all coefficients of w^2 are positive. So M^T M - I
    = (N^T N - w^2 I) / w^2 lies, at every s, in the convex hull of the quotients of coefficients,
    and its norm is at most the largest of theirs, d. Singular values are then within sqrt(1 - d)
    and sqrt(1 + d), nearer to 1 than d. A coefficient is a sum of at most n + 1 products, each
    with two rounded binomials and weights: 4 (n + 8) u times the largest |M_i|^2 a quotient.

    If d is more than `RIGID`, the motion is taken for affine: |M| <= max |M_i|, M being a convex
    combination.

    :param motion: the curve.
    :returns: stretch, and 1 if the linear part is a rotation (or mirrors) within it, else 0.
    """
    n = motion.degree
    linear = motion.control_points[:, :, :3]
    weight = np.array([math.comb(n, i) for i in range(n + 1)]) * _scaled(motion.weights)
    rows = weight[:, None, None] * linear
    square = np.convolve(weight, weight)
    product = np.zeros((2 * n + 1, 3, 3))
    for i, row in enumerate(rows):
        product[i : i + n + 1] += row.T @ rows
    off = product / square[:, None, None] - np.eye(3)
    size = np.square(linear).sum(axis=(1, 2)).max()
    rounding = 4.0 * (n + 8.0) * _UNIT * (1.0 + 3.0 * size)
    defect = float(np.sqrt(np.square(off).sum(axis=(1, 2)).max()) * (1.0 + 2.0**-40) + rounding)
    if defect <= RIGID:
        return defect, 1.0
    largest = np.linalg.norm(linear, ord=2, axis=(1, 2)).max()
    return max(0.0, float(largest * (1.0 + 2.0**-40) - 1.0)), 0.0


def _scaled(weights: np.ndarray) -> np.ndarray:
    """Return weights times a power of two, the largest then in [1/2, 1)."""
    _, exponent = np.frexp(weights.max())
    return np.ldexp(weights, -int(exponent))


def _check(i: int, motion: RationalMotion) -> None:
    if motion.degree > HIGHEST_DEGREE:
        raise RequestError(
            Reason.TOO_LARGE,
            f'motions[{i}] has degree {motion.degree}, more than {HIGHEST_DEGREE}',
        )
    ratio = float(motion.weights.min() / motion.weights.max())
    if not ratio >= 2.0 * SMALLEST_WEIGHT:
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'motions[{i}] has weights from {motion.weights.min():g} to {motion.weights.max():g}',
        )
    entry = float(np.abs(motion.control_points).max())
    if not entry <= 0.25 * LARGEST_ENTRY:
        raise RequestError(
            Reason.TOO_LARGE, f'motions[{i}] has a control point with the entry {entry:g}'
        )
