"""The node `guard`: certifies trajectories on request."""

from collections.abc import Callable, Sequence
import os
import signal
import sys
import threading
from typing import Any

from rcl_interfaces.msg import SetParametersResult
import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args, try_shutdown
from std_msgs.msg import String
from trajectory_guard_interfaces.srv import CertifyTrajectory

from msg_adapters.result import result_to_message, ros_message_types
from trajectory_guard.certificate import text
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason, RequestError, TrajectoryGuardError
from trajectory_guard.result import Result
from trajectory_guard.robot import Robot
from trajectory_guard.ros.configuration import Configuration
from trajectory_guard.ros.parameters import declare, values
from trajectory_guard.ros.question import question_from_request
from trajectory_guard.scene import load_scene
from trajectory_guard.urdf import load_robot, robot_from_urdf
from trajectory_guard.warm import warm_up
from trajectory_guard.workcell import Workcell

NAME = 'guard'

# Requests that arrive faster than they are taken wait here; the middleware drops older ones.
REQUESTS = QoSProfile(depth=256)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

# Callbacks of parameters and topics must find a thread while certifications fill all cores.
SPARE_THREADS = 2

# How long a signal may go unnoticed [s].
LOOK_UP = 0.2

BAD_INPUT = 2
INTERNAL_ERROR = 3


class Guard(Node):
    """
    Certifies trajectories against one robot and one scene.

    A request sees one version of the parameters and one of robot and scene, whatever changes
    meanwhile: both are values that are replaced as a whole.

    :param options: as of every node: context, namespace, parameter overrides.
    :raises TrajectoryGuardError: a parameter, or a file that one names, cannot be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(NAME, **options)
        self._values = declare(self)
        self._configuration = configuration = Configuration.from_values(self._values)
        self._topic = self._resolved(configuration.robot_description_topic)
        self._types = ros_message_types()
        self._scene = None
        if configuration.scene_files:
            self._scene = load_scene(configuration.scene_files, configuration.T_root_scene)
        robot = None
        if configuration.robot_description_file:
            robot = load_robot(configuration.robot_description_file)
            # Reads the meshes: one that is missing must not wait for the scene to be noticed.
            robot.digest()
        self._model = self._model_of(robot)
        self.get_logger().info('warming up (the first start compiles the kernels)')
        warm_up(configuration.settings.cover)

        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        if robot is None:
            self.create_subscription(
                String,
                configuration.robot_description_topic,
                self._take_robot,
                LATCHED,
                callback_group=MutuallyExclusiveCallbackGroup(),
            )
        self.create_service(
            CertifyTrajectory,
            '~/certify',
            self._certify,
            qos_profile=REQUESTS,
            callback_group=ReentrantCallbackGroup(),
        )
        self._say_state()

    @property
    def configuration(self) -> Configuration:
        """The parameters that a request sees now."""
        return self._configuration

    def _model_of(self, robot: Robot | None) -> Workcell | TrajectoryGuardError:
        """Return robot and scene together, or what is missing."""
        missing = []
        if robot is None:
            missing.append(
                f'no robot: waiting for {self._topic} (std_msgs/String, transient local); '
                'or set robot_description_file'
            )
        if self._scene is None:
            missing.append('no scene: set scene_files')
        if robot is None or self._scene is None:
            return RequestError(Reason.NOT_READY, '; '.join(missing))
        return Workcell(robot, self._scene)

    def _say_state(self) -> None:
        """Say in one line whether the guard is ready, and for what."""
        model = self._model
        if isinstance(model, TrajectoryGuardError):
            self.get_logger().warning(f'not ready: {model}')
            return
        self.get_logger().info(
            f'ready: robot {model.robot.name!r} ({model.robot_hash[:12]}), '
            f'{len(model.robot.collision_links)} links; scene ({model.scene_hash[:12]}), '
            f'{len(model.scene.obstacles)} obstacles'
        )

    # Robot

    def _resolved(self, topic: str) -> str:
        """Return the full name of the robot's topic."""
        try:
            return self.resolve_topic_name(topic)
        except RuntimeError as error:
            raise RequestError(
                Reason.INVALID_PARAMETER, f'robot_description_topic {topic!r}: {error}'
            ) from error

    def _take_robot(self, message: String) -> None:
        """Replace the robot; one that cannot be used ends what was said of the one before."""
        try:
            self._model = self._model_of(robot_from_urdf(message.data))
        except Exception as error:
            self._model = RequestError(
                Reason.NOT_READY,
                f'the robot on {self._topic} cannot be used: '
                + (str(error) if isinstance(error, TrajectoryGuardError) else repr(error)),
            )
        self._say_state()

    # Parameters

    def _check_parameters(self, changed: Sequence[Parameter]) -> SetParametersResult:
        try:
            Configuration.from_values(self._values | values(changed))
        except TrajectoryGuardError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, changed: Sequence[Parameter]) -> None:
        self._values |= values(changed)
        self._configuration = Configuration.from_values(self._values)

    # Requests

    def _certify(
        self, request: CertifyTrajectory.Request, response: CertifyTrajectory.Response
    ) -> CertifyTrajectory.Response:
        try:
            result = self._answer(request)
            response.result = result_to_message(result, self._types)
            if result.certificate is not None:
                response.certificate = text(result.certificate)
        except Exception as error:  # fail closed: an error here would end the node
            self.get_logger().error(f'a request failed: {error!r}')
            internal = TrajectoryGuardError(Reason.INTERNAL_ERROR, f'internal error: {error!r}')
            response.result = result_to_message(Result.rejected(internal), self._types)
        return response

    def _answer(self, request: CertifyTrajectory.Request) -> Result:
        model, configuration = self._model, self._configuration
        if isinstance(model, TrajectoryGuardError):
            result = Result.rejected(model, configuration.settings)
        else:
            try:
                result = judge(model, *question_from_request(request, configuration))
            except TrajectoryGuardError as error:
                result = Result.rejected(error, configuration.settings)
        self.get_logger().debug(
            f'{result.verdict.name.lower()} {result.reason_code} in {result.compute_time:.6f} s'
        )
        return result


