"""The action FollowJointTrajectory before the controller's own."""

from dataclasses import dataclass
from functools import partial
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer, CancelResponse, ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from trajectory_guard_interfaces.msg import GateDecision

from trajectory_guard.errors import Reason
from trajectory_guard.ros.gate_trial import Trial
from trajectory_guard.ros.gatekeeper import Gatekeeper


@dataclass(slots=True, eq=False)
class _Goal:
    """
    A goal between its client and the controller.

    :param handle: towards the client.
    :param trial: what is decided about; None: nothing.
    :param controller: towards the controller; None: it has not accepted the goal yet.
    :param canceling: the client wants it to end.
    :param status: how it ended (of action_msgs/msg/GoalStatus).
    :param result: what it ended with; None: it has not.
    """

    handle: ServerGoalHandle
    trial: Trial | None = None
    controller: Any = None
    canceling: bool = False
    status: int = GoalStatus.STATUS_UNKNOWN
    result: Any = None


class ActionGate:
    """
    Takes goals, and passes on to the controller those that are proved free.

    A rejected goal could not say why, so every goal is accepted, and one that is held is aborted
    with error_code INVALID_GOAL and the reason in error_string. Feedback and result of the
    controller come back as they are. A goal stays *accepted* until its result is there: a
    coroutine of rclpy that waited for it would keep the executor busy.

    :param node: whose action this is.
    :param action: control_msgs/action/FollowJointTrajectory.
    :param name: the controller's action.
    :param keeper: decides.
    """

    def __init__(self, node: Node, action: Any, name: str, keeper: Gatekeeper) -> None:
        self._action = action
        self._keeper = keeper
        self._logger = node.get_logger()
        self._name = name
        self._goals: dict[bytes, _Goal] = {}
        self._controller = ActionClient(node, action, name)
        self._server = ActionServer(
            node,
            action,
            '~/follow_joint_trajectory',
            execute_callback=self._finish,
            handle_accepted_callback=self._begin,
            cancel_callback=self._cancel,
        )

    def has_controller(self) -> bool:
        """Return whether a controller takes goals."""
        ready: bool = self._controller.server_is_ready()
        return ready

    def _no_controller(self) -> str:
        return '' if self.has_controller() else f'nobody offers the action {self._name}'

    # The way of a goal

    def _begin(self, handle: ServerGoalHandle) -> None:
        goal = self._goals[_key(handle)] = _Goal(handle)
        poses = handle.request.multi_dof_trajectory
        if poses.points or poses.joint_names:
            text = 'multi_dof_trajectory is not certified, only trajectory'
            self._keeper.refuse(Reason.MULTI_DOF, text)
            self._end(goal, GoalStatus.STATUS_ABORTED, self._refusal(Reason.MULTI_DOF, text))
            return
        goal.trial = self._keeper.consider(
            handle.request.trajectory,
            forward=partial(self._send, goal),
            receiver=self._no_controller,
            decided=partial(self._decided, goal),
        )

    def _decided(self, goal: _Goal, decision: GateDecision) -> None:
        if decision.decision == GateDecision.PASSED:
            return
        canceled = decision.reason_code == Reason.CANCELED
        self._end(
            goal,
            GoalStatus.STATUS_CANCELED if canceled else GoalStatus.STATUS_ABORTED,
            self._refusal(decision.reason_code, decision.message),
        )

    def _send(self, goal: _Goal) -> None:
        answer = self._controller.send_goal_async(
            goal.handle.request, feedback_callback=partial(self._feedback, goal)
        )
        answer.add_done_callback(partial(self._answered, goal))

    def _answered(self, goal: _Goal, answer: Future) -> None:
        goal.controller = answer.result()
        if not goal.controller.accepted:
            text = f'the controller ({self._name}) rejects the goal; its log says why'
            self._logger.warning(text)
            self._end(goal, GoalStatus.STATUS_ABORTED, self._refusal('', text))
            return
        if goal.canceling:
            goal.controller.cancel_goal_async()
        goal.controller.get_result_async().add_done_callback(partial(self._finished, goal))

    def _feedback(self, goal: _Goal, message: Any) -> None:
        goal.handle.publish_feedback(message.feedback)

    def _finished(self, goal: _Goal, answer: Future) -> None:
        response = answer.result()
        self._end(goal, response.status, response.result)

    def _cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        goal = self._goals.get(_key(handle))
        if goal is None:
            return CancelResponse.REJECT
        goal.canceling = True
        if goal.controller is not None:
            goal.controller.cancel_goal_async()
        elif goal.trial is not None:
            # If it has been passed on already, its acceptance finds that it is to be canceled.
            self._keeper.void(goal.trial, Reason.CANCELED, 'the client canceled the goal')
        return CancelResponse.ACCEPT

    def _end(self, goal: _Goal, status: int, result: Any) -> None:
        """Give the client the result, as soon as a cancellation that is being taken is."""
        if goal.result is None:
            goal.status, goal.result = status, result
            goal.handle.execute()

    def _finish(self, handle: ServerGoalHandle) -> Any:
        goal = self._goals.pop(_key(handle))
        if goal.status == GoalStatus.STATUS_SUCCEEDED:
            handle.succeed()
        elif goal.status == GoalStatus.STATUS_CANCELED and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return goal.result

    def _refusal(self, reason: str, message: str) -> Any:
        """Return a result of the action that says why a goal was not passed on."""
        text = f'{reason}: {message}' if reason else message
        return self._action.Result(error_code=self._action.Result.INVALID_GOAL, error_string=text)


def action_before(node: Node, name: str, keeper: Gatekeeper) -> ActionGate | None:
    """
    Stand before the action of a controller.

    :param node: whose action this is.
    :param name: the controller's action; '': none.
    :param keeper: decides.
    :returns: None: there is none, or control_msgs is not installed, and the log says so.
    """
    if not name:
        return None
    try:
        from control_msgs.action import FollowJointTrajectory
    except ImportError:
        node.get_logger().info(
            'control_msgs is not installed: there is no action, trajectories come by topic only'
        )
        return None
    return ActionGate(node, FollowJointTrajectory, name, keeper)


def _key(handle: ServerGoalHandle) -> bytes:
    return bytes(handle.goal_id.uuid)
