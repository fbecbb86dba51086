"""Real roots: exact isolation, comparison and merging."""

from fractions import Fraction
import itertools

from flint import fmpq, fmpz_poly
import numpy as np
import pytest

from trajectory_guard.canny.polynomial import from_bernstein, to_bernstein
from trajectory_guard.canny.root import compare, gap_signs, isolate, ranked
from trajectory_guard.canny.signs import place, trace
from trajectory_guard.canny.transitions import any_of, both, either, holds


def with_roots(roots, others=((1,),)):
    """Return the polynomial with rational roots and further factors."""
    f = fmpz_poly([1])
    for root in roots:
        f *= fmpz_poly([-root.numerator, root.denominator])
    for factor in others:
        f *= fmpz_poly(list(factor))
    return f


def encloses(found, root):
    """Say whether a root's enclosure has a rational number."""
    lower, upper = (Fraction(int(x.p), int(x.q)) for x in (found.lower, found.upper))
    return lower == root == upper if found.exact else lower < root < upper


@pytest.mark.parametrize('seed', range(20))
def test_isolated_roots_are_all_the_roots(seed):
    """Random rational roots, some equal, some at dyadic places, 0 and 1 left out."""
    rng = np.random.default_rng(seed)
    pool = [Fraction(int(rng.integers(-8, 24)), int(rng.integers(1, 20))) for _ in range(5)]
    pool += [Fraction(int(rng.integers(0, 9)), 8)]
    roots = [pool[i] for i in rng.integers(0, 6, 6)]
    f = with_roots(roots, [(1, 0, 1), (1, -1, 1)])
    inside = sorted({root for root in roots if 0 < root < 1})
    found = isolate(f)
    assert len(found) == len(inside)
    for one, root in zip(found, inside, strict=True):
        assert encloses(one, root)
        fine = one.refined(70)
        assert encloses(fine, root)
        assert fine.exact or fine.upper - fine.lower == fmpq(1, 2**70)
    ends = [Fraction(0), *inside, Fraction(1)]
    middles = [(a + b) / 2 for a, b in itertools.pairwise(ends)]
    values = [f(fmpq(m.numerator, m.denominator)) for m in middles]
    assert gap_signs(f, found) == [(v > 0) - (v < 0) for v in values]


def test_roots_nearer_than_any_double_are_told_apart():
    near = [Fraction(1, 3), Fraction(1, 3) + Fraction(1, 10**40)]
    a, b = isolate(with_roots(near))
    assert compare(a, b) == -compare(b, a) == -1
    (c,) = isolate(with_roots(near[:1], [(1, 1)]))
    assert compare(a, c) == 0
    assert compare(b, c) == 1


def test_equal_irrational_roots_of_different_polynomials():
    """sqrt(1/2) as a root of 2 s^2 - 1 and of its products."""
    half = fmpz_poly([-1, 0, 2])
    f, g = half * fmpz_poly([-1, 3]), half * half * fmpz_poly([1, 0, 0, 5])
    different, places = ranked([*isolate(f), *isolate(g)])
    assert len(different) == 2
    assert sorted(places.values()) == [0, 1, 1]


def test_signs_on_cells():
    """S (s - 1/2)^2 (s - 3/4), with (s - 1/2) beside it."""
    f = with_roots([Fraction(0), Fraction(1, 2), Fraction(1, 2), Fraction(3, 4)])
    g = with_roots([Fraction(1, 2)])
    polynomials = [f, g, fmpz_poly([0]), fmpz_poly([7])]
    traces = [trace(to_bernstein(p, 4), lambda p=p: p) for p in polynomials]
    roots, signs = place(traces)
    assert len(roots) == 2
    cells = range(7)
    assert [signs[0].at(cell) for cell in cells] == [0, -1, 0, -1, 0, 1, 1]
    assert [signs[1].at(cell) for cell in cells] == [-1, -1, 0, 1, 1, 1, 1]
    assert [signs[2].at(cell) for cell in cells] == [0] * 7
    assert [signs[3].at(cell) for cell in cells] == [1] * 7
    for one in signs:
        for name, wanted in {
            'negative': [-1], 'positive': [1], 'zero': [0], 'nonzero': [-1, 1],
            'not_above': [-1, 0], 'not_below': [0, 1],
        }.items():  # fmt: skip
            found = getattr(one, name)()
            assert [holds(found, c) for c in cells] == [one.at(c) in wanted for c in cells]
            flipped = [one.flipped().at(c) for c in cells]
            assert flipped == [-one.at(c) for c in cells]


def test_bernstein_and_back():
    rng = np.random.default_rng(0)
    values = [int(x) for x in rng.integers(-50, 50, 6)]
    binomials = [1, 5, 10, 10, 5, 1]
    scaled = [v * b for v, b in zip(values, binomials, strict=True)]
    assert to_bernstein(from_bernstein(values), 5) == scaled


@pytest.mark.parametrize('seed', range(10))
def test_merges_are_set_operations(seed):
    rng = np.random.default_rng(seed)

    def cells():
        return tuple(int(x) for x in np.sort(rng.choice(20, 2 * int(rng.integers(0, 5)), False)))

    def members(transitions):
        return {c for c in range(20) if holds(transitions, c)}

    sets = [cells() for _ in range(9)]
    for a, b in itertools.product(sets, repeat=2):
        assert members(both(a, b)) == members(a) & members(b)
        assert members(either(a, b)) == members(a) | members(b)
        merged = either(a, b)
        assert list(merged) == sorted(set(merged))
    assert members(any_of(sets)) == set().union(*map(members, sets))
