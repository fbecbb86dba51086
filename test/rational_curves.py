"""Rational motions of degree 8 for tests: quartic quaternion curves and curves of translations."""

from math import comb
from typing import NamedTuple

import numpy as np


class RationalCurve(NamedTuple):
    """Control points (K, 3, 4) and positive Bernstein weights (K,)."""

    control_points: np.ndarray
    weights: np.ndarray


def _times(a, b):
    """Return the product of two polynomials in Bernstein form."""
    n, m = len(a) - 1, len(b) - 1
    out = np.zeros(n + m + 1)
    for i, j in np.ndindex(n + 1, m + 1):
        out[i + j] += a[i] * b[j] * comb(n, i) * comb(m, j) / comb(n + m, i + j)
    return out


def rational_curve(quaternions, path):
    """
    Return the rotations of a curve of quaternions, and a rational curve of translations.

    :param quaternions: (5, 4) control points w, x, y, z; not so far apart that a weight vanishes.
    :param path: (9, 3) control points of the translation.
    """
    w, x, y, z = np.asarray(quaternions, dtype=float).T
    ww, xx, yy, zz = (_times(q, q) for q in (w, x, y, z))
    xy, xz, yz = _times(x, y), _times(x, z), _times(y, z)
    wx, wy, wz = _times(w, x), _times(w, y), _times(w, z)
    weights = ww + xx + yy + zz
    rows = [
        [ww + xx - yy - zz, 2 * (xy - wz), 2 * (xz + wy)],
        [2 * (xy + wz), ww - xx + yy - zz, 2 * (yz - wx)],
        [2 * (xz - wy), 2 * (yz + wx), ww - xx - yy + zz],
    ]
    turns = np.moveaxis(np.array(rows) / weights, -1, 0)
    return RationalCurve(np.concatenate([turns, np.asarray(path)[:, :, None]], axis=2), weights)


def random_curve(rng, scale=1.0, turn=0.3, shift=1.0):
    """Return a random motion; its translations are about a scale long."""
    quaternions = [1, 0, 0, 0] + turn * np.cumsum(rng.normal(size=(5, 4)), axis=0) / 2.0
    line = np.linspace(-1, 1, 9)[:, None] * rng.normal(size=3) + 0.2 * rng.normal(size=(9, 3))
    return rational_curve(quaternions, scale * shift * line)
