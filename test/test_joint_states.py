"""What is known of the joints, and for how long."""

from collections.abc import Iterator
import math
import time

from guard_process import ros_context
import numpy as np
import pytest
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from sensor_msgs.msg import JointState as JointStateMessage

from trajectory_guard.ros.joint_states import JointStates

# One is fresh so long [s].
AGE = 0.5


@pytest.fixture(scope='module')
def node() -> Iterator[Node]:
    with ros_context() as context:
        simulated = [Parameter('use_sim_time', value=True)]
        yield Node('robot', context=context, parameter_overrides=simulated, cli_args=[])


@pytest.fixture
def states(node: Node) -> Iterator[JointStates]:
    set_clock(node, 1000.0)
    made = JointStates(node, 'joint_states', 8)
    yield made
    made.destroy()


def set_clock(node: Node, seconds: float) -> None:
    """Set the simulated clock of the node, as a message on /clock does."""
    node.get_clock().set_ros_time_override(
        Time(nanoseconds=round(seconds * 1e9), clock_type=ClockType.ROS_TIME)
    )


def say(states: JointStates, age: float = 0.0, stamp: float = 0.0, **positions: float) -> None:
    """Take a message that came some time ago [s]."""
    message = JointStateMessage(name=[*positions], position=[*positions.values()])
    message.header.stamp = Time(nanoseconds=round(stamp * 1e9)).to_msg()
    states.take(message, time.monotonic_ns() - round(age * 1e9))


def known(states: JointStates, *wanted: str) -> dict[str, float]:
    """Return the positions of the joints of which it is known."""
    found = states.fresh(wanted or ('a', 'b', 'c'), AGE)
    return dict(zip(found[0].joint_names, found[0].positions, strict=True)) if found else {}


def test_parts_add_up_and_each_has_its_own_age(states: JointStates) -> None:
    assert known(states) == {}
    say(states, a=1.0, b=2.0)
    say(states, age=0.3, c=3.0)
    assert known(states) == {'a': 1.0, 'b': 2.0, 'c': 3.0}
    assert known(states, 'c', 'd') == {'c': 3.0}
    found = states.fresh(['a', 'c'], AGE)
    assert found is not None and 0.3 <= found[1] < 0.45
    time.sleep(0.25)
    assert known(states) == {'a': 1.0, 'b': 2.0}
    say(states, b=7.0)
    assert known(states)['b'] == 7.0


@pytest.mark.parametrize(
    ('stamp', 'fresh'),
    [(0.0, True), (1000.0, True), (999.6, True), (1000.4, True), (999.4, False), (1000.6, False)],
)
def test_a_stamp_is_neither_old_nor_in_the_future(
    states: JointStates, stamp: float, fresh: bool
) -> None:
    say(states, stamp=stamp, a=1.0)
    assert bool(known(states)) is fresh


def test_a_clock_that_jumps_makes_nothing_fresh(node: Node, states: JointStates) -> None:
    say(states, stamp=1000.0, a=1.0)
    for now in (900.0, 1100.0):
        set_clock(node, now)
        assert known(states) == {}
    # By its stamp it is fresh again, but it came too long ago: a simulation that stands still.
    say(states, age=0.6, stamp=1000.0, a=1.0)
    set_clock(node, 1000.0)
    assert known(states) == {}
    set_clock(node, 1000.2)
    say(states, stamp=1000.0, a=1.0)
    assert known(states) == {'a': 1.0}


def test_what_is_not_measured_is_not_known(states: JointStates) -> None:
    say(states, a=math.nan, b=math.inf, c=1.0)
    assert known(states) == {'c': 1.0}
    message = JointStateMessage(name=['a', 'c'], position=[1.0, 2.0], velocity=[3.0, math.nan])
    states.take(message, time.monotonic_ns())
    found = states.fresh(['a', 'c'], AGE)
    assert found is not None
    assert dict(zip(found[0].joint_names, found[0].velocities, strict=True)) == {'a': 3, 'c': 0}
    message.velocity = [math.inf, 0.0]
    states.take(message, time.monotonic_ns())
    assert known(states) == {'c': 2.0}


@pytest.mark.parametrize(
    'message',
    [
        JointStateMessage(name=['a'], position=[1.0, 2.0]),
        JointStateMessage(name=['a', 'b'], position=[1.0]),
        JointStateMessage(name=['a'], position=[1.0], velocity=[1.0, 2.0]),
        JointStateMessage(name=[f'j{i}' for i in range(9)], position=[0.0] * 9),
    ],
)
def test_a_message_that_is_none_says_nothing(
    states: JointStates, message: JointStateMessage
) -> None:
    say(states, a=0.5)
    states.take(message, time.monotonic_ns())
    assert known(states, 'a', 'j1') == {'a': 0.5}


def test_joints_that_come_and_go_do_not_pile_up(states: JointStates) -> None:
    for i in range(1000):
        say(states, **{f'j{i}': 1.0, f'k{i}': 2.0})
    assert len(states._joints) <= 16
    assert known(states, 'j999', 'k999') == {'j999': 1.0, 'k999': 2.0}


def test_reads_what_was_published(node: Node, states: JointStates) -> None:
    publisher = node.create_publisher(JointStateMessage, 'joint_states', 10)
    end = time.monotonic() + 20.0
    positions = np.linspace(0.0, 1.0, 50)
    while not known(states) and time.monotonic() < end:
        for position in positions:
            publisher.publish(JointStateMessage(name=['a'], position=[position]))
        time.sleep(0.05)
        states._look()
    assert known(states) == {'a': 1.0}
    # It may have come right after the look before.
    states._look()
    found = states.fresh(['a'], AGE)
    assert found is not None and found[1] >= 0.04
