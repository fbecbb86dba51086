"""A turn at constant rate about a fixed axis as a quaternion curve: slerp, made rational."""

from fractions import Fraction
from functools import lru_cache
from math import comb

import numpy as np

from trajectory_guard.paths.free_motion.bernstein import U

# What the approximation of the half-angle's tangent may cost [rad].
ACCURACY = 5e-10

# Terms of the tangent's series; at x = pi / 4 the rest is below 1e-15.
TERMS = 28


def constant_turn(start: np.ndarray, axis: np.ndarray, angle: float) -> tuple[np.ndarray, float]:
    """
    Return Bernstein coefficients of a curve along q(s) = exp(axis angle s / 2) start.

    About the middle the angle is 2 x, x = angle (s - 1/2) / 2 in [-X, X], X = angle / 4, and
    q ~ (1 + u axis) middle with u ~ tan x. Because atan is 1-Lipschitz, |2 atan u - 2 x| <=
    2 |u - tan x|.

    The power series of the tangent has positive coefficients with ratios below 0.41 (they
    increase to 4 / pi^2), so what is left out after the last term t is below 0.41 X^2 t /
    (1 - 0.41 X^2). In Chebyshev's basis it is cut where what is dropped is below the accuracy.

    :param start: (4,) unit quaternion (x, y, z, w).
    :param axis: (3,) unit axis in the parent frame.
    :param angle: in [0, pi] [rad].
    :returns: (n + 1, 4), and a bound on how far the turn may be off, rounding included [rad].
    """
    X = angle / 4.0
    u, error = _tangent(X)
    half = 0.5 * angle / 2.0
    middle = multiplied(np.append(np.sin(half) * axis, np.cos(half)), start)
    turned = multiplied(np.append(axis, 0.0), middle)
    # Sine, cosine and two products of unit quaternions: below 32 u each.
    return middle + u[:, None] * turned, 2.0 * error + 128.0 * U


def multiplied(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the product of two quaternions (x, y, z, w)."""
    x, y, z, w = a.tolist()
    X, Y, Z, W = b.tolist()
    return np.array(
        [
            w * X + x * W + y * Z - z * Y,
            w * Y - x * Z + y * W + z * X,
            w * Z + x * Y - y * X + z * W,
            w * W - x * X - y * Y - z * Z,
        ]
    )


def _tangent(X: float) -> tuple[np.ndarray, float]:
    """
    Return Bernstein coefficients of a polynomial near tan(X (2 s - 1)), and its error.

    All coefficients of the series are positive, in powers and in Chebyshev's basis alike, so their
    rounding is relative: below 256 u.
    """
    powers = _series() * X ** (2.0 * np.arange(TERMS) + 1.0)
    chebyshev = _in_chebyshev() @ powers
    rest = 0.41 * X * X * powers[-1] / (1.0 - 0.41 * X * X)
    kept = TERMS
    while kept > 1 and chebyshev[kept - 1 :].sum() + rest <= 0.4 * ACCURACY:
        kept -= 1
    dropped = float(chebyshev[kept:].sum()) + rest
    u = _in_bernstein(kept) @ chebyshev[:kept]
    # Chebyshev polynomials of degree k have Bernstein coefficients below 4^k.
    sizes = chebyshev[:kept] * 4.0 ** (2.0 * np.arange(kept) + 1.0)
    rounding = 64.0 * U * float(sizes.sum()) + 256.0 * U
    return u, (dropped + rounding) * (1.0 + 1e-9)


@lru_cache(maxsize=1)
def _series() -> np.ndarray:
    """Return the coefficients of x, x^3, x^5, ... of the tangent, from tan' = 1 + tan^2."""
    t: list[Fraction] = [Fraction(1)]
    for k in range(1, TERMS):
        square = sum((t[i] * t[k - 1 - i] for i in range(k)), Fraction(0))
        t.append(square / (2 * k + 1))
    return np.array([float(c) for c in t])


@lru_cache(maxsize=1)
def _in_chebyshev() -> np.ndarray:
    """Return column i: coefficients of T_1, T_3, ... of the power 2 i + 1; all >= 0."""
    table = np.zeros((TERMS, TERMS))
    for i in range(TERMS):
        n = 2 * i + 1
        for k in range(i + 1):
            table[k, i] = 2 * comb(n, (n - (2 * k + 1)) // 2) / 2**n
    return table


@lru_cache(maxsize=TERMS)
def _in_bernstein(count: int) -> np.ndarray:
    """Return column k: Bernstein coefficients of T_(2k+1)(2 s - 1), of degree 2 count - 1."""
    degree = 2 * count - 1
    table = np.zeros((degree + 1, count))
    for k in range(count):
        n = 2 * k + 1
        own = [Fraction((-1) ** (n - j) * comb(2 * n, 2 * j), comb(n, j)) for j in range(n + 1)]
        for i in range(degree + 1):
            terms = (
                Fraction(comb(n, j) * comb(degree - n, i - j), comb(degree, i)) * own[j]
                for j in range(max(0, i - degree + n), min(n, i) + 1)
            )
            table[i, k] = float(sum(terms, Fraction(0)))
    return table
