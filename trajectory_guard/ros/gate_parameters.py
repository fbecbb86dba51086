"""The gate's parameters: what they are, and one consistent set of them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.result import NANOSECONDS
from trajectory_guard.ros.parameters import Declaration
from trajectory_guard.settings import LARGEST_LENGTH
from trajectory_guard.takeover import Allowance

DECLARATIONS = {
    'guard': Declaration(
        'guard', 'name of the node that certifies, with its namespace', read_only=True
    ),
    'input_topic': Declaration(
        '~/trajectory', 'trajectories to check (trajectory_msgs/JointTrajectory)', read_only=True
    ),
    'output_topic': Declaration(
        'joint_trajectory_controller/joint_trajectory',
        'topic of the controller, where what is proved free is passed on',
        read_only=True,
    ),
    'joint_states_topic': Declaration(
        'joint_states', 'sensor_msgs/JointState of the robot, stamped', read_only=True
    ),
    'controller_action': Declaration(
        'joint_trajectory_controller/follow_joint_trajectory',
        'action of the controller that ~/follow_joint_trajectory stands before; empty: none',
        read_only=True,
    ),
    'state_interfaces': Declaration(
        ['position', 'velocity'],
        'state_interfaces of the controller: what it reads of the robot when it begins',
    ),
    'continuous_joints': Declaration(
        [''], 'continuous joints, of which the controller does not count whole turns'
    ),
    'max_state_age': Declaration(
        0.1,
        'a joint state is fresh up to this age, by its stamp and by its arrival [s]',
        (1e-3, 10.0),
    ),
    'max_drift': Declaration(
        0.002,
        'how far a joint may be off the certified state when the controller begins [rad or m]',
        (0.0, 1.0),
    ),
    'max_velocity_drift': Declaration(
        0.01,
        'how far the velocity of a joint may be off then [rad/s or m/s]; '
        'one that is not measured is taken to be below this',
        (0.0, 10.0),
    ),
    'max_start_delay': Declaration(
        0.02,
        'from passing on to the first sample of the controller; '
        'how far its clock may differ, too [s]',
        (0.0, 10.0),
    ),
    'allowed_start_tolerance': Declaration(
        0.01,
        'how far the robot may be off the path where the controller does not approach it '
        '[rad or m]',
        (0.0, 1.0),
    ),
    'tracking_tolerance': Declaration(
        [0.0],
        'how far the robot may follow off the path [rad or m]: one value >= 0, or one for each of '
        "tracking_tolerance_joints; the guard's own where that is larger",
    ),
    'tracking_tolerance_joints': Declaration(
        [''], 'joints that the values of tracking_tolerance belong to; empty: one value for all'
    ),
    'clearance': Declaration(
        0.0, "distance that free must exceed [m]; 0: the guard's own", (0.0, LARGEST_LENGTH)
    ),
    'tolerance': Declaration(
        0.0, "gaps larger than this are decided [m]; 0: the guard's own", (0.0, LARGEST_LENGTH)
    ),
    'deadline': Declaration(1.0, 'time for the answer of the guard [s]', (1e-3, 3600.0)),
    'answer_margin': Declaration(
        0.1, 'how much later than that its answer may arrive [s]', (0.0, 10.0)
    ),
}

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
        interfaces = _named(values['state_interfaces'])
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
                continuous_joints=frozenset(_named(values['continuous_joints'])),
                reads_velocity='velocity' in interfaces,
                reads_acceleration='acceleration' in interfaces,
            ),
            max_state_age_ns=round(values['max_state_age'] * NANOSECONDS),
            tracking_tolerance=tuple(values['tracking_tolerance'] or ()),
            tracking_tolerance_joints=_named(values['tracking_tolerance_joints']),
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


def per_joint(
    joint_names: Sequence[str], values: Sequence[float], joints: Sequence[str], whose: str
) -> tuple[float, ...]:
    """
    Return the tracking tolerance of each joint.

    :param joint_names: joints of a trajectory.
    :param values: one value, or one for each of ``joints`` [rad or m].
    :param joints: the joints that they belong to; empty: one value for all.
    :param whose: node of the parameters, for the message.
    :raises RequestError: there is no value for one of them.
    """
    if not joints and len(values) == 1:
        return tuple(values) * len(joint_names)
    named = dict(zip(joints, values, strict=False))
    for name in joint_names:
        if name not in named:
            raise RequestError(
                Reason.INVALID_TRACKING_TOLERANCE,
                f'tracking_tolerance_joints of {whose} has no joint {name!r}, '
                f'but {", ".join(named)}',
            )
    return tuple(named[name] for name in joint_names)


def declare(node: Node) -> dict[str, Any]:
    """
    Declare all parameters.

    :param node: a node that has none of them yet.
    :returns: the values by name.
    :raises RequestError: a value of the wrong type or out of its range, or an unknown name.
    """
    try:
        found = [
            node.declare_parameter(name, declaration.default, _descriptor(declaration))
            for name, declaration in DECLARATIONS.items()
        ]
    except ParameterException as error:
        raise _invalid(str(error)) from error
    # ROS takes no notice of a name that no node declares, and has no public way to ask for them.
    unknown = [name for name in node._parameter_overrides if not node.has_parameter(name)]
    if unknown:
        raise _invalid(
            f'the gate has no parameter {", ".join(map(repr, sorted(unknown)))}, '
            f'but {", ".join(DECLARATIONS)}'
        )
    return values_of(found)


def values_of(parameters: Iterable[Parameter]) -> dict[str, Any]:
    """Return the values of parameters of the gate by name; those of the node are left out."""
    return {
        parameter.name: parameter.value
        for parameter in parameters
        if parameter.name in DECLARATIONS
    }


def _descriptor(declaration: Declaration) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        description=declaration.description, read_only=declaration.read_only
    )
    if declaration.bounds is not None:
        low, high = declaration.bounds
        descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    return descriptor


def _invalid(message: str) -> RequestError:
    return RequestError(Reason.INVALID_PARAMETER, message)


def _named(values: Sequence[str] | None) -> tuple[str, ...]:
    """Return the names in a list; ROS cannot write an empty list of strings but as ['']."""
    return tuple(value for value in values or () if value)
