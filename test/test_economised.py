"""Polynomial cosines and folded products: the exact value lies inside the bound."""

from fractions import Fraction
import math

from flint import arb, ctx
import kernel_calls
from kernel_calls import CONTROLS
import numpy as np
import pytest

from trajectory_guard.kernels.layout import TERMS


def value(coefficients, tau):
    """Return a polynomial's exact value."""
    return sum(Fraction(float(c)) * tau**k for k, c in enumerate(coefficients))


def ball(x):
    """Return a rational as an arb ball."""
    return arb(x.numerator) / arb(x.denominator)


@pytest.mark.parametrize('seed', range(3))
def test_folding_loses_no_more_than_it_says(seed):
    """A product of degree 10 and its six coefficients differ by the dropped ones' weights."""
    rng = np.random.default_rng(seed)
    for _ in range(50):
        p = rng.normal(size=11) * 10.0 ** rng.integers(-3, 4, size=11)
        kept, gone = kernel_calls.economise(p)
        bound = sum(abs(Fraction(g)) / 2 ** (5 + k) for k, g in enumerate(gone))
        rounding = Fraction(64, 2**53) * sum(abs(Fraction(c)) for c in p) * 7
        for tau in (Fraction(k, 8) for k in range(-8, 9)):
            assert abs(value(p, tau) - value(kept, tau)) <= bound + rounding


@pytest.mark.parametrize('k', range(TERMS, 11))
def test_a_dropped_power_is_replaced_by_chebyshev(k):
    """What is kept is tau^k minus the dropped coefficients' 2^(1-j) T_j, exactly."""
    kept, gone = kernel_calls.economise(np.eye(11)[k])
    for tau in (Fraction(n, 7) for n in range(-7, 8)):
        chebyshev = [Fraction(1), tau]
        for _ in range(9):
            chebyshev.append(2 * tau * chebyshev[-1] - chebyshev[-2])
        lost = sum(Fraction(g) * chebyshev[TERMS + j] / 2 ** (5 + j) for j, g in enumerate(gone))
        assert value(kept, tau) + lost == tau**k


@pytest.mark.parametrize('span', [1e-12, 1e-6, 0.01, 0.3, 1.0, 1.499])
@pytest.mark.parametrize('degree', [1, 3, 5])
def test_cosine_and_sine_lie_within_delta(span, degree):
    """In 128-bit balls, the pair is within delta of the rotation at every place."""
    ctx.prec = 128
    rng = np.random.default_rng(degree)
    tightest = 0.0
    for _ in range(20):
        phi = np.zeros(TERMS)
        phi[1 : degree + 1] = rng.normal(size=degree) * 0.4 ** np.arange(degree)
        phi *= span / np.abs(phi).sum()
        cosine, sine, delta = kernel_calls.fit_rotation(phi, np.abs(phi).sum())
        for tau in (Fraction(k, 16) for k in range(-16, 17)):
            angle = ball(value(phi, tau))
            across = ball(value(cosine, tau)) - angle.cos()
            along = ball(value(sine, tau)) - angle.sin()
            square = across * across + along * along
            off = square.abs_upper().sqrt()
            assert off.upper() <= delta
            tightest = max(tightest, float(off) / delta)
    if span >= 1.0 and degree > 1:
        assert tightest > 0.05


def test_bernstein_rows_reproduce_the_powers():
    """tau^k in Bernstein form of degree 12 is tau^k."""
    n = CONTROLS - 1
    rows = kernel_calls.bernstein()
    for k in range(TERMS):
        for s in np.linspace(0.0, 1.0, 9):
            basis = [math.comb(n, i) * s**i * (1.0 - s) ** (n - i) for i in range(CONTROLS)]
            assert abs(rows[k] @ basis - (2.0 * s - 1.0) ** k) < 1e-14
    assert np.abs(rows).max() <= 1.0


def test_bernstein_coefficients_are_rounded_once():
    """Every coefficient is the exact rational, rounded."""
    n = CONTROLS - 1
    for k, row in enumerate(kernel_calls.bernstein()):
        for i, computed in enumerate(row):
            exact = sum(
                Fraction((-1) ** (k - j) * math.comb(k, j) * math.comb(n - k, i - j))
                for j in range(max(0, i - n + k), min(i, k) + 1)
            ) / math.comb(n, i)
            assert computed == float(exact)


def test_lanes_and_one_turn_agree_to_the_bit():
    """Eight joints at once have the coefficients and the bound of each alone."""
    rng = np.random.default_rng(8)
    phi = rng.normal(size=(TERMS, 8)) * 0.2
    phi[0] = 0.0
    phi[:, 3] = 0.0
    span = np.abs(phi).sum(axis=0)
    cosine, sine, delta = kernel_calls.fit_rotations(phi, span)
    for lane in range(8):
        alone = kernel_calls.fit_rotation(phi[:, lane].copy(), span[lane])
        assert (cosine[:, lane] == alone[0]).all()
        assert (sine[:, lane] == alone[1]).all()
        assert delta[lane] == alone[2]
