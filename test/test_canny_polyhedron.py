"""Convex polyhedra: exact hulls, and what is refused."""

from fractions import Fraction
import itertools

from canny_judge import cross, dot, minus
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from trajectory_guard.canny import ConvexPolyhedron
from trajectory_guard.errors import Reason, RequestError


def exact(body):
    """Return the vertices as fractions."""
    return [[Fraction(x) for x in p] for p in body.vertices.tolist()]


def check_hull(body, cloud):
    """Every point of a cloud lies below every face, and faces turn counter-clockwise."""
    points, rest = exact(body), [[Fraction(x) for x in p] for p in np.asarray(cloud).tolist()]
    for face in body.faces:
        a, b, c = (points[i] for i in face[:3])
        normal = cross(minus(b, a), minus(c, a))
        assert any(normal)
        assert all(dot(normal, minus(p, a)) <= 0 for p in rest)
        assert all(dot(normal, minus(points[i], a)) == 0 for i in face)
    directed = [e for face in body.faces for e in zip(face, face[1:] + face[:1], strict=True)]
    assert len(set(directed)) == len(directed) == 2 * len(body.edges)
    assert {e[::-1] for e in directed} == set(directed)


def test_box():
    body = ConvexPolyhedron.box([-1.0, -2.0, -3.0], [4.0, 5.0, 6.0])
    assert (len(body.vertices), len(body.edges), len(body.faces)) == (8, 12, 6)
    check_hull(body, body.vertices)


@pytest.mark.parametrize('seed', range(6))
def test_hull_of_random_points(seed):
    cloud = np.random.default_rng(seed).normal(size=(30, 3))
    body = ConvexPolyhedron.hull(cloud)
    check_hull(body, cloud)
    assert len(body.vertices) == len(ConvexHull(cloud).vertices)


def test_hull_of_a_grid_has_plane_faces():
    """Points in faces, in edges and inside are no vertices; equal ones count once."""
    grid = np.array(list(itertools.product([0.0, 1.0, 2.0], repeat=3)))
    body = ConvexPolyhedron.hull(np.concatenate((grid, grid)))
    assert (len(body.vertices), len(body.edges), len(body.faces)) == (8, 12, 6)


@pytest.mark.parametrize('seed', range(4))
def test_hull_of_nearly_plane_faces(seed):
    """A turned and rounded box has faces that are plane only to rounding."""
    rng = np.random.default_rng(seed)
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    cloud = ConvexPolyhedron.box([-1.0] * 3, [1.0] * 3).vertices @ R.T
    body = ConvexPolyhedron.hull(cloud)
    check_hull(body, cloud)
    assert len(body.vertices) == 8


def test_edges_know_their_faces():
    body = ConvexPolyhedron.hull(np.random.default_rng(3).normal(size=(12, 3)))
    for f, edges in enumerate(body.face_edges):
        around = []
        for k, way in edges:
            tail, head = body.edges[k][::way]
            assert body.edge_faces[k][0 if way > 0 else 1] == f
            around.append((tail, head))
        face = body.faces[f]
        assert around == list(zip(face, face[1:] + face[:1], strict=True))


TETRAHEDRON = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


@pytest.mark.parametrize(
    ('vertices', 'faces', 'words'),
    [
        (TETRAHEDRON, FACES[:3], 'no face on its other side'),
        (TETRAHEDRON, tuple(face[::-1] for face in FACES), 'lies outside'),
        (TETRAHEDRON, ((0, 2, 9), *FACES[1:]), 'indices of vertices'),
        (TETRAHEDRON, (*FACES, FACES[0]), 'already bounded'),
        ([*TETRAHEDRON, [0.1, 0.1, 0.1]], FACES, 'close one surface'),
        ([*TETRAHEDRON[:3], [np.nan, 0.0, 1.0]], FACES, 'not finite'),
        ([*TETRAHEDRON[:3], [0.0, 0.0, 1e10]], FACES, 'exceeds'),
        (TETRAHEDRON[:3], FACES, r'shape \(3, 3\)'),
        (
            [[0, 0, 0], [1, 0, 0], [1, 1, 1e-9], [0, 1, 0], [0, 0, 1]],
            ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
            'plane polygon',
        ),
    ],
)
def test_what_is_refused(vertices, faces, words):
    with pytest.raises(RequestError, match=words) as caught:
        ConvexPolyhedron(np.array(vertices, float), faces)
    assert caught.value.reason == Reason.INVALID_PARAMETER


@pytest.mark.parametrize('points', [np.eye(3), np.eye(4)[:, :3] * [1, 1, 0], np.ones((5, 3))])
def test_flat_clouds_are_refused(points):
    with pytest.raises(RequestError):
        ConvexPolyhedron.hull(points)


def test_a_star_is_no_face():
    """Corners that all turn left, but twice around."""
    angles = 2 * np.pi * np.arange(5) / 5
    ring = np.round(1000 * np.column_stack((np.cos(angles), np.sin(angles), 0 * angles)))
    points = np.concatenate((ring, [[0, 0, 5]]))
    body = ConvexPolyhedron.hull(points)
    bottom = next(face for face in body.faces if len(face) == 5)
    sides = [face for face in body.faces if len(face) == 3]
    with pytest.raises(RequestError):
        ConvexPolyhedron(body.vertices, (*sides, bottom[::2] + bottom[1::2]))
