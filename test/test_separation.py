"""The inequality that certifies: never above the exact value, never fooled by a NaN."""

from fractions import Fraction
import math

import kernel_calls
import numpy as np
import pytest
from random_robot import box_body, core, hull_body, random_body

from trajectory_guard.cell.pack import solids
from trajectory_guard.kernels.layout import CORE, FAR, FIRST, LANES, LAST


def controls(rng, count, scale=1.0, spread=0.3):
    """Return (1, count, 12) poses near one another."""
    from scipy.spatial.transform import Rotation

    base = rng.normal(size=3)
    points = np.empty((1, count, 12))
    for i in range(count):
        R = Rotation.from_rotvec(base + spread * rng.normal(size=3)).as_matrix()
        t = scale * (np.array([2.0, 0.0, 0.0]) + spread * rng.normal(size=3))
        points[0, i] = np.column_stack([R, t]).ravel()
    return points


def unit(rng):
    """Return a direction."""
    n = rng.normal(size=3)
    return n / np.linalg.norm(n)


def exact_gap(n, points, body, obstacle):
    """Return min n.(P v) - max n.p in rational arithmetic."""
    n = [Fraction(float(x)) for x in n]
    rows = [[Fraction(float(x)) for x in row] for row in points[0]]
    low = min(
        sum(
            n[r] * (sum(row[4 * r + c] * Fraction(float(v[c])) for c in range(3)) + row[4 * r + 3])
            for r in range(3)
        )
        for row in rows
        for v in body.vertices
    )
    high = max(sum(n[c] * Fraction(float(p[c])) for c in range(3)) for p in obstacle.vertices)
    return low - high


