"""The exact spans of a path on which two bodies overlap, and what touches at their ends."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import functools
import itertools

from flint import fmpz_mat, fmpz_poly

from trajectory_guard.canny.conditions import Constraints, overlap
from trajectory_guard.canny.constraint import constraint_a, constraint_b, constraint_c, features
from trajectory_guard.canny.contact import Contact, contact_point, touching
from trajectory_guard.canny.fast import fast_overlap
from trajectory_guard.canny.integers import exponent
from trajectory_guard.canny.moment import Moment, moment
from trajectory_guard.canny.motion import Motion, still
from trajectory_guard.canny.polyhedron import ConvexPolyhedron
from trajectory_guard.canny.polynomial import to_bernstein
from trajectory_guard.canny.relative import degree, relative_basis
from trajectory_guard.canny.root import Root
from trajectory_guard.canny.signs import place, Signs, Trace, trace
from trajectory_guard.canny.transitions import any_of, runs


@dataclass(frozen=True, slots=True)
class Overlap:
    """
    A closed span of s in which bodies have a point in common at every instant.

    Just before and just after it they have none, unless the path ends there. Both ends belong to
    it, because bodies are closed; a touch without an overlap is a span of one instant.

    :param start: first instant.
    :param end: last instant.
    :param opening: features that touch at the start; none if the path starts in overlap.
    :param closing: features that touch at the end; none if the path ends in overlap.
    """

    start: Moment
    end: Moment
    opening: tuple[Contact, ...]
    closing: tuple[Contact, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Mover:
    """
    A body, the union of convex parts, on a path.

    :param parts: convex parts in the frame of the body.
    :param motion: its path.
    """

    parts: tuple[ConvexPolyhedron, ...]
    motion: Motion


def overlaps(
    a: Sequence[ConvexPolyhedron],
    motion_a: Motion,
    b: Sequence[ConvexPolyhedron],
    motion_b: Motion | None = None,
) -> tuple[Overlap, ...]:
    """
    Return when two unions of convex polyhedra overlap, exactly.

    Pairs of parts that are certainly apart on the whole path, by rounded arithmetic with bounds
    (``fast.py``), are left out first.

    :param a: convex parts of A.
    :param motion_a: path of A.
    :param b: convex parts of B.
    :param motion_b: path of B; None: B stands at the origin.
    :returns: maximal spans, in order, disjoint.
    """
    motions = motion_a, motion_b or still()
    near = [
        (i, j)
        for i, j in itertools.product(range(len(a)), range(len(b)))
        if fast_overlap(a[i], motions[0], b[j], motions[1]).possible
    ]
    return exact_overlaps(a, motions[0], b, motions[1], near)


def exact_overlaps(
    a: Sequence[ConvexPolyhedron],
    motion_a: Motion,
    b: Sequence[ConvexPolyhedron],
    motion_b: Motion,
    pairs: Sequence[tuple[int, int]],
) -> tuple[Overlap, ...]:
    """
    Return when some of the pairs of two unions overlap, by exact arithmetic alone.

    :param pairs: indices of parts of A and of B.
    """
    motions = motion_a, motion_b
    roots, tables = constraints(a, b, motions, pairs)
    cells = 2 * len(roots) + 3
    found = []
    for first, last in runs(any_of(overlap(table) for table in tables)):
        ends = [(first, first > 0), (last - 1, last < cells)]
        moments = [moment(roots, cell) for cell, _ in ends]
        contacts = [
            tuple(_contacts(pairs, tables, motions, cell, float(when))) if inner else ()
            for (cell, inner), when in zip(ends, moments, strict=True)
        ]
        found.append(Overlap(moments[0], moments[1], contacts[0], contacts[1]))
    return tuple(found)


def pairwise(movers: Sequence[Mover]) -> dict[tuple[int, int], tuple[Overlap, ...]]:
    """Return the overlaps of every two of several movers, by indices [Canny 1984, sec. 6]."""
    return {
        (i, j): overlaps(movers[i].parts, movers[i].motion, movers[j].parts, movers[j].motion)
        for i, j in itertools.combinations(range(len(movers)), 2)
    }


def constraints(
    a: Sequence[ConvexPolyhedron],
    b: Sequence[ConvexPolyhedron],
    motions: tuple[Motion, Motion],
    pairs: Sequence[tuple[int, int]],
) -> tuple[list[Root], list[Constraints]]:
    """
    Return the different roots of all constraints, and the constraints' signs for each pair.

    :param a: convex parts of A.
    :param b: convex parts of B.
    :param motions: of A and of B.
    :param pairs: indices of parts of A and of B.
    """
    k = exponent(*(body.vertices for body in (*a, *b)), *(motion.positions for motion in motions))
    n = degree(*motions)
    basis = relative_basis(*motions, k)
    traces = [t for i, j in pairs for t in _traces(a[i], b[j], k, basis, n)]
    roots, signs = place(traces)
    rest = iter(signs)
    return roots, [_table(a[i], b[j], rest) for i, j in pairs]


def _traces(
    a: ConvexPolyhedron, b: ConvexPolyhedron, k: int, basis: Sequence[fmpz_poly], n: int
) -> Iterator[Trace]:
    """Yield the constraints A, B, C of a pair by rows."""
    of_a, of_b = features(a, k), features(b, k)
    rows = [
        *(constraint_a(f, v) for f in of_a.planes for v in of_b.points),
        *(constraint_b(v, f) for v in of_a.points for f in of_b.planes),
        *(constraint_c(e, g) for e in of_a.lines for g in of_b.lines),
    ]
    matrix = fmpz_mat(rows)
    bernstein = matrix * fmpz_mat([to_bernstein(f, n) for f in basis])
    power = matrix * fmpz_mat([[f[i] for i in range(n + 1)] for f in basis])
    for values, coefficients in zip(bernstein.tolist(), power.tolist(), strict=True):
        yield trace([int(x) for x in values], functools.partial(fmpz_poly, coefficients))


def _table(a: ConvexPolyhedron, b: ConvexPolyhedron, rest: Iterator[Signs]) -> Constraints:
    """Return the next signs as the constraints of a pair."""
    shapes = (
        (len(a.faces), len(b.vertices)),
        (len(a.vertices), len(b.faces)),
        (len(a.edges), len(b.edges)),
    )
    rows = ([[next(rest) for _ in range(n)] for _ in range(m)] for m, n in shapes)
    return Constraints(a, b, *rows)


def _contacts(
    pairs: Sequence[tuple[int, int]],
    tables: Sequence[Constraints],
    motions: tuple[Motion, Motion],
    cell: int,
    s: float,
) -> Iterator[Contact]:
    for (part_a, part_b), table in zip(pairs, tables, strict=True):
        for kind, i, j in touching(table, cell):
            point = contact_point(table, kind, i, j, motions, s)
            yield Contact(kind, part_a, part_b, i, j, point)
