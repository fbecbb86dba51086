"""Rational motions of free bodies, given or random, and their exact value."""

from fractions import Fraction
from math import comb
from typing import NamedTuple

import numpy as np

from trajectory_guard.motion import RationalMotion


class RationalCurve(NamedTuple):
    """Control points (K, 3, 4) and positive Bernstein weights (K,)."""

    control_points: np.ndarray
    weights: np.ndarray


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the Bernstein coefficients of a product."""
    m, n = len(a) - 1, len(b) - 1
    c = np.zeros(m + n + 1)
    for i in range(m + 1):
        for k in range(n + 1):
            c[i + k] += comb(m, i) * comb(n, k) * a[i] * b[k]
    return c / [comb(m + n, k) for k in range(m + n + 1)]


def rigid_motion(quaternions: np.ndarray, positions: np.ndarray) -> RationalMotion:
    """
    Return x -> q x q* / |q|^2 + p, to rounding.

    :param quaternions: (n + 1, 4) Bernstein coefficients of q, real part first.
    :param positions: (m + 1, 3) Bernstein coefficients of p [m].
    """
    w, x, y, z = np.asarray(quaternions, float).T
    one = np.ones(len(positions))
    ww, xx, yy, zz = (product(a, a) for a in (w, x, y, z))
    norm = ww + xx + yy + zz
    rows = [
        [
            ww + xx - yy - zz,
            2 * (product(x, y) - product(w, z)),
            2 * (product(x, z) + product(w, y)),
        ],
        [
            2 * (product(x, y) + product(w, z)),
            ww - xx + yy - zz,
            2 * (product(y, z) - product(w, x)),
        ],
        [
            2 * (product(x, z) - product(w, y)),
            2 * (product(y, z) + product(w, x)),
            ww - xx - yy + zz,
        ],
    ]
    weights = product(norm, one)
    control = np.empty((len(weights), 3, 4))
    for i in range(3):
        for k in range(3):
            control[:, i, k] = product(rows[i][k], one) / weights
        control[:, i, 3] = product(norm, np.asarray(positions, float)[:, i]) / weights
    return RationalMotion(control, weights)


def random_rigid_motion(
    rng: np.random.Generator, degree: int = 2, size: float = 1.0, turn: float = 0.4
) -> RationalMotion:
    """Return a motion of degree 2 degree + 2 within a cube of half side `size` [m]."""
    first = rng.normal(size=4)
    steps = turn * rng.normal(size=(degree, 4))
    quaternions = np.cumsum(np.vstack([first / np.linalg.norm(first), steps]), axis=0)
    return rigid_motion(quaternions, rng.uniform(-size, size, (3, 3)))


def exact_pose(motion: RationalMotion, s: Fraction) -> list[list[Fraction]]:
    """Return the (3, 4) displacement at s, exactly."""
    n = motion.degree
    basis = [
        comb(n, i) * s**i * (1 - s) ** (n - i) * Fraction(w)
        for i, w in enumerate(motion.weights.tolist())
    ]
    total = sum(basis)
    points = motion.control_points.tolist()
    return [
        [
            sum(b * Fraction(p[r][c]) for b, p in zip(basis, points, strict=True)) / total
            for c in range(4)
        ]
        for r in range(3)
    ]


def exact_image(motion: RationalMotion, s: Fraction, x: np.ndarray) -> list[Fraction]:
    """Return where a point is at s, exactly."""
    y = [*map(Fraction, x.tolist()), Fraction(1)]
    return [sum(a * b for a, b in zip(row, y, strict=True)) for row in exact_pose(motion, s)]


def rational_curve(quaternions, path):
    """
    Return the rotations of a curve of quaternions, and a rational curve of translations.

    :param quaternions: (5, 4) control points w, x, y, z; not so far apart that a weight vanishes.
    :param path: (9, 3) control points of the translation.
    """
    w, x, y, z = np.asarray(quaternions, dtype=float).T
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
    return RationalCurve(np.concatenate([turns, np.asarray(path)[:, :, None]], axis=2), weights)


def random_curve(rng, scale=1.0, turn=0.3, shift=1.0):
    """Return a random motion; its translations are about a scale long."""
    quaternions = [1, 0, 0, 0] + turn * np.cumsum(rng.normal(size=(5, 4)), axis=0) / 2.0
    line = np.linspace(-1, 1, 9)[:, None] * rng.normal(size=3) + 0.2 * rng.normal(size=(9, 3))
    return rational_curve(quaternions, scale * shift * line)
