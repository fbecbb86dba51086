"""Motions from quaternions, dual quaternions, splines and keyframes are what they say."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest
from rational_curves import exact_pose
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from trajectory_guard.cell.free_body import free_body
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import certify
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.paths.free_motion.keyframes import through_poses
from trajectory_guard.paths.free_motion.quaternion_curve import (
    dual_quaternion_motion,
    Rigid,
    rigid_motion,
)
from trajectory_guard.paths.free_motion.spline import (
    bezier_pieces,
    displacement_spline,
    dual_quaternion_spline,
    rigid_spline,
)
from trajectory_guard.paths.free_motion.turn import constant_turn
from trajectory_guard.result import Status
from trajectory_guard.shapes.primitive import Box

SECOND = 10**9
INSTANTS = [Fraction(k, 7) for k in range(8)] + [Fraction(1, 1000)]


def exact_value(control: np.ndarray, s: Fraction) -> list[Fraction]:
    """Return the value of a Bezier curve, exactly."""
    n = len(control) - 1
    basis = [comb(n, i) * s**i * (1 - s) ** (n - i) for i in range(n + 1)]
    return [
        sum(b * Fraction(c) for b, c in zip(basis, column, strict=True))
        for column in control.T.tolist()
    ]


def exact_rotation(q: list[Fraction]) -> list[list[Fraction]]:
    """Return q x q* / |q|^2 as a matrix."""
    x, y, z, w = q
    n = x * x + y * y + z * z + w * w
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), w * w - x * x + y * y - z * z, 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), w * w - x * x - y * y + z * z],
    ]
    return [[entry / n for entry in row] for row in rows]


def offs(rigid: Rigid, s: Fraction, rotation, translation) -> tuple[float, float]:
    """Return how far linear part and translation are from the exact ones."""
    pose = exact_pose(rigid.motion, s)
    turn = [[float(pose[i][k] - rotation[i][k]) for k in range(3)] for i in range(3)]
    shift = [float(pose[i][3] - translation[i]) for i in range(3)]
    return float(np.linalg.norm(turn, 2)), float(np.linalg.norm(shift))


@pytest.mark.parametrize('size', [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(('n', 'm'), [(0, 0), (1, 0), (1, 3), (2, 2), (4, 1)])
def test_a_quaternion_curve_is_within_its_error(n: int, m: int, size: float) -> None:
    rng = np.random.default_rng(n + 10 * m)
    q = rng.normal(size=4) + 0.3 * np.cumsum(rng.normal(size=(n + 1, 4)), axis=0)
    p = size * rng.uniform(-1.0, 1.0, (m + 1, 3))
    v = rng.uniform(0.5, 2.0, m + 1)
    rigid = rigid_motion(7.0 * q, p, v)
    assert 0.0 < rigid.turn_error < 1e-10
    assert rigid.shift_error < 1e-10 * size
    for s in INSTANTS:
        weight = exact_value(v[:, None], s)[0]
        place = [c / weight for c in exact_value_weighted(p, v, s)]
        turn, shift = offs(rigid, s, exact_rotation(exact_value(7.0 * q, s)), place)
        assert turn <= rigid.turn_error
        assert shift <= rigid.shift_error


def exact_value_weighted(p: np.ndarray, v: np.ndarray, s: Fraction) -> list[Fraction]:
    n = len(p) - 1
    basis = [
        comb(n, i) * s**i * (1 - s) ** (n - i) * Fraction(w) for i, w in enumerate(v.tolist())
    ]
    return [
        sum(b * Fraction(c) for b, c in zip(basis, column, strict=True)) for column in p.T.tolist()
    ]


@pytest.mark.parametrize('on_quadric', [True, False])
def test_a_dual_quaternion_curve_is_within_its_error(on_quadric: bool) -> None:
    """Translation 2 d q* / |q|^2, vector part, whether or not the curve is on Study's quadric."""
    rng = np.random.default_rng(4)
    q = rng.normal(size=4) + 0.3 * rng.normal(size=(3, 4))
    d = rng.normal(size=(3, 4))
    if on_quadric:
        # A constant translation by p: d = 1/2 p q.
        d = np.array([0.5 * times(np.array([1.0, 2.0, 3.0, 0.0]), row) for row in q])
    rigid = dual_quaternion_motion(np.column_stack((q, d)))
    for s in INSTANTS:
        a, e = exact_value(q, s), exact_value(d, s)
        conjugate = [-a[0], -a[1], -a[2], a[3]]
        norm = sum(c * c for c in a)
        place = [2 * c / norm for c in times_exact(e, conjugate)[:3]]
        turn, shift = offs(rigid, s, exact_rotation(a), place)
        assert turn <= rigid.turn_error
        assert shift <= rigid.shift_error
        if on_quadric:
            assert np.allclose([float(c) for c in place], [1.0, 2.0, 3.0])


