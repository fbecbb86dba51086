"""Polynomials of a piece: exact values lie inside the bounds."""

from fractions import Fraction
import math

import kernel_calls
import numpy as np
import pytest

from trajectory_guard.kernels.layout import REVOLUTE


def evaluate(coefficients, x):
    """Return a polynomial's exact value."""
    return sum(Fraction(float(c)) * x**k for k, c in enumerate(coefficients))


def bernstein_value(scaled, s):
    """Return the value of scaled Bernstein coefficients at s."""
    degree = len(scaled) - 1
    return sum(c * s**i * (1.0 - s) ** (degree - i) for i, c in enumerate(scaled))


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('size', [1e-9, 1.0, 1e6])
def test_restriction_contains_the_exact_polynomial(seed, size):
    """q(m + h tau) is the written polynomial within the reported rounding, in exact arithmetic."""
    rng = np.random.default_rng(seed)
    for _ in range(50):
        c = np.zeros(6)
        c[: rng.integers(1, 7)] = rng.normal() * size
        c *= rng.normal(size=6)
        level = int(rng.integers(0, 49))
        k = int(rng.integers(0, 2**level))
        h = 0.5 ** (level + 1)
        m = (2 * k + 1) * h
        d, span, rounding = kernel_calls.restrict(c, m, h)
        for tau in (-1, Fraction(-1, 3), 0, Fraction(7, 11), 1):
            exact = evaluate(c, Fraction(m) + Fraction(h) * tau)
            written = evaluate(d, Fraction(tau))
            assert abs(exact - written) <= Fraction(rounding)
            assert abs(written - Fraction(d[0])) <= Fraction(span)


@pytest.mark.parametrize('k', range(4, 16))
def test_powers_are_replaced_by_chebyshev(k):
    """The cubic is tau^k minus the dropped coefficients' 2^(1-j) T_j, exactly; all are bounded."""
    p, bound = kernel_calls.economise_to_cubic(np.eye(16)[k])
    for tau in (Fraction(n, 7) for n in range(-7, 8)):
        chebyshev = [Fraction(1), tau]
        for _ in range(14):
            chebyshev.append(2 * tau * chebyshev[-1] - chebyshev[-2])
        lost = sum(Fraction(p[j]) * chebyshev[j] / 2 ** (j - 1) for j in range(4, 16))
        assert evaluate(p[:4], tau) + lost == tau**k
        assert abs(lost) <= Fraction(bound)


@pytest.mark.parametrize('degree', [1, 3, 5])
@pytest.mark.parametrize('span', [1e-8, 1e-3, 0.3, 1.2, 1.79])
def test_half_angle_bound_contains_the_angle(degree, span):
    """|2 atan u - phi| stays below the bound at dense places, and the bound is not idle."""
    rng = np.random.default_rng(degree)
    tightest = 0.0
    for _ in range(40):
        d = np.zeros(6)
        d[1 : degree + 1] = rng.normal(size=degree) * 0.3 ** np.arange(degree)
        d *= span / np.abs(d[1:]).sum()
        u, bound = kernel_calls.fit_half_angle(d, np.abs(d[1:]).sum())
        for tau in np.linspace(-1.0, 1.0, 41):
            phi = sum(d[k] * tau**k for k in range(1, 6))
            off = abs(2.0 * math.atan(bernstein_value(u, 0.5 * (1 + tau))) - phi)
            assert off <= bound
            tightest = max(tightest, off / bound)
    if span > 0.1:
        assert tightest > 0.3


def test_a_joint_that_turns_too_far_is_frozen():
    """Beyond the range of the series the motion is constant and the whole turn is the error."""
    u, bound = kernel_calls.fit_half_angle([0.0, 7.0, 0.0, 0.0, 0.0, 0.0], 7.0)
    assert bound == 7.0
    assert not u.any()


def test_nan_freezes_rather_than_fits():
    """A NaN span never passes for a small one."""
    u, bound = kernel_calls.fit_half_angle(np.full(6, np.nan), math.nan)
    assert math.isnan(bound)
    assert not u.any()


def test_slide_bound_contains_the_quintic():
    """A prismatic joint's cubic differs from its quintic by no more than the bound."""
    rng = np.random.default_rng(2)
    for _ in range(100):
        d = rng.normal(size=6)
        u, bound = kernel_calls.fit_slide(d)
        for tau in np.linspace(-1.0, 1.0, 21):
            exact = sum(d[k] * tau**k for k in range(1, 6))
            assert abs(bernstein_value(u, 0.5 * (1.0 + tau)) - exact) <= bound


def test_factors_are_a_rotation_in_bernstein_form():
    """cosine^2 + sine^2 = weight^2 at every place, and the ratio bounds the columns."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        c, s, w, degree, kappa = kernel_calls.factors(REVOLUTE, rng.normal(size=4) * 0.3)
        assert degree == 6
        for place in np.linspace(0.0, 1.0, 11):
            cv, sv, wv = (bernstein_value(x, place) for x in (c, s, w))
            assert abs(cv * cv + sv * sv - wv * wv) < 1e-12 * wv * wv
        if math.isfinite(kappa):
            assert (np.abs(c) + np.abs(s) <= kappa * w * (1.0 + 1e-15)).all()


def test_factors_refuse_weights_that_are_not_positive():
    """A wild u has no usable hull, and says so."""
    for u in ([9.0, -90.0, 90.0, -9.0], [np.nan] * 4):
        *_, kappa = kernel_calls.factors(REVOLUTE, u)
        assert not kappa < math.inf
