"""The node `guard`: certifies trajectories on request."""

from collections.abc import Callable, Sequence
import dataclasses
from functools import partial
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from lifecycle_msgs.msg import State
from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.service import Service
from trajectory_guard_interfaces.msg import GuardStatus
from trajectory_guard_interfaces.srv import CertifyTrajectory

from msg_adapters.result import result_to_message, ros_message_types
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certificate import text
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason, RequestError, TrajectoryGuardError
from trajectory_guard.result import Result
from trajectory_guard.ros.admission import Admission
from trajectory_guard.ros.configuration import Configuration
from trajectory_guard.ros.declared import declare, values_of
from trajectory_guard.ros.health import Health
from trajectory_guard.ros.joint_states import JointStates
from trajectory_guard.ros.managed import ManagedNode
from trajectory_guard.ros.model import Model
from trajectory_guard.ros.moments import MomentsPublisher
from trajectory_guard.ros.namesakes import Namesakes
from trajectory_guard.ros.parameters import DECLARATIONS
from trajectory_guard.ros.question import measured_start, Question, question_from_request
from trajectory_guard.ros.status import StatusPublisher
from trajectory_guard.warm import warm_up

NAME = 'guard'
STATUS = '~/status'

# Requests that arrive faster than they are taken wait here; the middleware drops older ones.
REQUESTS = QoSProfile(depth=4096)
EVENTS = QoSProfile(depth=1000)

# How often it is looked whether the scene has got old, or somebody else has gone [s].
WATCH = 0.2


