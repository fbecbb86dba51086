"""Where a link is, for pictures: to rounding, and nothing is proved by it."""

from collections.abc import Mapping

import numpy as np

from trajectory_guard.cell.robot import FLOATING_TYPES, Joint, JointType, Robot


def link_pose(robot: Robot, link: str, positions: Mapping[str, float]) -> np.ndarray | None:
    """
    Return the pose of a link in the root frame; None if a floating joint moves it.

    :param robot: the robot.
    :param link: one of its links.
    :param positions: of all movable joints, mimic joints included, by name [rad or m].
    :returns: (4, 4) [m].
    """
    above = {joint.child: joint for joint in robot.joints}
    T = np.eye(4)
    while link != robot.root:
        joint = above[link]
        if joint.type in FLOATING_TYPES:
            return None
        T = joint.T_parent_joint @ _motion(joint, positions) @ T
        link = joint.parent
    return T


def _motion(joint: Joint, positions: Mapping[str, float]) -> np.ndarray:
    """Return a joint's motion in its own frame, (4, 4); a turn by the formula of Rodrigues."""
    T = np.eye(4)
    if joint.type is JointType.FIXED:
        return T
    q = positions[joint.name]
    if joint.type is JointType.PRISMATIC:
        T[:3, 3] = q * joint.axis
        return T
    x, y, z = joint.axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    T[:3, :3] += np.sin(q) * cross + (1.0 - np.cos(q)) * (cross @ cross)
    return T
