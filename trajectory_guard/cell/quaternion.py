"""Poses as messages write them: a position and a quaternion x, y, z, w."""

from collections.abc import Sequence
import math

import numpy as np

# How far from 1 the length of a quaternion may be; it is divided by it, as viewers do.
LENGTH_TOLERANCE = 1e-3


def quaternion_length(quaternion: Sequence[float]) -> float:
    """Return the length of a quaternion; nonsense has a nonsense length."""
    return math.sqrt(sum(value * value for value in quaternion))


def quaternion_pose(position: Sequence[float], quaternion: Sequence[float]) -> np.ndarray:
    """
    Return a pose as a matrix; every entry of the rotation is within 10 * 2^-53 of the exact one.

    That is the rotation of the quaternion divided by its length, n = q . q. With u = 2^-53 an
    entry on the diagonal, (w^2 + x^2 - y^2 - z^2) / n, has a numerator within 4 u n (a product and
    three sums), n itself is within 4 u n, and the quotient rounds: 9 u, as no entry exceeds 1. Off
    it, 2 (x y - w z) / n is within 2 u + 4 u + u, because 2 |x y| + 2 |w z| <= n. The rest covers
    terms in u^2.

    :param position: x, y, z [m].
    :param quaternion: x, y, z, w, of length 1 within `LENGTH_TOLERANCE`.
    :returns: (4, 4).
    """
    x, y, z, w = quaternion
    n = x * x + y * y + z * z + w * w
    T = np.eye(4)
    T[:3, :3] = (
        (w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    T[:3, :3] /= n
    T[:3, 3] = position
    return T


def quaternion_of(R: np.ndarray) -> tuple[float, float, float, float]:
    """
    Return the unit quaternion x, y, z, w of a rotation, to rounding.

    Of 4 q q^T, whose entries are sums of entries of R, the row with the largest diagonal is taken:
    it is at least 1, so that nothing is lost in dividing by its root.

    :param R: rotation, (3, 3).
    """
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    rows = (
        (1.0 + a - e - i, b + d, c + g, h - f),
        (b + d, 1.0 - a + e - i, f + h, c - g),
        (c + g, f + h, 1.0 - a - e + i, d - b),
        (h - f, c - g, d - b, 1.0 + a + e + i),
    )
    best = rows[max(range(4), key=lambda k: rows[k][k])]
    x, y, z, w = (value / quaternion_length(best) for value in best)
    return x, y, z, w
