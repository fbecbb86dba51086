"""The joint path against the controller's own rules, and everything it refuses."""

from bisect import bisect_right
from contextlib import contextmanager
from fractions import Fraction
import math

import numpy as np
import pytest

from trajectory_guard.cell.robot import Joint, JointType, Mimic
from trajectory_guard.errors import Reason, RequestError, TrajectoryError, TrajectoryGuardError
from trajectory_guard.paths.joint_path import joint_path, JointPath
from trajectory_guard.paths.trajectory import JointState, Point, Trajectory

SECOND = 10**9
TURN = 2 * math.pi


def joint(name, kind=JointType.REVOLUTE, lower=-9.0, upper=9.0, mimic=None):
    if kind is JointType.CONTINUOUS:
        lower, upper = -math.inf, math.inf
    axis = np.array([0.0, 0.0, 1.0])
    return Joint(name, kind, f'{name}_parent', name, np.eye(4), axis, lower, upper, mimic)


# An arm with a wheel, a rail, and a gripper whose second finger follows the first.
ROBOT = (
    joint('mount', JointType.FIXED, 0.0, 0.0),
    joint('rail', JointType.PRISMATIC, -2.0, 2.0),
    joint('shoulder'),
    joint('elbow'),
    joint('wheel', JointType.CONTINUOUS),
    joint('finger', JointType.PRISMATIC, 0.0, 0.04),
    joint('second_finger', JointType.PRISMATIC, -0.05, 0.01, Mimic('finger', -1.0, 0.005)),
)
ARM = ('rail', 'shoulder', 'elbow', 'wheel')
MOVABLE = (*ARM, 'finger', 'second_finger')
HOME = JointState((*ARM, 'finger'), (0.1, 0.2, 0.3, 0.4, 0.02))


def points(times_s, q, v=None, a=None, has=None):
    """Return points; has says for each which of velocities and accelerations it carries."""
    has = has or [(v is not None, a is not None)] * len(q)
    return [
        Point(round(t * SECOND), q[i], v[i] if has[i][0] else (), a[i] if has[i][1] else ())
        for i, t in enumerate(times_s)
    ]


def plan(names, *args, **kwargs):
    return Trajectory.from_points(names, points(*args, **kwargs))


def random_plan(seed, names=ARM, size=6, first=0.0, has=(True, True), scale=1.0):
    rng = np.random.default_rng(seed)
    times_s = first + np.cumsum(rng.uniform(0.05, 1.0, size)) * (np.arange(size) > 0)
    q, v, a = rng.uniform(-scale, scale, (3, size, len(names)))
    v[-1] = 0.0
    return plan(names, times_s, q, v, a, [has] * size)


@contextmanager
def refused(reason, *words, kind=TrajectoryError):
    with pytest.raises(TrajectoryGuardError) as caught:
        yield
    assert type(caught.value) is kind
    assert caught.value.reason is reason
    assert all(word in str(caught.value) for word in words), str(caught.value)


