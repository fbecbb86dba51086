"""Rounded contact times: what is certain is so, what is possible leaves nothing out, exactly."""

import ctypes
from fractions import Fraction
import itertools
import math
from pathlib import Path

from canny_judge import random_body, random_curve, random_motion
from flint import fmpq
import numpy as np
import pytest

from trajectory_guard.canny import (
    Configuration,
    ConvexPolyhedron,
    fast_overlap,
    Motion,
    recentred,
    still,
    straight,
)
from trajectory_guard.canny.constraint import constraint_a, constraint_b, constraint_c, features
from trajectory_guard.canny.fast import _structure
from trajectory_guard.canny.integers import exponent
from trajectory_guard.canny.overlap import exact_overlaps
from trajectory_guard.canny.polynomial import to_bernstein
from trajectory_guard.canny.relative import degree, relative_basis, TERMS
from trajectory_guard.kernels.canny import CLOSED_FORM, course_structure, HALVING
from trajectory_guard.kernels.compiled import load
from trajectory_guard.kernels.layout import address

NEGATIVE, POSITIVE, UNKNOWN = 1, 2, 4
METHODS = [CLOSED_FORM, HALVING]
BOX = ConvexPolyhedron.box([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0])
SMALL = ConvexPolyhedron.box([-0.25, -0.25, -0.25], [0.25, 0.25, 0.25])


def call(name, *arguments, returns=ctypes.c_int64):
    """Call an exported function of ``canny_calls.cpp``."""
    function = load(Path(__file__).with_name('canny_calls.cpp'))[name]
    function.restype = returns
    passed = []
    for x in arguments:
        if isinstance(x, np.ndarray):
            passed.append(ctypes.c_void_p(address(x)))
        elif isinstance(x, ctypes.Structure):
            passed.append(ctypes.byref(x))
        else:
            passed.append(ctypes.c_double(x) if isinstance(x, float) else ctypes.c_int64(x))
    return function(*passed)


def within(found, exact, error, given=0.0):
    """Check an enclosure, and that the bound is not many times what was given, plus rounding."""
    off = [abs(Fraction(x) - y) for x, y in zip(found.tolist(), exact, strict=True)]
    assert 0 < max(off) <= Fraction(error)
    assert error <= (20.0 * given + 1e-13) * max(1.0, np.abs(found).max())


def off_by(row, error):
    """Return coefficients that are off by an error, all the same way."""
    return [Fraction(x) + Fraction(error) for x in np.asarray(row).tolist()]


# Without its rounding term, or without what the operands err, a bound would be too small.
ERRORS = [0.0, 1e-3]


@pytest.mark.parametrize('error', ERRORS)
@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize(('m', 'n'), [(1, 1), (2, 3), (8, 9), (20, 20)])
def test_products_and_sums(m, n, seed, error):
    rng = np.random.default_rng(seed)
    f, g, out = rng.normal(size=m + 1), rng.normal(size=n + 1), np.empty(m + n + 1)
    bound = call('canny_product', f, m, g, n, error, out, returns=ctypes.c_double)
    shares = [math.comb(m + n, k) for k in range(m + n + 1)]
    for signs in itertools.product((1, -1), repeat=2):
        rows = [off_by(row, sign * error) for row, sign in zip((f, g), signs, strict=True)]
        exact = [Fraction(0)] * (m + n + 1)
        for (i, x), (j, y) in itertools.product(*map(enumerate, rows)):
            exact[i + j] += math.comb(m, i) * math.comb(n, j) * x * y / shares[i + j]
        within(out, exact, bound, error)
    h, out = rng.normal(size=m + 1) * 3.0, np.empty(m + 1)
    bound = call('canny_sum', f, h, m, error, out, returns=ctypes.c_double)
    rows = off_by(f, error), off_by(h, -error)
    within(out, [x - y for x, y in zip(*rows, strict=True)], bound, error)


def test_what_either_factor_errs_counts():
    """Constants, where the bound is nearly reached: (1 + e)(8 + e), (8 + e)(1 + e)."""
    for x, y in ((1.0, 8.0), (8.0, 1.0)):
        out = np.empty(1)
        bound = call(
            'canny_product', np.array([x]), 0, np.array([y]), 0, 0.5, out, returns=ctypes.c_double
        )
        assert 8.5 * 1.5 - 8.0 <= bound < 4.76


