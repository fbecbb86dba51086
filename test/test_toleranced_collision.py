"""Collision detection with toleranced motions: what is free is free at every instant, exactly."""

from fractions import Fraction
from typing import NamedTuple

from exact_contact import exact, images, pose, surfaces_meet, winds_round
import numpy as np
import pytest
from rational_curves import random_curve, rational_curve

from trajectory_guard.errors import RequestError
from trajectory_guard.shapes.polyhedron import Polyhedron
from trajectory_guard.toleranced.collision import collide, collisions
from trajectory_guard.toleranced.pair import pair_of
from trajectory_guard.toleranced.suspect import Kind, Why


class RationalCurve(NamedTuple):
    """A motion that nobody has checked."""

    control_points: np.ndarray
    weights: np.ndarray


STILL = [[1.0, 0.0, 0.0, 0.0]] * 5


def box(half, centre=(0, 0, 0)):
    """Return a closed box of rectangles."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    rings = ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])
    return Polyhedron(corners * half + centre, tuple(np.array(ring) for ring in rings))


def angle_prism(height=0.3):
    """Return a closed prism over an L, with two non-convex faces."""
    ring = np.array([[0, 0], [1, 0], [1, 0.3], [0.3, 0.3], [0.3, 1], [0, 1]]) - 0.3
    below = np.column_stack([ring, np.zeros(6)])
    sides = [np.array([i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6]) for i in range(6)]
    points = np.vstack([below, below + [0, 0, height]])
    return Polyhedron(points, (np.arange(5, -1, -1), np.arange(6, 12), *sides))


def tetrahedron(rng):
    """Return a closed tetrahedron in general position."""
    points = rng.normal(size=(4, 3)) * 0.5
    if np.linalg.det(points[1:] - points[0]) < 0:
        points = points[[1, 0, 2, 3]]
    return Polyhedron(
        points, tuple(np.array(f) for f in ([0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]))
    )


def grid(n):
    """Return the unit square as n x n squares."""
    x = np.linspace(-0.5, 0.5, n + 1)
    points = np.array([[a, b, 0.0] for a in x for b in x])
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    return Polyhedron(points, tuple(corner[:, None] + [0, n + 1, n + 2, 1]))


def scaled(polyhedron, scale):
    return Polyhedron(polyhedron.vertices * scale, polyhedron.faces)


def shifted(motion, by):
    """Return the motion followed by a translation."""
    points = motion.control_points.copy()
    points[:, :, 3] += by
    return RationalCurve(points, motion.weights)


def in_contact(moving, fixed, motion, s):
    """Say whether two surfaces, or the solids they bound, have a common point at an instant."""
    moved, still = images(pose(motion, s), moving.vertices), exact(fixed.vertices)
    if surfaces_meet(moved, moving.triangles, still, fixed.triangles):
        return True
    if not (moving.watertight and fixed.watertight):
        return False
    return winds_round(moved[0], still, fixed.triangles) or winds_round(
        still[0], moved, moving.triangles
    )


def check_partition(found):
    """Intervals are those of [0, 1], free ones apart from the others."""
    spans = [(s, True) for s in found.free]
    spans += [((x.start, x.end), False) for x in found.suspect]
    at = 0.0
    for (start, end), is_free in sorted(spans):
        assert start < end
        assert start == at if is_free else start <= at
        at = max(at, end)
    assert at == 1.0


def is_free(found, s):
    return any(a <= s <= b for a, b in found.free)


# Soundness


@pytest.mark.parametrize('seed', range(12))
def test_free_intervals_hold_no_contact(seed):
    """Random motions of solids, judged exactly, at the ends of intervals as well."""
    rng = np.random.default_rng(seed)
    scale = [1e-6, 1.0, 1e6][seed % 3]
    moving = scaled([tetrahedron(rng), angle_prism()][seed % 2], scale)
    fixed = scaled([box((0.3, 0.2, 0.4)), tetrahedron(rng), angle_prism(0.5)][seed % 3], scale)
    motion = random_curve(rng, scale)
    for individual, adapted in ((True, True), (True, False), (False, True)):
        found = collide(
            moving,
            fixed,
            motion,
            epsilon=0.02 * scale,
            individual=individual,
            adapted=adapted,
        )
        check_partition(found)
        ends = [Fraction(x) for span in found.free for x in span]
        for s in {*(Fraction(k, 16) for k in range(17)), *ends}:
            if is_free(found, s):
                assert not in_contact(moving, fixed, motion, s)


def test_collisions_are_found_and_the_rest_is_free():
    """A box passes through a wall: about while it does, and no longer."""
    path = np.array([[4.0 * k / 8 - 2, 0.1, 0.2] for k in range(9)])
    motion = rational_curve(STILL, path)
    moving, wall = box((0.2, 0.2, 0.2)), box((0.1, 1, 1))
    found = collide(moving, wall, motion, epsilon=0.01)
    check_partition(found)
    # In contact for |x| <= 0.3, x = 4 s - 2.
    first, last = found.free
    assert 0.425 - 0.02 < first[1] <= 0.425
    assert 0.575 <= last[0] < 0.575 + 0.02
    for suspect in found.suspect:
        assert suspect.why in (Why.EPSILON, Why.CONTAINED)


def test_named_place_is_near_both():
    """A corner comes down on a plate and goes up again."""
    turned = [[np.cos(0.4), np.sin(0.4), 0.3, 0.0]] * 5
    height = [0.5, 0.4, 0.3, 0.2, -0.6, 0.2, 0.3, 0.4, 0.5]
    motion = rational_curve(turned, [[0.1, 0.05, z] for z in height])
    moving, plate = box((0.1, 0.1, 0.1)), grid(3)
    found = collide(moving, plate, motion, epsilon=0.005)
    assert found.suspect
    for suspect in found.suspect:
        assert suspect.why == Why.EPSILON
        assert suspect.kind <= Kind.FACE_PIERCED
        s = Fraction(suspect.start + suspect.end) / 2
        moved = images(pose(motion, s), moving.vertices[moving.faces[suspect.moving_face]])
        moved = moved.astype(float)
        place = np.array(suspect.place)
        assert (place > moved.min(axis=0) - 0.02).all()
        assert (place < moved.max(axis=0) + 0.02).all()
        ring = plate.vertices[plate.faces[suspect.fixed_face]]
        if suspect.kind != Kind.EDGE_PIERCES:
            assert (place > ring.min(axis=0) - 0.02).all()
            assert (place < ring.max(axis=0) + 0.02).all()
        assert {*suspect.moving} <= {*moving.faces[suspect.moving_face].tolist()}
        assert {*suspect.fixed} <= {*plate.faces[suspect.fixed_face].tolist()}


def test_pierced_all_the_time_is_never_free():
    """Nothing of the triangle's outline is near the square's, and it is stuck in it."""
    square = Polyhedron(
        np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]]), (np.arange(4),)
    )
    triangle = Polyhedron(
        np.array([[0, -0.1, -0.8], [0, 0.1, -0.8], [0, 0, 0.9]]), (np.arange(3),)
    )
    path = [[0.02 * np.sin(k), 0.02 * np.cos(k), 0.0] for k in range(9)]
    for hierarchy in (True, False):
        found = collide(
            square, triangle, rational_curve(STILL, path), epsilon=1e-3, hierarchy=hierarchy
        )
        assert found.free == ()


@pytest.mark.parametrize('swap', [False, True])
def test_one_solid_inside_the_other(swap):
    """Surfaces stay apart, solids do not; without a side left out there is no inside."""
    path = [[0.1 * np.sin(k), 0.1 * np.cos(k), 0.0] for k in range(9)]
    motion = rational_curve(STILL, path)
    pair = [box((0.1, 0.1, 0.1)), box((1, 1, 1))]
    moving, fixed = pair[::-1] if swap else pair
    found = collide(moving, fixed, motion, epsilon=0.01)
    assert found.free == ()
    assert [(s.start, s.end, s.why, s.kind) for s in found.suspect] == [
        (0.0, 1.0, Why.CONTAINED, Kind.CONTAINED)
    ]
    pair[1] = Polyhedron(pair[1].vertices, pair[1].faces[:5])
    moving, fixed = pair[::-1] if swap else pair
    assert collide(moving, fixed, motion, epsilon=0.01).free == ((0.0, 1.0),)


def test_one_of_two_parts_inside():
    """A surface of two boxes, the second of which is inside the other solid."""
    far, near = box((0.1, 0.1, 0.1), (5, 0, 0)), box((0.1, 0.1, 0.1))
    both = Polyhedron(
        np.vstack([far.vertices, near.vertices]), (*far.faces, *(f + 8 for f in near.faces))
    )
    assert both.watertight
    motion = rational_curve(STILL, np.zeros((9, 3)))
    for moving, fixed in ((both, box((1, 1, 1))), (box((1, 1, 1)), both)):
        assert collide(moving, fixed, motion, epsilon=0.01).free == ()
    shell = Polyhedron(
        np.vstack([box((3, 3, 3)).vertices, box((2, 2, 2)).vertices]),
        (*box((3, 3, 3)).faces, *(f[::-1] + 8 for f in box((2, 2, 2)).faces)),
    )
    # In the cavity of a hollow solid there is room.
    assert shell.watertight
    assert collide(near, shell, motion, epsilon=0.01).free == ((0.0, 1.0),)


# Tangency


@pytest.mark.parametrize('ulps', [-1, 0, 1])
def test_touching_is_not_free(ulps):
    """A box slides along a plate, in contact, or one unit of rounding above or in it."""
    height = 0.25 + ulps * 2.0**-54
    path = [[0.1 * k - 0.4, 0.03 * k, height] for k in range(9)]
    motion = rational_curve(STILL, path)
    found = collide(box((0.25, 0.25, 0.25)), grid(2), motion, epsilon=0.05, max_depth=12)
    assert found.free == ()


def test_rounding_of_images():
    """A corner is computed to stand on a plate; where it is in it, exactly, nothing is free."""
    rng = np.random.default_rng(23)
    far = 1000.0
    plate = Polyhedron(8.0 * grid(1).vertices + [0, 0, far], grid(1).faces)
    met = 0
    for _ in range(150):
        # Its faces fill their boxes, so that planes decide, to the last bits.
        moving = box(rng.uniform(0.1, 0.5, 3))
        P = np.column_stack([np.linalg.qr(rng.normal(size=(3, 3)))[0], np.zeros(3)])
        P[2, 3] = far - (moving.vertices @ P[2, :3]).min()
        still = RationalCurve(np.tile(P, (3, 1, 1)), rng.uniform(0.5, 2.0, 3))
        if in_contact(moving, plate, still, Fraction(1, 2)):
            met += 1
            assert collide(moving, plate, still, epsilon=1e-9, max_depth=2).free == ()
    assert met > 30


@pytest.mark.parametrize('scale', [1e-6, 1.0, 1e6])
def test_clearance(scale):
    """A gap that is constant is free for all clearances below it, and for none that is not."""
    path = scale * np.array([[0.1 * k - 0.4, 0.03 * k, 0.5] for k in range(9)])
    motion = rational_curve(STILL, path)
    moving, fixed = scaled(box((0.25, 0.25, 0.25)), scale), scaled(grid(2), scale)
    for clearance, free in ((0.2, True), (0.24, True), (0.25, False), (0.3, False)):
        found = collide(
            moving, fixed, motion, epsilon=1e-3 * scale, clearance=clearance * scale, max_depth=16
        )
        assert (found.free == ((0.0, 1.0),)) == free
        assert free or found.free == ()


class Inexact(RationalCurve):
    """A motion with errors."""

    error = 0.0
    inflation = 0.0
    turn_error = 0.0


@pytest.mark.parametrize('name', ['error', 'inflation', 'turn_error'])
def test_errors_of_the_motion_are_added(name):
    path = [[0.1 * k - 0.4, 0.03 * k, 0.5] for k in range(9)]
    exact = rational_curve(STILL, path)
    motion = Inexact(exact.control_points, exact.weights)
    asked = {'moving': box((0.25, 0.25, 0.25)), 'fixed': grid(2), 'epsilon': 1e-3}
    for value, free in ((0.2, True), (0.7, False)):
        setattr(motion, name, value)
        assert (collide(motion=motion, **asked).free == ((0.0, 1.0),)) == free
    setattr(motion, name, -1.0)
    with pytest.raises(RequestError, match=name):
        collide(motion=motion, **asked)


# The search


@pytest.mark.parametrize('seed', range(4))
def test_plain_listing_agrees_and_tests_more(seed):
    """What the hierarchy calls free the plain listing does, up to the order of the tests."""
    rng = np.random.default_rng(seed)
    quaternions = [1, 0, 0, 0] + 0.1 * np.cumsum(rng.normal(size=(5, 4)), axis=0)
    path = np.array([[0.2 * k - 0.8, 0.1 * np.sin(k), 0.03 * (k - 4) ** 2] for k in range(9)])
    for n in (1, 2, 3):
        for height in (0.1, 0.45, 0.9):
            motion = rational_curve(quaternions, path + [0, 0, height])
            pair = pair_of(grid(n), grid(n))
            tree = collisions(pair, motion, epsilon=0.014)
            plain = collisions(pair, motion, epsilon=0.014, hierarchy=False)
            check_partition(tree)
            check_partition(plain)
            assert tree.polygon_tests <= plain.polygon_tests
            assert tree.polygon_pairs == plain.polygon_pairs == n**4
            assert tree.tests_of.sum() == tree.polygon_tests
            assert plain.node_tests == 0
            free = [sum(b - a for a, b in x.free) for x in (tree, plain)]
            assert free[0] == pytest.approx(free[1], abs=0.1)


def test_answers_do_not_depend_on_threads():
    rng = np.random.default_rng(2)
    pair = pair_of(grid(6), box((0.4, 0.3, 0.2)))
    motion = shifted(random_curve(rng, turn=0.5), [0.1, 0.0, 0.2])
    one, *more = (collisions(pair, motion, epsilon=0.01, threads=n) for n in (1, 2, 5))
    assert one.suspect
    assert one.free
    for other in more:
        assert (one.free, one.suspect) == (other.free, other.suspect)
        assert (one.polygon_tests, one.node_tests) == (other.polygon_tests, other.node_tests)


def test_budget_depth_and_stop():
    """What is left over is suspect, what was proved stays; nothing is free that was not."""
    moving, fixed = grid(4), grid(4)
    path = np.array([[0.2 * k - 0.8, 0.1 * np.sin(k), 0.05] for k in range(9)])
    motion = rational_curve([[1, 0.1 * k, 0.05 * k, 0.1] for k in range(5)], path)
    whole = collide(moving, fixed, motion, epsilon=0.01)
    assert whole.suspect
    for hierarchy in (True, False):
        for tests in (1, 20, 300):
            some = collide(
                moving, fixed, motion, epsilon=0.01, max_tests=tests, hierarchy=hierarchy
            )
            check_partition(some)
            assert Why.BUDGET in {s.why for s in some.suspect}
    shallow = collide(moving, fixed, motion, epsilon=0.01, max_depth=2)
    check_partition(shallow)
    assert {s.why for s in shallow.suspect} == {Why.DEPTH}
    assert shallow.depth <= 2
    stopped = collide(moving, fixed, motion, epsilon=0.01, stop=np.ones(1, np.int64))
    assert stopped.free == ()
    assert {s.why for s in stopped.suspect} == {Why.STOPPED}
    assert stopped.suspect[0].place is None


def test_given_moments():
    """The distribution for all may be given; which one is a question of speed only."""
    pair = grid(2), box((0.2, 0.2, 0.2))
    motion = rational_curve(STILL, [[0.2 * k - 0.8, 0, 0.3] for k in range(9)])
    points = np.column_stack([np.random.default_rng(1).normal(size=(5, 3)), np.ones(5)])
    given = collide(*pair, motion, epsilon=0.02, individual=False, moments=points.T @ points)
    assert given.free == ((0.0, 1.0),)
    # Masses in a point make large balls, and nothing free that is not.
    points[:, :3] = 0.0
    lumped = collide(
        *pair,
        shifted(motion, [0, 0, -0.15]),
        epsilon=0.02,
        individual=False,
        moments=points.T @ points,
        max_depth=10,
    )
    assert not is_free(lumped, 0.5)
    with pytest.raises(RequestError, match='individual'):
        pair_of(*pair, moments=np.eye(4))
    with pytest.raises(RequestError, match='moments'):
        pair_of(*pair, individual=False, moments=np.full((4, 4), np.nan))


def test_flat_and_needle_faces():
    """Triangles without area, and faces a million times as long as wide, are no special case."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0, 0], [0, 1e-6, 0.0]])
    thin = Polyhedron(points, (np.array([0, 2, 1]), np.array([0, 1, 3])))
    for height, free in ((0.05, True), (0.0, False)):
        motion = rational_curve(STILL, [[0.05 * k - 0.2, 0.1, height] for k in range(9)])
        found = collide(thin, grid(3), motion, epsilon=1e-3, max_depth=14)
        assert (found.free == ((0.0, 1.0),)) == free