def played(trajectory, start, t):
    """
    Return what the controller commands at t seconds, from its rules in powers of t.

    The message is taken as it is: names in its order, one start state in the same order that is
    never further than half a turn away.
    """
    knots = [
        (
            trajectory.times_ns[i] / 1e9,
            trajectory.positions[i],
            trajectory.velocities[i] if trajectory.has_velocities[i] else None,
            trajectory.accelerations[i] if trajectory.has_accelerations[i] else None,
        )
        for i in range(len(trajectory.times_ns))
    ]
    if start is not None and knots[0][0] > 0:
        _, _, v, a = knots[0]
        still = np.zeros(len(start.positions))
        start_v = still if start.velocities is None else start.velocities
        first = (
            0.0,
            start.positions,
            None if v is None else start_v,
            None if a is None else still,
        )
        knots.insert(0, first)
    if len(knots) == 1:
        return knots[0][1]
    i = min(bisect_right([knot[0] for knot in knots], t), len(knots) - 1) - 1
    (t0, q0, v0, a0), (t1, q1, v1, a1) = knots[i], knots[i + 1]
    h, t = t1 - t0, t - t0
    if v0 is None or v1 is None:
        return q0 + t * (q1 - q0) / h
    if a0 is None or a1 is None:
        c2 = (-3 * q0 + 3 * q1 - 2 * v0 * h - v1 * h) / h**2
        c3 = (2 * q0 - 2 * q1 + v0 * h + v1 * h) / h**3
        return q0 + v0 * t + c2 * t**2 + c3 * t**3
    c3 = (-20 * q0 + 20 * q1 - 3 * a0 * h**2 + a1 * h**2 - 12 * v0 * h - 8 * v1 * h) / (2 * h**3)
    c4 = (30 * q0 - 30 * q1 + 3 * a0 * h**2 - 2 * a1 * h**2 + 16 * v0 * h + 14 * v1 * h) / (
        2 * h**4
    )
    c5 = (-12 * q0 + 12 * q1 - a0 * h**2 + a1 * h**2 - 6 * v0 * h - 6 * v1 * h) / (2 * h**5)
    return q0 + v0 * t + a0 / 2 * t**2 + c3 * t**3 + c4 * t**4 + c5 * t**5


@pytest.mark.parametrize('has', [(False, False), (True, False), (True, True)])
@pytest.mark.parametrize('first', [0.0, 0.5])
@pytest.mark.parametrize('velocities', [None, (0.1, -0.2, 0.3, -0.4, 0.0)])
def test_is_what_the_controller_plays(has, first, velocities):
    names = (*ARM, 'finger')
    trajectory = random_plan(1, names, has=has, first=first)
    start = JointState(names, HOME.positions, velocities)
    path = joint_path(
        ROBOT, trajectory, start, check_joint_limits=False, allowed_start_tolerance=2.0
    )
    assert path.duration_ns == trajectory.times_ns[-1]
    for time_ns in np.linspace(0, path.duration_ns, 200).astype(int):
        judged = played(trajectory, start, time_ns / 1e9)
        np.testing.assert_allclose(path.position(time_ns)[:5], judged, rtol=0, atol=1e-11)


def test_is_what_the_controller_plays_when_the_fields_change():
    has = [(True, True), (True, True), (True, False), (False, False), (True, False), (True, True)]
    q, v, a = np.random.default_rng(2).uniform(-1, 1, (3, 6, 4))
    v[-1] = 0.0
    trajectory = plan(ARM, [0.5, 1.0, 1.5, 2.5, 3.5, 3.75], q, v, a, has)
    start = JointState(ARM, (0.0, 0.5, -0.5, 1.0), (1.0, 2.0, 3.0, 4.0))
    gripper = JointState((*ARM, 'finger'), (*start.positions, 0.0), (*start.velocities, 0.0))
    path = joint_path(ROBOT, trajectory, gripper, check_joint_limits=False)
    assert len(path.knots_ns) == 7
    for time_ns in np.linspace(0, path.duration_ns, 200).astype(int):
        judged = played(trajectory, start, time_ns / 1e9)
        np.testing.assert_allclose(path.position(time_ns)[:4], judged, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ('has', 'order'), [((False, False), 0), ((True, False), 1), ((True, True), 2)]
)
def test_knots_are_met_and_joined_to_the_order_of_the_degree(has, order):
    path = joint_path(ROBOT, random_plan(3, has=has), HOME, allowed_start_tolerance=2.0)
    h = np.diff(path.knots_ns)[:, None] / 1e9
    for derivative in range(order + 1):
        factor = np.array([math.perm(k, derivative) for k in range(6)], dtype=float)
        begin = path.coefficients[:, :, derivative] * factor[derivative] / h**derivative
        end = (path.coefficients * factor).sum(axis=-1) / h**derivative
        np.testing.assert_allclose(end[:-1], begin[1:], rtol=1e-9, atol=1e-9)


