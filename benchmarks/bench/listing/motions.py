"""
Rational motions of degree 8: a quartic curve of quaternions turns, a curve of degree 8 shifts.

With q(s) of degree 4 the matrix |q|^2 R(q) and the weight |q|^2 have degree 8; the control points
of the translation are free. Motions of one experiment differ by a constant translation.
"""

from math import comb
from typing import NamedTuple

import numpy as np


class Motion(NamedTuple):
    """Control points (9, 3, 4) and positive Bernstein weights (9,)."""

    control_points: np.ndarray
    weights: np.ndarray


def rational_motion(quaternions: np.ndarray, path: np.ndarray) -> Motion:
    """
    Return the motion of a quartic quaternion curve.

    :param quaternions: (5, 4) control points w, x, y, z.
    :param path: (9, 3) control points of the translation.
    """
    w, x, y, z = quaternions.T
    ww, xx, yy, zz = (product(q, q) for q in (w, x, y, z))
    xy, xz, yz = product(x, y), product(x, z), product(y, z)
    wx, wy, wz = product(w, x), product(w, y), product(w, z)
    weights = ww + xx + yy + zz
    rows = [
        [ww + xx - yy - zz, 2 * (xy - wz), 2 * (xz + wy)],
        [2 * (xy + wz), ww - xx + yy - zz, 2 * (yz - wx)],
        [2 * (xz - wy), 2 * (yz + wx), ww - xx - yy + zz],
    ]
    turns = np.moveaxis(np.array(rows) / weights, -1, 0)
    return Motion(np.concatenate([turns, path[:, :, None]], axis=2), weights)


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the product of two polynomials in Bernstein form."""
    n, m = len(a) - 1, len(b) - 1
    out = np.zeros(n + m + 1)
    for i, j in np.ndindex(n + 1, m + 1):
        out[i + j] += a[i] * b[j] * comb(n, i) * comb(m, j) / comb(n + m, i + j)
    return out


def octagon_motion(shift: tuple[float, float, float]) -> Motion:
    """Return a slide along the fixed octagon with a wobble, as near as the translation puts it."""
    k, j = np.arange(5) - 2.0, np.arange(9) - 4.0
    quaternions = np.stack([np.ones(5), 0.1 * k, 0.1 - 0.05 * k**2, 0.3 * k], axis=1)
    path = np.stack([0.25 * j, 0.1 * j, 0.02 * j**2], axis=1)
    return rational_motion(quaternions, path + shift)


def square_motion(height: float) -> Motion:
    """
    Return a turn of 34 degrees about the vertical, tilted by 0.6 rad, while a corner comes down.

    :param height: of the corner above the fixed square at its lowest.
    """
    turn = 0.6 * (np.arange(5) / 4.0 - 0.5)
    tilt = np.full(5, np.sin(0.3) * np.sqrt(0.5))
    quaternions = np.stack([np.cos(0.3) * np.cos(turn), tilt, -tilt, np.sin(turn)], axis=1)
    j = np.arange(9) - 4.0
    path = np.stack([0.05 + 0.12 * j, 0.05 + 0.06 * j, (j / 8.0) ** 2], axis=1)
    motion = rational_motion(quaternions, path)
    motion.control_points[:, 2, 3] += height - LOWEST
    return motion


# Of the corners of the unit square under the motion before it is lifted.
LOWEST = -0.37151
