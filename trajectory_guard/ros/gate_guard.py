"""The guard as the gate sees it: is it the only one, is it ready, and what does it answer."""

from collections.abc import Callable
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.task import Future
from trajectory_guard_interfaces.msg import CertificationResult, GuardStatus
from trajectory_guard_interfaces.srv import CertifyTrajectory

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.ros.model import LATCHED

# The middleware brings every client the answers to all; with the usual ten places those to others
# would push its own out while it waits for a core.
_ANSWERS = QoSProfile(depth=1000)

_LEAST = ('tracking_tolerance', 'tracking_tolerance_joints')


class GuardClient:
    """
    Asks one guard.

    :param node: whose client this is.
    :param guard: name of the guard's node, relative to the namespace of the gate.
    :param changed: called when the guard has said that it became ready, or that it is not.
    """

    def __init__(self, node: Node, guard: str, changed: Callable[[], None]) -> None:
        self._node = node
        self._service = node.resolve_service_name(f'{guard}/certify')
        self._certify = node.create_client(
            CertifyTrajectory, f'{guard}/certify', qos_profile=_ANSWERS
        )
        self._parameters = node.create_client(
            GetParameters, f'{guard}/get_parameters', qos_profile=_ANSWERS
        )
        self._status: GuardStatus | None = None
        self._changed = changed
        node.create_subscription(GuardStatus, f'{guard}/status', self._take, LATCHED)

    def missing(self) -> RequestError | None:
        """Return why the guard cannot be asked now, or would refuse; None: it can."""
        servers = self._node.count_services(self._service)
        if servers > 1:
            return RequestError(
                Reason.GUARD_AMBIGUOUS,
                f'{servers} nodes offer {self._service}: which of them is right?',
            )
        if servers == 0:
            # What it said holds for nobody.
            self._status = None
        if servers == 0 or not self._certify.service_is_ready():
            return RequestError(Reason.GUARD_MISSING, f'no node offers {self._service}')
        if not self._parameters.service_is_ready():
            return RequestError(
                Reason.GUARD_MISSING, f'no node offers {self._parameters.srv_name}'
            )
        if self._status is None:
            return RequestError(Reason.GUARD_NOT_READY, 'the guard has not said that it is ready')
        if not self._status.ready:
            return RequestError(
                Reason.GUARD_NOT_READY,
                f'the guard says {self._status.reason_code}: {self._status.message}',
            )
        return None

    def changed_since(self, result: CertificationResult) -> RequestError | None:
        """Return what is not as it was for a result; None: all is."""
        status = self._status or GuardStatus()
        for what in ('robot', 'scene'):
            then, now = (getattr(said, f'{what}_hash') for said in (result, status))
            if then != now:
                return RequestError(
                    Reason.SCENE_CHANGED, f'certified was {what} {then}, the guard has {now}'
                )
        return None

    def least_tracking_tolerance(self) -> Future:
        """Ask for the tracking tolerance that the guard's requests have at least."""
        return self._parameters.call_async(GetParameters.Request(names=list(_LEAST)))

    def certify(self, request: CertifyTrajectory.Request) -> Future:
        """Ask whether a trajectory is free."""
        return self._certify.call_async(request)

    def forget(self, future: Future | None) -> None:
        """Take no answer any more of what was asked."""
        client: Client
        for client in (self._certify, self._parameters):
            if future is not None:
                client.remove_pending_request(future)

    def _take(self, status: GuardStatus) -> None:
        self._status = status
        self._changed()


def least_from_response(response: Any) -> tuple[tuple[float, ...], tuple[str, ...]]:
    """
    Return the tracking tolerance of the guard's parameters.

    :param response: GetParameters response to `GuardClient.least_tracking_tolerance`.
    :returns: one value, or one for each of the joints [rad or m]; the joints, if any.
    :raises RequestError: the guard does not have these parameters.
    """
    if len(response.values) != len(_LEAST):
        raise RequestError(
            Reason.ANSWER_INVALID,
            f'the guard says nothing of its parameters {", ".join(_LEAST)}',
        )
    values, joints = response.values
    if not len(values.double_array_value):
        raise RequestError(
            Reason.ANSWER_INVALID, 'the parameter tracking_tolerance of the guard is no list'
        )
    return (
        tuple(values.double_array_value),
        tuple(name for name in joints.string_array_value if name),
    )