@pytest.mark.parametrize('error', ERRORS)
@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('n', [3, 5, 17, 40])
def test_values_and_parts(n, seed, error):
    rng = np.random.default_rng(seed)
    f, out = rng.normal(size=n + 1), np.empty(1)
    for s in rng.uniform(0.0, 1.0, 8).tolist():
        bound = call('canny_value', f, n, s, error, out, returns=ctypes.c_double)
        within(out, [value(off_by(f, error), Fraction(s))], bound, error)
    for t in (0.5, 7.0 / 16.0):
        out = np.empty(2 * n + 2)
        bound = call('canny_split', f, n, t, error, out, returns=ctypes.c_double)
        row, left, right = off_by(f, error), [], []
        while row:
            left.append(row[0])
            right.insert(0, row[-1])
            row = [a + (b - a) * Fraction(t) for a, b in itertools.pairwise(row)]
        within(out, left + right, bound, error)


@pytest.mark.parametrize('error', ERRORS)
@pytest.mark.parametrize('seed', range(3))
def test_combinations_of_rounded_constants(seed, error):
    rng = np.random.default_rng(seed)
    constants = [Fraction(int(x), 3**20) for x in rng.integers(-(3**20), 3**20, 7)]
    f, out = rng.normal(size=(7, 4)), np.empty(4)
    rounded = np.array([float(x) for x in constants])
    bound = call('canny_combination', rounded, 7, f, 3, error, out, returns=ctypes.c_double)
    # All off in the direction that adds up.
    rows = [off_by(row, math.copysign(error, x)) for row, x in zip(f, constants, strict=True)]
    exact = [sum(x * row[k] for x, row in zip(constants, rows, strict=True)) for k in range(4)]
    within(out, exact, bound, error)


def stretches(coefficients, error, method):
    """Return what the kernel says of a polynomial."""
    c = np.array(coefficients, float)
    out = np.empty((400, 3))
    count = call('canny_stretches', c, len(c) - 1, float(error), method, len(out), out)
    assert count <= len(out)
    return [(a, b, int(state)) for a, b, state in out[:count].tolist()]


def value(coefficients, s):
    """Evaluate a Bernstein polynomial exactly."""
    row = [Fraction(c) for c in coefficients]
    while len(row) > 1:
        row = [(1 - s) * a + s * b for a, b in itertools.pairwise(row)]
    return row[0]


def check_stretches(coefficients, error, method):
    """Stretches cover [0, 1]; certain ones are so at both ends and between, whatever the error."""
    found = stretches(coefficients, error, method)
    assert found[0][0] == 0.0
    assert found[-1][1] == 1.0
    assert all(a[1] == b[0] for a, b in itertools.pairwise(found))
    error = Fraction(error)
    for a, b, state in found:
        a, b = Fraction(a), Fraction(b)
        for i in range(5):
            y = value(coefficients, a + (b - a) * i / 4)
            assert state != POSITIVE or y > error
            assert state != NEGATIVE or y < -error
    return found


@pytest.mark.parametrize('method', METHODS)
@pytest.mark.parametrize('n', [0, 1, 2, 3, 5, 9])
def test_stretches_of_random_polynomials(n, method):
    rng = np.random.default_rng(n)
    for error in (0.0, 1e-16, 1e-9, 0.1):
        for _ in range(8):
            found = check_stretches(rng.normal(size=n + 1).tolist(), error, method)
            unknown = sum(b - a for a, b, state in found if state == UNKNOWN)
            assert unknown < 1e-3 or error > 1e-10


HARD = {
    'double root in the middle': [1, -1, 1],
    'double root': [1, -7, 49],
    'double root of a cubic': [0.25, -0.25, 0.25, -1.25],
    'triple root': [-1, 1, -1, 1],
    'three roots, one in the middle': [-1, 3.5, -3.5, 1],
    'nearly double, real': [1, -1 - 2**-40, 1],
    'nearly double, complex': [1, -1 + 2**-40, 1],
    'roots at the ends': [0, 1, 1, 0],
    'double roots at the ends': [0, 0, 1, 0],
    'zero': [0, 0, 0, 0],
    'leading coefficient vanishes': [-1, 0, 1, 2],
    'leading coefficient almost vanishes': [-1, 0, 1, 2 + 2**-50],
    'quadratic as a cubic': [1, -1, -1, 1],
    'tiny': [-1e-300, 1e-300, 2e-300, 3e-300],
    'subnormal': [-5e-324, 5e-324, 5e-324, 5e-324],
    'huge': [-1e300, 1e300, 2e300, 1e300],
    'root next to 0': [-1e-18, 1, 1, 1],
    'root next to 1': [1, 1, 1, -1e-18],
    'flat': [1e-17, -1e-17, 1e-17, 1],
    'quintic with five roots': [-1, 8, -20, 20, -8, 1],
    'wild': [1, -9, 9, -9, 9, -9, 9, -1],
}


