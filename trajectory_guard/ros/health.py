"""What a node says of itself on /diagnostics."""

from collections.abc import Callable
import socket

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from trajectory_guard.ros.tally import Tally

TOPIC = '/diagnostics'
PERIOD = 1.0
QUEUE = 10

# A failure to publish is said this often [s].
SAY_AGAIN = 10.0


class Health:
    """
    Publishes one status of a node every second, and at once where it changes.

    The status is named `<node>: <name>` with the namespace before the node, its hardware_id is the
    host, and its values are the counts of a `Tally`. Nothing here raises once it is made: what is
    said of a decision must not change it.

    :param node: whose status it is; its clock stamps, its executor serves.
    :param name: what the status is about.
    :param state: level (of diagnostic_msgs/DiagnosticStatus) and text, asked at each publication,
        in the thread that publishes; where it raises, the status is an error.
    """

    def __init__(self, node: Node, name: str, state: Callable[[], tuple[bytes, str]]) -> None:
        self._node = node
        self._state = state
        self._name = f'{node.get_fully_qualified_name().lstrip("/")}: {name}'
        self._host = socket.gethostname()
        self._tally = Tally()
        self._publisher = node.create_publisher(DiagnosticArray, TOPIC, QUEUE)
        # On the steady clock: a simulation that stands still must not look like a dead node.
        node.create_timer(
            PERIOD,
            self.changed,
            callback_group=MutuallyExclusiveCallbackGroup(),
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )

    def count(self, outcome: str, reason: str, seconds: float, message: str = '') -> None:
        """
        Count one decision; any thread may.

        :param outcome: what was decided, for instance 'free'.
        :param reason: stable code of the reason; '': there is none.
        :param seconds: how long it took [s].
        :param message: the reason in words.
        """
        self._tally.count(outcome, reason, seconds, message)

    def changed(self) -> None:
        """Publish now; any thread may, but none that holds what `state` waits for."""
        try:
            self._publisher.publish(self._message())
        except Exception as error:  # ROS is being shut down, or worse
            self._node.get_logger().error(
                f'cannot publish {TOPIC}: {error!r}', throttle_duration_sec=SAY_AGAIN
            )

    def _message(self) -> DiagnosticArray:
        try:
            level, text = self._state()
        except Exception as error:
            level, text = DiagnosticStatus.ERROR, f'the state is not known: {error!r}'
        status = DiagnosticStatus(
            level=level,
            name=self._name,
            message=text,
            hardware_id=self._host,
            values=[KeyValue(key=key, value=value) for key, value in self._tally.entries()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        return message
