"""Spans of overlap against exact separating axes, and the degenerate cases one by one."""

from fractions import Fraction

from canny_judge import (
    apart,
    inside,
    moved_scaled,
    random_body,
    random_curve,
    random_motion,
    scaled,
)
import numpy as np
import pytest

from trajectory_guard.canny import (
    conditions,
    Configuration,
    ConvexPolyhedron,
    Kind,
    Motion,
    Mover,
    overlaps,
    pairwise,
    recentred,
    still,
    straight,
)
from trajectory_guard.canny.overlap import constraints, exact_overlaps
from trajectory_guard.canny.transitions import runs

BOX = ConvexPolyhedron.box([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0])
SMALL = ConvexPolyhedron.box([-0.25, -0.25, -0.25], [0.25, 0.25, 0.25])
SAMPLES = 16


def line(start, end, turn=(1, 0, 0, 0)):
    """Return a translation."""
    return straight(Configuration(start, turn), Configuration(end, turn))


def ends(found):
    """Return the spans as numbers."""
    return [(float(one.start), float(one.end)) for one in found]


def check(a, motion_a, b, motion_b, samples=SAMPLES):
    """Dense exact samples agree with the spans; just outside of an end the bodies are apart."""
    found = exact_overlaps([a], motion_a, [b], motion_b, [(0, 0)])
    for i in range(samples + 1):
        s = Fraction(i, samples)
        known = inside(found, s)
        assert known is None or known != apart(a, motion_a, b, motion_b, s), s
    for one in found:
        for s, inner in (
            (one.start.lower, one.start.lower == one.start.upper),
            (one.start.upper, True),
            (one.end.lower, True),
            (one.end.upper, one.end.lower == one.end.upper),
        ):
            if one.start.upper <= one.end.lower:
                assert apart(a, motion_a, b, motion_b, s) != inner
    return found


@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize(
    'kinds', [('box', 'box'), ('tetrahedron', 'box'), ('hull', 'tetrahedron')]
)
def test_random_lines(seed, kinds):
    rng = np.random.default_rng(seed)
    a, b = (random_body(rng, kind) for kind in kinds)
    check(a, random_motion(rng, 1.0), b, still())


@pytest.mark.parametrize('seed', range(3))
def test_two_movers(seed):
    rng = np.random.default_rng(seed)
    a, b = (random_body(rng, kind) for kind in ('box', 'tetrahedron'))
    check(a, random_motion(rng, 1.0), b, random_motion(rng, 1.0))


@pytest.mark.parametrize('seed', range(3))
def test_curves(seed):
    rng = np.random.default_rng(seed)
    a, b = (random_body(rng, kind) for kind in ('tetrahedron', 'box'))
    check(a, random_curve(rng, 3, 2), b, still())


def test_the_random_cases_do_overlap():
    rng = np.random.default_rng(0)
    counts = [len(overlaps([SMALL], random_motion(rng, 1.5), [BOX])) for _ in range(12)]
    assert {0, 1} <= {*counts}


def test_through_a_box():
    """Face to face contact, dyadic: exact ends and all four vertices."""
    (one,) = check(SMALL, line((-2.25, 0, 0), (2.25, 0, 0)), BOX, still())
    assert ends([one]) == [pytest.approx((1 / 4.5, 3.5 / 4.5), abs=1e-15)]
    assert {c.kind for c in one.opening} == {Kind.B}
    assert len(one.opening) == len(one.closing) == 4
    assert all(c.point[0] == pytest.approx(-1.0) for c in one.opening)


def test_wholly_inside_without_any_contact():
    """Vertices inside, no boundary meets; the planning pairs say no more than they should."""
    motion = line((-0.5, 0, 0), (0.5, 0, 0))
    for a, motion_a, b, motion_b in ((SMALL, motion, BOX, still()), (BOX, still(), SMALL, motion)):
        (one,) = check(a, motion_a, b, motion_b)
        assert ends([one]) == [(0.0, 1.0)]
        assert one.opening == one.closing == ()
        _, (table,) = constraints([a], [b], (motion_a, motion_b), [(0, 0)])
        assert conditions.boundaries_meet(table) == ()
        assert bool(conditions.blocked_a(table)) != bool(conditions.blocked_b(table))


