"""The limit check sees the curve between its points, and errs toward an excess by rounding."""

from fractions import Fraction
import math

import numpy as np
import pytest

from trajectory_guard.paths.joint_limits import limit_excess


def excess(curve, lower=-math.inf, upper=math.inf, tolerance=0.0, error=0.0):
    """Judge one curve, given by its power coefficients."""
    coefficients = np.zeros((1, 1, 6))
    coefficients[0, 0, : len(curve)] = curve
    return limit_excess(
        coefficients, np.full((1, 1), error), np.array([lower]), np.array([upper]), tolerance
    )


def exact_value(curve, s):
    return sum(Fraction(float(c)) * Fraction(float(s)) ** k for k, c in enumerate(curve))


def exact_peak(curve):
    """Return a value of the curve at, to rounding, its largest place: sup or just below it."""
    slope = np.polynomial.polynomial.polyder(curve)
    roots = np.polynomial.polynomial.polyroots(np.trim_zeros(slope, 'b')).real
    return max(exact_value(curve, s) for s in [0.0, 1.0, *roots[(roots > 0) & (roots < 1)]])


def test_an_overshoot_between_two_good_points():
    bump = [0.0, 4.0, -4.0]
    found = excess(bump, upper=0.9, tolerance=0.05)
    assert (found.segment, found.joint, found.limit) == (0, 0, 0.9)
    assert found.s == pytest.approx(0.5)
    assert found.value == pytest.approx(1.0)
    assert excess(bump, upper=0.96, tolerance=0.05) is None


def test_an_undershoot_below_the_lower_limit():
    found = excess([0.0, -4.0, 4.0], lower=-0.9)
    assert found.limit == -0.9
    assert found.value == pytest.approx(-1.0)
    assert excess([0.0, -4.0, 4.0], lower=-1.01) is None


@pytest.mark.parametrize('value', [0.1, -2.8973, 1e300, 5e-324, 0.0])
def test_a_held_joint_is_judged_exactly(value):
    above, below = np.nextafter(value, math.inf), np.nextafter(value, -math.inf)
    assert excess([value], lower=value, upper=value) is None
    assert excess([above], upper=value).value == above
    assert excess([below], lower=value).value == below


@pytest.mark.parametrize(
    'curve',
    [
        [0.0, 4.0, -4.0],
        [0.0, 8.0, -24.0, 32.0, -16.0],
        [0.0, 1.0],
        [1.0, -1.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        [0.0, 6.75, -13.5, 6.75],
    ],
    ids=['parabola', 'flat peak', 'rising', 'falling', 'steep end', 'cubic bump'],
)
def test_tangency_is_decided_within_rounding(curve):
    peak = float(exact_peak(curve))
    assert peak == pytest.approx(1.0, abs=1e-15)
    for offset in (1e-11, 1e-9, 1e-3):
        assert excess(curve, upper=peak + offset) is None
        assert excess(curve, upper=peak - offset).value == pytest.approx(1.0)
        assert excess([-c for c in curve], lower=-peak - offset) is None
        assert excess([-c for c in curve], lower=-peak + offset).value == pytest.approx(-1.0)
    # Equality is not provable with rounding, so it counts as an excess or not, but ends.
    excess(curve, upper=peak)


def test_no_excess_is_a_proof_and_an_excess_is_real():
    rng = np.random.default_rng(1)
    for _ in range(150):
        curve = rng.uniform(-3, 3, 6) * 10.0 ** rng.integers(-3, 4)
        size = np.abs(curve).sum()
        peak = exact_peak(curve)
        for offset in (0.0, *rng.choice([-1, 1], 3) * size * 10.0 ** rng.uniform(-16, -1, 3)):
            upper = float(peak) + offset
            if excess(curve, upper=upper) is None:
                assert peak <= Fraction(upper)
            else:
                assert float(peak - Fraction(upper)) > -1e-12 * size


def test_the_error_of_the_curve_counts():
    assert excess([0.0, 1.0], upper=1.1, error=0.09) is None
    assert excess([0.0, 1.0], upper=1.1, error=0.11) is not None
    assert excess([0.0, 1.0], lower=-0.1, error=0.11) is not None


def test_the_tolerance_widens_both_sides():
    assert excess([0.0, 1.0], lower=0.1, upper=0.9, tolerance=0.1 + 1e-12) is None
    assert excess([0.0, 1.0], lower=0.1, upper=2.0, tolerance=0.09).limit == 0.1
    assert excess([0.0, 1.0], lower=-1.0, upper=0.9, tolerance=0.09).limit == 0.9


@pytest.mark.parametrize('tolerance', [0.0, 1e-6])
def test_without_limits_nothing_exceeds(tolerance):
    assert excess([1e6, -3.0, 2.0], tolerance=tolerance) is None
    assert excess([1e6, -3.0, 2.0], upper=2e6, tolerance=tolerance) is None
    assert excess([1e6, -3.0, 2.0], lower=0.0, tolerance=tolerance) is None


@pytest.mark.parametrize('wrong', [math.nan, math.inf])
def test_what_is_not_a_number_is_an_excess(wrong):
    with np.errstate(all='ignore'):
        assert excess([0.0, 1.0], upper=math.nan) is not None
        assert excess([0.0, 1.0], lower=-9.0, upper=9.0, error=wrong) is not None


def test_reports_the_largest_excess_of_the_first_segment():
    coefficients = np.zeros((4, 3, 6))
    coefficients[1, 0, :3] = [0.0, 4.8, -4.8]
    coefficients[1, 2, :3] = [0.0, -8.0, 8.0]
    coefficients[3, 1, 0] = 50.0
    found = limit_excess(
        coefficients, np.zeros((4, 3)), np.full(3, -1.0), np.full(3, 1.0), tolerance=1e-6
    )
    assert (found.segment, found.joint, found.limit) == (1, 2, -1.0)
    assert found.value == pytest.approx(-2.0)


def test_many_curves_close_to_the_limit():
    rng = np.random.default_rng(2)
    curves = rng.uniform(-1, 1, (300, 7, 6))
    dense = curves @ np.linspace(0, 1, 201) ** np.arange(6)[:, None]
    upper = dense.max(axis=(0, 2))
    lower = dense.min(axis=(0, 2))
    none = np.zeros((300, 7))
    assert limit_excess(curves, none, lower, upper, 1e-3) is None
    found = limit_excess(curves, none, lower + 1e-3, upper - 1e-3, 1e-6)
    first = np.nonzero((dense > upper[:, None] - 1e-3) | (dense < lower[:, None] + 1e-3))[0][0]
    assert found.segment == first
