"""Parameters of a node: how each is declared, and that there are no others."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from trajectory_guard.errors import Reason, RequestError

AT_CONFIGURE = 'taken when the node is configured; cannot change while it is active'


class Declaration(NamedTuple):
    """
    How one parameter is declared.

    :param default: value if nothing else is said; its type is the parameter's.
    :param description: what it means, with its unit.
    :param bounds: least and greatest value of a number; None: the configuration checks it.
    :param read_only: it cannot change while the node runs.
    :param at_configure: it says what is loaded when the node is configured, and cannot change
        while that is in use.
    """

    default: Any
    description: str
    bounds: tuple[float, float] | tuple[int, int] | None = None
    read_only: bool = False
    at_configure: bool = False


def declare(node: Node, declarations: Mapping[str, Declaration]) -> dict[str, Any]:
    """
    Declare all parameters of a node.

    :param node: a node that has none of them yet.
    :param declarations: by name.
    :returns: the values by name.
    :raises RequestError: a value of the wrong type or out of its range, or an unknown name.
    """
    try:
        found = [
            node.declare_parameter(name, declaration.default, _descriptor(declaration))
            for name, declaration in declarations.items()
        ]
    except ParameterException as error:
        raise RequestError(Reason.INVALID_PARAMETER, str(error)) from error
    # ROS takes no notice of a name that no node declares: a clearance that is misspelt would be no
    # clearance. (There is no public way to ask for them.)
    unknown = [name for name in node._parameter_overrides if not node.has_parameter(name)]
    if unknown:
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'the {node.get_name()} has no parameter {", ".join(map(repr, sorted(unknown)))}, '
            f'but {", ".join(declarations)}',
        )
    return values_of(found, declarations)


def values_of(
    parameters: Iterable[Parameter], declarations: Mapping[str, Declaration]
) -> dict[str, Any]:
    """Return the values of declared parameters by name; those of every node are left out."""
    return {
        parameter.name: parameter.value
        for parameter in parameters
        if parameter.name in declarations
    }


def names_in(values: Sequence[str] | None) -> tuple[str, ...]:
    """Return the names in a list; ROS cannot write an empty list of strings but as ['']."""
    return tuple(value for value in values or () if value)


def per_joint(
    joint_names: Sequence[str], values: Sequence[float], joints: Sequence[str], whose: str
) -> tuple[float, ...]:
    """
    Return a tracking tolerance per joint.

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


def _descriptor(declaration: Declaration) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        description=declaration.description,
        read_only=declaration.read_only,
        additional_constraints=AT_CONFIGURE if declaration.at_configure else '',
    )
    if declaration.bounds is not None:
        low, high = declaration.bounds
        if isinstance(declaration.default, int):
            descriptor.integer_range = [IntegerRange(from_value=low, to_value=high)]
        else:
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    return descriptor
