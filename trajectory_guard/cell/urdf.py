"""
URDF text to a `Robot`.

The XML is read with the standard library: yourdfpy repairs broken XML, takes two roots, duplicate
names, NaN sizes and unknown joint types without a word, and only warns of a missing mesh.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from trajectory_guard.cell.robot import Collision, floating_joint, Joint, JointType, Mimic, Robot
from trajectory_guard.cell.urdf_elements import (
    attribute,
    collision_of,
    joint_of,
    link_of,
    origin_of,
)
from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.shapes.resource import ANY_MESH, MeshLimits

# Joint types with more than one degree of freedom.
FLOATING = 'floating'
PLAIN = ('revolute', 'continuous', 'prismatic', 'fixed')
UNDETERMINED = (FLOATING, 'planar')


def load_robot(path: str | Path, limits: MeshLimits = ANY_MESH) -> Robot:
    """
    Read a URDF file; its meshes are read when they are first needed.

    :param limits: which mesh files may be read.
    :raises RobotError: the file cannot be read, or describes no robot that can be judged.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise RobotError(Reason.ROBOT_INVALID, f'cannot read {path}: {error}') from error
    with _about(str(path)):
        return robot_from_urdf(content, path.parent, limits)


def robot_from_urdf(
    text: str | bytes, folder: str | Path | None = None, limits: MeshLimits = ANY_MESH
) -> Robot:
    """
    Read a URDF document.

    :param folder: where relative mesh paths start and packages are looked for upwards.
    :param limits: which mesh files may be read.
    :raises RobotError: the message names the element and the value that is wrong.
    """
    source = text.encode('utf-8', 'surrogatepass') if isinstance(text, str) else text
    # Meshes are read later, from wherever the process is by then.
    folder = None if folder is None else Path(folder).absolute()
    root = _parse(source)
    links = _by_name(root, 'link')
    joints = _by_name(root, 'joint')
    if not links:
        raise RobotError(Reason.ROBOT_EMPTY, 'no link at all')
    base, order = _tree(links, joints)
    collisions: dict[str, tuple[Collision, ...]] = {}
    for name in (base, *(link_of(joints[joint], 'child') for joint in order)):
        with _about(f'link {name!r}'):
            found = tuple(
                collision_of(c, folder, limits) for c in links[name].findall('collision')
            )
        if found:
            collisions[name] = found
    kept = _determined([joints[name] for name in order], base, set(collisions))
    if not collisions:
        raise RobotError(Reason.ROBOT_EMPTY, 'no link has collision geometry')
    return Robot(
        name=root.get('name', ''),
        root=base,
        joints=_with_resolved_mimics(kept),
        collisions=collisions,
        source=source,
    )


@contextmanager
def _about(what: str) -> Iterator[None]:
    """Say what an error inside is about."""
    try:
        yield
    except RobotError as error:
        raise RobotError(error.reason, f'{what}: {error}') from error


def _parse(source: bytes) -> Element:
    try:
        root = ElementTree.fromstring(source)
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise RobotError(Reason.ROBOT_INVALID, f'broken XML: {error}') from error
    if root.tag != 'robot':
        raise RobotError(Reason.ROBOT_INVALID, f'the document is a <{root.tag}>, not a <robot>')
    for element in root.iter():
        if 'xacro' in element.tag.partition('}')[0]:
            raise RobotError(
                Reason.ROBOT_INVALID, f'unexpanded xacro: {element.tag.rpartition("}")[2]!r}'
            )
    return root


def _by_name(root: Element, tag: str) -> dict[str, Element]:
    elements: dict[str, Element] = {}
    for element in root.findall(tag):
        name = attribute(element, 'name')
        if name in elements:
            raise RobotError(Reason.ROBOT_INVALID, f'two {tag}s are called {name!r}')
        elements[name] = element
    return elements


def _tree(links: dict[str, Element], joints: dict[str, Element]) -> tuple[str, list[str]]:
    """Return the root link and the joints depth first, the order of the file among siblings."""
    below: dict[str, list[str]] = {link: [] for link in links}
    above: dict[str, str] = {}
    for name, element in joints.items():
        with _about(f'joint {name!r}'):
            parent, child = link_of(element, 'parent'), link_of(element, 'child')
            for role, link in (('parent', parent), ('child', child)):
                if link not in links:
                    raise RobotError(Reason.ROBOT_INVALID, f'{role} link {link!r} does not exist')
            if child in above:
                raise RobotError(
                    Reason.ROBOT_INVALID, f'link {child!r} is already moved by {above[child]!r}'
                )
        above[child] = name
        below[parent].append(name)
    roots = [link for link in links if link not in above]
    if len(roots) != 1:
        raise RobotError(
            Reason.ROBOT_INVALID, f'expected one root link, got {len(roots)}: {roots[:8]}'
        )
    order: list[str] = []
    waiting = below[roots[0]][::-1]
    while waiting:
        order.append(waiting.pop())
        waiting += below[link_of(joints[order[-1]], 'child')][::-1]
    if len(order) < len(joints):
        lost = sorted(joints.keys() - set(order))
        raise RobotError(Reason.ROBOT_INVALID, f'joints form a cycle: {lost[:8]}')
    return roots[0], order