class Guard(ManagedNode):
    """
    Certifies trajectories against one robot and one scene, while it is active.

    A request sees one version of the parameters and one of robot and scene, whatever changes
    meanwhile: both are values that are replaced as a whole.

    :param options: as of every node: context, namespace, parameter overrides.
    :raises TrajectoryGuardError: a parameter cannot be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(NAME, **options)
        try:
            self._values = declare(self, DECLARATIONS)
            self._configuration = self._checked(self._values)
        except TrajectoryGuardError:
            self.destroy_node()
            raise
        self._types = ros_message_types()
        self._admission = Admission()
        self._active = False
        self._model: Model | None = None
        self._loaded: dict[str, Any] = {}
        self._joint_states: JointStates | None = None
        self._service: Service | None = None
        self._failure: TrajectoryGuardError = RequestError(
            Reason.NOT_READY, 'another transition is under way'
        )
        self._quiet = False

        self._status_publisher = StatusPublisher(self, STATUS)
        self._health = Health(self, 'certify', self._health_state)
        self._moments = MomentsPublisher(self)
        self._judged: tuple[Result, Workcell, Question] | None = None
        self._to_show = self.create_guard_condition(self._show, MutuallyExclusiveCallbackGroup())
        self._namesakes = Namesakes(self, STATUS)
        self.create_timer(
            WATCH,
            self._watch,
            callback_group=MutuallyExclusiveCallbackGroup(),
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)

    @property
    def configuration(self) -> Configuration:
        """The parameters that a request sees now."""
        return self._configuration

    # Life

    def start(self) -> None:
        """
        Configure and activate, unless somebody else has begun to.

        :raises TrajectoryGuardError: a parameter, or a file that one names, cannot be used.
        """
        with self._transition:
            if self.state != State.PRIMARY_STATE_UNCONFIGURED:
                return
            self._quiet = True
            try:
                for trigger in (self.trigger_configure, self.trigger_activate):
                    if trigger() is not TransitionCallbackReturn.SUCCESS:
                        raise self._failure
            finally:
                self._quiet = False

    def close(self) -> None:
        """Reject all requests that come from now on."""
        self._admission.close()
        self._say_state()

    @property
    def idle(self) -> bool:
        """Whether no request is in flight."""
        return self._admission.empty

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Load what the parameters name; on failure nothing has changed."""
        try:
            self._configure()
        except TrajectoryGuardError as error:
            return self._failed(error)
        except Exception as error:
            return self._failed(
                TrajectoryGuardError(Reason.INTERNAL_ERROR, f'internal error: {error!r}')
            )
        return TransitionCallbackReturn.SUCCESS

    def _failed(self, error: TrajectoryGuardError) -> TransitionCallbackReturn:
        self._forget()
        self._failure = error
        if not self._quiet:
            self.get_logger().error(f'cannot be configured: {error.reason}: {error}')
        return TransitionCallbackReturn.FAILURE

    def _configure(self) -> None:
        configuration = self._configuration
        self._loaded = _at_configure(self._values)
        self._model = Model(self, configuration, self._say_state)
        self.get_logger().info('warming up (the first start compiles the kernels)')
        warm_up(configuration.settings.cover)
        if self._namesakes.wait():
            raise RequestError(
                Reason.DUPLICATE_NAME,
                f'there is another node {self.get_fully_qualified_name()}: stop it, or give this '
                'one another namespace (-r __ns:=/...)',
            )
        if configuration.joint_states_topic:
            self._joint_states = JointStates(
                self, configuration.joint_states_topic, configuration.max_joints
            )
        if self._service is None:
            # It stays: without it a client could not be told why.
            self._service = self.create_service(
                CertifyTrajectory,
                '~/certify',
                self._certify,
                qos_profile=REQUESTS,
                callback_group=ReentrantCallbackGroup(),
            )
            # The executor does not tell when an answer has left.
            send = self._service.send_response
            self._service.send_response = partial(self._send, send)  # type: ignore[method-assign]
            self._introspect()

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer from now on, unless other files or topics are wanted than are in use."""
        wanted = _at_configure(self._values)
        changed = [name for name, value in self._loaded.items() if value != wanted[name]]
        if changed:
            self._failure = RequestError(
                Reason.NOT_READY,
                f'{", ".join(changed)} changed since the guard was configured: clean it up, and '
                'configure it again',
            )
            if not self._quiet:
                self.get_logger().error(f'cannot be activated: {self._failure}')
            return TransitionCallbackReturn.FAILURE
        self._active = True
        self._say_state()
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Reject everything from now on, what is in flight included."""
        self._active = False
        self._say_state()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Drop robot and scene."""
        self._forget()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Drop everything for good."""
        self._forget()
        return TransitionCallbackReturn.SUCCESS

    def _forget(self) -> None:
        self._active = False
        model, self._model = self._model, None
        states, self._joint_states = self._joint_states, None
        for part in (model, states):
            if part is not None:
                part.destroy()
        self._say_state()

    # State

    def _refusal(self) -> TrajectoryGuardError | None:
        """Return why nothing at all may be answered now."""
        if not self._active:
            return RequestError(
                Reason.NOT_READY, 'the guard is inactive: its lifecycle node has to be activated'
            )
        if self._namesakes.any:
            return RequestError(
                Reason.DUPLICATE_NAME,
                f'there is another node {self.get_fully_qualified_name()}, '
                'and whose answer comes is not known',
            )
        return None

    def _workcell(self, configuration: Configuration) -> Workcell:
        """
        Return what requests are judged against now.

        :raises TrajectoryGuardError: why they cannot be.
        """
        # Once: it goes when another thread cleans up.
        model = self._model
        refusal = self._refusal()
        if refusal is not None or model is None:
            raise refusal or RequestError(Reason.NOT_READY, 'the guard is not configured')
        workcell = model.value
        if isinstance(workcell, TrajectoryGuardError):
            raise workcell
        stale = model.staleness(configuration.max_scene_age)
        if stale is not None:
            raise stale
        return workcell

    def _status(self) -> GuardStatus:
        try:
            if self._admission.closed:
                raise RequestError(Reason.NOT_READY, 'the guard is shutting down')
            workcell = self._workcell(self._configuration)
        except TrajectoryGuardError as error:
            return GuardStatus(reason_code=str(error.reason), message=str(error))
        return GuardStatus(
            ready=True, robot_hash=workcell.robot_hash, scene_hash=workcell.scene_hash
        )

    def _watch(self) -> None:
        self._namesakes.look()
        self._say_state()

    def _say_state(self) -> None:
        """Say whether the guard is ready, and for what, if that has changed."""
        before = self._status_publisher.renew(self._status)
        if before is None:
            return
        status, model = self._status_publisher.said, self._model
        workcell = model.value if model is not None else None
        if status.ready and isinstance(workcell, Workcell):
            words = (
                f'ready: robot {workcell.robot.name!r} ({workcell.robot_hash[:12]}), '
                f'{len(workcell.robot.collision_links)} links; scene '
                f'({workcell.scene_hash[:12]}), {len(workcell.scene.obstacles)} obstacles'
            )
            if before.ready and before.robot_hash == status.robot_hash:
                # A live scene may change many times a second.
                self.get_logger().debug(words)
            else:
                self.get_logger().info(words)
        elif self._active or before.ready:
            # That it is inactive at the start is nothing to be warned of.
            self.get_logger().warning(f'not ready: {status.message}')
        self._health.changed()

    def _health_state(self) -> tuple[bytes, str]:
        said = self._status_publisher.said
        if said.ready:
            return DiagnosticStatus.OK, 'ready'
        level = DiagnosticStatus.ERROR if self._active else DiagnosticStatus.WARN
        return level, f'{said.reason_code}: {said.message}'

    # Parameters

    def _checked(self, values: dict[str, Any]) -> Configuration:
        """Return the configuration of some values, with topics that can be."""
        configuration = Configuration.from_values(values)
        for name in ('robot_description_topic', 'scene_topic', 'joint_states_topic'):
            topic = getattr(configuration, name)
            try:
                self.resolve_topic_name(topic or 'none')
            except RuntimeError as error:
                raise RequestError(
                    Reason.INVALID_PARAMETER, f'{name} {topic!r}: {error}'
                ) from error
        return configuration

    def _check_parameters(self, changed: Sequence[Parameter]) -> SetParametersResult:
        new = values_of(changed, DECLARATIONS)
        if self.loaded:
            for name in new:
                if DECLARATIONS[name].at_configure and new[name] != self._values[name]:
                    return SetParametersResult(
                        successful=False,
                        reason=f'{name} cannot change while the guard is active; deactivate and '
                        'clean it up, then it holds when it is configured again',
                    )
        try:
            self._checked(self._values | new)
        except TrajectoryGuardError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, changed: Sequence[Parameter]) -> None:
        self._values |= values_of(changed, DECLARATIONS)
        self._configuration = Configuration.from_values(self._values)
        self._introspect()

    def _introspect(self) -> None:
        """Tell as much about requests as the parameter says."""
        if self._service is not None:
            self._service.configure_introspection(
                self.get_clock(), EVENTS, self._configuration.introspection
            )

    # Requests

    def _certify(
        self, request: CertifyTrajectory.Request, response: CertifyTrajectory.Response
    ) -> CertifyTrajectory.Response:
        begin = time.perf_counter()
        self._admission.taken()
        try:
            result = self._answer(request)
            response.result = result_to_message(result, self._types)
            if result.certificate is not None:
                response.certificate = text(result.certificate)
        except Exception as error:  # fail closed: an error here would end the node
            self.get_logger().error(f'a request failed: {error!r}')
            internal = TrajectoryGuardError(Reason.INTERNAL_ERROR, f'internal error: {error!r}')
            result = Result.rejected(internal)
            response = CertifyTrajectory.Response(result=result_to_message(result, self._types))
        self._health.count(
            result.verdict.name.lower(),
            result.reason_code,
            time.perf_counter() - begin,
            result.message,
        )
        return response

    def _send(self, send: Callable[..., None], *answer: object) -> None:
        """Send an answer, and count it as sent."""
        try:
            send(*answer)
        finally:
            self._admission.sent()

    def _answer(self, request: CertifyTrajectory.Request) -> Result:
        configuration, model = self._configuration, self._model
        try:
            with self._admission.entered(configuration.max_requests):
                result = self._judged_by(self._workcell(configuration), request, configuration)
            # Deactivated meanwhile, or without a scene: an answer that comes now must not start a
            # motion.
            self._workcell(configuration)
            if self._model is not model:
                raise RequestError(Reason.NOT_READY, 'the guard was configured anew meanwhile')
        except TrajectoryGuardError as error:
            return Result.rejected(error, configuration.settings)
        return result

    def _judged_by(
        self,
        workcell: Workcell,
        request: CertifyTrajectory.Request,
        configuration: Configuration,
    ) -> Result:
        """Return what is said of a request by one version of everything."""
        question = question_from_request(request, configuration)
        states = self._joint_states
        measured = None
        if question.start is None and states is not None:
            measured = measured_start(question, workcell, states.fresh, configuration)
        if states is None or measured is None:
            result = judge(workcell, *question)
        else:
            state, age = measured
            question = question._replace(start=state)
            result = judge(workcell, *question)
            warning = f'the start state is from {states.topic}, up to {age:.3f} s old'
            result = dataclasses.replace(result, warnings=(*result.warnings, warning))
        self._judged = result, workcell, question
        self._to_show.trigger()
        return result

    def _show(self) -> None:
        """Draw the last result, later than its answer."""
        if self._judged is not None:
            result, workcell, question = self._judged
            self._moments.publish(result, workcell, question.trajectory, question.start)


def _at_configure(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values that say what is loaded."""
    return {name: value for name, value in values.items() if DECLARATIONS[name].at_configure}