def test_knots_are_inside_the_error():
    trajectory = random_plan(4, scale=2.0)
    path = joint_path(ROBOT, trajectory, HOME, allowed_start_tolerance=3.0)
    for i in range(len(trajectory.times_ns) - 1):
        for j, name in enumerate(ARM):
            c = [Fraction(x) for x in path.coefficients[i, j]]
            assert c[0] == Fraction(trajectory.positions[i, j]), name
            off = abs(sum(c) - Fraction(trajectory.positions[i + 1, j]))
            assert off <= Fraction(path.coefficient_error[i, j]), name


def test_permuted_joints_give_the_same_bits():
    rng = np.random.default_rng(5)
    q, v, a = rng.uniform(-1, 1, (3, 4, 4))
    reference = None
    for order in ([0, 1, 2, 3], [3, 1, 0, 2], [2, 3, 1, 0]):
        trajectory = plan(
            [ARM[k] for k in order], [0.5, 1, 2, 3], q[:, order], v[:, order], a[:, order]
        )
        start = JointState([HOME.joint_names[k] for k in (4, *order)], HOME.positions[[4, *order]])
        path = joint_path(ROBOT, trajectory, start, allow_nonzero_end_velocity=True)
        assert path.joint_names == MOVABLE
        bits = path.coefficients.tobytes() + path.coefficient_error.tobytes()
        reference = reference or bits
        assert bits == reference


