"""The different rows of an array."""

import numpy as np


def unique_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """
    Return what ``numpy.unique`` does along axis 0, several times as fast.

    That compares rows as wholes; here each column is sorted as numbers.

    :param rows: (n, k), without NaN; zeros of either sign are equal.
    :returns: the different rows in lexicographic order, and (n,) the place of each row in them.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    first = np.ones(len(rows), dtype=np.bool_)
    np.any(ordered[1:] != ordered[:-1], axis=1, out=first[1:])
    inverse = np.empty(len(rows), dtype=np.intp)
    inverse[order] = np.cumsum(first) - 1
    return ordered[first], inverse