def times_exact(a, b):
    x, y, z, w = a
    X, Y, Z, W = b
    return [
        w * X + x * W + y * Z - z * Y,
        w * Y - x * Z + y * W + z * X,
        w * Z + x * Y - y * X + z * W,
        w * W - x * X - y * Y - z * Z,
    ]


def times(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.array(times_exact(a.tolist(), b.tolist()))


@pytest.mark.parametrize('angle', [0.0, 1e-9, 1e-3, 0.4, 1.5, 3.0, np.pi])
def test_a_constant_turn_is_slerp(angle: float) -> None:
    start = Rotation.random(random_state=3)
    axis = np.array([0.6, 0.0, 0.8])
    control, error = constant_turn(start.as_quat(), axis, angle)
    assert error < 1e-9
    rigid = rigid_motion(control, np.zeros((1, 3)))
    for s in np.linspace(0.0, 1.0, 33):
        true = (Rotation.from_rotvec(axis * angle * s) * start).as_matrix()
        off = np.linalg.norm(rigid.motion.pose(s)[:, :3] - true, 2)
        assert off <= error + rigid.turn_error + 1e-14


def test_a_curve_through_zero_is_refused_and_one_near_it_is_not() -> None:
    q = np.array([[1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0]])
    with pytest.raises(RequestError, match='too near to zero') as caught:
        rigid_motion(q, np.zeros((1, 3)))
    assert caught.value.reason is Reason.INVALID_PARAMETER
    near = np.array([[1.0, 0.0, 0.0, 0.0], [-1.0, 0.9, 0.0, 0.0]])
    rigid = rigid_motion(near, np.zeros((1, 3)))
    assert rigid.motion.degree > 2
    turn, _ = offs(
        rigid, Fraction(1, 2), exact_rotation(exact_value(near, Fraction(1, 2))), [0, 0, 0]
    )
    assert turn <= rigid.turn_error


KNOTS = [0, 0, 0, 0, 1, 3, 3, 6, 6, 6, 6]


def test_pieces_are_the_spline() -> None:
    rng = np.random.default_rng(1)
    control = rng.normal(size=(7, 4))
    spline = BSpline(KNOTS, control, 3)
    pieces = bezier_pieces(KNOTS, 3, control)
    assert [(piece.start_ns, piece.end_ns) for piece in pieces] == [(0, 1), (1, 3), (3, 6)]
    for piece in pieces:
        for s in np.linspace(0.0, 1.0, 9):
            value = [float(c) for c in exact_value(piece.control, Fraction(float(s)))]
            t = piece.start_ns + s * (piece.end_ns - piece.start_ns)
            assert np.allclose(value, spline(t), atol=1e-14)


def test_splines_move_as_their_control_values_say() -> None:
    rng = np.random.default_rng(2)
    q = rng.normal(size=4) + 0.4 * rng.normal(size=(7, 4))
    p = rng.normal(size=(7, 3))
    knots = [SECOND * k for k in KNOTS]
    path = rigid_spline('part', knots, 3, q, p)
    assert path.knots_ns.tolist() == [0, SECOND, 3 * SECOND, 6 * SECOND]
    both = BSpline(KNOTS, np.column_stack((q, p)), 3)
    dual = dual_quaternion_spline(
        'part',
        knots,
        3,
        np.column_stack(
            (q, [0.5 * times(np.array([*x, 0.0]), y) for x, y in zip(p, q, strict=True)])
        ),
    )
    linear = displacement_spline('part', knots, 3, displacements(rng), np.arange(1.0, 8.0))
    for t in np.linspace(0.0, 6.0, 25):
        now = int(t * SECOND)
        value = both(now / SECOND)
        pose = path.pose(now)
        assert np.allclose(pose[:, :3], Rotation.from_quat(value[:4]).as_matrix(), atol=1e-12)
        assert np.allclose(pose[:, 3], value[4:], atol=1e-12)
        assert np.allclose(dual.pose(now)[:, :3], pose[:, :3], atol=1e-12)
        assert linear.pose(now).shape == (3, 4)


def displacements(rng: np.random.Generator) -> np.ndarray:
    return rng.normal(size=(7, 3, 4))


def test_a_displacement_spline_is_the_rational_spline() -> None:
    rng = np.random.default_rng(8)
    points, weights = displacements(rng), rng.uniform(0.5, 2.0, 7)
    path = displacement_spline('part', KNOTS, 3, points, weights)
    rows = np.column_stack((weights[:, None] * points.reshape(-1, 12), weights))
    spline = BSpline(KNOTS, rows, 3)
    for t in (0, 1, 2, 3, 4, 5, 6):
        value = spline(t)
        assert np.allclose(path.pose(t).ravel(), value[:12] / value[12], atol=1e-12)


def poses(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    turns = Rotation.from_rotvec(np.cumsum(0.6 * rng.normal(size=(count, 3)), axis=0))
    signs = rng.choice([-1.0, 1.0], (count, 1))
    return rng.uniform(-1.0, 1.0, (count, 3)), signs * turns.as_quat()


@pytest.mark.parametrize('unit', [1, SECOND, 10**17])
def test_keyframes_are_passed_twice_smooth_and_at_rest(unit: int) -> None:
    rng = np.random.default_rng(3)
    p, q = poses(rng, 5)
    times_ns = [unit * t for t in (0, 10, 30, 40, 80)]
    path = through_poses('part', times_ns, p, q)
    for t, place, turn in zip(times_ns, p, q, strict=True):
        pose = path.pose(t)
        assert np.allclose(pose[:, :3], Rotation.from_quat(turn).as_matrix(), atol=1e-12)
        assert np.allclose(pose[:, 3], place, atol=1e-12)
    h = 1e-4
    for i in (0, 1, 2):
        lengths = np.diff(path.knots_ns)[i : i + 2] / unit
        before, after = path.motions[i], path.motions[i + 1]
        one = (before.pose(1.0) - before.pose(1.0 - h / lengths[0])) / h
        two = (after.pose(h / lengths[1]) - after.pose(0.0)) / h
        assert np.allclose(one, two, atol=1e-3)
    first = path.motions[0]
    assert np.allclose(first.pose(1e-5), first.pose(0.0), atol=1e-8)


def test_a_path_of_keyframes_is_certified() -> None:
    rng = np.random.default_rng(6)
    shape, obstacle = Box((0.3, 0.1, 0.2)), Box((0.5, 0.4, 0.3))
    work = Workcell(free_body('part', shape), Scene((Obstacle('o', (obstacle.load().body,)),), ''))
    seen = set()
    corners = shape.load().body.vertices
    for _ in range(10):
        p, q = poses(rng, 4)
        result = certify(work, through_poses('part', [0, SECOND, 3 * SECOND, 4 * SECOND], p, q))
        path = through_poses('part', [0, SECOND, 3 * SECOND, 4 * SECOND], p, q)
        for row in result.intervals:
            seen.add(row.status)
            for t in np.linspace(row.start_ns, row.end_ns, 40):
                pose = path.pose(int(t))
                inside = (np.abs(corners @ pose[:, :3].T + pose[:, 3]) < [0.25, 0.2, 0.15]).all(
                    axis=1
                )
                assert not (row.status is Status.FREE and inside.any())
    assert {Status.FREE, Status.COLLISION} <= seen


@pytest.mark.parametrize(
    ('make', 'named'),
    [
        (lambda: rigid_motion(np.zeros((2, 4)), np.zeros((1, 3))), 'all zero'),
        (lambda: rigid_motion(np.ones((2, 3)), np.zeros((1, 3))), 'quaternions must have shape'),
        (
            lambda: rigid_motion(np.full((1, 4), np.nan), np.zeros((1, 3))),
            'quaternions[0, 0] is nan',
        ),
        (lambda: rigid_motion(np.ones((1, 4)), np.full((1, 3), 1e10)), 'positions[0, 0]'),
        (lambda: rigid_motion(np.ones((1, 4)), np.zeros((1, 3)), np.zeros(1)), 'position_weights'),
        (lambda: dual_quaternion_motion(np.ones((2, 7))), 'dual_quaternions must have'),
        (lambda: bezier_pieces([0, 0, 1, 1], 0, np.ones((3, 1))), 'degree must be'),
        (lambda: bezier_pieces([0, 0, 1, 1], 1, np.ones((1, 1))), 'control must be'),
        (lambda: bezier_pieces([0, 0, 1], 1, np.ones((2, 1))), 'knots_ns must have 4'),
        (lambda: bezier_pieces([0, 0, 3, 2, 4, 4], 1, np.ones((4, 1))), 'knots_ns[3] is 2'),
        (lambda: bezier_pieces([0, 1, 2, 2], 1, np.ones((2, 1))), 'begin and end with 2 equal'),
        (lambda: rigid_spline('x', [0, 0, 1, 1], 1, np.ones((2, 4)), np.ones((3, 3))), '(K, 3)'),
        (
            lambda: displacement_spline('x', [0, 0, 1, 1], 1, np.ones((2, 3, 4)), [1.0, 0.0]),
            'positive',
        ),
        (lambda: through_poses('x', [0], np.ones((1, 3)), np.ones((1, 4))), 'P >= 2'),
        (lambda: through_poses('x', [0, 0], np.ones((2, 3)), np.ones((2, 4))), 'times_ns[1]'),
        (lambda: through_poses('x', [0, 1], np.ones((2, 3)), np.zeros((2, 4))), 'quaternions[0]'),
    ],
)
def test_what_is_no_motion_is_refused_by_name(make, named: str) -> None:
    with pytest.raises(RequestError) as caught:
        make()
    assert named in str(caught.value)
