"""The hull contains every point, whatever the program that proposes it does."""

from itertools import product

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

from trajectory_guard.shapes import hull as module
from trajectory_guard.shapes.hull import convex_hull, distance_bound

RNG = np.random.default_rng(7)
BALL = RNG.normal(size=(300, 3))
SPHERE = BALL / np.linalg.norm(BALL, axis=1, keepdims=True)
GRID = np.array(list(product(np.linspace(-1.0, 1.0, 5), repeat=3)))
TURN = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
CLOUDS = {
    'ball': BALL,
    'sphere': SPHERE,
    'grid': GRID,
    'turned grid': GRID @ TURN.T,
    'almost coplanar': GRID @ TURN.T + 1e-15 * RNG.normal(size=GRID.shape),
    'nearly coplanar': GRID @ TURN.T + 1e-10 * RNG.normal(size=GRID.shape),
    'needle': BALL * [1e-6, 1e-6, 1.0],
    'plate': GRID * [1.0, 1.0, 1e-9],
    'far away': SPHERE * 0.01 + [1e3, -1e3, 1e3],
    'tiny': BALL * 1e-9,
    'huge': BALL * 1e8,
    'flat': GRID[GRID[:, 2] == 1.0],
    'collinear': np.outer(np.arange(5.0), [1.0, 2.0, 3.0]),
    'one point': np.array([[1.0, 2.0, 3.0]]),
    'tetrahedron': np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
}


def distance(point: np.ndarray, vertices: np.ndarray) -> float:
    """Return the distance of a point from a convex hull, by least squares over its weights."""
    shifted = vertices - point
    scale = np.abs(shifted).max() or 1.0
    rows = np.vstack((shifted.T / scale, np.full(len(vertices), 1e3)))
    weights, _ = nnls(rows, np.array([0.0, 0.0, 0.0, 1e3]))
    return float(np.linalg.norm((weights / weights.sum()) @ shifted))


@pytest.mark.parametrize('cloud', CLOUDS.values(), ids=CLOUDS.keys())
def test_every_point_is_within_the_ball_of_the_hull(cloud: np.ndarray) -> None:
    hull = convex_hull(cloud)
    size = np.ptp(cloud, axis=0).max()
    assert 0.0 <= hull.ball <= 1e-11 * size + 1e-13 * np.abs(cloud).max()
    # What the judge itself cannot see below.
    noise = 1e-8 * size
    for point in cloud:
        assert distance(point, hull.vertices) <= hull.ball + noise
    given = {tuple(point) for point in cloud}
    assert all(tuple(vertex) in given for vertex in hull.vertices)
    n = RNG.normal(size=(500, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    reach = (hull.vertices @ n.T).max(axis=0) + hull.ball
    assert ((cloud @ n.T).max(axis=0) <= reach + 4e-16 * np.abs(cloud).max()).all()


def test_interior_points_are_not_kept() -> None:
    assert len(convex_hull(GRID).vertices) == 8
    assert len(convex_hull(np.concatenate((SPHERE, 0.9 * SPHERE))).vertices) == len(SPHERE)


@pytest.mark.parametrize('offset', [0.0, 1e-12, 1e-3, 10.0])
def test_the_distance_bound_is_above_the_distance_and_near_it(offset: float) -> None:
    """Points over the faces of a cube, where the distance is known."""
    cube = np.array(list(product((-1.0, 1.0), repeat=3)))
    hull = ConvexHull(cube)
    over = RNG.uniform(-0.9, 0.9, size=(200, 3))
    over[np.arange(200), RNG.integers(0, 3, 200)] = 1.0 + offset
    bound = distance_bound(over, cube[hull.simplices], hull.neighbors, np.zeros(3))
    true = over.max(axis=1) - 1.0
    assert (bound >= true).all()
    # It is measured towards the centre, not across the face.
    assert (bound <= np.sqrt(3.0) * true + 1e-13).all()


@pytest.mark.parametrize('name', ['ball', 'sphere', 'turned grid', 'plate'])
def test_a_hull_that_drops_vertices_is_mended(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    cloud = CLOUDS[name]
    # A proposal that has seen only some of the points.
    monkeypatch.setattr(
        module, 'ConvexHull', lambda points: ConvexHull(points[: len(points) // 2])
    )
    hull = convex_hull(cloud)
    for point in cloud:
        assert distance(point, hull.vertices) <= hull.ball + 1e-8
    assert hull.ball < 1e-9
