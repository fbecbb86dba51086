"""One trajectory on its way through the gate."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.task import Future
from trajectory_guard_interfaces.msg import CertificationResult, GateDecision
from trajectory_guard_interfaces.srv import CertifyTrajectory

from trajectory_guard.paths.takeover import Takeover
from trajectory_guard.paths.trajectory import Trajectory
from trajectory_guard.ros.gate_configuration import GateConfiguration


@dataclass(slots=True, eq=False)
class Trial:
    """
    A trajectory that is being decided on.

    :param message: trajectory_msgs/JointTrajectory.
    :param forward: passes it on, unchanged.
    :param receiver: says why nobody would receive it; '': somebody would.
    :param decided: is told the decision.
    :param configuration: the parameters when it arrived, which hold for it.
    :param arrived_ns: when it arrived, on the steady clock [ns].
    :param trajectory: what the message says; None: not read yet.
    :param plan: how the controller takes it over; None: not planned yet.
    :param request: what the guard was asked; None: nothing yet.
    :param future: the answer that is waited for; None: none.
    :param result: what the guard said; None: nothing yet.
    """

    message: Any
    forward: Callable[[], None]
    receiver: Callable[[], str]
    decided: Callable[[GateDecision], None]
    configuration: GateConfiguration
    arrived_ns: int
    trajectory: Trajectory | None = None
    plan: Takeover | None = None
    request: CertifyTrajectory.Request | None = None
    future: Future | None = None
    result: CertificationResult | None = None

    @property
    def expires_ns(self) -> int:
        """When it is too late for an answer, on the steady clock [ns]."""
        return self.arrived_ns + self.configuration.allowance.max_wait_ns
