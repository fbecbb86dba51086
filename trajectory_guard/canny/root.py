"""
Real roots of integer polynomials in (0, 1), exact: isolated, refined, compared.

A root is a squarefree polynomial and a dyadic interval that holds one of its roots and no other;
two such intervals are disjoint or nested, so roots are compared by refining until they part, and
by a common divisor if they do not.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import functools
import itertools

from flint import fmpq, fmpz_poly

# Intervals are refined so far before a common divisor is asked for [powers of two].
FINE = 40

_SHIFT = fmpz_poly([1, 1])


@dataclass(frozen=True, slots=True, eq=False)
class Root:
    """
    One real root in (0, 1).

    :param polynomial: squarefree; its only root in the open interval (n, n + 1) / 2^level.
    :param n: place of the interval; the root itself is n / 2^level if it is `exact`.
    :param level: its power of two.
    :param before: sign of the polynomial between the left end and the root.
    :param exact: whether the root is n / 2^level.
    """

    polynomial: fmpz_poly
    n: int
    level: int
    before: int
    exact: bool = False

    @property
    def lower(self) -> fmpq:
        """The left end of the enclosure."""
        return fmpq(self.n, 1 << self.level)

    @property
    def upper(self) -> fmpq:
        """The right end of the enclosure."""
        return self.lower if self.exact else fmpq(self.n + 1, 1 << self.level)

    def refined(self, level: int) -> 'Root':
        """Return the root with an enclosure of length 2^-level or less."""
        n, at = self.n, self.level
        while at < level and not self.exact:
            n, at = 2 * n, at + 1
            middle = sign(self.polynomial(fmpq(n + 1, 1 << at)))
            if middle == 0:
                return Root(self.polynomial, n + 1, at, self.before, exact=True)
            n += middle == self.before
        return Root(self.polynomial, n, at, self.before, self.exact)


def sign(x: fmpq) -> int:
    """Return -1, 0 or 1."""
    return (x > 0) - (x < 0)


def variations(f: fmpz_poly) -> int:
    """
    Bound the number of roots in (0, 1), counted as often as they are; 0 and 1 are exact.

    The positive roots of (1 + x)^n f(1 / (1 + x)) are the roots of f in (0, 1), and by Descartes
    as many as its coefficients change sign, or less by an even number. (The coefficients are those
    of f in the Bernstein basis, times binomials, in reverse order.)
    """
    reverse = fmpz_poly(f.coeffs()[::-1])
    signs = [c > 0 for c in reverse(_SHIFT).coeffs() if c != 0]
    return sum(a != b for a, b in itertools.pairwise(signs))


def squarefree(f: fmpz_poly) -> fmpz_poly:
    """Return the polynomial with the same roots, each once."""
    common = f.gcd(f.derivative())
    return f if common.degree() < 1 else f // common


def isolate(f: fmpz_poly) -> list[Root]:
    """
    Return the roots of a polynomial in (0, 1), in order.

    Modified Uspensky (Collins and Akritas 1976), which [Canny 1984, sec. 6] names: halve until a
    half has no variation or one.

    :param f: not zero.
    """
    f = squarefree(f)
    found = []
    waiting = [(f, 0, 0)]
    while waiting:
        g, n, level = waiting.pop()
        count = variations(g)
        if count == 1:
            found.append(Root(f, n, level, _first_sign(g)))
        if count < 2:
            continue
        coefficients = g.coeffs()
        top = len(coefficients) - 1
        left = fmpz_poly([int(c) << (top - i) for i, c in enumerate(coefficients)])
        right = left(_SHIFT)
        waiting += [(left, 2 * n, level + 1), (right, 2 * n + 1, level + 1)]
        if right[0] == 0:
            found.append(Root(f, 2 * n + 1, level + 1, 0, exact=True))
    return sorted(found, key=lambda root: (root.lower, root.upper))


def compare(a: Root, b: Root) -> int:
    """Return -1, 0 or 1 as a is less than, equal to or greater than b."""
    level = max(a.level, b.level, FINE)
    a, b = a.refined(level), b.refined(level)
    common = None
    while True:
        if a.exact or b.exact:
            # A dyadic number of no higher level is never inside of an interval.
            order = sign(a.lower - b.lower)
            if order == 0:
                order = a.exact - b.exact
                return -order
            return order
        if a.n != b.n:
            return 1 if a.n > b.n else -1
        if common is None:
            common = a.polynomial.gcd(b.polynomial)
        if common.degree() < 1:
            level += 8
        else:
            ends = sign(common(a.lower)), sign(common(a.upper))
            if 0 not in ends and ends[0] != ends[1]:
                return 0
            if 0 not in ends:
                common = fmpz_poly([1])
            level += 1
        a, b = a.refined(level), b.refined(level)


def ranked(roots: Sequence[Root]) -> tuple[list[Root], dict[int, int]]:
    """
    Sort roots and find the equal ones.

    :returns: the different roots in order, and for each root (by `id`) its place among them.
    """
    fine = {id(root): root.refined(FINE) for root in roots}
    different: list[Root] = []
    places: dict[int, int] = {}
    key = functools.cmp_to_key(compare)
    for root in sorted(roots, key=lambda root: key(fine[id(root)])):
        if not different or compare(different[-1], fine[id(root)]) != 0:
            different.append(fine[id(root)])
        places[id(root)] = len(different) - 1
    return different, places


def sample_between(a: Root | None, b: Root | None) -> fmpq:
    """Return a number between two different roots, None for 0 and 1."""
    while True:
        low = fmpq(0) if a is None else a.upper
        high = fmpq(1) if b is None else b.lower
        if low < high:
            return (low + high) / 2
        a = a and a.refined(a.level + 1)
        b = b and b.refined(b.level + 1)


def gap_signs(f: fmpz_poly, roots: Sequence[Root]) -> list[int]:
    """Return the signs of a polynomial between 0, its roots in (0, 1) in order, and 1."""
    ends: list[Root | None] = [None, *roots, None]
    return [sign(f(sample_between(a, b))) for a, b in itertools.pairwise(ends)]


def _first_sign(f: fmpz_poly) -> int:
    """Return the sign of a polynomial just right of 0."""
    return next(1 if c > 0 else -1 for c in f.coeffs() if c != 0)
