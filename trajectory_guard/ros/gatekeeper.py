"""What the gate decides: nothing passes but what is proved, and what stops the robot."""

from collections.abc import Callable
from functools import partial
import time

from rclpy.node import Node
from rclpy.task import Future
from trajectory_guard_interfaces.msg import CertificationResult, GateDecision
from trajectory_msgs.msg import JointTrajectory

from msg_adapters.result import nanoseconds_to_message
from msg_adapters.trajectory import stamp_from_message, trajectory_from_message
from trajectory_guard.errors import Reason, RequestError, TrajectoryError, TrajectoryGuardError
from trajectory_guard.paths.takeover import Takeover, takeover
from trajectory_guard.ros.declared import per_joint
from trajectory_guard.ros.gate_configuration import GateConfiguration
from trajectory_guard.ros.gate_guard import GuardClient, least_from_response
from trajectory_guard.ros.gate_request import refusal, request_for
from trajectory_guard.ros.gate_states import JointStates
from trajectory_guard.ros.gate_trial import Trial


class Gatekeeper:
    """
    Decides on one trajectory after the other; a newer one supersedes one that is undecided.

    All of it runs in one thread, so what is passed on comes in the order of the decisions. Each
    step of a trial begins by asking whether the trial is still the one that is undecided: an
    answer that comes after a stop, a newer trajectory or the end of its time finds that it is not.

    :param node: whose clock, log and executor are used.
    :param states: the robot's state.
    :param guard: the guard.
    :param configuration: the parameters that hold for a trajectory that arrives now.
    :param publish: publishes a decision.
    """

    def __init__(
        self,
        node: Node,
        states: JointStates,
        guard: GuardClient,
        configuration: GateConfiguration,
        publish: Callable[[GateDecision], None],
    ) -> None:
        self._node = node
        self._states = states
        self._guard = guard
        self.configuration = configuration
        self._publish = publish
        self._trial: Trial | None = None
        # When something was passed on last, on the steady clock.
        self._passed_ns: int | None = None
        self._number = 0

    def consider(
        self,
        message: JointTrajectory,
        forward: Callable[[], None],
        receiver: Callable[[], str],
        decided: Callable[[GateDecision], None] = lambda _: None,
    ) -> Trial:
        """
        Begin to decide on a trajectory; one without points passes at once.

        :param message: the trajectory.
        :param forward: passes it on, unchanged.
        :param receiver: says why nobody would receive it; '': somebody would.
        :param decided: is told the decision, maybe before this returns.
        """
        now_ns = time.monotonic_ns()
        trial = Trial(message, forward, receiver, decided, self.configuration, now_ns)
        if not message.points:
            self._stop(trial)
            return trial
        if self._trial is not None:
            self._hold(self._trial, Reason.SUPERSEDED, 'a newer trajectory came')
        self._trial = trial
        self._step(trial, self._ask_least, trial)
        return trial

    def refuse(self, reason: Reason, message: str) -> None:
        """
        Hold what is no joint trajectory; it supersedes one that is undecided all the same.

        :param reason: stable code.
        :param message: why it is none.
        """
        nothing = JointTrajectory()
        now_ns = time.monotonic_ns()
        trial = Trial(nothing, _never, str, lambda _: None, self.configuration, now_ns)
        if self._trial is not None:
            self._hold(self._trial, Reason.SUPERSEDED, 'something newer came')
        self._hold(trial, reason, message)

    def void(self, trial: Trial, reason: Reason, message: str) -> None:
        """
        Hold a trajectory if it is undecided.

        :param trial: what `consider` returned.
        :param reason: stable code.
        :param message: the same in words.
        """
        if self._trial is trial:
            self._hold(trial, reason, message)

    def look_at_clock(self) -> None:
        """Hold the trajectory that has waited too long for an answer."""
        trial = self._trial
        if trial is not None and time.monotonic_ns() > trial.expires_ns:
            self._late(trial)

    # Steps of a trial, in their order

    def _step(self, trial: Trial, step: Callable[..., None], *arguments: object) -> None:
        """Take a step of the trial that is undecided; whatever is raised holds the trajectory."""
        if self._trial is not trial:
            return
        try:
            if time.monotonic_ns() > trial.expires_ns:
                self._late(trial)
            else:
                step(*arguments)
        except TrajectoryGuardError as error:
            self._hold(trial, error.reason, str(error))
        except Exception as error:  # fail closed
            self._hold(trial, Reason.INTERNAL_ERROR, f'internal error: {error!r}')

    def _ask_least(self, trial: Trial) -> None:
        """Refuse what cannot be played, or asked; ask what the guard asks for at least."""
        trial.trajectory = trajectory_from_message(trial.message)
        stamp = trial.message.header.stamp
        if stamp.sec < 0:
            # Whatever the sum with nanosec is, the controller's own type of time raises.
            raise TrajectoryError(Reason.STAMP_INVALID, f'header.stamp is negative: {stamp.sec} s')
        self._check_surroundings(trial)
        trial.future = self._guard.least_tracking_tolerance()
        trial.future.add_done_callback(partial(self._step, trial, self._ask_certify, trial))

    def _ask_certify(self, trial: Trial, answer: Future) -> None:
        """Plan how the controller takes it over, and ask the guard about that."""
        configuration, allowance = trial.configuration, trial.configuration.allowance
        trajectory = trial.trajectory
        assert trajectory is not None
        steady_ns, now_ns = self._now()
        trial.plan = takeover(
            trajectory,
            stamp_from_message(trial.message),
            now_ns,
            self._states.fresh(steady_ns, now_ns, configuration.max_state_age_ns),
            allowance,
        )
        least = per_joint(
            trajectory.joint_names, *least_from_response(answer.result()), whose='the guard'
        )
        own = configuration.tracking_tolerance_of(trajectory.joint_names)
        trial.request = request_for(trial.message, trial.plan, [*map(max, own, least)])
        trial.request.clearance = configuration.clearance
        trial.request.tolerance = configuration.tolerance
        left_ns = configuration.deadline_ns - (steady_ns - trial.arrived_ns)
        trial.request.deadline = nanoseconds_to_message(
            max(left_ns, 1), type(trial.request.deadline)
        )
        trial.future = self._guard.certify(trial.request)
        trial.future.add_done_callback(partial(self._step, trial, self._take_answer, trial))

    def _take_answer(self, trial: Trial, answer: Future) -> None:
        """Pass the trajectory on if it is proved free, and if the proof holds now."""
        trial.result = result = answer.result().result
        assert trial.plan is not None and trial.request is not None
        refused = refusal(trial.request, result)
        if refused is not None:
            self._hold(trial, *refused)
            return
        self._check_surroundings(trial)
        changed = self._guard.changed_since(result)
        if changed is not None:
            raise changed
        self._check_state(trial, trial.plan)
        try:
            trial.forward()
        finally:
            self._passed_ns = time.monotonic_ns()
        self._trial = None
        self._decide(trial, GateDecision.PASSED, Reason.PROVED_FREE, '')

    def _check_state(self, trial: Trial, plan: Takeover) -> None:
        """
        Check that the proof holds for where the robot is now.

        Only a state counts that was measured when the controller had begun with what was passed on
        last: an older one tells of a robot that was still to be set in motion.
        """
        steady_ns, now_ns = self._now()
        fresh = self._states.fresh(steady_ns, now_ns, trial.configuration.max_state_age_ns)
        if self._passed_ns is not None:
            begun_ns = self._passed_ns + trial.configuration.allowance.max_start_delay_ns
            for name in plan.measured.keys() & fresh.keys():
                if fresh[name].age_ns > steady_ns - begun_ns:
                    raise TrajectoryError(
                        Reason.STATE_CHANGED,
                        f'the controller may not have begun with the trajectory before when joint '
                        f'{name!r} was measured, {fresh[name].age_ns / 1e9:.3f} s ago',
                    )
        plan.check(now_ns, fresh)

    # Decisions

    def _check_surroundings(self, trial: Trial) -> None:
        """
        Refuse to go on without the guard or the controller.

        :raises RequestError: one of them is missing, or there are several guards.
        """
        missing = self._guard.missing()
        if missing is not None:
            raise missing
        nobody = trial.receiver()
        if nobody:
            raise RequestError(Reason.CONTROLLER_MISSING, nobody)

    def _stop(self, trial: Trial) -> None:
        """Pass an empty trajectory on before anything else."""
        try:
            trial.forward()
        except Exception as error:
            self._hold(trial, Reason.INTERNAL_ERROR, f'a stop could not be passed on: {error!r}')
            return
        finally:
            if self._trial is not None:
                self._hold(self._trial, Reason.STOPPED, 'a stop came')
        self._decide(trial, GateDecision.PASSED, Reason.STOP, trial.receiver())

    def _late(self, trial: Trial) -> None:
        waited = (time.monotonic_ns() - trial.arrived_ns) / 1e9
        self._hold(trial, Reason.GUARD_SILENT, f'no answer of the guard in {waited:.3f} s')

    def _hold(self, trial: Trial, reason: str, message: str) -> None:
        if self._trial is trial:
            self._trial = None
        self._guard.forget(trial.future)
        self._decide(trial, GateDecision.HELD, reason, message)

    def _decide(self, trial: Trial, decision: int, reason: str, message: str) -> None:
        self._number += 1
        made = GateDecision(
            decision=decision,
            stamp=self._node.get_clock().now().to_msg(),
            number=self._number,
            reason_code=str(reason),
            message=message,
            latency=(time.monotonic_ns() - trial.arrived_ns) / 1e9,
            result=trial.result or CertificationResult(),
        )
        for tell in (self._publish, trial.decided):
            try:
                tell(made)
            except Exception as error:  # what was decided is decided
                self._node.get_logger().error(f'a decision could not be told: {error!r}')

    def _now(self) -> tuple[int, int]:
        """Return the time on the steady clock and on the node's [ns]."""
        return time.monotonic_ns(), self._node.get_clock().now().nanoseconds


def _never() -> None:
    """Pass on what must not be."""
    raise AssertionError('this is not to be passed on')