def test_joints_the_message_lacks_hold_and_mimics_follow():
    trajectory = plan(('finger', 'elbow'), [1.0, 2.0], [[0.0, 1.0], [0.04, 2.0]])
    path = joint_path(ROBOT, trajectory, HOME)
    assert path.in_path.tolist() == [False, False, True, False, True, True]
    for time_ns in range(0, 2 * SECOND + 1, SECOND // 7):
        rail, shoulder, _, wheel, finger, second = path.position(time_ns)
        assert (rail, shoulder, wheel) == (0.1, 0.2, 0.4)
        assert second == pytest.approx(0.005 - finger, abs=1e-16)
    held = [0, 1, 3]
    assert not path.coefficients[:, held, 1:].any()
    assert not path.coefficient_error[:, held].any()


def test_a_chain_of_mimics_is_inside_the_error():
    robot = (
        joint('c', mimic=Mimic('b', 0.7, -0.1)),
        joint('a'),
        joint('b', mimic=Mimic('a', -1.3, 0.2)),
    )
    trajectory = random_plan(6, ('a',), has=(True, True))
    path = joint_path(robot, trajectory)
    exact = [[Fraction(x) for x in row] for row in path.coefficients[:, 1]]
    for i, row in enumerate(exact):
        b = [Fraction(-1.3) * x for x in row]
        b[0] += Fraction(0.2)
        c = [Fraction(0.7) * x for x in b]
        c[0] -= Fraction(0.1)
        for j, expected in ((2, b), (0, c)):
            computed = path.coefficients[i, j]
            off = sum(abs(Fraction(x) - e) for x, e in zip(computed, expected, strict=True))
            assert off <= Fraction(path.coefficient_error[i, j])
            assert path.coefficient_error[i, j] >= 0.9 * path.coefficient_error[i, 1]


def test_a_held_leader_holds_its_mimic():
    path = joint_path(ROBOT, random_plan(7, has=(False, False)), HOME, allowed_start_tolerance=2.0)
    assert path.position(0)[4:].tolist() == [0.02, 0.005 - 0.02]
    assert not path.in_path[4:].any()


def test_continuous_joints_approach_the_short_way():
    trajectory = plan(ARM, [1.0, 2.0], [[0.0, 0.0, 0.0, -3.0], [0.0, 0.0, 0.0, -3.0]])
    path = joint_path(ROBOT, trajectory, JointState(HOME.joint_names, (0, 0, 0, 3.0, 0)))
    wheel = [path.position(t)[3] for t in range(0, SECOND + 1, SECOND // 10)]
    assert wheel[0] == pytest.approx(3.0 - TURN, abs=1e-15)
    assert (np.diff(wheel) > 0).all()
    exact = Fraction(6283185307179586476925286766559, 10**30)
    off = abs(Fraction(path.coefficients[0, 3, 0]) - (3 - exact))
    assert 0 < off <= Fraction(path.coefficient_error[0, 3])


def test_without_a_start_the_approach_is_unknown():
    trajectory = plan((*ARM, 'finger'), [0.5, 1.0], np.zeros((2, 5)))
    path = joint_path(ROBOT, trajectory)
    assert path.unknown_until_ns == SECOND // 2
    assert path.knots_ns.tolist() == [SECOND // 2, SECOND]
    with refused(Reason.INVALID_PARAMETER, '499999999', kind=RequestError):
        path.position(499_999_999)
    # A start state that only names joints the message lacks does not tell either.
    trajectory = plan(ARM, [0.5, 1.0], np.zeros((2, 4)))
    path = joint_path(ROBOT, trajectory, JointState(['finger', 'lamp'], [0.01, 5.0]))
    assert path.unknown_until_ns == SECOND // 2
    assert path.position(SECOND)[4] == 0.01


@pytest.mark.parametrize(
    ('time_s', 'start', 'knots_s', 'unknown_s'),
    [
        (0.0, None, [0.0, 0.0], 0.0),
        (0.0, (0.5, 0.5), [0.0, 0.0], 0.0),
        (2.0, None, [2.0, 2.0], 2.0),
        (2.0, (0.0, 0.5), [0.0, 2.0], 0.0),
    ],
)
def test_a_single_point(time_s, start, knots_s, unknown_s):
    robot = (joint('a'), joint('b'))
    trajectory = plan('ab', [time_s], [[0.5, 0.5]], [[0.0, 0.0]], [[0.0, 0.0]])
    path = joint_path(robot, trajectory, None if start is None else JointState('ab', start))
    assert path.knots_ns.tolist() == [round(t * SECOND) for t in knots_s]
    assert path.unknown_until_ns == round(unknown_s * SECOND)
    assert path.coefficients.shape == (1, 2, 6)
    assert path.position(path.duration_ns).tolist() == [0.5, 0.5]
    if knots_s[0] == knots_s[1]:
        assert not path.coefficients[..., 1:].any()
        assert not path.coefficient_error.any()


@pytest.mark.parametrize('ns', [1, 10**18])
def test_the_shortest_and_a_very_long_segment(ns):
    trajectory = Trajectory.from_points(
        'a', [Point(0, [1.0], [0.0], [0.0]), Point(ns, [2.0], [0.0], [0.0])]
    )
    path = joint_path((joint('a'),), trajectory)
    assert path.coefficients[0, 0].tolist() == [1.0, 0.0, 0.0, 10.0, -15.0, 6.0]
    assert path.position(0) == [1.0]
    assert path.position(ns) == [2.0]


def test_arrays_are_read_only():
    path = joint_path((joint('a'),), plan('a', [0.0, 1.0], [[0.0], [1.0]]))
    for array in (path.in_path, path.knots_ns, path.coefficients, path.coefficient_error):
        with pytest.raises(ValueError, match='read-only'):
            array[...] = 0


def test_effort_does_not_shape_the_path():
    bare = [Point(0, [0.0]), Point(SECOND, [1.0])]
    loaded = [point._replace(effort=[5.0]) for point in bare]
    paths = [joint_path((joint('a'),), Trajectory.from_points('a', p)) for p in (bare, loaded)]
    assert paths[0].coefficients.tobytes() == paths[1].coefficients.tobytes()


@pytest.mark.parametrize(
    ('reason', 'names', 'words'),
    [
        (Reason.UNKNOWN_JOINT, ('rail', 'tail'), ["'tail'", "'shoulder'", "'wheel'"]),
        (Reason.MIMIC_JOINT, ('rail', 'second_finger'), ["'second_finger'", "'finger'"]),
        (Reason.FIXED_JOINT, ('rail', 'mount'), ["'mount'"]),
        (Reason.JOINT_POSITION_UNKNOWN, ARM[:3], ["'wheel'", "'finger'"]),
    ],
)
def test_refuses_names(reason, names, words):
    trajectory = plan(names, [0.0, 1.0], np.zeros((2, len(names))))
    with refused(reason, *words):
        joint_path(ROBOT, trajectory)


def test_unknown_positions_name_only_what_is_unknown():
    with pytest.raises(TrajectoryError) as caught:
        joint_path(ROBOT, plan(ARM, [0.0], np.zeros((1, 4))))
    assert 'finger' in str(caught.value)
    assert 'second' not in str(caught.value)
    assert 'rail' not in str(caught.value)


def test_refuses_a_start_that_does_not_agree():
    trajectory = plan(ARM, [0.0, 1.0], np.zeros((2, 4)))
    start = JointState(HOME.joint_names, (0.0, 0.011, 0.0, TURN, 0.0))
    with refused(Reason.START_STATE_MISMATCH, "'shoulder'", '0.011', '0.01'):
        joint_path(ROBOT, trajectory, start)
    path = joint_path(ROBOT, trajectory, start, allowed_start_tolerance=0.02)
    assert path.position(0).tolist() == [0.0, 0.0, 0.0, 0.0, 0.0, 0.005]
    assert path.unknown_until_ns == 0
    with refused(Reason.START_STATE_UNKNOWN, "'wheel'"):
        joint_path(ROBOT, trajectory, JointState((*ARM[:3], 'finger'), (0, 0, 0, 0)))


def test_refuses_to_end_in_motion():
    moving = plan('ab', [0.0, 1.0], np.zeros((2, 2)), [[0.5, 0.5], [0.0, -0.25]])
    robot = (joint('b'), joint('a'))
    with refused(Reason.NONZERO_END_VELOCITY, "'b'", '-0.25'):
        joint_path(robot, moving)
    path = joint_path(robot, moving, allow_nonzero_end_velocity=True)
    assert path.joint_names == ('b', 'a')
    # The controller's own threshold for rest.
    for velocity, rests in ((1.1e-7, True), (1.2e-7, False)):
        slow = plan('a', [0.0, 1.0], [[0.0], [0.0]], [[0.0], [velocity]])
        if rests:
            joint_path((joint('a'),), slow)
        else:
            with refused(Reason.NONZERO_END_VELOCITY):
                joint_path((joint('a'),), slow)


def overshoot():
    """Go from 0 to 0 with a bump of 0.25 in the middle, inside every limit at the points."""
    return plan('a', [0.0, 1.0, 2.0], [[0.0]] * 3, [[0.0], [1.0], [0.0]])


def test_limits_hold_between_the_points():
    bump = 4 / 27
    for limits, word in (((-bump + 1e-3, 1.0), 'lower'), ((-1.0, bump - 1e-3), 'upper')):
        robot = (joint('a', JointType.REVOLUTE, *limits),)
        with refused(Reason.JOINT_LIMIT, "'a'", '0.148148', word):
            joint_path(robot, overshoot())
        path = joint_path(robot, overshoot(), joint_limit_tolerance=2e-3)
        assert path.limits_checked
    joint_path((joint('a', JointType.REVOLUTE, -bump - 1e-9, bump + 1e-9),), overshoot())
    joint_path((joint('a', JointType.CONTINUOUS),), overshoot())


def test_a_limit_excess_says_where():
    with refused(Reason.JOINT_LIMIT, '0.666666', 'point 1', '-0.1'):
        joint_path((joint('a', JointType.REVOLUTE, -0.1, 1.0),), overshoot())
    with refused(Reason.JOINT_LIMIT, '1.33333', 'point 2', '0.1'):
        joint_path((joint('a', JointType.REVOLUTE, -1.0, 0.1),), overshoot())


def test_limits_may_be_left_unchecked_and_the_path_says_so():
    robot = (joint('a', JointType.REVOLUTE, -0.01, 0.01),)
    path = joint_path(robot, overshoot(), check_joint_limits=False)
    assert path.limits_checked is False


def test_limits_hold_on_the_approach():
    trajectory = plan('a', [1.0], [[0.5]], [[0.0]])
    robot = (joint('a', JointType.REVOLUTE, 0.0, 1.0),)
    joint_path(robot, trajectory, JointState('a', [0.2]))
    for start, velocity in ((1.1, 0.0), (-0.1, 0.0), (0.2, -3.0)):
        with refused(Reason.JOINT_LIMIT, "'a'", 'point 0'):
            joint_path(robot, trajectory, JointState('a', [start], [velocity]))


def test_limits_hold_for_mimic_joints():
    with refused(Reason.JOINT_LIMIT, "'follower'", '2.1'):
        joint_path(
            (joint('a'), joint('follower', JointType.REVOLUTE, -1, 2, Mimic('a', 2.0, 0.1))),
            plan('a', [0.0, 1.0], [[0.0], [1.0]]),
        )


def test_limits_do_not_bind_joints_that_are_held():
    start = JointState(HOME.joint_names, (0.0, 0.0, 0.0, 0.0, 0.041))
    joint_path(ROBOT, plan(ARM, [0.0, 1.0], np.zeros((2, 4))), start)


@pytest.mark.parametrize(
    'fields',
    [
        {'q': [[-1e308], [1e308]]},
        {'q': [[0.0], [0.0]], 'v': [[1e308], [0.0]]},
        {'q': [[0.0], [0.0]], 'v': [[0.0], [0.0]], 'a': [[0.0], [1e307]]},
    ],
)
def test_refuses_what_overflows(fields):
    trajectory = plan(
        'ab', [0.0, 10.0], **{k: np.hstack([np.zeros((2, 1)), v]) for k, v in fields.items()}
    )
    robot = (joint('a'), joint('b', JointType.CONTINUOUS))
    with refused(Reason.TOO_LARGE, "'b'", 'point 1'):
        joint_path(robot, trajectory)


def test_refuses_an_offset_that_overflows():
    robot = (joint('a'), joint('b', JointType.CONTINUOUS, mimic=Mimic('a', 1e308, 0.0)))
    with refused(Reason.TOO_LARGE, "'b'", 'point 0'):
        joint_path(robot, plan('a', [0.0], [[5.0]]))


@pytest.mark.parametrize('value', [-1e-9, math.nan, math.inf])
@pytest.mark.parametrize('name', ['allowed_start_tolerance', 'joint_limit_tolerance'])
def test_refuses_tolerances(name, value):
    with refused(Reason.INVALID_PARAMETER, name, str(value), kind=RequestError):
        joint_path((joint('a'),), plan('a', [0.0], [[0.0]]), **{name: value})


def test_ten_thousand_points():
    rng = np.random.default_rng(9)
    q, v, a = rng.uniform(-1, 1, (3, 10_000, 4))
    v[-1] = 0.0
    trajectory = plan(ARM, np.arange(10_000) * 0.01, q * 0.1, v * 0.1, a * 0.1)
    path = joint_path(ROBOT, trajectory, HOME, allowed_start_tolerance=1.0)
    assert path.coefficients.shape == (9_999, 6, 6)
    for i in rng.integers(0, 10_000, 20):
        np.testing.assert_allclose(path.position(int(i) * 10**7)[:4], q[i] * 0.1, atol=1e-15)


def test_no_time_before_the_first_knot_is_left_out() -> None:
    """A path made by hand cannot begin late without saying that it does."""
    with pytest.raises(RequestError, match='unknown_until_ns is 0, the first knot 5'):
        JointPath(('j',), [True], [5, 6], np.zeros((1, 1, 6)), np.zeros((1, 1)), 0, True)
