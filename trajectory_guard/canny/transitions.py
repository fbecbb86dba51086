"""
Subsets of a path as sorted lists of true-false transitions [Canny 1984, sec. 5].

A path is cut at the roots of all polynomials into *cells*: 0 is the instant s = 0, then open gaps
(odd) and instants (even) in turn; the last is the instant s = 1. A set of cells is the tuple of
the places where membership changes, false before the first: (2, 5) holds the cells 2, 3, 4. So
open and closed ends are exact, and a merge compares integers.
"""

from collections.abc import Callable, Iterable, Sequence

Transitions = tuple[int, ...]

NOWHERE: Transitions = ()


def runs(cells: Transitions) -> list[tuple[int, int]]:
    """Return the runs [first, last) of a set."""
    return list(zip(cells[::2], cells[1::2], strict=True))


def holds(cells: Transitions, cell: int) -> bool:
    """Say whether a set has a cell."""
    return sum(change <= cell for change in cells) % 2 == 1


def both(a: Transitions, b: Transitions) -> Transitions:
    """Return the conjunction."""
    return _merge(a, b, 2) if a and b else NOWHERE


def either(a: Transitions, b: Transitions) -> Transitions:
    """Return the disjunction."""
    return _merge(a, b, 1) if a and b else a or b


def _merge(a: Transitions, b: Transitions, enough: int) -> Transitions:
    """Return where at least `enough` of two sets are true; linear in the transitions."""
    merged: list[int] = []
    i = j = inside = 0
    while i < len(a) or j < len(b):
        take_a = j == len(b) or (i < len(a) and a[i] <= b[j])
        take_b = i == len(a) or (j < len(b) and b[j] <= a[i])
        place = a[i] if take_a else b[j]
        i += take_a
        j += take_b
        before, inside = inside, (i % 2) + (j % 2)
        if (before >= enough) != (inside >= enough):
            merged.append(place)
    return tuple(merged)


def all_of(sets: Iterable[Transitions]) -> Transitions:
    """Return the conjunction of one set or more; the first empty one ends it."""
    found: Transitions | None = None
    for cells in sets:
        found = cells if found is None else both(found, cells)
        if not found:
            return NOWHERE
    return found or NOWHERE


def any_of(sets: Iterable[Transitions]) -> Transitions:
    """
    Return the disjunction, merged in the order of a binary tree.

    log2 N phases, each linear in the transitions of all N sets: O(N log N) [Canny 1984, sec. 5].
    """
    return _tree([cells for cells in sets if cells], either)


def _tree(
    sets: Sequence[Transitions], merge: Callable[[Transitions, Transitions], Transitions]
) -> Transitions:
    while len(sets) > 1:
        pairs = [merge(a, b) for a, b in zip(sets[::2], sets[1::2], strict=False)]
        sets = pairs + list(sets[len(pairs) * 2 :])
    return sets[0] if sets else NOWHERE
