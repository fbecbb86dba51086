"""Polynomial cosines and folded products: the exact value lies inside the bound."""

from fractions import Fraction
import math

from flint import arb, ctx
import kernel_calls
import numpy as np
import pytest

from trajectory_guard.kernels.economised import BERNSTEIN, CONTROLS
from trajectory_guard.kernels.piece import TERMS


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
        p = tuple(rng.normal(size=11) * 10.0 ** rng.integers(-3, 4, size=11))
        kept, gone = kernel_calls.economised(p)
        bound = sum(abs(Fraction(g)) / 2 ** (5 + k) for k, g in enumerate(gone))
        rounding = Fraction(64, 2**53) * sum(abs(Fraction(c)) for c in p) * 7
        for tau in (Fraction(k, 8) for k in range(-8, 9)):
            assert abs(value(p, tau) - value(kept, tau)) <= bound + rounding


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
        cosine, sine, delta = kernel_calls.fit_rotation(tuple(phi), float(np.abs(phi).sum()))
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
    for k in range(TERMS):
        for s in np.linspace(0.0, 1.0, 9):
            basis = [math.comb(n, i) * s**i * (1.0 - s) ** (n - i) for i in range(CONTROLS)]
            assert abs(BERNSTEIN[:, k] @ basis - (2.0 * s - 1.0) ** k) < 1e-14
    assert np.abs(BERNSTEIN).max() <= 1.0
