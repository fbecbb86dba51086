"""Whether the guard is ready, said once for each change."""

from collections.abc import Callable
from contextlib import suppress
from copy import copy
import threading

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from trajectory_guard_interfaces.msg import GuardStatus

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class StatusPublisher:
    """
    Publishes a status whenever it has changed.

    :param node: gets the publisher; its clock gives the stamps.
    :param topic: trajectory_guard_interfaces/GuardStatus, transient local.
    """

    def __init__(self, node: Node, topic: str) -> None:
        self._node = node
        # What is found and what is said must come in the same order.
        self._lock = threading.Lock()
        self._said = GuardStatus()
        self._publisher = node.create_publisher(GuardStatus, topic, LATCHED)

    @property
    def said(self) -> GuardStatus:
        """The last status, without a stamp; at first it is not ready and has no reason."""
        return self._said

    def renew(self, find: Callable[[], GuardStatus]) -> GuardStatus | None:
        """
        Say what holds now; any thread may.

        :param find: returns the status without a stamp.
        :returns: the one before; None: nothing has changed.
        """
        with self._lock:
            before, self._said = self._said, find()
            if self._said == before:
                return None
            stamped = copy(self._said)
            stamped.stamp = self._node.get_clock().now().to_msg()
            # The context may be shut down by now.
            with suppress(Exception):
                self._publisher.publish(stamped)
        return before
