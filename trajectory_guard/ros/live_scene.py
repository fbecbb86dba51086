"""
Live markers as a part of the scene.

A node makes one `LiveScene` with a topic and a callback, which comes after every array, whether it
was taken or refused; it runs in a callback group of the `LiveScene`'s own, one call at a time.
The node then reads `state`, a value, and builds its scene anew::

    live = LiveScene(node, 'markers', changed, limits, lambda: frames_of_the_robot_or_none)

    def changed() -> None:
        state = live.state
        if state.error is not None:
            ...  # not ready: what is shown is not what would be checked
        scene = with_markers(files, state.scene, fixed_frames(robot))  # SceneError: likewise

Before the first array `received_ns` is None: whether to wait for one is up to the node.
"""

from collections.abc import Callable, Mapping
import time

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.event_handler import (
    QoSMessageLostInfo,
    QoSRequestedIncompatibleQoSInfo,
    SubscriptionEventCallbacks,
)
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from visualization_msgs.msg import MarkerArray

from msg_adapters.marker import added_keys, changes_from_message
from trajectory_guard.errors import Reason, SceneError, TrajectoryGuardError
from trajectory_guard.markers.live_markers import LiveMarkers
from trajectory_guard.markers.marker_scene import Frames, MarkerLimits

# What was published before the node came too, and nothing is lost: of a bounded queue, arrays that
# come faster than they are taken would fall out silently, and an obstacle with them.
MARKERS = QoSProfile(
    history=HistoryPolicy.KEEP_ALL,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    reliability=ReliabilityPolicy.RELIABLE,
)


class LiveScene:
    """
    The markers of one topic.

    A publisher that is not transient local and reliable is never heard; since its markers may be
    on show, that is an error, and so is an array that the middleware lost. Only an array that
    begins by removing everything ends them. What a publisher itself has not kept for those who
    come later, as its depth says, nobody can know of.

    :param node: gets the subscription.
    :param topic: visualization_msgs/MarkerArray, reliable and transient local.
    :param on_change: called after every array, and when somebody cannot be heard; it must not
        raise.
    :param limits: how much there may be; the defaults if None.
    :param frames: returns those that markers may be in; None: the robot is not known yet, and
        `with_markers` finds a wrong one.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        on_change: Callable[[], None],
        limits: MarkerLimits | None = None,
        frames: Callable[[], Frames | None] = lambda: None,
    ) -> None:
        self._node = node
        self._on_change = on_change
        self._limits = limits or MarkerLimits()
        self._frames = frames
        self._state = LiveMarkers()
        self._received_ns: int | None = None
        self._subscription = node.create_subscription(
            MarkerArray,
            topic,
            self._take,  # type: ignore[arg-type] # the stubs know of one argument only
            MARKERS,
            callback_group=MutuallyExclusiveCallbackGroup(),
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=self._unheard, message_lost=self._lost
            ),
        )

    @property
    def state(self) -> LiveMarkers:
        """The scene of markers and what is missing in it; a value, replaced as a whole."""
        return self._state

    @property
    def received_ns(self) -> int | None:
        """When the last array that was taken came, on ``time.monotonic_ns`` [ns]."""
        return self._received_ns

    @property
    def topic(self) -> str:
        """The full name of the topic."""
        return str(self._subscription.topic_name)

    def destroy(self) -> None:
        """Stop listening."""
        self._node.destroy_subscription(self._subscription)

    def _take(self, message: MarkerArray, info: Mapping[str, int]) -> None:
        # It may have waited long behind others: markers that lag are old.
        waited_ns = time.time_ns() - (info['received_timestamp'] or time.time_ns())
        received_ns = time.monotonic_ns() - max(waited_ns, 0)
        self._state = self._after(message)
        self._received_ns = received_ns
        self._on_change()

    def _after(self, message: MarkerArray) -> LiveMarkers:
        """Return what is known after an array; whatever goes wrong, nothing is forgotten."""
        try:
            changes = changes_from_message(message, self._limits)
            return self._state.received(changes, self._limits, self._frames())
        except TrajectoryGuardError as error:
            return self._state.refused(error, added_keys(message, self._limits))
        except Exception as error:  # fail closed
            internal = SceneError(Reason.INTERNAL_ERROR, f'markers on {self.topic}: {error!r}')
            return self._state.refused(internal)

    def _unheard(self, event: QoSRequestedIncompatibleQoSInfo) -> None:
        self._incomplete(
            f'{event.total_count} publishers offer another quality of service '
            f'({event.last_policy_kind!r}) than reliable and transient local, and are not heard'
        )

    def _lost(self, event: QoSMessageLostInfo) -> None:
        self._incomplete(f'{event.total_count} arrays were lost on the way')

    def _incomplete(self, words: str) -> None:
        """Remember that something may be shown of which nothing is known."""
        error = SceneError(Reason.SCENE_INVALID, f'markers on {self.topic}: {words}')
        self._state = self._state.refused(error)
        self._on_change()