# Refusals


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        ({'epsilon': 0.0}, 'epsilon'),
        ({'epsilon': np.nan}, 'epsilon'),
        ({'clearance': -1.0}, 'clearance'),
        ({'clearance': np.nan}, 'clearance'),
        ({'max_depth': -1}, 'max_depth'),
        ({'max_depth': 49}, 'max_depth'),
        ({'max_tests': 0}, 'max_tests'),
        ({'threads': 0}, 'threads'),
        ({'motion': RationalCurve(np.full((2, 3, 4), np.nan), np.ones(2))}, 'control_points'),
        ({'motion': RationalCurve(np.full((2, 3, 4), 1e10), np.ones(2))}, 'control_points'),
        ({'motion': RationalCurve(np.zeros((2, 12)), np.ones(2))}, 'control_points'),
        ({'motion': RationalCurve(np.zeros((2, 3, 4)), np.ones(3))}, 'weights'),
        ({'motion': RationalCurve(np.zeros((2, 3, 4)), np.array([1.0, -1.0]))}, 'weights'),
        ({'motion': RationalCurve(np.zeros((2, 3, 4)), np.array([1.0, np.nan]))}, 'weights'),
        ({'motion': RationalCurve(np.zeros((2, 3, 4)), np.array([1.0, 1e-300]))}, 'weights'),
    ],
)
def test_refused(change, message):
    asked = {'motion': rational_curve(STILL, np.ones((9, 3))), 'epsilon': 0.1}
    with pytest.raises(RequestError, match=message):
        collide(grid(1), grid(1), **{**asked, **change})


@pytest.mark.parametrize('solid_moves', [True, False])
def test_a_sheet_inside_a_solid_is_not_free(solid_moves):
    """A surface that is not closed has no inside, but it may be inside."""
    sheet, solid = scaled(grid(2), 0.2), box((1.0, 1.0, 1.0))
    motion = rational_curve(STILL, [[0.01 * k, 0.0, 0.0] for k in range(9)])
    pair = (solid, sheet) if solid_moves else (sheet, solid)
    found = collide(*pair, motion, epsilon=0.01)
    assert found.free == ()
    assert found.suspect[0].why is Why.CONTAINED
    away = collide(*pair, shifted(motion, [5.0, 0.0, 0.0]), epsilon=0.01)
    assert away.free == ((0.0, 1.0),)
