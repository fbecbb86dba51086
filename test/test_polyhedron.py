"""Polyhedral surfaces: what is refused, what is closed, and triangles that cover each face."""

import numpy as np
import pytest

from trajectory_guard.shapes.polyhedron import Polyhedron

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
SIDES = (
    [0, 1, 3, 2],
    [4, 6, 7, 5],
    [0, 4, 5, 1],
    [2, 3, 7, 6],
    [0, 2, 6, 4],
    [1, 5, 7, 3],
)


def faces(*rings):
    return tuple(np.array(ring) for ring in rings)


def area(points, rings):
    """Return the vector area of closed rings of points, (3,)."""
    return sum(
        0.5 * np.cross(points[ring], points[np.roll(ring, -1)]).sum(axis=0) for ring in rings
    )


def test_closed_surface():
    cube = Polyhedron(CUBE, faces(*SIDES))
    assert cube.watertight
    assert len(cube.edges) == 12
    assert len(cube.triangles) == 12
    volume = np.einsum('ij,ij->', cube.vertices[cube.triangles[:, 0]], np.cross(*_sides(cube)))
    assert volume / 6.0 == pytest.approx(1.0)


def _sides(polyhedron):
    corners = polyhedron.vertices[polyhedron.triangles]
    return corners[:, 1], corners[:, 2]


@pytest.mark.parametrize(
    'rings',
    [
        SIDES[:5],
        (*SIDES, SIDES[0]),
        (*SIDES[:5], SIDES[5][::-1]),
    ],
    ids=['open', 'doubled', 'turned'],
)
def test_surfaces_that_bound_nothing(rings):
    assert not Polyhedron(CUBE, faces(*rings)).watertight


@pytest.mark.parametrize('seed', range(20))
def test_triangles_cover_a_polygon(seed):
    """Star-shaped polygons in any plane: areas are positive and add up, corners stay in order."""
    rng = np.random.default_rng(seed)
    k = int(rng.integers(4, 12))
    angle = np.sort(rng.uniform(0, 2 * np.pi, k)) * 0.1 + np.arange(k) * 2 * np.pi / k * 0.9
    radius = rng.uniform(0.1, 1.0, k)
    flat = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    points = flat @ turn.T + rng.normal(size=3)
    polygon = Polyhedron(points, (np.arange(k),))
    normal = turn[:, 2]
    parts = [area(points, [t]) @ normal for t in polygon.triangles]
    whole = area(points, [np.arange(k)]) @ normal
    assert min(parts) >= -1e-15
    assert sum(parts) == pytest.approx(whole)
    # Points of the polygon and only they are in a triangle.
    for x in rng.uniform(-1, 1, (200, 2)):
        inside = _winds(flat[:, :2], x)
        held = [_winds(flat[t, :2], x) for t in polygon.triangles]
        assert sum(held) == inside


def _winds(ring, x):
    """Say whether a polygon of the plane contains a point (crossings of a ray)."""
    a, b = ring, np.roll(ring, -1, axis=0)
    crosses = (a[:, 1] > x[1]) != (b[:, 1] > x[1])
    rise = np.where(crosses, b[:, 1] - a[:, 1], 1.0)
    at = a[:, 0] + (x[1] - a[:, 1]) * (b[:, 0] - a[:, 0]) / rise
    return int((crosses & (at > x[0])).sum() % 2)


def test_corners_on_a_line():
    """A corner inside a side is part of a polygon, and the ears go round it."""
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 2, 0], [1, 2, 0], [0, 2, 0.0]])
    for first in range(6):
        polygon = Polyhedron(points, (np.roll(np.arange(6), first),))
        parts = [area(points, [t])[2] for t in polygon.triangles]
        assert min(parts) >= 0.0
        assert sum(parts) == pytest.approx(4.0)


SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]


@pytest.mark.parametrize(
    ('points', 'rings', 'message'),
    [
        (SQUARE, (), 'at least one face'),
        (SQUARE, ([0, 1],), 'face 0 must have three'),
        (SQUARE, ([0, 1, 2], [0, 1, 4]), 'face 1 names vertex 4'),
        (SQUARE, ([0, 1, -1],), 'face 0 names vertex -1'),
        (SQUARE, ([0, 1, 2, 1],), 'corner 1 twice'),
        (SQUARE, ([0, 2, 1, 3],), 'no area'),
        ([*SQUARE[:3], [0, 1, 0.1]], ([0, 1, 2, 3],), 'not planar'),
        ([[0, 0, 0], [4, 0, 0], [4, 1, 0], [1, 3, 0], [3, 3, 0.0]], (range(5),), 'not simple'),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0.0]], ([0, 1, 2, 3],), 'no area'),
        ([*SQUARE[:3], [0, 1, np.nan]], ([0, 1, 2],), 'not finite'),
        ([*SQUARE[:3], [0, 1, 1e10]], ([0, 1, 2],), 'exceeds'),
        ([[0, 0]], ([0, 0, 0],), 'shape'),
    ],
)
def test_refused(points, rings, message):
    with pytest.raises(ValueError, match=message):
        Polyhedron(np.array(points), faces(*rings))


def test_soup_is_merged_and_nothing_is_lost():
    """Corners of a soup are one vertex; a segment on a side goes, a flat triangle stays."""
    cube = Polyhedron(CUBE, faces(*SIDES))
    soup = cube.vertices[cube.triangles].reshape(-1, 3)
    rows = np.arange(36).reshape(-1, 3)
    merged = Polyhedron.from_triangles(soup, rows)
    assert merged.watertight
    assert len(merged.vertices) == 8
    again = Polyhedron.from_triangles(soup, [*rows.tolist(), [0, 0, 1], [1, 1, 1]])
    assert len(again.faces) == 12
    # A flat triangle closes a T-junction.
    points = [[0, 0, 0], [2, 0, 0], [1, 0, 0], [1, 1, 0], [1, -1, 0], [1, 0, 1.0]]
    flat = Polyhedron.from_triangles(points, [[0, 1, 2], [0, 3, 1]])
    assert len(flat.faces) == 2


def test_soup_refused():
    with pytest.raises(ValueError, match='triangle 1 is no more than a segment'):
        Polyhedron.from_triangles([*SQUARE, [5, 5, 5.0]], [[0, 1, 2], [0, 4, 4]])
    with pytest.raises(ValueError, match='outside'):
        Polyhedron.from_triangles(SQUARE, [[0, 1, 4]])
    with pytest.raises(ValueError, match='not finite'):
        Polyhedron.from_triangles([[0, 0, np.inf], *SQUARE], [[0, 1, 2]])


def test_arrays_are_read_only():
    cube = Polyhedron(CUBE, faces(*SIDES))
    for array in (cube.vertices, cube.edges, cube.triangles, *cube.faces):
        with pytest.raises(ValueError, match='read-only'):
            array[0] = 0
