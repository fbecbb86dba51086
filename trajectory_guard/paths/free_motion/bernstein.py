"""Products of polynomials in Bernstein form, with a bound on their rounding."""

from functools import lru_cache
from math import comb

import numpy as np

U = 2.0**-53


@lru_cache(maxsize=256)
def _shares(m: int, n: int) -> np.ndarray:
    """Return C(m, i) C(n, k) / C(m + n, i + k), (m + 1, n + 1); they add up to 1 along i + k."""
    shares = np.array(
        [
            [comb(m, i) * comb(n, k) / comb(m + n, i + k) for k in range(n + 1)]
            for i in range(m + 1)
        ]
    )
    shares.flags.writeable = False
    return shares


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """
    Return the Bernstein coefficients of a product.

    A coefficient is a mean of products a_i b_k with weights that add up to 1; its rounding is at
    most `product_rounding` times max |a| max |b|.

    :param a: (m + 1,).
    :param b: (n + 1,).
    :returns: (m + n + 1,).
    """
    m, n = len(a) - 1, len(b) - 1
    terms = _shares(m, n) * a[:, None] * b
    c = np.zeros(m + n + 1)
    for i in range(m + 1):
        c[i : i + n + 1] += terms[i]
    return c


def product_rounding(m: int, n: int) -> float:
    """Bound the rounding: a share, two products, and a sum of at most min(m, n) + 1 terms."""
    return (min(m, n) + 5.0) * U


def elevated(a: np.ndarray, degree: int) -> np.ndarray:
    """Return the coefficients of the same polynomial at a higher degree."""
    times = degree - (len(a) - 1)
    return product(a, np.ones(times + 1)) if times else a
