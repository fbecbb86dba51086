"""The elements of a URDF joint and of a collision as values; units are metres and radians."""

import math
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from trajectory_guard.cell.pose import pose_matrix
from trajectory_guard.cell.robot import Collision, Joint, JointType, Mimic, Shape
from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.shapes.body import LARGEST_COORDINATE
from trajectory_guard.shapes.mesh import MeshFile
from trajectory_guard.shapes.primitive import Box, Cylinder, Sphere
from trajectory_guard.shapes.resource import ANY_MESH, MeshLimits

LIMITED = (JointType.REVOLUTE, JointType.PRISMATIC)


def joint_of(element: Element, type_: JointType) -> Joint:
    """
    Return the joint an element describes.

    :param element: `<joint>`, its name already checked.
    :param type_: the kind of joint it is taken for.
    :raises RobotError: a value is missing, broken or out of range; the message names it.
    """
    fixed = type_ is JointType.FIXED
    lower, upper = _limits(element) if type_ in LIMITED else (-math.inf, math.inf)
    return Joint(
        name=element.get('name', ''),
        type=type_,
        parent=link_of(element, 'parent'),
        child=link_of(element, 'child'),
        T_parent_joint=origin_of(element),
        # Exporters write an axis of zeros to fixed joints; it means nothing there.
        axis=np.array([1.0, 0.0, 0.0]) if fixed else _axis(element),
        lower=0.0 if fixed else lower,
        upper=0.0 if fixed else upper,
        mimic=None if fixed else _mimic(element),
    )


def link_of(joint: Element, role: str) -> str:
    """Return the link a joint names as its parent or child."""
    element = only(joint, role)
    return attribute(element, 'link') if element is not None else _missing(f'<{role}>')


def collision_of(
    element: Element, folder: Path | None, limits: MeshLimits = ANY_MESH
) -> Collision:
    """
    Return the geometry of a `<collision>`; mesh files are not touched.

    :param folder: where relative mesh paths start.
    :param limits: which mesh files may be read.
    :raises RobotError: the geometry is missing, of an unknown kind, or its size is no length.
    """
    geometry = only(element, 'geometry')
    if geometry is None or len(geometry) != 1:
        raise RobotError(
            Reason.ROBOT_INVALID, 'a <collision> needs one <geometry> with one shape in it'
        )
    return Collision(origin_of(element), _shape(geometry[0], folder, limits))


def origin_of(element: Element) -> np.ndarray:
    """Return the pose of an `<origin>`: R = Rz(yaw) Ry(pitch) Rx(roll), the identity if absent."""
    origin = only(element, 'origin')
    if origin is None:
        return np.eye(4)
    unknown = set(origin.keys()) - {'xyz', 'rpy'}
    if unknown:
        raise RobotError(
            Reason.ROBOT_INVALID, f'<origin> has unknown attributes {sorted(unknown)}'
        )
    xyz = _numbers(origin, 'xyz', 3, (0.0, 0.0, 0.0))
    rpy = _numbers(origin, 'rpy', 3, (0.0, 0.0, 0.0))
    if not max(map(abs, xyz)) <= LARGEST_COORDINATE or not max(map(abs, rpy)) < math.inf:
        raise RobotError(Reason.ROBOT_INVALID, f'<origin> is out of range: {xyz} {rpy}')
    return pose_matrix(xyz, rpy)


def only(element: Element, tag: str) -> Element | None:
    """Return the child with a tag, or None; raises RobotError if there are several."""
    found = element.findall(tag)
    if len(found) > 1:
        raise RobotError(Reason.ROBOT_INVALID, f'{len(found)} elements <{tag}>')
    return found[0] if found else None


def attribute(element: Element, name: str) -> str:
    """Return a text attribute; raises RobotError if it is missing or empty."""
    return element.get(name) or _missing(f'<{element.tag}> attribute {name!r}')


def _missing(what: str) -> str:
    raise RobotError(Reason.ROBOT_INVALID, f'{what} is missing')


def _numbers(
    element: Element, name: str, count: int, default: tuple[float, ...] = ()
) -> tuple[float, ...]:
    text = element.get(name) if default else attribute(element, name)
    if text is None:
        return default
    try:
        # Python would take 1_000 for a number; nobody else does.
        values = tuple(float(word.replace('_', '?')) for word in text.split())
    except ValueError:
        values = ()
    if len(values) != count or any(map(math.isnan, values)):
        raise RobotError(
            Reason.ROBOT_INVALID, f'<{element.tag}> {name} must be {count} numbers, got {text!r}'
        )
    return values


def _axis(element: Element) -> np.ndarray:
    axis = only(element, 'axis')
    if axis is None:
        return np.array([1.0, 0.0, 0.0])
    try:
        xyz = np.array(_numbers(axis, 'xyz', 3))
    except RobotError as error:
        raise RobotError(Reason.JOINT_AXIS_INVALID, str(error)) from error
    largest = np.abs(xyz).max()
    if not 0.0 < largest < math.inf:
        raise RobotError(
            Reason.JOINT_AXIS_INVALID, f'axis must be finite and not zero, got {xyz.tolist()}'
        )
    # Scaled first, so that no square under- or overflows.
    xyz = xyz / largest
    return xyz / np.linalg.norm(xyz)


def _limits(element: Element) -> tuple[float, float]:
    limit = only(element, 'limit')
    if limit is None:
        raise RobotError(Reason.LIMITS_MISSING, f'a {element.get("type")} joint needs a <limit>')
    # Absent bounds are 0 by the specification.
    (lower,) = _numbers(limit, 'lower', 1, (0.0,))
    (upper,) = _numbers(limit, 'upper', 1, (0.0,))
    if not (lower <= upper and lower < math.inf and upper > -math.inf):
        raise RobotError(Reason.ROBOT_INVALID, f'limits [{lower}, {upper}] are empty')
    return lower, upper


def _mimic(element: Element) -> Mimic | None:
    mimic = only(element, 'mimic')
    if mimic is None:
        return None
    (multiplier,) = _numbers(mimic, 'multiplier', 1, (1.0,))
    (offset,) = _numbers(mimic, 'offset', 1, (0.0,))
    if not (math.isfinite(multiplier) and math.isfinite(offset)):
        raise RobotError(Reason.ROBOT_INVALID, f'<mimic> is not finite: {multiplier}, {offset}')
    return Mimic(attribute(mimic, 'joint'), multiplier, offset)


def _shape(element: Element, folder: Path | None, limits: MeshLimits) -> Shape:
    match element.tag:
        case 'box':
            x, y, z = _numbers(element, 'size', 3)
            return Box((x, y, z))
        case 'cylinder':
            return Cylinder(_numbers(element, 'radius', 1)[0], _numbers(element, 'length', 1)[0])
        case 'sphere':
            return Sphere(_numbers(element, 'radius', 1)[0])
        case 'mesh':
            x, y, z = _numbers(element, 'scale', 3, (1.0, 1.0, 1.0))
            if not all(0.0 < abs(factor) < math.inf for factor in (x, y, z)):
                raise RobotError(
                    Reason.ROBOT_INVALID, f'mesh scale must be finite and not 0, got {x} {y} {z}'
                )
            return MeshFile(attribute(element, 'filename'), folder, (x, y, z), limits)
    raise RobotError(
        Reason.GEOMETRY_UNSUPPORTED,
        f'geometry <{element.tag}> is not one of box, cylinder, sphere, mesh',
    )
