"""What a trajectory and a joint state accept, and how they say what they refuse."""

from array import array
from contextlib import contextmanager
import math
import pickle

import numpy as np
import pytest

from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.trajectory import JointState, Point, Trajectory

NAMES = ('a', 'b')
SECOND = 10**9


def point(seconds, positions=(0.0, 0.0), velocities=(), accelerations=(), effort=()):
    return Point(int(seconds * SECOND), positions, velocities, accelerations, effort)


@contextmanager
def refused(reason, *words):
    """Expect a reason and a message that names what is wrong."""
    with pytest.raises(TrajectoryError) as caught:
        yield
    assert caught.value.reason is reason
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_keeps_what_the_points_say():
    trajectory = Trajectory.from_points(
        NAMES,
        [
            point(0, (1.0, 2.0)),
            point(1, (3.0, 4.0), (5.0, 6.0)),
            point(2, (7.0, 8.0), (9.0, 10.0), (11.0, 12.0), (0.0, 0.0)),
        ],
        name='lift',
    )
    assert trajectory.joint_names == NAMES
    assert trajectory.name == 'lift'
    assert trajectory.times_ns.tolist() == [0, SECOND, 2 * SECOND]
    assert trajectory.positions.tolist() == [[1, 2], [3, 4], [7, 8]]
    assert trajectory.velocities.tolist() == [[0, 0], [5, 6], [9, 10]]
    assert trajectory.accelerations.tolist() == [[0, 0], [0, 0], [11, 12]]
    assert trajectory.has_velocities.tolist() == [False, True, True]
    assert trajectory.has_accelerations.tolist() == [False, False, True]


def test_arrays_are_copies_and_read_only():
    positions = np.zeros((1, 2))
    trajectory = Trajectory(
        NAMES, np.zeros(1, dtype=np.int64), positions, positions, [False], positions, [False]
    )
    positions[0, 0] = 1.0
    assert trajectory.positions[0, 0] == 0.0
    for field in ('times_ns', 'positions', 'velocities', 'accelerations', 'has_velocities'):
        with pytest.raises(ValueError, match='read-only'):
            getattr(trajectory, field)[...] = 0


@pytest.mark.parametrize('kind', [list, tuple, np.array, lambda row: array('d', row)])
def test_rows_may_be_any_sequence(kind):
    trajectory = Trajectory.from_points(
        list(NAMES), [point(0, kind([1, 2]), kind([3.5, 4])), point(1, kind([5.0, 6.0]), kind([]))]
    )
    assert trajectory.positions.tolist() == [[1, 2], [5, 6]]
    assert trajectory.velocities.tolist() == [[3.5, 4], [0, 0]]


def test_one_point_is_a_trajectory():
    assert len(Trajectory.from_points(NAMES, [point(0)]).times_ns) == 1


def test_the_largest_time_of_a_message_fits():
    latest = (2**31 - 1) * SECOND + SECOND - 1
    trajectory = Trajectory.from_points(NAMES, [Point(0, (0.0, 0.0)), Point(latest, (1.0, 1.0))])
    assert trajectory.times_ns[1] == latest


@pytest.mark.parametrize(
    ('reason', 'names', 'points', 'words'),
    [
        (Reason.NO_POINTS, NAMES, [], ['no points']),
        (Reason.NO_POINTS, (), [], ['no points']),
        (Reason.NO_JOINTS, (), [point(0, ())], ['no joints']),
        (Reason.DUPLICATE_JOINT, ('a', 'a'), [point(0)], ["'a'"]),
        (Reason.EFFORT_ONLY, NAMES, [point(0), point(1, (), effort=(1.0, 1.0))], ['point 1']),
        (Reason.MISSING_POSITIONS, NAMES, [point(0), point(1, (), (1.0, 1.0))], ['point 1']),
        (Reason.MISSING_POSITIONS, NAMES, [point(0, ())], ['point 0']),
        (Reason.SIZE_MISMATCH, NAMES, [point(0, (1.0,))], ['point 0', '1 positions', '2 joints']),
        (Reason.SIZE_MISMATCH, NAMES, [point(0, velocities=(1.0,) * 3)], ['3 velocities']),
        (
            Reason.SIZE_MISMATCH,
            NAMES,
            [point(0, velocities=(0.0, 0.0), accelerations=(1.0,))],
            ['1 accelerations'],
        ),
        (Reason.SIZE_MISMATCH, NAMES, [point(0, effort=(1.0,))], ['1 effort']),
        (
            Reason.ACCELERATIONS_WITHOUT_VELOCITIES,
            NAMES,
            [point(0), point(1, accelerations=(0.0, 0.0))],
            ['point 1'],
        ),
        (Reason.NEGATIVE_TIME, NAMES, [point(-1), point(1)], ['point 0', '-1000000000']),
        (Reason.UNSORTED_TIMES, NAMES, [point(0), point(2), point(1)], ['point 2', 'point 1']),
        (Reason.UNSORTED_TIMES, NAMES, [point(1), point(1)], ['point 1']),
        (Reason.TOO_LARGE, NAMES, [Point(2**63, (0.0, 0.0))], ['point 0', '64 bits']),
        (Reason.TRAJECTORY_UNREADABLE, NAMES, [Point(0.5, (0.0, 0.0))], ['point 0', '0.5']),
        (Reason.TRAJECTORY_UNREADABLE, NAMES, [point(0, ('1.0', '2.0'))], ['positions']),
        (Reason.TRAJECTORY_UNREADABLE, NAMES, [point(0, (None, 2.0))], ['positions']),
        (Reason.TRAJECTORY_UNREADABLE, NAMES, [point(0, ((1.0,), 2.0))], ['positions']),
        (Reason.TRAJECTORY_UNREADABLE, NAMES, [point(0, ((1.0,), (2.0,)))], ['positions']),
        (Reason.TRAJECTORY_UNREADABLE, NAMES, [point(0, 3.0)], ['point 0', 'positions', '3.0']),
        (Reason.TRAJECTORY_UNREADABLE, ('a', 7), [point(0)], ['7']),
    ],
)
def test_refuses(reason, names, points, words):
    with refused(reason, *words):
        Trajectory.from_points(names, points)


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ('field', 'word'),
    [
        ('positions', 'position'),
        ('velocities', 'velocity'),
        ('accelerations', 'acceleration'),
        ('effort', 'effort'),
    ],
)
def test_refuses_what_is_not_finite(field, word, value):
    fields = dict.fromkeys(('positions', 'velocities', 'accelerations', 'effort'), (0.0, 0.0))
    fields[field] = (0.0, value)
    with refused(Reason.NOT_FINITE, 'point 1', "'b'", word, str(value)):
        Trajectory.from_points(NAMES, [point(0), point(1, **fields)])


