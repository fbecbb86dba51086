"""The interpolation against exact arithmetic: the exact curve lies inside the stated error."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.interpolate import BPoly, CubicHermiteSpline

from trajectory_guard.paths.hermite import degrees, hermite, Knots

# Velocities and accelerations present at the knot.
P, V, A = (False, False), (True, False), (True, True)


def knots(times_ns, q, v=None, a=None, has=None, start_error=None):
    q = np.array(q, dtype=float)
    zero = np.zeros_like(q)
    has = has or [(v is not None, a is not None)] * len(q)
    return Knots(
        times_ns=np.array(times_ns, dtype=np.int64),
        positions=q,
        velocities=zero if v is None else np.array(v, dtype=float),
        has_velocities=np.array([velocity for velocity, _ in has]),
        accelerations=zero if a is None else np.array(a, dtype=float),
        has_accelerations=np.array([acceleration for _, acceleration in has]),
        start_error=np.zeros(q.shape[1]) if start_error is None else np.array(start_error),
    )


def exact_curve(ns, q0, q1, v0, v1, a0, a1, degree):
    """
    Solve the end conditions in rationals, by elimination from the low orders up.

    p = q0 + v0 t + a0/2 t^2 + (what is missing at t = h) as a polynomial in t/h; returned in s.
    """
    h = Fraction(int(ns), 10**9)
    q0, q1, v0, v1, a0, a1 = (Fraction(float(x)) for x in (q0, q1, v0, v1, a0, a1))
    if degree == 1:
        return [q0, q1 - q0, 0, 0, 0, 0]
    if degree == 3:
        value = q1 - (q0 + v0 * h)
        slope = (v1 - v0) * h
        # c2 + c3 = value, 2 c2 + 3 c3 = slope.
        return [q0, v0 * h, 3 * value - slope, slope - 2 * value, 0, 0]
    value = q1 - (q0 + v0 * h + a0 * h * h / 2)
    slope = (v1 - v0 - a0 * h) * h
    bend = (a1 - a0) * h * h
    # c3 + c4 + c5 = value, 3 c3 + 4 c4 + 5 c5 = slope, 6 c3 + 12 c4 + 20 c5 = bend.
    c5 = 6 * value - 3 * slope + bend / 2
    c4 = slope - 3 * value - 2 * c5
    return [q0, v0 * h, a0 * h * h / 2, value - c4 - c5, c4, c5]


def test_the_judge_meets_the_end_conditions():
    h = Fraction(1, 4)
    data = (1.0, -2.0, 0.5, 3.0, -1.0, 0.25)
    for degree, orders in ((1, 1), (3, 2), (5, 3)):
        c = exact_curve(h * 10**9, *data, degree)
        for order in range(orders):
            for end in (0, 1):
                total = Fraction(0)
                for k in range(order, 6):
                    factor = 1
                    for i in range(order):
                        factor *= k - i
                    total += c[k] * factor * (1 if end or k == order else 0)
                assert total == Fraction(data[2 * order + end]) * h**order


def draw(rng, kind, size):
    """Draw numbers of one character: everyday, spread over many decades, or small integers."""
    if kind == 'everyday':
        return rng.uniform(-3.0, 3.0, size)
    if kind == 'decades':
        return rng.choice([-1.0, 1.0], size) * 10.0 ** rng.uniform(-40, 40, size)
    if kind == 'tiny':
        return rng.choice([-1.0, 0.0, 1.0], size) * 10.0 ** rng.uniform(-323, -300, size)
    return rng.integers(-2, 3, size).astype(float)


@pytest.mark.parametrize('kind', ['everyday', 'decades', 'tiny', 'integers'])
@pytest.mark.parametrize('ns', [1, 7, 10**6, 123_456_789, 10**9, 10**18 + 1, 2**62 + 12345])
@pytest.mark.parametrize('has', [P, V, A])
def test_exact_curve_is_inside_the_error(kind, ns, has):
    rng = np.random.default_rng([ns % 2**32, len(kind), sum(has)])
    q, v, a = (draw(rng, kind, (2, 20)) for _ in range(3))
    q[1, :3] = np.nextafter(q[0, :3], 9.0)
    data = knots([0, ns], q, v, a, [has, has])
    coefficients, error = hermite(data)
    degree = degrees(data)[0]
    for j in range(20):
        exact = exact_curve(ns, *q[:, j], *v[:, j], *a[:, j], degree)
        off = sum(abs(Fraction(c) - e) for c, e in zip(coefficients[0, j], exact, strict=True))
        assert off <= Fraction(error[0, j])


@pytest.mark.parametrize('has', [P, V, A])
def test_an_error_of_the_start_is_inside_the_error(has):
    rng = np.random.default_rng(5)
    q, v, a = rng.uniform(-3, 3, (3, 3, 6))
    size = 1e-9
    data = knots([0, 10**9, 2 * 10**9], q, v, a, [has] * 3, [size] * 6)
    coefficients, error = hermite(data)
    degree = degrees(data)[0]
    for j in range(6):
        moved = q[0, j] + rng.choice([-size, size])
        exact = exact_curve(10**9, moved, q[1, j], *v[:2, j], *a[:2, j], degree)
        off = sum(abs(Fraction(c) - e) for c, e in zip(coefficients[0, j], exact, strict=True))
        assert Fraction(size) / 2 < off <= Fraction(error[0, j])
    assert (error[1] < 1e-12).all()


def test_the_error_of_an_everyday_motion_is_rounding():
    rng = np.random.default_rng(7)
    _, error = hermite(knots([0, 10**8], *rng.uniform(-3, 3, (3, 2, 50))))
    assert (error < 1e-12).all()


def test_what_does_not_move_is_exact():
    coefficients, error = hermite(knots([0, 10, 20], [[0.1, 5.0]] * 3, np.zeros((3, 2))))
    assert (coefficients[..., 0] == [0.1, 5.0]).all()
    assert not coefficients[..., 1:].any()
    assert not error.any()


@pytest.mark.parametrize(
    ('ends', 'degree'),
    [
        ((P, P), 1),
        ((P, V), 1),
        ((V, P), 1),
        ((P, A), 1),
        ((A, P), 1),
        ((V, V), 3),
        ((V, A), 3),
        ((A, V), 3),
        ((A, A), 5),
    ],
)
def test_a_derivative_counts_if_both_ends_carry_it(ends, degree):
    data = knots([0, 10**9], [[0.0], [1.0]], [[0.5], [0.25]], [[2.0], [-3.0]], list(ends))
    assert degrees(data).tolist() == [degree]
    coefficients, _ = hermite(data)
    exact = exact_curve(10**9, 0.0, 1.0, 0.5, 0.25, 2.0, -3.0, degree)
    assert coefficients[0, 0].tolist() == [float(c) for c in exact]


def test_the_degree_may_change_at_every_knot():
    has = [P, V, V, A, A, V, P]
    q, v, a = np.random.default_rng(3).uniform(-1, 1, (3, 7, 2))
    data = knots(np.arange(7) * 10**8, q, v, a, has)
    assert degrees(data).tolist() == [1, 3, 3, 5, 3, 1]
    coefficients, error = hermite(data)
    for i, degree in enumerate(degrees(data)):
        for j in range(2):
            exact = exact_curve(
                10**8, *q[i : i + 2, j], *v[i : i + 2, j], *a[i : i + 2, j], degree
            )
            off = sum(abs(Fraction(c) - e) for c, e in zip(coefficients[i, j], exact, strict=True))
            assert off <= Fraction(error[i, j])


def test_agrees_with_scipy():
    rng = np.random.default_rng(11)
    times_ns = np.cumsum(rng.integers(10**7, 10**9, 9))
    q, v, a = rng.uniform(-3, 3, (3, 9, 4))
    t = times_ns / 1e9
    judges = {
        1: BPoly.from_derivatives(t, q[:, None]),
        3: CubicHermiteSpline(t, q, v),
        5: BPoly.from_derivatives(t, np.stack([q, v, a], axis=1)),
    }
    for has, degree in ((P, 1), (V, 3), (A, 5)):
        coefficients, _ = hermite(knots(times_ns, q, v, a, [has] * 9))
        for i in range(8):
            for s in np.linspace(0, 1, 11):
                value = coefficients[i] @ s ** np.arange(6)
                judged = judges[degree](t[i] + s * (t[i + 1] - t[i]))
                np.testing.assert_allclose(value, judged, rtol=0, atol=1e-12)


def test_overflow_shows():
    with np.errstate(all='ignore'):
        coefficients, error = hermite(knots([0, 10**9], [[-1e308, 0.0], [1e308, 1.0]]))
    assert not (np.isfinite(coefficients[0, 0]).all() and np.isfinite(error[0, 0]))
    assert np.isfinite(coefficients[0, 1]).all()
