"""Crossings and contacts of real surfaces: what is claimed holds after every allowed move."""

from fractions import Fraction

import kernel_calls
import numpy as np
import pytest

from trajectory_guard.cell.pack import solids
from trajectory_guard.kernels.layout import PARTS, TRIANGLE
from trajectory_guard.shapes.body import ConvexBody
from trajectory_guard.shapes.primitive import Box


def exact(rows):
    """Return exact coordinates."""
    return [[Fraction(float(x)) for x in row] for row in rows]


def determinant(a, b, c, d):
    """Return six times the signed volume of four points."""
    u, v, w = ([p[r] - a[r] for r in range(3)] for p in (b, c, d))
    return (
        u[0] * (v[1] * w[2] - v[2] * w[1])
        - u[1] * (v[0] * w[2] - v[2] * w[0])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
    )


def goes_through(p, q, t):
    """Say whether the closed edge pq meets a triangle off its plane, in exact arithmetic."""
    before, after = determinant(*t, p), determinant(*t, q)
    if before * after > 0:
        return False
    sides = [determinant(p, q, t[k], t[(k + 1) % 3]) for k in range(3)]
    return all(s >= 0 for s in sides) or all(s <= 0 for s in sides)


def meet(mine, theirs):
    """Say whether two triangles meet, in exact arithmetic."""
    a, b = exact(mine), exact(theirs)
    return any(
        goes_through(x[k], x[(k + 1) % 3], y) for x, y in ((a, b), (b, a)) for k in range(3)
    )


@pytest.mark.parametrize('scale', [1e-6, 1.0, 1e5])
@pytest.mark.parametrize('offset', [0.0, 100.0])
def test_what_crosses_goes_on_crossing_within_the_rim(scale, offset):
    """Every corner moved by half of the rim, in any direction: the triangles still meet."""
    rng = np.random.default_rng(1)
    crossed = 0
    for _ in range(300):
        mine, theirs = scale * (rng.normal(size=(2, 3, 3)) + offset)
        rim, place = kernel_calls.crossing(mine, theirs)
        if not rim > 0.0:
            continue
        crossed += 1
        assert meet(mine, theirs)
        assert np.abs(place - mine.mean(axis=0)).max() < 10 * scale
        for _ in range(10):
            shift = rng.normal(size=(2, 3, 3))
            shift *= 0.499 * rim / np.linalg.norm(shift, axis=2, keepdims=True)
            assert meet(mine + shift[0], theirs + shift[1])
        # As a whole, too, by all of it.
        shift = rng.normal(size=3)
        assert meet(mine + 0.999 * rim * shift / np.linalg.norm(shift), theirs)
    assert crossed > 30


def test_what_does_not_meet_does_not_cross():
    """No rim is claimed for triangles that exact arithmetic finds apart."""
    rng = np.random.default_rng(2)
    apart = 0
    for _ in range(500):
        mine, theirs = rng.normal(size=(2, 3, 3))
        if not meet(mine, theirs):
            apart += 1
            assert kernel_calls.crossing(mine, theirs)[0] == 0.0
    assert apart > 100


FLAT = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    'needle',
    [
        [[0.2, 0.2, 0.0], [0.2, 0.2, 1.0], [0.3, 0.2, 1.0]],  # its tip in the plane
        [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]],  # through a corner, without area
        [[0.5, 0.0, -1.0], [0.5, 0.0, 1.0], [0.6, -1.0, 1.0]],  # through a side
        [[0.2, 0.2, 0.0], [0.3, 0.2, 0.0], [0.2, 0.3, 0.0]],  # in the plane
        [[np.nan, 0.2, -1.0], [0.2, 0.2, 1.0], [0.3, 0.2, 1.0]],
        [[0.2, 0.2, -np.inf], [0.2, 0.2, 1.0], [0.3, 0.2, 1.0]],
    ],
)
def test_a_graze_is_no_crossing(needle):
    """What touches, lies in the plane or is no number proves nothing."""
    assert kernel_calls.crossing(needle, FLAT)[0] == 0.0
    assert kernel_calls.crossing(FLAT, needle)[0] == 0.0


def test_the_rim_of_a_known_crossing():
    """A needle through the middle of a big triangle holds as long as its ends keep away."""
    needle = [[0.0, 0.0, -0.1], [0.0, 0.0, 0.3], [0.0, 5.0, 0.3]]
    rim, place = kernel_calls.crossing(needle, [[-9, -9, 0], [9, -9, 0], [0, 9, 0]])
    assert 0.1 * (1 - 1e-9) < rim <= 0.1
    assert np.allclose(place, 0.0)


def triangle(points, node, ball=0.0):
    """Return a packed triangle of a real surface."""
    packed = solids([ConvexBody(np.asarray(points, float), ball=ball)], [node])
    packed.ranges[:, PARTS] = TRIANGLE
    return packed


@pytest.mark.parametrize('swapped', [False, True])
def test_a_triangle_in_a_box(swapped):
    """The slack is the depth of a point of the triangle in the box, less the triangle's ball."""
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(200):
        corners = rng.normal(size=(3, 3))
        T = np.eye(4)
        T[:3, 3] = rng.normal(size=3) * 0.3
        links, obstacles = solids([Box((2, 2, 2)).load().body], [0]), triangle(corners, -1, 0.01)
        if swapped:
            links, obstacles = (
                triangle(corners, 0, 0.01),
                solids([Box((2, 2, 2)).load().body], [-1]),
            )
        slack, y, place = kernel_calls.contact(T[:3], links, obstacles)
        if not slack > 0.0:
            continue
        found += 1
        assert np.allclose(place, y + T[:3, 3])
        in_box, in_triangle = (place, y) if swapped else (y, place)
        assert slack + 0.01 <= 1.0 - np.abs(in_box).max() + 1e-12
        weights = np.linalg.lstsq(
            np.vstack([corners.T, np.ones(3)]), [*in_triangle, 1], rcond=None
        )
        assert (weights[0] > -1e-9).all()
        assert np.allclose(weights[0] @ corners, in_triangle)
    assert found > 50


def test_without_faces_nothing_is_inside():
    """A triangle against a body of which nothing is known to be inside makes no contact."""
    body = ConvexBody(np.random.default_rng(0).normal(size=(8, 3)))
    pose = np.eye(4)[:3]
    assert kernel_calls.contact(pose, solids([body], [0]), triangle(FLAT, -1))[0] == -np.inf
    assert kernel_calls.contact(pose, triangle(FLAT, 0), solids([body], [-1]))[0] == -np.inf
