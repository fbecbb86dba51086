"""The sign of a polynomial on every cell of a path (``transitions.py``)."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from flint import fmpz_poly

from trajectory_guard.canny.root import gap_signs, isolate, ranked, Root
from trajectory_guard.canny.transitions import Transitions


@dataclass(frozen=True, slots=True)
class Signs:
    """
    A row of runs of cells with one sign each.

    :param starts: first cell of each run, ascending from 0; then the number of cells.
    :param values: sign of each run: -1, 0 or 1.
    """

    starts: tuple[int, ...]
    values: tuple[int, ...]

    def at(self, cell: int) -> int:
        """Return the sign on a cell."""
        return self.values[sum(start <= cell for start in self.starts) - 1]

    def negative(self) -> Transitions:
        """Return where the sign is -1."""
        return self._where(lambda value: value < 0)

    def positive(self) -> Transitions:
        """Return where the sign is 1."""
        return self._where(lambda value: value > 0)

    def zero(self) -> Transitions:
        """Return where the sign is 0."""
        return self._where(lambda value: value == 0)

    def nonzero(self) -> Transitions:
        """Return where the sign is not 0."""
        return self._where(lambda value: value != 0)

    def not_above(self) -> Transitions:
        """Return where the sign is not 1."""
        return self._where(lambda value: value <= 0)

    def not_below(self) -> Transitions:
        """Return where the sign is not -1."""
        return self._where(lambda value: value >= 0)

    def flipped(self) -> 'Signs':
        """Return the signs of the negative polynomial."""
        return Signs(self.starts, tuple(-value for value in self.values))

    def _where(self, wanted: Callable[[int], bool]) -> Transitions:
        changes: list[int] = []
        for start, value in zip(self.starts, self.values, strict=False):
            if wanted(value) != (len(changes) % 2 == 1):
                changes.append(start)
        return tuple(changes) + (self.starts[-1:] if len(changes) % 2 else ())


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """
    A polynomial's roots in (0, 1) and its signs around them.

    :param roots: in order.
    :param gaps: signs between 0, the roots and 1.
    :param ends: signs at 0 and at 1.
    """

    roots: Sequence[Root]
    gaps: Sequence[int]
    ends: tuple[int, int]


def trace(scaled_bernstein: Sequence[int], power: Callable[[], fmpz_poly]) -> Trace:
    """
    Return the roots and signs of a polynomial.

    :param scaled_bernstein: its Bernstein coefficients times positive numbers; they decide if they
        all have one sign.
    :param power: builds the polynomial itself, which is asked for if they do not.
    """
    first, last = scaled_bernstein[0], scaled_bernstein[-1]
    ends = (first > 0) - (first < 0), (last > 0) - (last < 0)
    low, high = min(scaled_bernstein), max(scaled_bernstein)
    if low >= 0 or high <= 0:
        return Trace((), ((high > 0) - (low < 0),), ends)
    f = power()
    roots = isolate(f)
    return Trace(roots, gap_signs(f, roots), ends)


def place(traces: Iterable[Trace]) -> tuple[list[Root], list[Signs]]:
    """
    Cut a path at the roots of all polynomials.

    :returns: the different roots in order (root k is cell 2 k + 2), and the polynomials' signs.
    """
    found = list(traces)
    different, places = ranked([root for each in found for root in each.roots])
    cells = 2 * len(different) + 3
    return different, [_signs(each, places, cells) for each in found]


def _signs(each: Trace, places: dict[int, int], cells: int) -> Signs:
    starts, values = [0, 1], [each.ends[0], each.gaps[0]]
    for root, gap in zip(each.roots, each.gaps[1:], strict=True):
        cell = 2 * places[id(root)] + 2
        starts += [cell, cell + 1]
        values += [0, gap]
    return Signs((*starts, cells - 1, cells), (*values, each.ends[1]))
