"""Points proved outside closed surfaces: never one that is inside or on the surface."""

from exact_contact import exact, winds_round
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from trajectory_guard.winding import surely_outside


def hull(points):
    """Return the triangles of a convex hull, counter-clockwise seen from outside."""
    found = ConvexHull(points)
    triangles = found.simplices.astype(np.int64)
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    turned = np.einsum('ij,ij->i', normal, found.equations[:, :3]) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return triangles


@pytest.mark.parametrize('scale', [1e-6, 1.0, 1e6])
def test_against_exact_rays(scale):
    rng = np.random.default_rng(1)
    outside = 0
    for _ in range(6):
        points = rng.normal(size=(12, 3)) * scale
        triangles = hull(points)
        for point in rng.normal(size=(30, 3)) * scale:
            told = surely_outside(point[None], points, triangles)
            assert told != winds_round(exact(point), exact(points), triangles)
            # Turned inside out it winds the other way, and as often.
            assert told == surely_outside(point[None], points, triangles[:, ::-1])
            outside += told
    assert 20 < outside < 160


def test_on_the_surface_is_not_outside():
    rng = np.random.default_rng(2)
    # Small whole numbers, so that the means are exact.
    points = rng.integers(-40, 40, (12, 3)).astype(float)
    triangles = hull(points)
    corners = points[triangles]
    for weights in ([1, 0, 0], [0.5, 0.5, 0], [0.25, 0.25, 0.5]):
        for point in np.einsum('i,tij->tj', weights, corners):
            assert not surely_outside(point[None], points, triangles)


def test_every_point_counts():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    triangles = hull(points)
    within, without = [0.1, 0.1, 0.1], [0.9, 0.9, 0.9]
    assert surely_outside(np.array([without]), points, triangles)
    assert not surely_outside(np.array([without, within]), points, triangles)
    assert not surely_outside(np.array([[np.nan, 0.1, 0.1]]), points, triangles)
