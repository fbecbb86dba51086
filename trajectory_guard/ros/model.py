"""Robot and scene of the guard, from files and from topics."""

from collections.abc import Callable
import threading
import time

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription
from std_msgs.msg import String

from trajectory_guard.cell.robot import Robot
from trajectory_guard.cell.scene import load_scene, Scene
from trajectory_guard.cell.urdf import load_robot, robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.errors import Reason, RequestError, SceneError, TrajectoryGuardError
from trajectory_guard.markers.marker_scene import fixed_frames, Frames, with_markers
from trajectory_guard.result import NANOSECONDS
from trajectory_guard.ros.configuration import Configuration
from trajectory_guard.ros.live_scene import LiveScene

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Model:
    """
    What requests are judged against: one value, replaced as a whole.

    :param node: gets the subscriptions.
    :param configuration: names files and topics.
    :param on_change: called after every change, in the node's executor.
    :raises TrajectoryGuardError: a file cannot be used.
    """

    def __init__(
        self, node: Node, configuration: Configuration, on_change: Callable[[], None]
    ) -> None:
        self._node = node
        self._limits = configuration.mesh_limits
        self._on_change = on_change
        self._lock = threading.Lock()
        self._files: Scene | None = None
        if configuration.scene_files:
            self._files = load_scene(
                configuration.scene_files, configuration.T_root_scene, self._limits
            )
        self._robot: Robot | TrajectoryGuardError
        self._subscription: Subscription | None = None
        self._live: LiveScene | None = None
        if configuration.robot_description_file:
            self._robot = load_robot(configuration.robot_description_file, self._limits)
            # Reads the meshes: one that is missing must not wait for the scene to be noticed.
            self._robot.digest()
        else:
            topic = node.resolve_topic_name(configuration.robot_description_topic)
            self._robot = RequestError(
                Reason.NOT_READY,
                f'no robot: waiting for {topic} (std_msgs/String, transient local); '
                'or set robot_description_file',
            )
            self._subscription = node.create_subscription(
                String,
                topic,
                self._take_robot,
                LATCHED,
                callback_group=MutuallyExclusiveCallbackGroup(),
            )
        if configuration.live_scene:
            self._live = LiveScene(
                node,
                configuration.scene_topic,
                self._renew,
                configuration.marker_limits,
                self._frames,
            )
        with self._lock:
            self._value = self._made()

    @property
    def value(self) -> Workcell | TrajectoryGuardError:
        """Robot and scene packed together, or what is missing."""
        return self._value

    def staleness(self, max_age: float) -> TrajectoryGuardError | None:
        """
        Return the error if the live scene is too old.

        :param max_age: since its last message came [s]; 0: it never gets old.
        """
        if self._live is None or not max_age or self._live.received_ns is None:
            return None
        age = (time.monotonic_ns() - self._live.received_ns) / NANOSECONDS
        if age <= max_age:
            return None
        return SceneError(
            Reason.SCENE_STALE,
            f'the last markers on {self._live.topic} came more than max_scene_age, '
            f'{max_age:g} s, ago',
        )

    def destroy(self) -> None:
        """Stop listening."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        if self._live is not None:
            self._live.destroy()

    def _frames(self) -> Frames | None:
        return fixed_frames(self._robot) if isinstance(self._robot, Robot) else None

    def _take_robot(self, message: String) -> None:
        """Replace the robot; one that cannot be used ends what was said of the one before."""
        try:
            robot: Robot | TrajectoryGuardError = robot_from_urdf(message.data, None, self._limits)
        except Exception as error:  # fail closed
            robot = self._unusable('robot', error)
        self._renew(robot)

    def _renew(self, robot: Robot | TrajectoryGuardError | None = None) -> None:
        """Replace the value, with another robot or the same."""
        # Robot and markers come at once, and the last one must see both.
        with self._lock:
            self._robot = robot or self._robot
            self._value = self._made()
        self._on_change()

    def _made(self) -> Workcell | TrajectoryGuardError:
        robot, scene = self._robot, self._scene()
        missing = [part for part in (robot, scene) if isinstance(part, TrajectoryGuardError)]
        if isinstance(robot, TrajectoryGuardError) or isinstance(scene, TrajectoryGuardError):
            return RequestError(Reason.NOT_READY, '; '.join(map(str, missing)))
        try:
            return Workcell(robot, scene)
        except Exception as error:  # fail closed
            return self._unusable('robot', error)

    def _scene(self) -> Scene | TrajectoryGuardError:
        """Return the obstacles of files and markers together, or what is missing."""
        if self._live is None:
            return self._files or RequestError(
                Reason.NOT_READY, 'no scene: set scene_files, or live_scene'
            )
        markers, frames = self._live.state, self._frames()
        if markers.error is not None:
            return self._unusable('scene', markers.error)
        if self._live.received_ns is None:
            return RequestError(
                Reason.NOT_READY,
                f'no scene: waiting for {self._live.topic} (visualization_msgs/MarkerArray, '
                'reliable and transient local)',
            )
        if frames is None:
            return RequestError(Reason.NOT_READY, 'the markers wait for the robot')
        try:
            return with_markers(self._files, markers.scene, frames)
        except Exception as error:  # fail closed
            return self._unusable('scene', error)

    def _unusable(self, part: str, error: Exception) -> RequestError:
        said = str(error) if isinstance(error, TrajectoryGuardError) else repr(error)
        return RequestError(Reason.NOT_READY, f'the {part} cannot be used: {said}')
