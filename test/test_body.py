"""Bodies contain what they stand for, also after rounding."""

from collections.abc import Callable
from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from trajectory_guard.shapes.body import ConvexBody, near_center, rigid_defect, RIGID_TOLERANCE

CUBE = np.array(list(product((-0.5, 0.5), repeat=3)))
CUBE_FACES = np.column_stack((np.concatenate((np.eye(3), -np.eye(3))), np.full(6, 0.5)))


def exact_rotation(rng: np.random.Generator) -> list[list[Fraction]]:
    """Return a rotation of rational numbers, from a random integer quaternion."""
    w, x, y, z = (Fraction(int(k)) for k in rng.integers(-9, 10, 4) + np.array([20, 0, 0, 0]))
    n = w * w + x * x + y * y + z * z
    return [
        [1 - 2 * (y * y + z * z) / n, 2 * (x * y - z * w) / n, 2 * (x * z + y * w) / n],
        [2 * (x * y + z * w) / n, 1 - 2 * (x * x + z * z) / n, 2 * (y * z - x * w) / n],
        [2 * (x * z - y * w) / n, 2 * (y * z + x * w) / n, 1 - 2 * (x * x + y * y) / n],
    ]


def exact(values: np.ndarray) -> list[Fraction]:
    return [Fraction(float(value)) for value in values]


