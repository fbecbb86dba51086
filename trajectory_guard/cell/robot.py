"""A robot as data: a tree of joints, and convex bodies that contain the links."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
import hashlib
import math
from typing import NamedTuple, Protocol

import numpy as np

from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.shapes.body import ConvexBody, read_only

# What the two parts of a floating joint are called after it.
TRANSLATION_SUFFIX = '/translation'
ROTATION_SUFFIX = '/rotation'


class JointType(Enum):
    """How the child link may move against its parent."""

    REVOLUTE = 'revolute'
    CONTINUOUS = 'continuous'
    PRISMATIC = 'prismatic'
    FIXED = 'fixed'
    # A floating joint is two: its child link translates, and below that rotates, in any direction.
    TRANSLATION = 'translation'
    ROTATION = 'rotation'


FLOATING_TYPES = (JointType.TRANSLATION, JointType.ROTATION)


class Mimic(NamedTuple):
    """
    A joint that follows another: position = multiplier * position(joint) + offset.

    :param joint: the followed joint, movable and itself no mimic.
    :param multiplier: factor, dimensionless or [rad/m], [m/rad].
    :param offset: [rad] or [m].
    """

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """
    A joint of the tree: T_parent_child(q) = T_parent_joint * motion(q).

    The motion turns about the axis (q in rad) or slides along it (q in m); both through the
    joint's origin. The two parts of a floating joint have no axis and no position of their own.

    :param name: unique in the robot.
    :param type: kind of the motion.
    :param parent: parent link.
    :param child: child link, whose frame is the joint frame at q = 0.
    :param T_parent_joint: pose of the joint frame in the parent link, (4, 4), rigid; entries of
        the rotation within 16 * 2^-53 of the exact ones [m].
    :param axis: unit axis in the joint frame, (3,), each entry within 8 * 2^-53 of the exact one.
    :param lower: lower position limit [rad or m]; -inf for a continuous joint.
    :param upper: upper position limit [rad or m]; inf for a continuous joint.
    :param mimic: set if the joint follows another one.
    """

    name: str
    type: JointType
    parent: str
    child: str
    T_parent_joint: np.ndarray
    axis: np.ndarray
    lower: float
    upper: float
    mimic: Mimic | None = None

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        object.__setattr__(self, 'T_parent_joint', read_only(self.T_parent_joint))
        object.__setattr__(self, 'axis', read_only(self.axis))


def floating_joint(name: str, parent: str, child: str, T: np.ndarray) -> tuple[Joint, Joint]:
    """
    Return the two parts of a floating joint, which a link that is nowhere in the robot joins.

    :param name: the floating joint's.
    :param parent: parent link, which no joint moves.
    :param child: child link.
    :param T: pose of the joint frame in the parent link, (4, 4) [m].
    """

    def part(suffix: str, type_: JointType, above: str, below: str, pose: np.ndarray) -> Joint:
        z = np.array([0.0, 0.0, 1.0])
        return Joint(name + suffix, type_, above, below, pose, z, -math.inf, math.inf)

    between = child + TRANSLATION_SUFFIX
    return (
        part(TRANSLATION_SUFFIX, JointType.TRANSLATION, parent, between, T),
        part(ROTATION_SUFFIX, JointType.ROTATION, between, child, np.eye(4)),
    )


class Loaded(NamedTuple):
    """
    A shape that has been built.

    :param body: the body in the shape's own frame.
    :param content: SHA-256 of the file it came from, in hex; '' for a primitive.
    """

    body: ConvexBody
    content: str


class Shape(Protocol):
    """A collision geometry as it is described; hashable, and nothing is read before `load`."""

    def load(self) -> Loaded:
        """Return a body that contains the geometry; raises TrajectoryGuardError."""


class Collision(NamedTuple):
    """
    One collision geometry of a link.

    :param T_link_shape: pose of the shape in the link frame, (4, 4) [m].
    :param shape: what is there.
    """

    T_link_shape: np.ndarray
    shape: Shape


@dataclass(frozen=True, slots=True, eq=False)
class Robot:
    """
    A kinematic tree with collision geometry.

    ``links[0]`` is the root and ``links[k + 1]`` is the child of ``joints[k]``; a joint comes
    after the joint that moves its parent.

    :param name: the description's own name.
    :param root: root link; every pose is expressed in its frame.
    :param joints: all joints in topological order, fixed ones included.
    :param collisions: collision geometries of the links that have any, in the order of links.
    :param source: bytes of the description, for the digest.
    :param movable: all joints that are not fixed, mimic joints included, in the order of joints.
    """

    name: str
    root: str
    joints: tuple[Joint, ...]
    collisions: Mapping[str, tuple[Collision, ...]] = field(repr=False)
    source: bytes = field(repr=False)
    movable: tuple[Joint, ...] = field(init=False, repr=False)
    _shapes: dict[Shape, Loaded] = field(init=False, repr=False, default_factory=dict)
    _bodies: dict[str, tuple[ConvexBody, ...]] = field(
        init=False, repr=False, default_factory=dict
    )

    def __post_init__(self) -> None:
        """List the movable joints, which every request asks for."""
        movable = tuple(joint for joint in self.joints if joint.type is not JointType.FIXED)
        object.__setattr__(self, 'movable', movable)

    @property
    def floating(self) -> str | None:
        """The name of the floating joint, if there is one."""
        for joint in self.joints:
            if joint.type is JointType.TRANSLATION:
                return joint.name.removesuffix(TRANSLATION_SUFFIX)
        return None

    @property
    def links(self) -> tuple[str, ...]:
        """All links, the root first, then the child of each joint."""
        return (self.root, *(joint.child for joint in self.joints))

    @property
    def collision_links(self) -> tuple[str, ...]:
        """The links that have collision geometry, in the order of `links`."""
        return tuple(self.collisions)

    def bodies(self, link: str) -> tuple[ConvexBody, ...]:
        """
        Return convex bodies whose union contains the link's collision geometry.

        Meshes are read when a link is first asked for, once.

        :param link: name of a link.
        :returns: bodies in the link frame [m]; empty for a link without collision geometry.
        :raises RobotError: the link is unknown, or one of its meshes is missing or unusable.
        """
        if link not in self._bodies:
            if link not in self.collisions and link not in self.links:
                raise RobotError(Reason.ROBOT_INVALID, f'robot {self.name!r} has no link {link!r}')
            self._bodies[link] = tuple(
                self._load(collision.shape, link).body.moved(collision.T_link_shape)
                for collision in self.collisions.get(link, ())
            )
        return self._bodies[link]

    def digest(self) -> str:
        """
        Return the SHA-256 of the description and of every collision mesh, in hex.

        It depends on the bytes of the files, not on where they lie.

        :raises RobotError: a mesh is missing or unusable.
        """
        digest = hashlib.sha256(hashlib.sha256(self.source).digest())
        for link, collisions in self.collisions.items():
            for collision in collisions:
                digest.update(self._load(collision.shape, link).content.encode())
        return digest.hexdigest()

    def _load(self, shape: Shape, link: str) -> Loaded:
        if shape not in self._shapes:
            try:
                self._shapes[shape] = shape.load()
            except RobotError as error:
                raise RobotError(error.reason, f'link {link!r}: {error}') from error
        return self._shapes[shape]
