"""Leaves of the cover: what is known about a span of a segment, as rows of two arrays."""

import numpy as np

from trajectory_guard.kernels.jit import kernel

# Status; the values of `result.Status`.
FREE = 1
SUSPECT = 2
COLLISION = 3

# Why a leaf is suspect.
BY_TOLERANCE = 0
BY_DEPTH = 1
BY_BUDGET = 2
BY_STOP = 3

# Columns of the integers: [START, END] / 2^LEVEL of a SEGMENT; the middle 2^-WITNESS of the leaf
# provably collides, 0 if none does.
SEGMENT, START, END, LEVEL, STATUS, REASON, BODY, OBSTACLE, WITNESS = range(9)
COLUMNS = 9

# Columns of what is known about a pair on a piece: bounds of its gap, the place, the depth of a
# common point in both solids together, and an upper bound of the gap at every instant [m].
LOWER, UPPER, X, Y, Z, DEPTH, NEAR = range(7)
KNOWN = 7


@kernel
def grown(array, wanted):
    """Return the array, or a copy with room for at least ``wanted`` rows."""
    if wanted <= array.shape[0]:
        return array
    larger = np.empty((max(wanted, 2 * array.shape[0]), array.shape[1]), array.dtype)
    for i in range(array.shape[0]):
        for k in range(array.shape[1]):
            larger[i, k] = array[i, k]
    return larger


@kernel
def write(ints, floats, row, segment, k, level, status, reason, body, obstacle, known):
    """Write the leaf [k, k + 1] / 2^level; body and obstacle are -1 where no pair is named."""
    ints[row, SEGMENT] = segment
    ints[row, START] = k
    ints[row, END] = k + 1
    ints[row, LEVEL] = level
    ints[row, STATUS] = status
    ints[row, REASON] = reason
    ints[row, BODY] = body
    ints[row, OBSTACLE] = obstacle
    ints[row, WITNESS] = 0
    for c in range(KNOWN):
        floats[row, c] = known[c]
