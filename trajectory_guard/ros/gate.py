"""The node `gate`: stands before the controller, and passes on what the guard proves free."""

from collections.abc import Sequence
import threading
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import NameValidationException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from trajectory_guard_interfaces.msg import GateDecision, GateStatus
from trajectory_msgs.msg import JointTrajectory

from trajectory_guard.errors import Reason, RequestError, TrajectoryGuardError
from trajectory_guard.ros.declared import declare, values_of
from trajectory_guard.ros.gate_action import action_before
from trajectory_guard.ros.gate_codes import remedy
from trajectory_guard.ros.gate_configuration import GateConfiguration
from trajectory_guard.ros.gate_guard import GuardClient
from trajectory_guard.ros.gate_parameters import DECLARATIONS
from trajectory_guard.ros.gate_states import JointStates
from trajectory_guard.ros.gatekeeper import Gatekeeper
from trajectory_guard.ros.health import Health
from trajectory_guard.ros.process import LOOK_UP, made, on_signal, run

NAME = 'gate'

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Who comes late and asks for one sees the last; a burst of them is not thinned out.
DECISIONS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TRAJECTORIES = QoSProfile(depth=100)
# Takes reliable publishers and others. Several of them, each with some joints, share the queue.
STATES = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)

# How what is passed on may be encoded, big or little endian. Fast DDS reads other encodings as if
# they were this one, and who aligns them by the standard reads another trajectory.
PLAIN_CDR = (b'\0\0', b'\0\1')

# How often it is looked whether an answer is late, and whether the gate is ready [s].
CLOCK_PERIOD = 0.02
STATUS_PERIOD = 0.2