def test_vertex_grazes_a_face():
    """A double root: a body turns about a fixed centre and its corner just reaches a face."""
    spear = ConvexPolyhedron.hull([[0, 0, 1.0], [0.1, 0, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0]])
    motion = straight(
        Configuration((0, 0, -2), (1, -1, 0, 0)), Configuration((0, 0, -2), (1, 1, 0, 0))
    )
    (one,) = check(spear, motion, BOX, still())
    assert one.start == one.end
    assert one.start.lower == one.start.upper == Fraction(1, 2)
    (contact,) = one.opening
    assert contact.kind == Kind.B
    assert contact.point == pytest.approx((0.0, 0.0, -1.0))
    # A hair lower, and it does not; a hair higher, and it cuts.
    for shift, count in ((-(2.0**-50), 0), (2.0**-50, 1)):
        off = Motion(motion.positions + [0, 0, shift], motion.quaternions)
        found = check(spear, off, BOX, still())
        assert len(found) == count
        assert all(one.start.upper < one.end.lower for one in found)


def test_edges_graze():
    """Two crossed edges touch in one point at one instant and part again."""
    wedge = ConvexPolyhedron.hull(
        [[-1, 0, 0], [1, 0, 0], [-1, 1, 2], [-1, -1, 2], [1, 1, 2], [1, -1, 2]]
    )
    ridge = ConvexPolyhedron.hull(
        [[0, -1, 0], [0, 1, 0], [1, -1, -2], [-1, -1, -2], [1, 1, -2], [-1, 1, -2]]
    )
    curve = Motion(np.array([[0, 0, 1.0], [0, 0, -1.0], [0, 0, 1.0]]), still().quaternions)
    (one,) = check(wedge, curve, ridge, still())
    assert one.start.lower == one.end.upper == Fraction(1, 2)
    (contact,) = one.opening
    assert contact.kind == Kind.C
    assert contact.point == pytest.approx((0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ('start', 'end', 'wanted'),
    [
        ((2, 0, 0), (2, 5, 0), [(0.0, 0.4)]),  # along a face
        ((2, 2, 0), (2, 2, 5), [(0.0, 0.4)]),  # along an edge
        ((2, 2, -4), (2, 2, 4), [(0.25, 0.75)]),
        ((2, 2, 2), (4, 4, 4), [(0.0, 0.0)]),  # vertex to vertex, and away
        ((-4, 2, 0), (4, 2, 0), [(0.25, 0.75)]),  # coplanar faces slide over each other
        ((-4, 3, 0), (4, 3, 0), []),  # the same planes, apart
        ((-4, 2, 2), (4, 2, 2), [(0.25, 0.75)]),  # shared edges
        ((0, 0, 0), (0, 0, 0), [(0.0, 1.0)]),  # the same body
    ],
)
def test_touching_boxes(start, end, wanted):
    """Equal boxes whose features share planes and lines all the way."""
    found = check(BOX, line(start, end), BOX, still())
    assert ends(found) == wanted
    assert all(one.start.lower == one.start.upper for one in found)
    assert overlaps([BOX], line(start, end), [BOX]) == found


def test_boxes_in_one_plane_but_apart():
    """Every face of one lies in a plane of the other, far away: signs are zero, bodies free."""
    assert overlaps([BOX], line((3, 0, 0), (9, 0, 0)), [BOX]) == ()
    assert overlaps([BOX], line((3, 2, 0), (9, 2, 0)), [BOX]) == ()


def test_coplanar_faces_of_one_body():
    """A face cut in two triangles answers like the whole."""
    faces = [
        *BOX.faces[1:],
        BOX.faces[0][:3],
        BOX.faces[0][2:] + BOX.faces[0][:1],
    ]
    cut = ConvexPolyhedron(BOX.vertices, tuple(faces))
    for start, end in (((-4, 2, 0), (4, 2, 0)), ((-4, 0.5, 0.3), (4, 0.5, 0.1))):
        assert ends(check(BOX, line(start, end), cut, still())) == ends(
            check(BOX, line(start, end), BOX, still())
        )


def test_half_turn():
    """A bar turns by 180 degrees through a post, its rotation recentred in the middle."""
    bar = ConvexPolyhedron.box([0.0, -0.1, -0.1], [3.0, 0.1, 0.1])
    post = ConvexPolyhedron.box([-0.2, 1.8, -1.0], [0.2, 2.2, 1.0])
    quarter = Configuration((0, 0, 0), (1, 0, 0, 1))
    first = recentred(Configuration(), quarter)
    second = recentred(quarter, Configuration((0, 0, 0), (0, 0, 0, 1)))
    (one,), (two,) = check(bar, first, post, still()), check(bar, second, post, still())
    assert ends([one])[0][1] == 1.0
    assert ends([two])[0][0] == 0.0
    assert ends([one])[0][0] == pytest.approx(1.0 - ends([two])[0][1], abs=1e-15)


@pytest.mark.parametrize('exponent', [-20, 20])
@pytest.mark.parametrize('seed', range(3))
def test_size_of_the_world_does_not_matter(seed, exponent):
    """About 1e-6 and 1e6; powers of two keep the numbers, so the answer is the same to the bit."""
    rng = np.random.default_rng(seed)
    a, b, motion = random_body(rng, 'box'), random_body(rng, 'hull'), random_motion(rng, 1.0)
    factor = 2.0**exponent
    found = overlaps([a], motion, [b])
    assert ends(
        overlaps([scaled(a, factor)], moved_scaled(motion, factor), [scaled(b, factor)])
    ) == ends(found)


@pytest.mark.parametrize('factor', [1e-6, 1e6])
def test_size_in_powers_of_ten(factor):
    rng = np.random.default_rng(8)
    a, b = ConvexPolyhedron.hull(rng.normal(size=(6, 3)) * factor), scaled(BOX, factor)
    check(a, moved_scaled(random_motion(rng, 1.0), factor), b, still(), samples=12)


def test_planning_pairs_see_the_first_contact():
    """(i) + (iii), (ii) + (iv), (iii) + (iv) begin when overlap does, if the path starts free."""
    rng = np.random.default_rng(0)
    judged = 0
    for _ in range(12):
        a, b = random_body(rng, 'box'), random_body(rng, 'tetrahedron')
        start = Configuration(rng.normal(size=3) + [3, 0, 0])
        motion = recentred(start, Configuration(0.5 * rng.normal(size=3), rng.normal(size=4)))
        _, (table,) = constraints([a], [b], (motion, still()), [(0, 0)])
        whole = runs(conditions.overlap(table))
        if whole and whole[0][0] > 0:
            judged += 1
            for pair in (conditions.blocked_a, conditions.blocked_b, conditions.boundaries_meet):
                part = runs(pair(table))
                assert part[0][0] == whole[0][0]
                assert all(any(s <= p and q <= e for s, e in whole) for p, q in part)
    assert judged > 5


def test_an_l_is_a_union():
    """The notch of an L is free; the spans of the parts are joined where they meet."""
    l_shape = (
        ConvexPolyhedron.box([0, 0, 0], [3, 1, 1]),
        ConvexPolyhedron.box([0, 1, 0], [1, 3, 1]),
    )
    through_notch = overlaps([SMALL], line((2, 4, 0.5), (2, -4, 0.5)), l_shape)
    assert ends(through_notch) == [pytest.approx((2.75 / 8, 4.25 / 8))]
    down = overlaps([SMALL], line((0.5, 4, 0.5), (0.5, -4, 0.5)), l_shape)
    assert ends(down) == [pytest.approx((0.75 / 8, 4.25 / 8))]
    assert {c.part_b for c in down[0].opening} == {1}
    assert {c.part_b for c in down[0].closing} == {0}


def test_several_movers():
    movers = [
        Mover((SMALL,), line((-2, 0, 0), (2, 0, 0))),
        Mover((SMALL,), line((2, 0, 0), (-2, 0, 0))),
        Mover((SMALL,), line((0, 5, 0), (0, 5, 0))),
    ]
    found = pairwise(movers)
    assert set(found) == {(0, 1), (0, 2), (1, 2)}
    assert ends(found[0, 1]) == [pytest.approx((0.4375, 0.5625))]
    assert found[0, 2] == found[1, 2] == ()


@pytest.mark.parametrize('seed', range(6))
def test_contacts_lie_on_both_bodies(seed):
    """The features named do touch: the point has no height above either body, and one face's 0."""
    rng = np.random.default_rng(seed)
    a, b = random_body(rng, 'box'), random_body(rng, 'hull')
    motions = random_motion(rng, 1.2), random_motion(rng, 1.2)
    for one in overlaps([a], motions[0], [b], motions[1]):
        for moment, contacts in ((one.start, one.opening), (one.end, one.closing)):
            assert bool(contacts) == (0.0 < float(moment) < 1.0)
            for contact in contacts:
                for body, motion in ((a, motions[0]), (b, motions[1])):
                    pose = motion.pose(float(moment))
                    own = pose[:, :3].T @ (np.array(contact.point) - pose[:, 3])
                    assert abs(height(body, own)) < 1e-9


LOG = ConvexPolyhedron.hull([[1, 0, 0], [-1, 0, 0], [0, 1, -1], [0, -1, -1]])
ROOF = ConvexPolyhedron.hull([[0, 1, 0], [0, -1, 0], [1, 0, 1], [-1, 0, 1]])


@pytest.mark.parametrize('factor', [1.0, 1e-60, 1e-90, 1e-200, 1e-300, 1e8])
def test_crossing_edges_touch_in_a_point_at_every_size(factor):
    a, b = scaled(LOG, factor), scaled(ROOF, factor)
    start, end = ((0.125 * factor, 0.25 * factor, z * factor) for z in (-1, 1))
    (one,) = overlaps([a], line(start, end), [b])
    (contact,) = one.opening
    assert contact.kind == Kind.C
    assert np.array(contact.point) / factor == pytest.approx([0, 0.25, 0], abs=1e-12)


@pytest.mark.parametrize('tilt', [1e-20, 1e-200, 5e-324])
def test_edges_that_cross_within_rounding_of_parallel_touch_in_a_point_of_both(tilt):
    """The lower edge runs from x = 0 to 2, the upper one from -1 to 1."""
    tilted = ConvexPolyhedron.hull([[2, tilt, 0], [0, -tilt, 0], [1, 1, -1], [1, -1, -1]])
    upper = ConvexPolyhedron.hull([[1, 0, 0], [-1, 0, 0], [0, 1, 1], [0, -1, 1]])
    (one,) = overlaps([tilted], line((-0.25, 0, -1), (-0.25, 0, 1)), [upper])
    (x, y, z) = next(c.point for c in one.opening if c.kind == Kind.C)
    assert -0.25 <= x <= 1.0
    assert (y, z) == pytest.approx((0, 0), abs=1e-12)


def test_a_body_smaller_than_rounding_of_its_place_touches_somewhere():
    speck, roof = scaled(LOG, 1e-12), scaled(ROOF, 1e6)
    there = still(Configuration((1e6, 0, 0)))
    (one,) = overlaps([speck], line((1e6, 1e5, -1), (1e6, 1e5, 1)), [roof], there)
    points = [contact.point for contact in one.opening if contact.kind == Kind.C]
    assert points == [pytest.approx((1e6, 1e5, 0))]


def height(body, point):
    """Return the largest height of a point above the planes of a body."""
    highest = -np.inf
    for face in body.faces:
        p = body.vertices[list(face)]
        n = np.cross(p[1] - p[0], p[2] - p[0])
        highest = max(highest, n @ (point - p[0]) / np.linalg.norm(n))
    return highest
