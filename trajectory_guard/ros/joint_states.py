"""Where the robot is, as its joint states say."""

from collections.abc import Collection, Mapping
from contextlib import suppress
import math
import time
from types import SimpleNamespace
from typing import NamedTuple

from rclpy.callback_groups import CallbackGroup, MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState as JointStateMessage

from msg_adapters.trajectory import joint_state_from_message, nanoseconds_from_message
from trajectory_guard.paths.trajectory import JointState
from trajectory_guard.result import NANOSECONDS

# What came since the last look is read this often [s], ...
PERIOD = 0.02

# ... and there is no more of it than this: four publishers at 1 kHz.
STATES = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)


class Measured(NamedTuple):
    """
    What was last said of one joint.

    :param position: [rad or m]; NaN: not measured.
    :param velocity: [rad/s or m/s]; NaN: not measured.
    :param received_ns: when, on the steady clock, at the latest what it may have been [ns].
    :param stamp_ns: of the message, on the node's clock; 0: none [ns].
    """

    position: float
    velocity: float
    received_ns: int
    stamp_ns: int


class _Aside(CallbackGroup):
    """Its entities are left alone by the executor."""

    def can_execute(self, entity: object) -> bool:
        return False

    def beginning_execution(self, entity: object) -> bool:
        return False

    def ending_execution(self, entity: object) -> None:
        pass


class JointStates:
    """
    The latest state of every joint, whoever publishes it.

    An executor that wakes for each of a thousand messages a second takes a whole core, and hears
    few of them; here they are taken from the middleware together, fifty times a second.

    :param node: gets the subscription; stamps are compared with its clock.
    :param topic: sensor_msgs/JointState.
    :param most: joints that are kept; where there are more, all is forgotten.
    """

    def __init__(self, node: Node, topic: str, most: int) -> None:
        self._node = node
        self._most = most
        self._joints: dict[str, Measured] = {}
        self._looked_ns = time.monotonic_ns()
        self._subscription = node.create_subscription(
            JointStateMessage, topic, lambda _: None, STATES, callback_group=_Aside()
        )
        # On the steady clock: a simulation that stands still must not hold old states fresh.
        self._timer = node.create_timer(
            PERIOD,
            self._look,
            callback_group=MutuallyExclusiveCallbackGroup(),
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )

    @property
    def topic(self) -> str:
        """The full name of the topic."""
        return str(self._subscription.topic_name)

    def destroy(self) -> None:
        """Stop listening."""
        self._node.destroy_timer(self._timer)
        self._node.destroy_subscription(self._subscription)

    def _look(self) -> None:
        # Whatever is found now came after the look before, maybe at once.
        received, self._looked_ns = self._looked_ns, time.monotonic_ns()
        with suppress(InvalidHandle), self._subscription.handle:
            for _ in range(STATES.depth):
                taken = self._subscription.handle.take_message(JointStateMessage, False)
                if taken is None:
                    return
                self.take(taken[0], received)

    def take(self, message: JointStateMessage, received_ns: int) -> None:
        """
        Keep what a message says; one whose fields do not fit together says nothing.

        :param message: sensor_msgs/JointState.
        :param received_ns: when it came, or earlier, on the steady clock [ns].
        """
        names, positions = message.name, message.position
        velocities = message.velocity or [math.nan] * len(names)
        if len(names) > self._most or not len(names) == len(positions) == len(velocities):
            self._node.get_logger().warning(
                f'a joint state with {len(names)} names, {len(positions)} positions and '
                f'{len(velocities)} velocities is ignored; max_joints is {self._most}',
                throttle_duration_sec=10.0,
            )
            return
        if len(self._joints) + len(names) > 2 * self._most:
            self._joints = {}
        stamp = nanoseconds_from_message(message.header.stamp)
        for name, position, velocity in zip(names, positions, velocities, strict=True):
            self._joints[name] = Measured(position, velocity, received_ns, stamp)

    def fresh(self, wanted: Collection[str], max_age: float) -> tuple[JointState, float] | None:
        """
        Return the state of those of some joints of which it is known.

        A state is fresh if it came in time, by the steady clock, and its stamp, if it has one,
        is neither older than that nor as far in the future, by the node's clock.

        :param wanted: names of joints.
        :param max_age: [s].
        :returns: the state, and the age of the oldest part of it [s]; None: nothing is known.
        """
        limit = round(max_age * NANOSECONDS)
        now, stamp_now = time.monotonic_ns(), self._node.get_clock().now().nanoseconds
        found, oldest = {}, 0
        for name in wanted:
            joint = self._joints.get(name)
            if joint is None or not math.isfinite(joint.position) or math.isinf(joint.velocity):
                continue
            age = now - joint.received_ns
            if joint.stamp_ns:
                age = max(age, abs(stamp_now - joint.stamp_ns))
            if age <= limit:
                found[name] = joint
                oldest = max(oldest, age)
        return (_state(found), oldest / NANOSECONDS) if found else None


def _state(joints: Mapping[str, Measured]) -> JointState:
    """Return a state by the same rules as that of a request."""
    return joint_state_from_message(
        SimpleNamespace(
            name=[*joints],
            position=[joint.position for joint in joints.values()],
            velocity=[joint.velocity for joint in joints.values()],
        )
    )