def test_the_constructor_checks_as_well():
    good = {
        'joint_names': NAMES,
        'times_ns': np.array([0, 1]),
        'positions': np.zeros((2, 2)),
        'velocities': np.zeros((2, 2)),
        'has_velocities': [True, True],
        'accelerations': np.zeros((2, 2)),
        'has_accelerations': [True, True],
    }
    Trajectory(**good)
    for field, wrong, reason in (
        ('joint_names', ('a', 'a'), Reason.DUPLICATE_JOINT),
        ('times_ns', np.array([0.0, 1.0]), Reason.TRAJECTORY_UNREADABLE),
        ('times_ns', np.array([1, 0]), Reason.UNSORTED_TIMES),
        ('positions', np.zeros((2, 3)), Reason.SIZE_MISMATCH),
        ('positions', np.full((2, 2), np.nan), Reason.NOT_FINITE),
        ('has_velocities', [True], Reason.SIZE_MISMATCH),
        ('has_velocities', [True, False], Reason.ACCELERATIONS_WITHOUT_VELOCITIES),
    ):
        with refused(reason):
            Trajectory(**{**good, field: wrong})


def test_joint_state_keeps_its_values():
    state = JointState(['a', 'b'], [1, 2.5])
    assert state.joint_names == NAMES
    assert state.positions.tolist() == [1.0, 2.5]
    assert state.velocities is None
    assert JointState(NAMES, (0, 0), array('d', [3, 4])).velocities.tolist() == [3.0, 4.0]
    with pytest.raises(ValueError, match='read-only'):
        state.positions[0] = 0.0


@pytest.mark.parametrize(
    ('reason', 'arguments', 'words'),
    [
        (Reason.NO_JOINTS, ((), ()), ['no joints']),
        (Reason.DUPLICATE_JOINT, (('a', 'a'), (0.0, 0.0)), ["'a'"]),
        (Reason.SIZE_MISMATCH, (NAMES, (0.0,)), ['positions']),
        (Reason.SIZE_MISMATCH, (NAMES, (0.0, 0.0), ()), ['velocities']),
        (Reason.NOT_FINITE, (NAMES, (0.0, math.nan)), ["'b'", 'position', 'nan']),
        (Reason.NOT_FINITE, (NAMES, (0.0, 0.0), (math.inf, 0.0)), ["'a'", 'velocity', 'inf']),
        (Reason.TRAJECTORY_UNREADABLE, (NAMES, ('1', '2')), ['positions']),
        (Reason.TRAJECTORY_UNREADABLE, (NAMES, None), ['positions']),
    ],
)
def test_joint_state_refuses(reason, arguments, words):
    with refused(reason, *words):
        JointState(*arguments)


def test_errors_survive_pickling():
    error = pickle.loads(pickle.dumps(TrajectoryError(Reason.NO_POINTS, 'nothing')))
    assert type(error) is TrajectoryError
    assert error.reason is Reason.NO_POINTS
    assert str(error) == 'nothing'


def test_reasons_are_their_codes():
    assert {str(reason) for reason in Reason} == {reason.name.lower() for reason in Reason}
    assert f'{Reason.JOINT_LIMIT}' == 'joint_limit'