@pytest.mark.parametrize('method', METHODS)
@pytest.mark.parametrize('name', HARD)
def test_stretches_of_hard_polynomials(name, method):
    for error in (0.0, 2.0**-60):
        for sign in (1, -1):
            check_stretches([sign * float(c) for c in HARD[name]], error, method)


@pytest.mark.parametrize('method', METHODS)
def test_a_double_root_is_never_free_of_doubt(method):
    """Around the root the state is unknown, however the rounding falls."""
    for k in range(1, 40):
        r = k / 41.0
        c = [r * r, r * r - r, (1.0 - r) ** 2]
        assert any(s[2] == UNKNOWN for s in stretches(c, 1e-15, method))


@pytest.mark.parametrize('method', METHODS)
@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf])
def test_nonsense_is_unknown(method, bad):
    for k in range(4):
        c = [1.0, 2.0, 3.0, 4.0]
        assert stretches(c, bad if bad > 0 else math.nan, method) == [(0.0, 1.0, UNKNOWN)]
        c[k] = bad
        assert stretches(c, 0.0, method) == [(0.0, 1.0, UNKNOWN)]


def motions(seed):
    """Return motions of A and B of various degrees."""
    rng = np.random.default_rng(seed)
    return [
        (random_motion(rng), still()),
        (random_motion(rng), random_motion(rng)),
        (random_curve(rng, 3, 3), random_curve(rng, 1, 2)),
        (random_curve(rng, 8, 8), random_curve(rng, 8, 8)),
        (
            Motion(rng.normal(size=(2, 3)) * 1e6, rng.normal(size=(1, 4)) * 1e-3),
            random_motion(rng),
        ),
    ]


def course(motion):
    """Return a motion as the kernel takes it."""
    return course_structure(motion.positions, motion.quaternions)


@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('which', range(5))
def test_exact_basis_and_constraints_lie_within_the_errors(which, seed):
    a, b = motions(seed)[which]
    rng = np.random.default_rng(seed)
    body_a, body_b = random_body(rng, 'box'), random_body(rng, 'hull')
    n, k = degree(a, b), exponent(body_a.vertices, body_b.vertices, a.positions, b.positions)
    k_a, k_b = exponent(a.quaternions), exponent(b.quaternions)
    exact = [to_bernstein(f, n) for f in relative_basis(a, b, k)]
    binomials = [math.comb(n, i) for i in range(n + 1)]
    # The exact basis is multiplied by 2^(2 k_a + 2 k_b), lengths by 2^k.
    unit = fmpq(1, 1 << (2 * k_a + 2 * k_b))
    lengths = [0] * 9 + [1] * 6 + [0] + [1] * 9

    def right(row, power):
        scale = unit / (1 << (k * power))
        return [c * scale / m for c, m in zip(row, binomials, strict=True)]

    def check_row(found, row, power, error):
        for x, y in zip(found.tolist(), right(row, power), strict=True):
            assert abs(fmpq(*x.as_integer_ratio()) - y) <= fmpq(*error.as_integer_ratio())

    c, errors = np.empty((TERMS, n + 1)), np.empty(TERMS)
    assert call('canny_basis', course(a), course(b), c, errors) == n
    for found, row, power, error in zip(c, exact, lengths, errors.tolist(), strict=True):
        check_row(found, row, power, error)
        assert error <= 1e-12 * max(1.0, np.abs(found).max())
    of_a, of_b = features(body_a, k), features(body_b, k)
    structures = _structure(body_a), course(a), _structure(body_b), course(b)
    for kind, i, j in itertools.product(range(3), (0, 3), (1, 2)):
        coefficients = (
            constraint_b(of_a.points[i], of_b.planes[j]),
            constraint_a(of_a.planes[j], of_b.points[i]),
            constraint_c(of_a.lines[i], of_b.lines[j]),
        )[kind]
        row = [
            sum(x * f[m] for x, f in zip(coefficients, exact, strict=True)) for m in range(n + 1)
        ]
        found = np.empty(n + 1)
        error = call('canny_constraint', *structures, kind, i, j, found, returns=ctypes.c_double)
        check_row(found, row, 3, error)


