"""Which joints are known well enough, whoever tells of them."""

import math

from builtin_interfaces.msg import Time
import pytest
from sensor_msgs.msg import JointState

from trajectory_guard.ros.gate_states import FORGOTTEN_NS, JointStates, MOST_JOINTS

SECOND = 10**9
NOW = 1_700_000_000 * SECOND
AGE = SECOND // 10


def state(stamp_ns: int = NOW, **positions: float) -> JointState:
    """Return a message with velocities of 0."""
    message = JointState(name=list(positions), position=list(positions.values()))
    message.velocity = [0.0] * len(positions)
    message.header.stamp = Time(sec=stamp_ns // SECOND, nanosec=stamp_ns % SECOND)
    return message


def test_several_publishers_each_know_some() -> None:
    states = JointStates()
    states.take(state(a=1.0, b=2.0), 0)
    states.take(state(NOW + 5, c=3.0, b=4.0), 5)
    fresh = states.fresh(10, NOW + 10, AGE)
    assert {name: joint.position for name, joint in fresh.items()} == {'a': 1, 'b': 4, 'c': 3}
    assert {name: joint.age_ns for name, joint in fresh.items()} == {'a': 10, 'b': 5, 'c': 5}


@pytest.mark.parametrize(
    ('arrived_ns', 'stamp_ns', 'is_fresh'),
    [
        (0, NOW, True),
        (-AGE, NOW, True),
        (-AGE - 1, NOW, False),
        (0, NOW - AGE, True),
        (0, NOW - AGE - 1, False),
        (0, NOW + AGE, True),
        (0, NOW + AGE + 1, False),
        (0, 0, False),
    ],
)
def test_fresh_by_both_clocks(arrived_ns: int, stamp_ns: int, is_fresh: bool) -> None:
    states = JointStates()
    states.take(state(stamp_ns, a=1.0), arrived_ns)
    assert bool(states.fresh(0, NOW, AGE)) == is_fresh
    assert bool(states.complaint(0, NOW, AGE)) != is_fresh


@pytest.mark.parametrize(
    'nonsense',
    [
        JointState(name=['a', 'b'], position=[1.0]),
        JointState(name=['a'], position=[1.0], velocity=[0.0, 0.0]),
        JointState(name=['a', 'a'], position=[1.0, 1.0]),
        JointState(name=['a'], position=[math.nan]),
        JointState(name=['a'], position=[math.inf]),
        JointState(name=['a'], position=[1.0], velocity=[math.inf]),
        JointState(name=['a']),
    ],
    ids=str,
)
def test_nonsense_makes_a_joint_unknown(nonsense: JointState) -> None:
    states = JointStates()
    states.take(state(a=1.0, c=1.0), 0)
    nonsense.header.stamp = state().header.stamp
    states.take(nonsense, 0)
    assert [*states.fresh(0, NOW, AGE)] == ['c']


def test_velocities_may_be_missing() -> None:
    states = JointStates()
    message = state(a=1.0, b=1.0)
    message.velocity = [0.5, math.nan]
    states.take(message, 0)
    message = state(c=1.0)
    message.velocity = []
    states.take(message, 0)
    fresh = states.fresh(0, NOW, AGE)
    assert fresh['a'].velocity == 0.5
    assert math.isnan(fresh['b'].velocity)
    assert math.isnan(fresh['c'].velocity)


def test_the_memory_is_bounded() -> None:
    states = JointStates()
    states.take(state(a=1.0), 0)
    states.take(state(**{f'j{i}': 0.0 for i in range(MOST_JOINTS)}), 0)
    assert [*states.fresh(0, NOW, AGE)] == ['a']


def test_complaint_names_the_joint_until_it_is_forgotten() -> None:
    states = JointStates()
    assert 'no joint state' in states.complaint(0, NOW, AGE)
    states.take(state(gone=1.0), 0)
    states.take(state(NOW + SECOND, a=1.0), SECOND)
    assert "'gone'" in states.complaint(SECOND, NOW + SECOND, AGE)
    later = FORGOTTEN_NS + 1
    states.take(state(NOW + later, a=1.0), later)
    assert states.complaint(later, NOW + later, AGE) == ''
