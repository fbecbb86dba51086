"""Random rational motions, and their exact value."""

from fractions import Fraction
from math import comb

import numpy as np

from trajectory_guard.motions.motion import RationalMotion


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


def rational_curve(quaternions: np.ndarray, path: np.ndarray) -> RationalMotion:
    """
    Return the rotations of a curve of quaternions, and a rational curve of translations.

    :param quaternions: (5, 4) control points, real part first; not so far apart that a weight
        vanishes.
    :param path: (9, 3) control points of the translation.
    """
    turns = rigid_motion(quaternions, np.zeros((1, 3)))
    control = turns.control_points.copy()
    control[:, :, 3] = path
    return RationalMotion(control, turns.weights)


def random_curve(
    rng: np.random.Generator, scale: float = 1.0, turn: float = 0.3, shift: float = 1.0
) -> RationalMotion:
    """Return a random motion of degree 8; its translations are about a scale long."""
    quaternions = [1, 0, 0, 0] + turn * np.cumsum(rng.normal(size=(5, 4)), axis=0) / 2.0
    line = np.linspace(-1, 1, 9)[:, None] * rng.normal(size=3) + 0.2 * rng.normal(size=(9, 3))
    return rational_curve(quaternions, scale * shift * line)


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
