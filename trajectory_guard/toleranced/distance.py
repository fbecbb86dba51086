"""The largest number that a proof accepts."""

from collections.abc import Callable
import math

# Halvings of the interval that holds it: relative accuracy 1e-9, for drawing and reports.
HALVINGS = 30

# The first number tried lies below the guess by this fraction: usually it is accepted.
SHY = 2.0**-30


def largest_accepted(accepts: Callable[[float], bool], guess: float) -> float:
    """
    Return the largest number found between 0 and a guess that is accepted, 0 if none is.

    :param accepts: a proof; each number accepted is true by itself, whatever the others are.
    :param guess: about the largest that can be accepted.
    """
    if not 0.0 < guess < math.inf:
        return 0.0
    low, high = 0.0, guess
    middle = guess * (1.0 - SHY)
    for _ in range(HALVINGS):
        if accepts(middle):
            low = middle
        else:
            high = middle
        if high - low <= 2.0 * SHY * guess:
            break
        middle = 0.5 * (low + high)
    return low
