"""A free path as the path of a robot: its floating joint moves, all other joints stand."""

from collections.abc import Sequence
import math

import numpy as np

from trajectory_guard.cell.robot import FLOATING_TYPES, Joint, JointType, Robot
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.free_path import FreePath
from trajectory_guard.paths.joint_path import JointPath
from trajectory_guard.paths.mimic import follow, followers
from trajectory_guard.paths.trajectory import JointState

# A floating joint of this name is a bare body's: a message may call it what it wants.
ANY_NAME = ''


def floating_path(robot: Robot, free: FreePath, start: JointState | None = None) -> JointPath:
    """
    Return the path of all movable joints of a robot whose base moves.

    :param robot: a robot with a floating joint.
    :param free: the motion of that joint's child link in its parent link, the robot's root.
    :param start: positions of the other movable joints, which they hold.
    :raises TrajectoryError: the robot has no floating joint, or one of another name, or a joint's
        position is unknown.
    """
    check_floating_joint(robot, (free.joint_name,))
    joints = robot.movable
    coefficients = np.zeros((len(free.motions), len(joints), 6))
    error = np.zeros((len(free.motions), len(joints)))
    coefficients[:, :, 0] = _held(joints, start)
    for j, leader in followers(joints):
        follow(coefficients, error, joints[j], j, leader)
    return JointPath(
        joint_names=tuple(joint.name for joint in joints),
        in_path=np.array([joint.type in FLOATING_TYPES for joint in joints]),
        knots_ns=free.knots_ns,
        coefficients=coefficients,
        coefficient_error=error,
        unknown_until_ns=free.unknown_until_ns,
        limits_checked=True,
        floating=free,
    )


def check_floating_joint(robot: Robot, names: Sequence[str], frame_id: str = '') -> None:
    """
    Refuse poses that are not those of the robot's floating joint and nothing else.

    Poses are those of the joint: its child link in the joint's own frame. A message that names a
    frame names the parent link, and the joint then has no origin of its own there. A bare body
    is in any frame.

    :param robot: the robot.
    :param names: the message's.
    :param frame_id: the message's frame; '' if it does not say.
    :raises TrajectoryError: the robot has no floating joint, or one of another name or in another
        frame; or the message names more than that.
    """
    own = robot.floating
    told = ', '.join(map(repr, names))
    if own is None:
        raise TrajectoryError(
            Reason.UNKNOWN_JOINT,
            f'robot {robot.name!r} has no floating joint, the poses are of {told}',
        )
    if len(names) != 1 or own not in (ANY_NAME, names[0]):
        only = 'one body' if own == ANY_NAME else f'the floating joint {own!r}'
        raise TrajectoryError(
            Reason.UNKNOWN_JOINT, f'poses of {only} are expected, the message has {told}'
        )
    (joint,) = (j for j in robot.joints if j.type is JointType.TRANSLATION)
    frame = frame_id.removeprefix('/')
    if own != ANY_NAME and frame:
        if frame != joint.parent:
            raise TrajectoryError(
                Reason.FRAME_UNKNOWN,
                f'frame_id is {frame_id!r}; joint {own!r} has its poses in {joint.parent!r}',
            )
        if (joint.T_parent_joint != np.eye(4)).any():
            raise TrajectoryError(
                Reason.FRAME_UNKNOWN,
                f'frame_id is {frame_id!r}, but joint {own!r} has an origin of its own there, and '
                'poses are those of the joint; leave frame_id empty',
            )


def _held(joints: Sequence[Joint], start: JointState | None) -> list[float]:
    """Return where each joint stands; mimic joints and the floating one are left at 0."""
    known = {} if start is None else dict(zip(start.joint_names, start.positions, strict=True))
    asked = [j.name for j in joints if j.mimic is None and j.type not in FLOATING_TYPES]
    unknown = [repr(name) for name in asked if not math.isfinite(known.get(name, math.nan))]
    if unknown:
        raise TrajectoryError(
            Reason.JOINT_POSITION_UNKNOWN,
            'neither the trajectory nor the start state gives ' + ', '.join(unknown),
        )
    return [float(known[joint.name]) if joint.name in asked else 0.0 for joint in joints]
