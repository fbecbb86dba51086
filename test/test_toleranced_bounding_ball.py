"""Bounding balls contain the motion, in exact arithmetic; their order; Proposition 2."""

from fractions import Fraction
import json
import math
import os
from pathlib import Path
import subprocess
import sys
from typing import NamedTuple

from exact_orbit import distance_squared, fractions
import numpy as np
import pytest

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.toleranced.bounding_ball import (
    control_ball,
    curvature_ball,
    minimal_ball,
    tangent_ratio,
)
from trajectory_guard.toleranced.curve_bounds import curvature_bound, length_bound
from trajectory_guard.toleranced.metric import MassDistribution
from trajectory_guard.toleranced.smallest_ball import smallest_ball

SCALES = (1e-6, 1e-3, 1.0, 1e3, 1e6)
BALLS = {'control': control_ball, 'minimal': minimal_ball, 'curvature': curvature_ball}


class Motion(NamedTuple):
    """A rational Bezier motion."""

    control_points: np.ndarray
    weights: np.ndarray


def random_motion(rng, degree, turn, scale=1.0, offset=0.0):
    """Return a nearly straight motion that bends by about `turn`, and a metric."""
    points = scale * rng.normal(size=(6, 3))
    metric = MassDistribution.of_points(points, rng.uniform(0.5, 2.0, 6))
    units = [1.0, 1.0, 1.0, scale]
    start, way = rng.normal(size=(2, 3, 4)) * units
    start[:, 3] += offset * scale
    s = np.arange(degree + 1)[:, None, None] / max(degree, 1)
    bend = turn / max(degree, 1) * rng.normal(size=(degree + 1, 3, 4)) * units
    return Motion(start + s * way + bend, rng.uniform(0.8, 1.2, degree + 1)), metric


def poses(motion, s):
    """Return poses at parameters, to rounding, (n, 3, 4)."""
    n = len(motion.weights) - 1
    basis = np.array([math.comb(n, i) * s**i * (1.0 - s) ** (n - i) for i in range(n + 1)]).T
    basis = basis * motion.weights
    return np.einsum(
        'ni,irc->nrc', basis / basis.sum(axis=1, keepdims=True), motion.control_points
    )


def exact_pose(motion, s):
    """Return a pose in rational arithmetic."""
    n = len(motion.weights) - 1
    basis = [
        math.comb(n, i) * s**i * (1 - s) ** (n - i) * Fraction(float(w))
        for i, w in enumerate(motion.weights)
    ]
    total = sum(basis)
    points = fractions(motion.control_points)
    return [
        [sum(b * p[r][c] for b, p in zip(basis, points, strict=True)) / total for c in range(4)]
        for r in range(3)
    ]


@pytest.mark.parametrize('name', BALLS)
@pytest.mark.parametrize(('scale', 'offset'), [*[(s, 0.0) for s in SCALES], (1.0, 1e3)])
def test_the_curve_lies_in_the_ball(name, scale, offset):
    """Exactly, at dense instants; for the balls of control points at these, too."""
    rng = np.random.default_rng(0)
    found = 0
    for degree in (1, 2, 3, 8):
        motion, metric = random_motion(rng, degree, 0.05, scale, offset)
        ball = BALLS[name](motion, metric)
        if ball is None:
            continue
        found += 1
        square = Fraction(ball.radius) ** 2
        for k in range(9):
            pose = exact_pose(motion, Fraction(k, 8))
            assert distance_squared(metric, pose, ball.center) <= square
        if name != 'curvature':
            for point in motion.control_points:
                assert distance_squared(metric, point, ball.center) <= square
    assert found >= 3


def test_order_and_tightness():
    """Smallest <= control points'; both at least half of the distance of the ends."""
    rng = np.random.default_rng(1)
    for degree in (1, 2, 5, 8, 14, 28):
        for turn in (0.0, 0.1, 3.0):
            motion, metric = random_motion(rng, degree, turn)
            small, control = minimal_ball(motion, metric), control_ball(motion, metric)
            ends = metric.distance(motion.control_points[0], motion.control_points[-1])
            assert 0.5 * ends * (1.0 - 1e-12) <= small.radius
            assert small.radius <= control.radius * (1.0 + 1e-12)
    motion, metric = random_motion(rng, 1, 0.0)
    for make in BALLS.values():
        length = metric.distance(*motion.control_points)
        radius = make(Motion(motion.control_points, np.ones(2)), metric).radius
        assert radius == pytest.approx(0.5 * length, rel=1e-12)


