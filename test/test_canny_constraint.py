"""Constraints A, B and C against exact geometry."""

from fractions import Fraction
import itertools

from canny_judge import bezier, cross, dot, minus, placed, random_body, random_curve, random_motion
from flint import fmpq
import numpy as np
import pytest

from trajectory_guard.canny import Configuration, ConvexPolyhedron, Motion, still, straight
from trajectory_guard.canny.constraint import constraint_a, constraint_b, constraint_c, features
from trajectory_guard.canny.integers import exponent
from trajectory_guard.canny.relative import degree, relative_basis

BOX = ConvexPolyhedron.box([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0])


def values(a, motion_a, b, motion_b, s):
    """Return the values of all constraints at s by the basis, exactly, by kind."""
    k = exponent(a.vertices, b.vertices, motion_a.positions, motion_b.positions)
    basis = relative_basis(motion_a, motion_b, k)
    assert all(f.degree() <= degree(motion_a, motion_b) for f in basis)
    s = fmpq(Fraction(s).numerator, Fraction(s).denominator)
    at = [f(s) for f in basis]
    of_a, of_b = features(a, k), features(b, k)

    def value(row):
        return sum(c * x for c, x in zip(row, at, strict=True))

    return {
        'A': [[value(constraint_a(n, p)) for p in of_b.points] for n in of_a.planes],
        'B': [[value(constraint_b(p, n)) for n in of_b.planes] for p in of_a.points],
        'C': [[value(constraint_c(e, g)) for g in of_b.lines] for e in of_a.lines],
    }


def truth(a, motion_a, b, motion_b, s):
    """Return the same by placing both bodies."""
    p, q = placed(a, motion_a, s), placed(b, motion_b, s)

    def height(points, face, x):
        o, u, v = (points[i] for i in face[:3])
        return dot(cross(minus(u, o), minus(v, o)), minus(x, o))

    def passing(edge, other):
        (t, h), (o, u) = [p[i] for i in edge], [q[i] for i in other]
        return dot(cross(minus(h, t), minus(u, o)), minus(t, o))

    return {
        'A': [[height(p, f, x) for x in q] for f in a.faces],
        'B': [[height(q, f, x) for f in b.faces] for x in p],
        'C': [[passing(e, g) for g in b.edges.tolist()] for e in a.edges.tolist()],
    }


def check(a, motion_a, b, motion_b, s):
    found, wanted = values(a, motion_a, b, motion_b, s), truth(a, motion_a, b, motion_b, s)
    for kind, rows in found.items():
        for row, right in zip(rows, wanted[kind], strict=True):
            for x, y in zip(row, right, strict=True):
                assert (x > 0) - (x < 0) == (y > 0) - (y < 0), kind


@pytest.mark.parametrize('seed', range(6))
@pytest.mark.parametrize('kinds', [('box', 'hull'), ('tetrahedron', 'box')])
def test_signs_at_random_placements(seed, kinds):
    """Lines and curves, one mover and two."""
    rng = np.random.default_rng(seed)
    a, b = (random_body(rng, kind) for kind in kinds)
    other = still() if seed % 2 else random_motion(rng)
    motion = random_motion(rng) if seed < 4 else random_curve(rng, 3, 2)
    check(a, motion, b, other, Fraction(int(rng.integers(0, 100)), 99))


# Vertex on face, edge in face, coplanar faces, shared edge, shared vertex, parallel edges, inside.
PLACES = [(2, 0, 0), (1.5, 0.5, 0), (2, 2, 0), (2, 2, 2), (0.5, 0, 0), (3, 0, 0), (0, 0, 0)]


@pytest.mark.parametrize('place', PLACES)
@pytest.mark.parametrize(
    'turn', [(1, 0, 0, 0), (1, 1, 0, 0), (1, 1, 1, 1), (0, 1, 0, 0), (3, 1, 0, 0)]
)
def test_signs_at_degenerate_placements(place, turn):
    """Zeros are zeros: all numbers are exact."""
    check(BOX, still(Configuration(place, turn)), BOX, still(), 0)


