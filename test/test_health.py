"""A node's status on /diagnostics, heard over real DDS."""

import queue
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from guard_process import ros_context, spinning
import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.time import Time

from trajectory_guard.ros.health import Health

SOON = 30.0


class Listener:
    """A node of health, and what is heard of it."""

    def __init__(self, context, state, name):
        self.heard = queue.Queue()
        self.node = Node(name, namespace='left', context=context)
        self.health = Health(self.node, 'certification', state)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 10)

    def _hear(self, message):
        if message.status[0].name == f'left/{self.node.get_name()}: certification':
            self.heard.put(message)

    def next(self, wanted):
        """Return the next message that is as wanted."""
        while True:
            message = self.heard.get(timeout=SOON)
            if wanted(message.status[0]):
                return message


@pytest.fixture(scope='module')
def listener():
    """Return a function that makes listeners."""
    with ros_context() as context:
        executor = SingleThreadedExecutor(context=context)

        def make(state, name):
            made = Listener(context, state, name)
            executor.add_node(made.node)
            return made

        with spinning(executor):
            yield make


def test_says_itself_every_second(listener):
    """The status comes by itself, again and again, stamped by the node's clock."""
    one = listener(lambda: (DiagnosticStatus.OK, 'ready'), 'periodic')
    messages = [one.next(lambda status: True) for _ in range(3)]
    stamps = [Time.from_msg(message.header.stamp).nanoseconds * 1e-9 for message in messages]
    assert 1.0 < stamps[2] - stamps[0] < SOON
    assert abs(time.time() - stamps[2]) < SOON
    (status,) = messages[0].status
    assert (status.level, status.message) == (DiagnosticStatus.OK, 'ready')
    assert status.hardware_id


def test_says_changes_at_once_with_the_counts(listener):
    """What was counted is in the message, and a change does not wait for the next second."""
    level = DiagnosticStatus.OK
    one = listener(lambda: (level, 'text'), 'changing')
    one.next(lambda status: True)
    one.health.count('suspect', 'deadline', 0.25, 'no time left')
    level = DiagnosticStatus.WARN
    begin = time.monotonic()
    one.health.changed()
    found = one.next(lambda status: status.level == DiagnosticStatus.WARN).status[0]
    assert time.monotonic() - begin < 0.5
    found = {each.key: each.value for each in found.values}
    assert found['outcome suspect'] == found['reason deadline'] == '1'
    assert found['latency p99 [s]'] == '0.250000'
    assert found['last message'] == 'no time left'


@pytest.mark.parametrize(
    ('name', 'broken'),
    [
        ('raises', lambda: {}['state']),
        ('nonsense', lambda: ('text', 1)),
    ],
)
def test_a_state_that_fails_is_an_error_or_is_logged(listener, name, broken):
    """Whoever says a change gets no exception for it, and the next good state is heard."""
    states = [broken]
    one = listener(lambda: states[-1](), name)
    one.health.changed()
    if name == 'raises':
        found = one.next(lambda status: True).status[0]
        assert found.level == DiagnosticStatus.ERROR
        assert 'KeyError' in found.message
    states.append(lambda: (DiagnosticStatus.OK, 'mended'))
    one.health.changed()
    one.next(lambda status: status.message == 'mended')


def test_says_nothing_after_the_end_of_ros():
    """A decision that is made while ROS ends is not changed by it."""
    with ros_context() as context:
        node = Node('ending', context=context)
        health = Health(node, 'certification', lambda: (DiagnosticStatus.OK, ''))
    health.count('free', '', 0.0)
    health.changed()
    node.destroy_node()
    health.changed()