@pytest.mark.parametrize('d', [1, 2, 3, 12])
def test_the_smallest_ball_cannot_be_smaller(d):
    """Its centre is a mean of points that are all at the greatest distance, with weights >= 0."""
    rng = np.random.default_rng(2)
    for n in (1, 2, 3, 9, 43):
        for kind in range(4):
            points = rng.normal(size=(n, d))
            if kind == 1:  # on a sphere: many in the support
                points /= np.linalg.norm(points, axis=1, keepdims=True)
            elif kind == 2:  # repeated, on a line
                points = np.round(rng.normal(size=(n, 1))) * np.ones(d)
            elif kind == 3:
                points = 1e6 + 1e-3 * points
            share = smallest_ball(points)
            shifted = points - points[0]
            away = np.linalg.norm(shifted - share @ shifted, axis=1)
            assert share.sum() == pytest.approx(1.0)
            assert share.min() >= -1e-9
            size = np.ptp(points, axis=0).max()
            assert (away[share > 1e-9] >= away.max() - 1e-8 * size).all()


def test_length_and_curvature_bounds_hold_and_converge():
    """Against fine differences of the curve; on a short piece they are nearly exact."""
    rng = np.random.default_rng(3)
    ratios = []
    for degree in (2, 3, 5, 8):
        for turn in (0.05, 0.3):
            motion, metric = random_motion(rng, degree, turn)
            s = np.linspace(0.0, 1.0, 4001)
            y = metric.coordinates(poses(motion, s))
            sides = np.diff(y, axis=0)
            lengths = np.linalg.norm(sides, axis=1)
            assert lengths.sum() <= length_bound(motion, metric)
            tangents = sides / lengths[:, None]
            turns = 2.0 * np.arcsin(0.5 * np.linalg.norm(np.diff(tangents, axis=0), axis=1))
            curvature = (turns / (0.5 * (lengths[1:] + lengths[:-1]))).max()
            bound = curvature_bound(motion, metric)
            assert curvature * (1.0 - 1e-3) <= bound
            if np.isfinite(bound):
                ratios.append(bound / curvature)
    assert len(ratios) >= 6
    assert min(ratios) < 3.0


def circle_arc(metric, angle):
    """Return a quarter-circle-like arc of translations, exact as a rational quadratic."""
    half = 0.5 * angle
    points = np.zeros((3, 3, 4))
    points[:, :, :3] = np.eye(3)
    radius = 1.0 / np.sqrt(metric.mass)
    points[:, :2, 3] = radius * np.array(
        [[0.0, 0.0], [math.tan(half), 0.0], [math.sin(angle), 1.0 - math.cos(angle)]]
    )
    return Motion(points, np.array([1.0, math.cos(half), 1.0]))


def test_the_tangent_is_bounded():
    """Above the tangent, and the more so in the middle, where 0.178 is not 2/15."""
    for x in np.linspace(1e-6, 0.25 * np.pi, 1000):
        assert math.tan(x) / x <= tangent_ratio(x) <= math.tan(x) / x * 1.006
    assert 1.0 <= tangent_ratio(0.0) <= 1.0 + 1e-15


def test_a_circle_has_its_curvature():
    """A rational arc of radius 1 in the metric: bounds near 1, ball near tan(t/2)."""
    metric = MassDistribution(4.0, np.zeros(3), np.eye(3))
    for angle in (0.01, 0.1, 0.4):
        motion = circle_arc(metric, angle)
        bound = curvature_bound(motion, metric)
        assert 1.0 <= bound <= 1.0 + angle**2
        ball = curvature_ball(motion, metric)
        assert math.tan(0.5 * angle) <= ball.radius <= math.tan(0.5 * angle) * (1.0 + angle**2)
    assert curvature_ball(circle_arc(metric, 2.5), metric) is None