def _determined(elements: list[Element], base: str, solid: set[str]) -> list[Joint]:
    """
    Return the joints whose pose is known or can be told, in the order given.

    A floating joint above collision geometry hangs on the root, and there is one at most: a
    message can say where its child is. Where nothing solid hangs on a floating or planar joint, it
    is left out with all that follows it.

    :param elements: joints in topological order.
    :param base: root link.
    :param solid: links with collision geometry.
    """
    carries = set(solid)
    for element in reversed(elements):
        if link_of(element, 'child') in carries:
            carries.add(link_of(element, 'parent'))
    known, still = {base}, {base}
    joints: list[Joint] = []
    for element in elements:
        parent, child = link_of(element, 'parent'), link_of(element, 'child')
        with _about(f'joint {element.get("name")!r}'):
            type_ = attribute(element, 'type')
            if type_ in UNDETERMINED and child not in carries:
                continue
            if type_ == FLOATING:
                joints += _floating(element, still, joints)
            elif type_ in UNDETERMINED:
                raise RobotError(
                    Reason.JOINT_UNSUPPORTED,
                    f'a {type_} joint above collision geometry is not supported',
                )
            elif parent in known:
                joints.append(joint_of(element, _joint_type(type_)))
            else:
                continue
            known.add(child)
            if joints[-1].type is JointType.FIXED and parent in still:
                still.add(child)
    _check_names(joints)
    return joints


def _check_names(joints: list[Joint]) -> None:
    """Refuse names that those of a floating joint's parts repeat."""
    for names in ([joint.name for joint in joints], [joint.child for joint in joints]):
        for name in names:
            if names.count(name) > 1:
                raise RobotError(
                    Reason.ROBOT_INVALID, f'{name!r} is the name of a floating joint part, too'
                )


def _floating(element: Element, still: set[str], before: list[Joint]) -> tuple[Joint, Joint]:
    """Return the parts of a floating joint, if it is the only one and hangs on the root."""
    parent = link_of(element, 'parent')
    if parent not in still or any(joint.type is JointType.TRANSLATION for joint in before):
        raise RobotError(
            Reason.JOINT_UNSUPPORTED,
            'a floating joint above collision geometry must be the only one, and no joint may '
            'move its parent',
        )
    name = attribute(element, 'name')
    return floating_joint(name, parent, link_of(element, 'child'), origin_of(element))


def _joint_type(text: str) -> JointType:
    if text not in PLAIN:
        raise RobotError(Reason.JOINT_UNSUPPORTED, f'joint type {text!r} is not supported')
    return JointType(text)


def _with_resolved_mimics(joints: list[Joint]) -> tuple[Joint, ...]:
    """Return the joints, each mimic referring to a joint that is no mimic itself."""
    movable = {joint.name: joint for joint in joints if joint.type is not JointType.FIXED}
    return tuple(
        replace(joint, mimic=_resolved(joint, movable)) if joint.mimic else joint
        for joint in joints
    )


def _resolved(joint: Joint, movable: dict[str, Joint]) -> Mimic:
    """Follow a chain of mimics to its end; exact until the last rounding."""
    multiplier, offset = Fraction(1), Fraction(0)
    passed = [joint.name]
    while (mimic := movable[passed[-1]].mimic) is not None:
        offset += multiplier * Fraction(mimic.offset)
        multiplier *= Fraction(mimic.multiplier)
        if mimic.joint not in movable:
            raise RobotError(
                Reason.ROBOT_INVALID,
                f'joint {passed[-1]!r} mimics {mimic.joint!r}, which is no movable joint',
            )
        if mimic.joint in passed:
            raise RobotError(
                Reason.ROBOT_INVALID, f'joints mimic each other: {[*passed, mimic.joint]}'
            )
        passed.append(mimic.joint)
    return Mimic(passed[-1], float(multiplier), float(offset))