def check(a, motion_a, b, motion_b):
    """Possible spans have all exact ones, certain spans nothing else."""
    exact = exact_overlaps([a], motion_a, [b], motion_b, [(0, 0)])
    found = fast_overlap(a, motion_a, b, motion_b)
    for one in exact:
        assert any(p <= one.start.lower and one.end.upper <= q for p, q in found.possible)
    for p, q in found.certain:
        assert any(one.start.upper <= p and q <= one.end.lower for one in exact)
    for spans in found:
        assert all(p <= q for p, q in spans)
        assert all(x[1] < y[0] for x, y in itertools.pairwise(spans))
    return exact, found


@pytest.mark.parametrize('seed', range(8))
def test_overlaps_enclose_the_exact_ones(seed):
    rng = np.random.default_rng(seed)
    a, b = (random_body(rng, kind) for kind in (('box', 'box'), ('tetrahedron', 'hull'))[seed % 2])
    other = still() if seed % 3 else random_motion(rng, 1.0)
    exact, found = check(a, random_motion(rng, 1.0), b, other)
    # Nothing is left open but 1e-12 around an end.
    assert len(exact) == len(found.possible)
    for one, (p, q) in zip(exact, found.possible, strict=True):
        assert float(one.start) - p < 1e-12
        assert q - float(one.end) < 1e-12
    certain = sum(q - p for p, q in found.certain)
    assert certain == pytest.approx(sum(q - p for p, q in found.possible), abs=1e-10)


def line(start, end):
    """Return a translation."""
    return straight(Configuration(start), Configuration(end))


@pytest.mark.parametrize(
    ('start', 'end'),
    [
        ((2, 0, 0), (2, 5, 0)),
        ((2, 2, 0), (2, 2, 5)),
        ((2, 2, 2), (4, 4, 4)),
        ((-4, 2, 0), (4, 2, 0)),
        ((-4, 2, 2), (4, 2, 2)),
        ((0, 0, 0), (0, 0, 0)),
        ((2, 0, 0), (2, 0, 0)),
    ],
)
def test_touching_is_possible(start, end):
    exact, _ = check(BOX, line(start, end), BOX, still())
    assert exact


@pytest.mark.parametrize('start', [(3, 0, 0), (2.001, 2, 0), (2 + 1e-9, 0, 0)])
def test_common_planes_far_apart_are_free(start):
    """Features that share planes all the way, but a face is between."""
    assert fast_overlap(BOX, line(start, (9, 2, 0)), BOX, still()).possible == ()


def test_wholly_inside_is_certain():
    found = fast_overlap(SMALL, line((-0.5, 0, 0), (0.5, 0, 0)), BOX, still())
    assert found.possible == found.certain == ((0.0, 1.0),)
    found = fast_overlap(BOX, still(), SMALL, line((-0.5, 0, 0), (0.5, 0, 0)))
    assert found.possible == found.certain == ((0.0, 1.0),)


@pytest.mark.parametrize('shift', [0.0, 1e-17, -1e-17, 1e-15, -1e-15, 1e-9, -1e-9])
def test_graze(shift):
    """A corner turns by a face within rounding of touching it."""
    spear = ConvexPolyhedron.hull([[0, 0, 1.0], [0.1, 0, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0]])
    ends = (Configuration((0, 0, -2 + shift), (1, q, 0, 0)) for q in (-1, 1))
    exact, found = check(spear, straight(*ends), BOX, still())
    assert bool(exact) == (-2 + shift >= -2)
    assert bool(found.possible) or shift < -1e-14


@pytest.mark.parametrize('factor', [1e-6, 1e-100, 1e6, 1e8])
def test_sizes(factor):
    rng = np.random.default_rng(4)
    motion = recentred(
        Configuration((3, 0.1, 0.2), (1, 0, 0, 0)), Configuration((-3, 0, 0), rng.normal(size=4))
    )
    moved = Motion(motion.positions * factor, motion.quaternions)
    a, b = (ConvexPolyhedron(body.vertices * factor, body.faces) for body in (SMALL, BOX))
    exact, found = check(a, moved, b, still())
    assert exact
    if factor > 1e-50:
        assert found.certain
