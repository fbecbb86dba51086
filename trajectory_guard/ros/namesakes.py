"""Other guards of the same name, of which a client cannot tell whom it asks."""

from collections.abc import Callable

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.duration import Duration
from rclpy.event_handler import QoSLivelinessChangedInfo, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile
from trajectory_guard_interfaces.msg import GuardStatus

TOPIC = '~/status'

# A process that was killed stays in the graph for 20 s or so, and the guard that takes its place
# must not wait for that: whoever publishes a status is asserted alive by the middleware, and is
# not any more after this time [s].
LEASE = 2.0

STATUS = QoSProfile(
    depth=1,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    liveliness=LivelinessPolicy.AUTOMATIC,
    liveliness_lease_duration=Duration(seconds=LEASE),
)


class Namesakes:
    """
    Watches for other nodes of the node's full name whose status is alive.

    :param node: publishes its own status on `TOPIC` with the quality of service `STATUS`.
    :param on_change: called in the node's executor whenever one comes or goes.
    """

    def __init__(self, node: Node, on_change: Callable[[], None]) -> None:
        self._node = node
        self._on_change = on_change
        self._alive = 0
        node.create_subscription(
            GuardStatus,
            TOPIC,
            lambda _: None,
            STATUS,
            callback_group=MutuallyExclusiveCallbackGroup(),
            event_callbacks=SubscriptionEventCallbacks(liveliness=self._changed),
        )

    @property
    def any(self) -> bool:
        """
        Whether there is one.

        Some middlewares count the node's own status among those alive, Fast DDS does not; so the
        name must be in the graph twice, too.
        """
        if not self._alive:
            return False
        mine = (self._node.get_name(), self._node.get_namespace())
        return self._node.get_node_names_and_namespaces().count(mine) > 1

    def _changed(self, event: QoSLivelinessChangedInfo) -> None:
        self._alive = event.alive_count
        self._on_change()
