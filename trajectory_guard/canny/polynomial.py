"""Vectors of integer polynomials in s."""

from collections.abc import Sequence
import math

from flint import fmpz_poly

Vector = Sequence[fmpz_poly]


def from_bernstein(coefficients: Sequence[int]) -> fmpz_poly:
    """Return sum_i c_i C(n, i) s^i (1 - s)^(n - i)."""
    n = len(coefficients) - 1
    s, rest = fmpz_poly([0, 1]), fmpz_poly([1, -1])
    total = fmpz_poly([0])
    for i, c in enumerate(coefficients):
        total += c * math.comb(n, i) * s**i * rest ** (n - i)
    return total


def to_bernstein(f: fmpz_poly, degree: int) -> list[int]:
    """
    Return C(n, k) times the Bernstein coefficients of degree n.

    The coefficient of s^i is the sum over k >= i of C(n - i, k - i) times it.
    """
    coefficients = [int(c) for c in f.coeffs()]
    return [
        sum(c * math.comb(degree - i, k - i) for i, c in enumerate(coefficients[: k + 1]))
        for k in range(degree + 1)
    ]


def dot_product(a: Vector, b: Vector) -> fmpz_poly:
    """Return a . b."""
    total = fmpz_poly([0])
    for x, y in zip(a, b, strict=True):
        total += x * y
    return total


def cross_product(a: Vector, b: Vector) -> list[fmpz_poly]:
    """Return a x b."""
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


def rotation(Q: Vector) -> list[list[fmpz_poly]]:
    """Return the matrix of y -> Rot(y, Q) = (q0^2 - q.q) y + 2 (q.y) q + 2 q0 q x y, in rows."""
    w, x, y, z = Q
    return [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
