"""Primitive bodies are exact, and their inscribed polytopes are inside."""

from collections.abc import Callable
import math

import numpy as np
import pytest
from scipy.spatial import HalfspaceIntersection

from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.shapes.body import ConvexBody
from trajectory_guard.shapes.primitive import Box, Cylinder, Sphere, sphere_directions

SHAPES = [
    Box((0.2, 3.0, 0.01)),
    Cylinder(0.3, 2.0),
    Cylinder(2.0, 0.01),
    Sphere(0.7),
    Sphere(1e-6),
    Box((1e6, 1e6, 1e6)),
]


def support(body: ConvexBody, n: np.ndarray) -> np.ndarray:
    """Return the support of a body in unit directions, (k,)."""
    across = np.linalg.norm(np.cross(n, body.disc_axis), axis=1)
    return (body.vertices @ n.T).max(axis=0) + body.ball + body.disc_radius * across


def true_support(shape: Box | Cylinder | Sphere, n: np.ndarray) -> np.ndarray:
    match shape:
        case Box(size):
            return np.abs(n) @ (np.array(size) / 2)
        case Cylinder(radius, length):
            return np.abs(n[:, 2]) * length / 2 + radius * np.hypot(n[:, 0], n[:, 1])
        case Sphere(radius):
            return np.full(len(n), radius)


def surface(shape: Box | Cylinder | Sphere, rng: np.random.Generator) -> np.ndarray:
    """Return points of the solid, most on its surface, (k, 3)."""
    x = rng.uniform(-1.0, 1.0, size=(4000, 3))
    match shape:
        case Box(size):
            return np.clip(2.0 * x, -1.0, 1.0) * np.array(size) / 2
        case Cylinder(radius, length):
            x[:, :2] /= np.maximum(np.hypot(x[:, 0], x[:, 1]), 0.5)[:, None]
            x[:, :2] /= np.maximum(np.hypot(x[:, 0], x[:, 1]), 1.0)[:, None]
            return np.clip(2.0 * x, [-2, -2, -1], [2, 2, 1]) * [radius / 2, radius / 2, length / 2]
        case Sphere(radius):
            return x / np.linalg.norm(x, axis=1, keepdims=True) * radius


@pytest.mark.parametrize('shape', SHAPES, ids=str)
def test_the_body_is_the_primitive(shape: Box | Cylinder | Sphere) -> None:
    rng = np.random.default_rng(1)
    n = np.concatenate((rng.normal(size=(300, 3)), np.eye(3), -np.eye(3)))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    body = shape.load().body
    mine, true = support(body, n), true_support(shape, n)
    scale = true.max()
    assert np.abs(mine - true).max() <= 4e-16 * scale
    assert (surface(shape, rng) @ n.T).max(axis=0).max() <= scale * (1 + 1e-15)
    assert ((surface(shape, rng) @ n.T).max(axis=0) <= mine + 4e-16 * scale).all()


@pytest.mark.parametrize('shape', SHAPES, ids=str)
def test_the_polytope_is_inside_the_primitive_and_fills_it(
    shape: Box | Cylinder | Sphere,
) -> None:
    faces = shape.load().body.faces
    size = true_support(shape, np.eye(3))
    # Scaled to a unit body, so that qhull is exact enough.
    scaled = faces * [*size, 1.0]
    corners = HalfspaceIntersection(scaled * [1, 1, 1, -1], np.zeros(3)).intersections * size
    rng = np.random.default_rng(2)
    n = rng.normal(size=(300, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    reach = (corners @ n.T).max(axis=0)
    assert (reach <= true_support(shape, n) * (1 + 1e-12)).all()
    assert (reach >= 0.98 * true_support(shape, n)).all()
    assert np.abs(np.linalg.norm(faces[:, :3], axis=1) - 1.0).max() < 4.5e-16


def test_the_directions_of_the_sphere_leave_no_gap() -> None:
    directions, inradius = sphere_directions()
    x = np.random.default_rng(3).normal(size=(20000, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    assert (x @ directions.T).max(axis=1).min() >= inradius > 0.98


@pytest.mark.parametrize('value', [0.0, -1.0, math.nan, math.inf, 1e10])
@pytest.mark.parametrize(
    ('make', 'named'),
    [
        (lambda value: Box((1.0, value, 1.0)), 'box size'),
        (lambda value: Cylinder(value, 1.0), 'cylinder radius'),
        (lambda value: Cylinder(1.0, value), 'cylinder length'),
        (Sphere, 'sphere radius'),
    ],
)
def test_sizes_that_are_no_lengths_are_refused(
    make: Callable[[float], object], named: str, value: float
) -> None:
    with pytest.raises(RobotError, match=named) as caught:
        make(value)
    assert caught.value.reason is Reason.ROBOT_INVALID
    assert repr(value) in str(caught.value)
