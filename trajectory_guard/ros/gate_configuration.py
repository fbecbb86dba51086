"""What the parameters of the gate say, checked as a whole."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.paths.entry import Allowance
from trajectory_guard.result import NANOSECONDS
from trajectory_guard.ros.declared import names_in, per_joint

_INTERFACES = ('position', 'velocity', 'acceleration')


@dataclass(frozen=True, slots=True)
class GateConfiguration:
    """
    One consistent set of the gate's parameters.

    :param guard: name of the guard's node.
    :param input_topic: trajectories to check.
    :param output_topic: where they are passed on.
    :param joint_states_topic: the robot's state.
    :param controller_action: the controller's action; '': none.
    :param allowance: what may differ between the proof and the motion.
    :param max_state_age_ns: a joint state is fresh up to this age [ns].
    :param tracking_tolerance: one value, or one for each of the joints [rad or m].
    :param tracking_tolerance_joints: the joints; empty: one value for all.
    :param clearance: as in a request [m].
    :param tolerance: as in a request [m].
    :param deadline_ns: time for the answer [ns].
    :raises RequestError: naming the parameter and its value.
    """

    guard: str
    input_topic: str
    output_topic: str
    joint_states_topic: str
    controller_action: str
    allowance: Allowance
    max_state_age_ns: int
    tracking_tolerance: tuple[float, ...]
    tracking_tolerance_joints: tuple[str, ...]
    clearance: float
    tolerance: float
    deadline_ns: int

    def __post_init__(self) -> None:
        """Refuse what does not fit together; ranges have been checked before."""
        for name in ('guard', 'input_topic', 'output_topic', 'joint_states_topic'):
            if not getattr(self, name):
                raise _invalid(f'{name} must not be empty')
        joints, values = self.tracking_tolerance_joints, self.tracking_tolerance
        if len(set(joints)) != len(joints):
            raise _invalid(f'tracking_tolerance_joints names a joint twice: {list(joints)}')
        if len(values) != (len(joints) or 1):
            raise _invalid(
                'tracking_tolerance must be one value, or one for each of '
                f'tracking_tolerance_joints, got {list(values)} for {list(joints)}'
            )
        for value in values:
            if not (math.isfinite(value) and value >= 0.0):
                raise _invalid(f'tracking_tolerance must be finite and >= 0, got {value!r}')

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> 'GateConfiguration':
        """
        Build a configuration from the values of all parameters.

        :param values: by name, each within its declared range; None is an empty list.
        :raises RequestError: as the class does, and for state interfaces that there are not.
        """
        interfaces = names_in(values['state_interfaces'])
        if interfaces != _INTERFACES[: len(interfaces)] or not interfaces:
            raise _invalid(
                'state_interfaces must be position; position and velocity; or these and '
                f'acceleration, got {list(interfaces)}'
            )
        deadline_ns = round(values['deadline'] * NANOSECONDS)
        return cls(
            guard=values['guard'],
            input_topic=values['input_topic'],
            output_topic=values['output_topic'],
            joint_states_topic=values['joint_states_topic'],
            controller_action=values['controller_action'],
            allowance=Allowance(
                max_drift=values['max_drift'],
                max_velocity_drift=values['max_velocity_drift'],
                max_start_delay_ns=round(values['max_start_delay'] * NANOSECONDS),
                max_wait_ns=deadline_ns + round(values['answer_margin'] * NANOSECONDS),
                allowed_start_tolerance=values['allowed_start_tolerance'],
                continuous_joints=frozenset(names_in(values['continuous_joints'])),
                reads_velocity='velocity' in interfaces,
                reads_acceleration='acceleration' in interfaces,
            ),
            max_state_age_ns=round(values['max_state_age'] * NANOSECONDS),
            tracking_tolerance=tuple(values['tracking_tolerance'] or ()),
            tracking_tolerance_joints=names_in(values['tracking_tolerance_joints']),
            clearance=values['clearance'],
            tolerance=values['tolerance'],
            deadline_ns=deadline_ns,
        )

    def tracking_tolerance_of(self, joint_names: Sequence[str]) -> tuple[float, ...]:
        """
        Return how far each joint may follow off the path.

        :param joint_names: joints of a trajectory.
        :returns: one value a joint [rad or m].
        :raises RequestError: there is no value for one of them.
        """
        return per_joint(
            joint_names, self.tracking_tolerance, self.tracking_tolerance_joints, 'the gate'
        )


def _invalid(message: str) -> RequestError:
    return RequestError(Reason.INVALID_PARAMETER, message)
