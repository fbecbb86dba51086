"""Doubles as integers: exact, over a common power of two."""

import numpy as np


def exponent(*arrays: np.ndarray) -> int:
    """
    Return the least k >= 0 for which 2^k x is an integer for every number x.

    :param arrays: finite doubles of any shape.
    """
    ratios = (x.as_integer_ratio()[1] for array in arrays for x in array.ravel().tolist())
    return max(ratios, default=1).bit_length() - 1


def scaled(array: np.ndarray, k: int) -> list[list[int]]:
    """
    Return 2^k times an array, exactly.

    :param array: (n, m) finite doubles.
    :param k: at least what :func:`exponent` says of them.
    """
    rows = []
    for row in array.tolist():
        ratios = [x.as_integer_ratio() for x in row]
        rows.append([p * ((1 << k) // q) for p, q in ratios])
    return rows


def dot(a: list[int], b: list[int]) -> int:
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: list[int], b: list[int]) -> list[int]:
    """Return a x b."""
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


def minus(a: list[int], b: list[int]) -> list[int]:
    """Return a - b."""
    return [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
