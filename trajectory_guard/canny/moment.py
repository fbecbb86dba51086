"""Instants of a path, exact."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from trajectory_guard.canny.root import Root

# An instant is enclosed this closely [powers of two of the path].
ENCLOSURE = 60


@dataclass(frozen=True, slots=True)
class Moment:
    """
    An instant of a path, exact: a number s in [lower, upper].

    :param lower: least value.
    :param upper: greatest value; the same where s is a dyadic number that is known exactly, else
        at most 2^-60 more.
    """

    lower: Fraction
    upper: Fraction

    def __float__(self) -> float:
        """Return s within rounding."""
        return float((self.lower + self.upper) / 2)


def moment(roots: Sequence[Root], cell: int) -> Moment:
    """
    Return the instant of an even cell (``transitions.py``).

    :param roots: where the path is cut.
    :param cell: its number.
    """
    if cell in (0, 2 * len(roots) + 2):
        end = Fraction(int(cell > 0))
        return Moment(end, end)
    root = roots[cell // 2 - 1].refined(ENCLOSURE)
    return Moment(*(Fraction(int(x.p), int(x.q)) for x in (root.lower, root.upper)))