@pytest.mark.parametrize('scale', [1e-6, 1.0, 1e6])
def test_bound_is_below_the_exact_value(scale):
    """Whatever is rounded, the reported gap is below the rational one and close to it."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        body = hull_body(rng.normal(size=(12, 3)) * 0.2 * scale)
        obstacle = hull_body(rng.normal(size=(12, 3)) * 0.2 * scale)
        links, obstacles = solids([body], [0]), solids([obstacle], [-1])
        points = controls(rng, 5, scale)
        n = unit(rng)
        reach = float(links.size[0, FAR] + np.abs(points[0, :, 3::4]).sum(axis=1).max())
        gap = kernel_calls.separation(n, points, links, 0, obstacles, 0, 0.0, 2.0, reach)
        exact = exact_gap(n, points, body, obstacle)
        length = math.sqrt(float(sum(Fraction(float(x)) ** 2 for x in n)))
        assert Fraction(gap) <= exact / Fraction(length)
        assert float(exact) - gap < 1e-11 * scale


def test_bound_is_below_sampled_supports():
    """Balls and discs count fully: no sampled point pair is nearer than the bound."""
    rng = np.random.default_rng(2)
    for _ in range(60):
        body, obstacle = random_body(rng), random_body(rng)
        links, obstacles = solids([body], [0]), solids([obstacle], [-1])
        points = controls(rng, 4)
        n = unit(rng)
        gap = kernel_calls.separation(n, points, links, 0, obstacles, 0, 0.01, 2.0, 9.0)
        low = min(
            (n @ (core(body, rng) @ P[:, :3].T + P[:, 3]).T).min()
            for P in points[0].reshape(-1, 3, 4)
        )
        high = (core(obstacle, rng) @ n).max()
        assert gap <= low - body.ball - high - obstacle.ball - 0.01
        assert (
            gap >= low - body.ball - high - obstacle.ball - 0.01 - 0.06
        )  # rim samples are coarse


@pytest.mark.parametrize('bad', [np.nan, np.inf])
@pytest.mark.parametrize('where', ['control', 'vertex', 'obstacle', 'error', 'direction', 'kappa'])
def test_nonsense_never_certifies(bad, where):
    """Wherever a NaN enters, or an infinity that could only hurt, the gap is not positive."""
    rng = np.random.default_rng(3)
    links = solids([box_body(np.ones(3))], [0])
    obstacles = solids([box_body(np.ones(3), (-9.0, 0.0, 0.0))], [-1])
    points = controls(rng, 3)
    n = np.array([1.0, 0.0, 0.0])
    error, kappa, reach = 0.0, 2.0, 9.0
    whole = (points, links, 0, obstacles, 0)
    assert kernel_calls.separation(n, *whole, error, kappa, reach) > 5.0
    if where == 'control':
        points[0, 1, 3] = -bad
    elif where == 'vertex':
        links.vertices[:, 3] = -bad * np.sign(points[0, 0, :3])
    elif where == 'obstacle':
        obstacles.vertices[0, 3] = bad
    elif where == 'error':
        error = bad
    elif where == 'direction':
        n[0] = bad
    else:
        kappa = bad
    assert not kernel_calls.separation(n, *whole, error, kappa, reach) > 0.0


@pytest.mark.parametrize('length', [0.0, 0.5, 1.0 + 1e-12, 1e200, 2.0])
def test_a_direction_that_is_not_unit_is_refused(length):
    """A long direction would stretch the gap."""
    rng = np.random.default_rng(4)
    links = solids([box_body(np.ones(3))], [0])
    obstacles = solids([box_body(np.ones(3), (-9.0, 0.0, 0.0))], [-1])
    n = [length, 0.0, 0.0]
    gap = kernel_calls.separation(n, controls(rng, 3), links, 0, obstacles, 0, 0.0, 2.0, 9.0)
    assert gap == -math.inf


def test_tangency_and_one_step_either_side():
    """Faces that touch are not free; a gap just above the margin is."""
    links = solids([box_body(np.ones(3))], [0])
    points = np.array([[[1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0]]])
    for gap, free in ((-1e-9, False), (0.0, False), (1e-15, False), (1e-11, True)):
        points[0, 0, 3] = 1.0 + gap
        obstacles = solids([box_body(np.ones(3))], [-1])
        n = [1.0, 0.0, 0.0]
        bound = kernel_calls.separation(n, points, links, 0, obstacles, 0, 0.0, 1.0, 2.0)
        assert (bound > 0.0) is free


@pytest.mark.parametrize('seed', range(8))
def test_box_and_sphere_contain_the_core(seed):
    """The packed box, sphere and far distance hold every sampled core point."""
    rng = np.random.default_rng(seed)
    for scale in (1e-6, 1.0, 1e6):
        body = random_body(rng, scale)
        packed = solids([body], [-1])
        count = packed.ranges[0, LAST] - packed.ranges[0, FIRST]
        assert len(body.vertices) <= count < len(body.vertices) + LANES and count % LANES == 0
        np.testing.assert_array_equal(
            np.unique(packed.vertices.T, axis=0), np.unique(body.vertices, axis=0)
        )
        points = core(body, rng)
        for x in points:
            # A rim sample is off by its own rounding.
            assert kernel_calls.box_distance(x, packed) <= 1e-14 * scale
        tolerance = 1.0 + 1e-14
        assert (
            np.linalg.norm(points - body.center, axis=1).max() <= packed.size[0, CORE] * tolerance
        )
        assert np.linalg.norm(points, axis=1).max() <= packed.size[0, FAR] * tolerance


def test_the_box_of_a_turned_box_is_tight():
    """A scene's boxes get their own frame, not one twice as large."""
    from random_robot import pose
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(9)
    size = np.array([1.6, 1.8, 0.04])
    body = box_body(size).moved(pose([1.0, 2.0, 3.0], Rotation.random(random_state=rng)))
    half = solids([body], [-1]).place[0, 6:9]
    np.testing.assert_allclose(np.sort(half), np.sort(size / 2.0), rtol=1e-9)


@pytest.mark.parametrize('tilt', [0.0, 1e-12, 1e-9, 1e-8, 3e-8, 1e-6])
@pytest.mark.parametrize('radius', [1e-6, 1.0, 1e5])
def test_the_box_contains_a_disc_that_is_almost_aligned(tilt, radius):
    """Found in review: 1 - (r.a)^2 cancels, and the box lost R times the tilt."""
    from trajectory_guard.shapes.body import ConvexBody

    axis = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    body = ConvexBody(np.zeros((1, 3)), disc_radius=radius, disc_axis=axis)
    packed = solids([body], [-1])
    rim = radius * np.array([math.cos(tilt), 0.0, -math.sin(tilt)])
    for x in (rim, -rim, np.array([0.0, radius, 0.0])):
        assert kernel_calls.box_distance(x, packed) <= 2e-16 * radius