def test_proposition_2_on_extremal_curves():
    """
    Any turning at unit rate or less: plane curves by angle, t up to pi/2.

    The ball of half the length round the tangent's middle, without the tangent's growth, fails.
    """
    rng = np.random.default_rng(4)
    n, worst, half = 400, 0.0, 0.0
    for t in (0.1, 0.8, 1.5, 1.57):
        k = math.tan(0.5 * t)
        for trial in range(200):
            rate = np.sign(rng.normal(size=n)) if trial % 2 else rng.uniform(-1.0, 1.0, n)
            if trial < 100:  # an arc, then straight on or back
                rate = np.where(np.arange(n) < rng.integers(n + 1), 1.0, rng.choice([-1, 0, 1]))
            theta = np.concatenate(([0.0], np.cumsum(rate) * t / n))
            middle = 0.5 * (theta[1:] + theta[:-1])
            # Exact over a step of constant rate: a chord of length 2 sin(x/2)/x.
            steps = t / n * np.sinc(rate * t / n / (2.0 * np.pi))
            c = np.cumsum(steps * np.exp(1j * middle))
            worst = max(worst, (np.abs(c - k) / k).max())
            half = max(half, (np.abs(c - 0.5 * t) / (0.5 * t)).max())
    assert 0.9999 < worst <= 1.0 + 1e-9
    assert half > 1.05


BAD_MOTIONS = {
    'shape': (Motion(np.zeros((3, 4)), np.ones(3)), 'control_points'),
    'empty': (Motion(np.zeros((0, 3, 4)), np.ones(0)), 'control_points'),
    'nan': (Motion(np.full((2, 3, 4), np.nan), np.ones(2)), 'control_points'),
    'weights': (Motion(np.zeros((3, 3, 4)), np.ones(2)), 'weights'),
    'zero weight': (Motion(np.zeros((2, 3, 4)), np.array([1.0, 0.0])), 'weight 1'),
    'nan weight': (Motion(np.zeros((2, 3, 4)), np.array([np.nan, 1.0])), 'weight 0'),
}


@pytest.mark.parametrize('name', BALLS)
@pytest.mark.parametrize('bad', BAD_MOTIONS)
def test_bad_motions_are_refused_by_name(name, bad):
    """Each with the stable code."""
    motion, word = BAD_MOTIONS[bad]
    metric = MassDistribution(1.0, np.zeros(3), np.eye(3))
    with pytest.raises(RequestError, match=word) as refused:
        BALLS[name](motion, metric)
    assert refused.value.reason is Reason.INVALID_PARAMETER


def test_motions_that_rest_or_stop():
    """A constant motion has a ball of no radius, and no curvature; nor has one with a cusp."""
    metric = MassDistribution(1.0, np.zeros(3), np.eye(3))
    rest = Motion(np.ones((4, 3, 4)), np.ones(4))
    assert control_ball(rest, metric).radius < 1e-12
    assert minimal_ball(rest, metric).radius < 1e-12
    point = Motion(np.ones((1, 3, 4)), np.ones(1))
    assert minimal_ball(point, metric).radius < 1e-12
    for motion in (rest, point):
        assert curvature_ball(motion, metric) is None
    cusp = np.zeros((3, 3, 4))
    cusp[1, 0, 3] = 1.0
    assert curvature_ball(Motion(cusp, np.ones(3)), metric) is None
    assert np.isinf(curvature_bound(Motion(cusp, np.ones(3)), metric))


def test_the_benchmark_prints_its_table():
    """A row for every ball and number of pieces, none smaller than its motion."""
    script = Path(__file__).parent.parent / 'benchmarks' / 'bounding_balls.py'
    command = [sys.executable, str(script), '--cuts', '2', '--json']
    root = str(script.parent.parent)
    done = subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, 'PYTHONPATH': root}
    )
    assert done.returncode == 0, done.stderr
    found = [json.loads(line) for line in done.stdout.splitlines()]
    assert [row['pieces'] for row in found] == [1] * 3 + [4] * 3 + [16] * 3
    for row in found:
        assert row['unsound'] == 0
        assert row['us_a_ball'] > 0.0
    at_last = {row['ball']: row['median_excess'] for row in found[6:]}
    assert at_last['minimal'] <= at_last['c(1/2), control points'] < 0.1
