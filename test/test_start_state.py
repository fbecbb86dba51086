"""The segment before the first point, and what a start state must agree with."""

from fractions import Fraction
import math

import numpy as np
import pytest

from trajectory_guard.cell.robot import Joint, JointType
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.hermite import Knots
from trajectory_guard.paths.start_state import with_start
from trajectory_guard.paths.trajectory import JointState

# More digits of 2 pi than a float has.
TURN = Fraction(6283185307179586476925286766559005768394338798750, 10**48)


def joints(kind=JointType.REVOLUTE, names='ab'):
    axis = np.array([0.0, 0.0, 1.0])
    return [Joint(name, kind, 'p', 'c', np.eye(4), axis, -9.0, 9.0) for name in names]


def knots(time_ns, q, v=None, a=None):
    zero = np.zeros((1, len(q)))
    return Knots(
        times_ns=np.array([time_ns]),
        positions=np.array([q], dtype=float),
        velocities=zero if v is None else np.array([v], dtype=float),
        has_velocities=np.array([v is not None]),
        accelerations=zero if a is None else np.array([a], dtype=float),
        has_accelerations=np.array([a is not None]),
        start_error=np.zeros(len(q)),
    )


def shortest(start, target):
    """Turn as the controller does, in its own arithmetic; returns where it starts from."""
    angle = math.fmod(target - start + math.pi, 2 * math.pi)
    distance = angle + math.pi if angle <= 0.0 else angle - math.pi
    return target - distance


def test_without_a_start_nothing_is_added():
    only = knots(5, [1.0, 2.0])
    assert with_start(only, joints(), None, 0.01, ()) is only
    assert with_start(only, joints(), JointState(['x'], [0.0]), 0.01, ()) is only


def test_a_start_state_that_gives_only_some_joints_is_refused():
    for time_ns in (0, 5):
        with pytest.raises(TrajectoryError, match="'b'") as caught:
            with_start(knots(time_ns, [0, 0]), joints(), JointState(['a'], [0.0]), 0.01, ())
        assert caught.value.reason is Reason.START_STATE_UNKNOWN


@pytest.mark.parametrize('start_velocity', [None, (7.0, 8.0)])
@pytest.mark.parametrize('derivatives', [{}, {'v': [3, 4]}, {'v': [3, 4], 'a': [5, 6]}])
def test_the_start_takes_the_derivatives_of_point_0(start_velocity, derivatives):
    # Names in another order, and one the trajectory does not have.
    velocity = None if start_velocity is None else [start_velocity[1], 0.0, start_velocity[0]]
    start = JointState(['b', 'x', 'a'], [0.2, 9.0, 0.1], velocity)
    added = with_start(knots(5, [1, 2], **derivatives), joints(), start, 0.01, ())
    assert added.times_ns.tolist() == [0, 5]
    assert added.positions.tolist() == [[0.1, 0.2], [1, 2]]
    assert added.velocities[0].tolist() == list(start_velocity or (0.0, 0.0))
    assert added.accelerations[0].tolist() == [0.0, 0.0]
    assert added.has_velocities.tolist() == ['v' in derivatives] * 2
    assert added.has_accelerations.tolist() == ['a' in derivatives] * 2
    assert not added.start_error.any()


def test_point_0_at_time_0_must_agree():
    only = knots(0, [1.0, 2.0])
    assert with_start(only, joints(), JointState('ab', [1.009, 1.991]), 0.01, ()) is only
    for wrong in (1.02, 1.0 + 2 * math.pi):
        with pytest.raises(TrajectoryError, match="'a' starts at") as caught:
            with_start(only, joints(), JointState('ab', [wrong, 2.0]), 0.01, ())
        assert caught.value.reason is Reason.START_STATE_MISMATCH


def test_whole_turns_of_a_continuous_joint_agree():
    only = knots(0, [1.0])
    wheel = joints(JointType.CONTINUOUS, 'a')
    for turns in (-3, 0, 1, 1000):
        start = JointState('a', [1.005 + turns * 2 * math.pi])
        assert with_start(only, wheel, start, 0.01, ()) is only
        with pytest.raises(TrajectoryError):
            with_start(only, wheel, JointState('a', [1.02 + turns * 2 * math.pi]), 0.01, ())


def test_continuous_joints_turn_the_short_way():
    rng = np.random.default_rng(6)
    wheel = joints(JointType.CONTINUOUS, 'a')
    for _ in range(500):
        start = rng.uniform(-3, 3) * 10.0 ** rng.integers(0, 7)
        far = rng.integers(-2, 3) * 10 ** rng.integers(0, 6)
        target = start + far * 2 * math.pi + rng.uniform(-3.1, 3.1)
        added = with_start(knots(5, [target]), wheel, JointState('a', [start]), 1e-6, ())
        position, error = added.positions[0, 0], added.start_error[0]
        assert abs(target - position) <= math.pi
        turns = round((position - start) / (2 * math.pi))
        assert abs(Fraction(position) - Fraction(start) - turns * TURN) <= Fraction(error)
        assert abs(position - shortest(start, target)) <= error or turns == 0
        assert (error == 0.0) == (turns == 0)


def test_other_joints_go_all_the_way():
    added = with_start(knots(5, [6.0, 0.5]), joints(), JointState('ab', [-6.0, 0.0]), 0.01, ())
    assert added.positions[0].tolist() == [-6.0, 0.0]


@pytest.mark.parametrize('off', [-0.009, 0.0, 0.009])
def test_half_a_turn_leaves_the_direction_open(off):
    wheel = joints(JointType.CONTINUOUS, 'a')
    start = JointState('a', [0.3])
    with pytest.raises(TrajectoryError, match=r"'a'.*half a turn") as caught:
        with_start(knots(5, [0.3 + math.pi + off]), wheel, start, 0.01, ())
    assert caught.value.reason is Reason.START_STATE_MISMATCH
    ahead = with_start(knots(5, [0.3 + math.pi - 0.011]), wheel, start, 0.01, ())
    assert ahead.positions[0, 0] < ahead.positions[1, 0]
    back = with_start(knots(5, [0.3 + math.pi + 0.011]), wheel, start, 0.01, ())
    assert back.positions[0, 0] > back.positions[1, 0]


def test_a_mimicked_joint_may_not_turn_by_whole_turns():
    wheel = joints(JointType.CONTINUOUS, 'a')
    with_start(knots(5, [1.0]), wheel, JointState('a', [0.0]), 0.01, {'a'})
    far = JointState('a', [1.0 - 2 * math.pi])
    for time_ns in (0, 5):
        with pytest.raises(TrajectoryError, match='mimic') as caught:
            with_start(knots(time_ns, [1.0]), wheel, far, 0.01, {'a'})
        assert caught.value.reason is Reason.START_STATE_MISMATCH


@pytest.mark.parametrize('far', [1e300, -1e300, 1.7e308])
def test_a_start_beyond_all_turns_is_refused(far):
    wheel = joints(JointType.CONTINUOUS, 'a')
    with pytest.raises(TrajectoryError):
        with_start(knots(5, [1.0]), wheel, JointState('a', [far]), 0.01, ())
