"""Polynomials of a piece: exact values lie inside the bounds (Fraction and mpmath-free judges)."""

from fractions import Fraction
import math

import kernel_calls
import numpy as np
import pytest

from trajectory_guard.kernels.chain import REVOLUTE
from trajectory_guard.kernels.piece import ECONOMISERS, POWERS


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
        c = np.zeros((1, 1, 6))
        c[0, 0, : rng.integers(1, 7)] = rng.normal() * size
        c[0, 0] *= rng.normal(size=6)
        level = int(rng.integers(0, 49))
        k = int(rng.integers(0, 2**level))
        h = 0.5 ** (level + 1)
        m = (2 * k + 1) * h
        d = np.empty((1, 6))
        span, rounding = kernel_calls.restrict(c, m, h, d)
        for tau in (-1, Fraction(-1, 3), 0, Fraction(7, 11), 1):
            exact = evaluate(c[0, 0], Fraction(m) + Fraction(h) * tau)
            written = evaluate(d[0], Fraction(tau))
            assert abs(exact - written) <= Fraction(rounding)
            assert abs(written - Fraction(d[0, 0])) <= Fraction(span)


def test_economisers_are_monic_chebyshev():
    """tau^k minus its row has sup norm 2^(1-k) on [-1, 1], exactly."""
    for k in range(1, POWERS):
        for j in range(k + 1):
            tau = math.cos(math.pi * j / k)
            value = tau**k - sum(ECONOMISERS[k, i] * tau**i for i in range(k))
            assert abs(abs(value) - 2.0 ** (1 - k)) < 1e-13


@pytest.mark.parametrize('degree', [1, 3, 5])
@pytest.mark.parametrize('span', [1e-8, 1e-3, 0.3, 1.2, 1.79])
def test_half_angle_bound_contains_the_angle(degree, span):
    """|2 atan u - phi| stays below the bound at dense places, and the bound is not idle."""
    rng = np.random.default_rng(degree)
    p, u = np.empty(POWERS), np.empty((1, 4))
    tightest = 0.0
    for _ in range(40):
        d = np.zeros((1, 6))
        d[0, 1 : degree + 1] = rng.normal(size=degree) * 0.3 ** np.arange(degree)
        d[0] *= span / np.abs(d[0, 1:]).sum()
        bound = kernel_calls.fit_half_angle(d, np.abs(d[0, 1:]).sum(), p, u)
        for tau in np.linspace(-1.0, 1.0, 41):
            phi = sum(d[0, k] * tau**k for k in range(1, 6))
            off = abs(2.0 * math.atan(bernstein_value(u[0], 0.5 * (1 + tau))) - phi)
            assert off <= bound
            tightest = max(tightest, off / bound)
    if span > 0.1:
        assert tightest > 0.3


def test_a_joint_that_turns_too_far_is_frozen():
    """Beyond the range of the series the motion is constant and the whole turn is the error."""
    d = np.array([[0.0, 7.0, 0.0, 0.0, 0.0, 0.0]])
    u = np.ones((1, 4))
    assert kernel_calls.fit_half_angle(d, 7.0, np.empty(POWERS), u) == 7.0
    assert not u.any()


def test_nan_freezes_rather_than_fits():
    """A NaN span never passes for a small one."""
    d = np.full((1, 6), np.nan)
    u = np.ones((1, 4))
    assert math.isnan(kernel_calls.fit_half_angle(d, math.nan, np.empty(POWERS), u))
    assert not u.any()


def test_slide_bound_contains_the_quintic():
    """A prismatic joint's cubic differs from its quintic by no more than the bound."""
    rng = np.random.default_rng(2)
    p, u = np.empty(POWERS), np.empty((1, 4))
    for _ in range(100):
        d = rng.normal(size=(1, 6))
        bound = kernel_calls.fit_slide(d, p, u)
        for tau in np.linspace(-1.0, 1.0, 21):
            exact = sum(d[0, k] * tau**k for k in range(1, 6))
            assert abs(bernstein_value(u[0], 0.5 * (1.0 + tau)) - exact) <= bound


def test_factors_are_a_rotation_in_bernstein_form():
    """cosine^2 + sine^2 = weight^2 at every place, and the ratio bounds the columns."""
    rng = np.random.default_rng(3)
    c, s, w = np.empty(7), np.empty(7), np.empty(7)
    for _ in range(50):
        u = rng.normal(size=(1, 4)) * 0.3
        degree, kappa = kernel_calls.factors(REVOLUTE, u, c, s, w)
        assert degree == 6
        for place in np.linspace(0.0, 1.0, 11):
            cv, sv, wv = (bernstein_value(x, place) for x in (c, s, w))
            assert abs(cv * cv + sv * sv - wv * wv) < 1e-12 * wv * wv
        if math.isfinite(kappa):
            assert (np.abs(c) + np.abs(s) <= kappa * w * (1.0 + 1e-15)).all()


def test_factors_refuse_weights_that_are_not_positive():
    """A wild u has no usable hull, and says so."""
    c, s, w = np.empty(7), np.empty(7), np.empty(7)
    for u in ([[9.0, -90.0, 90.0, -9.0]], [[np.nan] * 4]):
        _, kappa = kernel_calls.factors(REVOLUTE, np.array(u), c, s, w)
        assert not kappa < math.inf