def main(args: Sequence[str] | None = None) -> int:
    """
    Run the guard until SIGINT or SIGTERM, as the whole of this process.

    :param args: command line, the program first; None: that of the process.
    :returns: exit code: 0 stopped, 2 an argument, a parameter or a file cannot be used, 3 the
        guard does not work here.
    """
    # There is nothing to end in good order yet.
    _on_signal(lambda: os._exit(0))
    try:
        _start_ros(sys.argv if args is None else list(args))
        _serve()
    except TrajectoryGuardError as error:
        get_logger(NAME).fatal(f'{error.reason}: {error}')
        return INTERNAL_ERROR if error.reason is Reason.INTERNAL_ERROR else BAD_INPUT
    finally:
        try_shutdown()
    return 0


def _on_signal(action: Callable[[], None]) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: action())


def _start_ros(args: list[str]) -> None:
    try:
        unknown = remove_ros_args(args)[1:]
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        raise RequestError(Reason.INVALID_PARAMETER, ' '.join(str(error).split())) from error
    if unknown:
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'unknown arguments {unknown}; ROS arguments come after --ros-args',
        )


def _serve() -> None:
    """Answer requests until a signal comes; what is being certified then is still answered."""
    executor = MultiThreadedExecutor((os.cpu_count() or 1) + SPARE_THREADS)
    executor.add_node(Guard())
    stop = threading.Event()
    _on_signal(stop.set)
    # Python handles a signal when the main thread comes back to it, which no signal hastens. (The
    # handlers of rclpy wake the executor before the context is invalid: it may sleep on for ever.)
    while not stop.is_set():
        executor.spin_once(timeout_sec=LOOK_UP)
