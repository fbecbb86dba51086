"""Vectors and lists of balls."""

import functools

from flint import arb, fmpq

Vector = list[arb]


def length(vector: Vector) -> arb:
    """Return an upper bound of the length of a vector."""
    return sum((x * x for x in vector), arb(0)).abs_upper().sqrt().upper()


def least(values: list[arb]) -> arb:
    """Return a ball that contains the smallest of the values."""
    return functools.reduce(arb.min, values)


def largest(values: list[arb]) -> arb:
    """Return a ball that contains the largest of the values."""
    return functools.reduce(arb.max, values)


def lerp(a: Vector, b: Vector, s: fmpq) -> Vector:
    """Return the vector at s between two, from 0 to 1."""
    return [x + s * (y - x) for x, y in zip(a, b, strict=True)]