class Gate(Node):
    """
    Passes trajectories on to the controller, unchanged, once the guard proves them free.

    Everything runs in the one thread of a `SingleThreadedExecutor`.

    :param options: as of every node: context, namespace, parameter overrides.
    :raises TrajectoryGuardError: a parameter cannot be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(NAME, **options)
        self._values = declare(self, DECLARATIONS)
        configuration = GateConfiguration.from_values(self._values)
        self._counts = {'passed': 0, 'stops': 0, 'held': 0}
        self._said: tuple[bool, str, tuple[int, ...]] | None = None
        self._health = Health(self, 'gate', self._state)
        self._decisions = self.create_publisher(GateDecision, '~/decision', DECISIONS)
        self._statuses = self.create_publisher(GateStatus, '~/status', LATCHED)
        try:
            self._connect(configuration)
        except (RuntimeError, NameValidationException) as error:
            raise RequestError(
                Reason.INVALID_PARAMETER, f'a topic or the guard: {" ".join(str(error).split())}'
            ) from error
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(CLOCK_PERIOD, self._keeper.look_at_clock, clock=steady)
        self.create_timer(STATUS_PERIOD, self._look_at_status, clock=steady)
        self._look_at_status()

    @property
    def configuration(self) -> GateConfiguration:
        """The parameters that a trajectory which arrives now is judged by."""
        return self._keeper.configuration

    def _connect(self, configuration: GateConfiguration) -> None:
        """Make what the parameters name."""
        self._states = JointStates()
        self._guard = GuardClient(self, configuration.guard, self._look_at_status)
        self._keeper = Gatekeeper(
            self, self._states, self._guard, configuration, self._publish_decision
        )
        self._output = self.create_publisher(
            JointTrajectory, configuration.output_topic, TRAJECTORIES
        )
        self.create_subscription(
            JointTrajectory,
            configuration.input_topic,
            self._take_trajectory,
            TRAJECTORIES,
            raw=True,
        )
        self.create_subscription(
            JointState, configuration.joint_states_topic, self._take_state, STATES
        )
        self._action = action_before(self, configuration.controller_action, self._keeper)

    # What comes in

    def _take_trajectory(self, raw: bytes) -> None:
        try:
            if bytes(raw[:2]) not in PLAIN_CDR:
                raise ValueError(f'its encoding is {bytes(raw[:2]).hex()}, not plain CDR')
            message = deserialize_message(raw, JointTrajectory)
        except Exception as error:
            self._keeper.refuse(Reason.TRAJECTORY_UNREADABLE, f'no trajectory: {error!r}')
            return
        self._keeper.consider(
            message,
            # The bytes themselves: nothing can have changed on the way.
            forward=lambda: self._output.publish(raw),
            receiver=self._no_receiver,
        )

    def _no_receiver(self) -> str:
        if self._output.get_subscription_count():
            return ''
        return f'nobody listens to {self._output.topic_name}'

    def _take_state(self, message: JointState) -> None:
        self._states.take(message, time.monotonic_ns())

    def _check_parameters(self, changed: Sequence[Parameter]) -> SetParametersResult:
        try:
            GateConfiguration.from_values(self._values | values_of(changed, DECLARATIONS))
        except TrajectoryGuardError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, changed: Sequence[Parameter]) -> None:
        self._values |= values_of(changed, DECLARATIONS)
        self._keeper.configuration = GateConfiguration.from_values(self._values)

    # What goes out

    def _publish_decision(self, decision: GateDecision) -> None:
        """Publish, count and log a decision."""
        code, words = decision.reason_code, decision.message
        took = f'after {decision.latency:.4f} s'
        if decision.decision != GateDecision.PASSED:
            kind = 'held'
            self.get_logger().warning(
                f'held: {code}: {words or "no more is known"} ({took}); {remedy(code)}'
            )
        elif code == Reason.STOP:
            kind = 'stops'
            self.get_logger().info(f'passed: an empty trajectory, which stops. {words}'.rstrip())
        else:
            kind = 'passed'
            self.get_logger().info(
                f'passed: proved free {took}; the proof took {decision.result.compute_time:.4f} s'
            )
        self._counts[kind] += 1
        self._decisions.publish(decision)
        self._health.count(kind, code, decision.latency, words)
        self._look_at_status()

    def _look_at_status(self) -> None:
        """Publish whether the gate could pass anything on, if that or a count has changed."""
        missing = self._missing()
        ready, code, words = missing is None, '', ''
        if missing is not None:
            code, words = missing.reason.value, str(missing)
        # Ages change all the time; that alone is no news.
        said = (ready, code, tuple(self._counts.values()))
        if said == self._said:
            return
        if self._said is None or self._said[:2] != said[:2]:
            if missing is None:
                self.get_logger().info('ready')
            else:
                self.get_logger().warning(f'not ready: {code}: {words}; {remedy(code)}')
            self._health.changed()
        self._said = said
        self._statuses.publish(
            GateStatus(
                stamp=self.get_clock().now().to_msg(),
                ready=ready,
                reason_code=code,
                message=words,
                **self._counts,
            )
        )

    def _state(self) -> tuple[bytes, str]:
        """Return level and text for the diagnostics."""
        missing = self._missing()
        if missing is None:
            return DiagnosticStatus.OK, 'ready'
        return DiagnosticStatus.WARN, f'closed: {missing.reason}: {missing}'

    def _missing(self) -> TrajectoryGuardError | None:
        """Return what is missing for anything to be passed on; None: nothing."""
        guard = self._guard.missing()
        if guard is not None:
            return guard
        stale = self._states.complaint(
            time.monotonic_ns(),
            self.get_clock().now().nanoseconds,
            self.configuration.max_state_age_ns,
        )
        if stale:
            return RequestError(Reason.STATE_STALE, stale)
        nobody = self._no_receiver()
        if nobody and not (self._action and self._action.has_controller()):
            return RequestError(Reason.CONTROLLER_MISSING, nobody)
        return None


def main(args: Sequence[str] | None = None) -> int:
    """
    Run the gate until SIGINT or SIGTERM, as the whole of this process.

    :param args: command line, the program first; None: that of the process.
    :returns: exit code: 0 stopped, 2 an argument or a parameter cannot be used.
    """
    return run(NAME, args, _serve)


def _serve() -> None:
    """Decide until a signal comes; what is undecided then is not passed on."""
    executor = SingleThreadedExecutor()
    gate = made(Gate)
    executor.add_node(gate)
    stop = threading.Event()
    on_signal(stop.set)
    while not stop.is_set():
        try:
            executor.spin_once(timeout_sec=LOOK_UP)
        except Exception as error:  # what raised has passed nothing on
            gate.get_logger().error(f'{Reason.INTERNAL_ERROR}: {error!r}')
