"""Ellipsoids and elliptic cylinders lie between the polytope inside and the polyhedron round."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull, HalfspaceIntersection

from trajectory_guard.shapes.stretched import ellipsoid, elliptic_cylinder

SIZES = [(1.0, 1.0, 1.0), (0.2, 0.5, 3.0), (1e-3, 1.0, 2.0), (1e-6, 1e-6, 5e-7), (1e3, 2e3, 1e3)]


def directions(vertices, count=2000):
    """Return random directions, and the normals of a polyhedron's faces, where it is nearest."""
    rng = np.random.default_rng(0)
    size = np.ptp(vertices, axis=0)
    normals = ConvexHull(vertices / size).equations[:, :3] / size
    found = np.concatenate((rng.normal(size=(count, 3)), rng.normal(size=(count, 3)) / size))
    found = np.concatenate((found, normals))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def corners(faces, size):
    """Return the corners of a polytope round 0."""
    scaled = np.column_stack((faces[:, :3] * size, -faces[:, 3]))
    return HalfspaceIntersection(scaled, np.zeros(3)).intersections * size


def ellipsoid_reach(u, size):
    """Return how far an ellipsoid reaches in each direction."""
    return np.linalg.norm(u * size / 2, axis=1)


def cylinder_reach(u, size):
    """Return how far an elliptic cylinder reaches in each direction."""
    return np.linalg.norm(u[:, :2] * size[:2] / 2, axis=1) + np.abs(u[:, 2]) * size[2] / 2


@pytest.mark.parametrize('size', SIZES)
@pytest.mark.parametrize(
    ('body_of', 'reach', 'excess'),
    [
        (ellipsoid, ellipsoid_reach, 0.0181),
        (lambda size: elliptic_cylinder(size[:2], size[2]), cylinder_reach, 0.009),
    ],
    ids=['ellipsoid', 'cylinder'],
)
def test_the_polyhedron_reaches_as_far_in_every_direction(body_of, reach, excess, size):
    """A convex set lies in another if that reaches as far everywhere; it is little larger."""
    vertices = body_of(size).vertices
    u = directions(vertices)
    inner, outer = reach(u, np.array(size)), (vertices @ u.T).max(axis=0)
    assert (outer >= inner * (1 - 1e-15)).all()
    assert (outer <= inner * (1 + excess) + 1e-12 * max(size)).all()


@pytest.mark.parametrize('size', SIZES)
def test_the_polytopes_lie_inside(size):
    size = np.array(size)
    inside = corners(ellipsoid(tuple(size)).faces, size) * 2 / size
    assert np.linalg.norm(inside, axis=1).max() <= 1.0
    inside = corners(elliptic_cylinder(tuple(size[:2]), size[2]).faces, size) * 2 / size
    assert np.linalg.norm(inside[:, :2], axis=1).max() <= 1.0
    assert np.abs(inside[:, 2]).max() <= 1.0
    # They are no trifles.
    assert np.linalg.norm(inside[:, :2], axis=1).max() > 0.98


def test_what_is_too_thin_for_its_rounding_has_nothing_inside():
    assert len(ellipsoid((1e-12, 1e3, 1e3)).faces) == 0
    assert len(elliptic_cylinder((1e-12, 1e3), 1.0).faces) == 0