def dot(a: list[Fraction], b: list[Fraction]) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def rounded(R: list[list[Fraction]], t: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = [[float(entry) for entry in row] for row in R]
    T[:3, 3] = t
    return T


@pytest.mark.parametrize('size', [1e-6, 1.0, 1e6])
def test_moved_contains_the_exact_image_of_every_vertex(size: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        R, t = exact_rotation(rng), rng.normal(size=3) * rng.choice([0.0, 1e-3, 10.0])
        body = ConvexBody(rng.normal(size=(9, 3)) * size, ball=0.1 * size)
        moved = body.moved(rounded(R, t))
        slack = Fraction(moved.ball) - Fraction(body.ball)
        assert 0 < slack < 1e-13 * (size + 30.0)
        for before, after in zip(body.vertices, moved.vertices, strict=True):
            v = exact(before)
            image = [dot(row, v) + Fraction(float(s)) for row, s in zip(R, t, strict=True)]
            error = [a - b for a, b in zip(image, exact(after), strict=True)]
            assert dot(error, error) <= slack**2


def test_moved_faces_bound_a_polytope_inside_the_exact_image() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        R, t = exact_rotation(rng), rng.normal(size=3) * 10.0
        body = ConvexBody(CUBE, faces=CUBE_FACES)
        moved = body.moved(rounded(R, t))
        corners = [
            [dot(row, exact(v)) + Fraction(float(s)) for row, s in zip(R, t, strict=True)]
            for v in CUBE * 1.01
        ]
        for before, after in zip(body.faces, moved.faces, strict=True):
            n = [dot(row, exact(before[:3])) for row in R]
            d = Fraction(before[3]) + dot(n, exact(t))
            for x in corners:
                assert dot(n, x) - d <= dot(exact(after[:3]), x) - Fraction(after[3])
        assert np.abs(moved.faces[:, 3] - moved.faces[:, :3] @ t - 0.5).max() < 1e-12


def test_moving_twice_is_moving_by_the_product() -> None:
    rng = np.random.default_rng(3)
    body = ConvexBody(rng.normal(size=(5, 3)), ball=0.1, disc_radius=0.2, faces=CUBE_FACES)
    A, B = (rounded(exact_rotation(rng), rng.normal(size=3)) for _ in range(2))
    twice, once = body.moved(A).moved(B), body.moved(B @ A)
    for name in ('vertices', 'ball', 'disc_radius', 'disc_axis', 'faces'):
        assert np.allclose(getattr(twice, name), getattr(once, name), rtol=0, atol=1e-12)


def test_the_identity_changes_nothing() -> None:
    body = ConvexBody(CUBE, ball=0.1)
    assert body.moved(np.eye(4)) is body


@pytest.mark.parametrize('disc_radius', [0.0, 0.7])
@pytest.mark.parametrize('count', [1, 2, 3, 8, 40])
def test_the_bounding_sphere_contains_the_solid(count: int, disc_radius: float) -> None:
    rng = np.random.default_rng(count)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    vertices = rng.normal(size=(count, 3)) + rng.choice([0.0, 1e6])
    body = ConvexBody(vertices, ball=0.25, disc_radius=disc_radius, disc_axis=axis)
    across = np.cross(axis, rng.normal(size=(500, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    disc = (disc_radius * across).astype(np.longdouble)
    points = (vertices.astype(np.longdouble)[:, None] + disc).reshape(-1, 3) - body.center
    farthest = np.sqrt((points**2).sum(axis=1)).max() + np.longdouble(0.25)
    # The sampled disc misses the farthest point by the square of its spacing.
    assert farthest * (1 - 1e-15) <= body.radius
    if disc_radius or count == 1:
        assert body.radius <= farthest * 1.001
    else:
        assert body.radius <= farthest + 1e-14 * np.abs(vertices).max()


def test_the_sphere_of_a_long_needle_is_tight() -> None:
    body = ConvexBody(np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]), disc_radius=1e-9)
    assert 1.0 < body.radius < 1.0 + 1e-14


def test_near_center_beats_the_box_for_a_skew_cloud() -> None:
    points = np.random.default_rng(4).normal(size=(60, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points = points[points[:, 0] + points[:, 1] > 0.0]
    box = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = np.linalg.norm(points - near_center(points), axis=1).max()
    assert radius <= np.linalg.norm(points - box, axis=1).max()


def test_nobody_can_change_a_body() -> None:
    body = ConvexBody(CUBE, faces=CUBE_FACES)
    for name in ('vertices', 'disc_axis', 'faces', 'center'):
        array = getattr(body, name)
        assert array.dtype == np.float64
        assert array.flags.c_contiguous
        with pytest.raises(ValueError, match='read-only'):
            array[0] = 0.0


@pytest.mark.parametrize(
    ('values', 'named'),
    [
        ({'vertices': np.empty((0, 3))}, 'vertices'),
        ({'vertices': np.zeros((2, 2))}, 'vertices'),
        ({'vertices': np.array([[0.0, np.nan, 0.0]])}, 'vertex'),
        ({'vertices': np.array([[0.0, 2e9, 0.0]])}, 'vertex'),
        ({'ball': -1e-300}, 'ball'),
        ({'ball': np.nan}, 'ball'),
        ({'disc_radius': np.inf}, 'disc_radius'),
        ({'disc_axis': np.array([0.0, 0.0, 1.1])}, 'disc_axis'),
        ({'disc_axis': np.full(3, np.nan)}, 'disc_axis'),
        ({'faces': np.zeros((2, 3))}, 'faces'),
        ({'faces': np.full((1, 4), np.nan)}, 'faces'),
    ],
)
def test_a_body_refuses_nonsense(values: dict, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        ConvexBody(**{'vertices': CUBE, **values})


def changed(row: int, column: int, value: float) -> np.ndarray:
    T = np.eye(4)
    T[row, column] = value
    return T


@pytest.mark.parametrize(
    'T',
    [
        np.eye(3),
        2.0 * np.eye(4),
        np.diag([1.0, 1.0, -1.0, 1.0]),
        np.diag([-1.0, -1.0, -1.0, 1.0]),
        np.zeros((4, 4)),
        changed(3, 0, 1e-300),
        changed(0, 1, 1e-12),
        changed(0, 3, np.nan),
        changed(0, 3, np.inf),
        changed(1, 1, np.nan),
        changed(1, 1, np.inf),
        changed(1, 2, 1e200),
    ],
)
def test_only_rigid_transforms_move_a_body(T: np.ndarray) -> None:
    assert not rigid_defect(T) <= RIGID_TOLERANCE
    with pytest.raises(ValueError, match='rigid'):
        ConvexBody(CUBE).moved(T)


@pytest.mark.parametrize('angle', [0.0, 1e-300, 0.3, np.pi, 100.0])
@pytest.mark.parametrize('make', [np.cos, np.sin])
def test_rotations_are_rigid(angle: float, make: Callable) -> None:
    c, s = np.cos(angle), np.sin(angle)
    T = np.eye(4)
    T[:2, :2] = [[c, -s], [s, c]]
    T[:3, 3] = make(angle) * 1e8
    assert rigid_defect(T) <= RIGID_TOLERANCE