def test_values_are_the_heights_of_unit_normals():
    """(6) and (7) for the unit cube at a known place, up to what is positive."""
    found = values(BOX, still(Configuration((3.0, 0.0, 0.0))), BOX, still(), 0)
    # Twice the area 4 of a face: n has length 8.
    heights = sorted({float(x) / 8.0 for row in found['B'] for x in row})
    assert heights == [-5.0, -3.0, -2.0, 0.0, 1.0, 3.0]


@pytest.mark.parametrize('seed', range(4))
def test_length_of_quaternions_does_not_matter(seed):
    """Signs are those of the unit quaternion, for any multiple, negative too."""
    rng = np.random.default_rng(seed)
    a, b = random_body(rng, 'box'), random_body(rng, 'tetrahedron')
    motion = random_motion(rng)
    longer = Motion(motion.positions, motion.quaternions * -12.0)
    for kind, rows in values(a, motion, b, still(), Fraction(1, 3)).items():
        for row, other in zip(
            rows, values(a, longer, b, still(), Fraction(1, 3))[kind], strict=True
        ):
            assert [x > 0 for x in row] == [x > 0 for x in other]
            assert [x < 0 for x in row] == [x < 0 for x in other]


def test_an_edge_that_leaves_through_a_face_has_positive_values():
    """The sign that the paper prints the other way around."""
    needle = ConvexPolyhedron.hull(
        [[0.1, 0.2, -0.5], [0.1, 0.2, 3.0], [0.11, 0.2, -0.5], [0.1, 0.21, -0.5]]
    )
    found = values(needle, still(), BOX, still(), 0)['C']
    (edge,) = (
        i
        for i, (t, h) in enumerate(needle.edges.tolist())
        if needle.vertices[[t, h], :2].tolist() == [[0.1, 0.2]] * 2
    )
    tail, head = needle.vertices[needle.edges[edge]]
    leaves = 1 if head[2] > tail[2] else -1
    (top,) = (j for j, f in enumerate(BOX.faces) if all(BOX.vertices[i][2] == 1.0 for i in f))
    for k, way in BOX.face_edges[top]:
        assert leaves * way * found[edge][k] > 0


def test_one_line_gives_cubics_and_two_give_quintics():
    rng = np.random.default_rng(0)
    assert degree(random_motion(rng), still()) == 3
    assert degree(random_motion(rng), random_motion(rng)) == 5
    k = exponent((m := random_motion(rng)).positions)
    assert max(f.degree() for f in relative_basis(m, still(), k)) == 3


def test_straight_is_the_line_in_q0_1():
    motion = straight(
        Configuration((0, 0, 0), (2, 2, 0, 0)), Configuration((1, 0, 0), (1, 0, 0, 0))
    )
    assert bezier(motion.quaternions, Fraction(1, 2)) == [1, Fraction(1, 2), 0, 0]
    # tan(45 deg) = 1: a turn by 90 degrees about x at the start.
    np.testing.assert_allclose(motion.pose(0.0)[:, 1], [0.0, 0.0, 1.0], atol=1e-15)


def test_pose_is_the_quaternion_formula():
    rng = np.random.default_rng(5)
    motion = random_curve(rng, 2, 3)
    for s in (0.0, 0.3, 1.0):
        pose = motion.pose(s)
        for p, exact in zip(BOX.vertices, placed(BOX, motion, s), strict=True):
            np.testing.assert_allclose(pose[:, :3] @ p + pose[:, 3], [float(x) for x in exact])


def test_all_kinds_of_pairs_have_been_zero():
    """The degenerate placements do meet zeros of every type, or they would test nothing."""
    met = set()
    for place, turn in itertools.product(PLACES, [(1, 0, 0, 0), (1, 1, 1, 1)]):
        found = values(BOX, still(Configuration(place, turn)), BOX, still(), 0)
        met |= {kind for kind, rows in found.items() for row in rows for x in row if x == 0}
    assert met == {'A', 'B', 'C'}
