"""Where the links of a robot of turning joints are, by plain matrices."""

import numpy as np

from trajectory_guard.cell.robot import JointType, Robot


def moved_links(robot: Robot) -> set[str]:
    """Return the links that some joint moves."""
    moved: set[str] = set()
    for joint in robot.joints:
        if joint.type is not JointType.FIXED or joint.parent in moved:
            moved.add(joint.child)
    return moved


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the rotation about a unit axis (Rodrigues), (3, 3)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    R = np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K
    left, _, right = np.linalg.svd(R)
    return left @ right


def placed(robot: Robot, q: np.ndarray) -> dict[str, np.ndarray]:
    """Return the vertices, by link that a joint moves, of a robot of turning joints [m]."""
    value = {joint.name: x for joint, x in zip(robot.movable, q, strict=True)}
    moved = moved_links(robot)
    T = {robot.root: np.eye(4)}
    for joint in robot.joints:
        T[joint.child] = T[joint.parent] @ joint.T_parent_joint
        if joint.name in value:
            T[joint.child][:3, :3] @= turn(joint.axis, value[joint.name])
    return {
        link: np.vstack([body.vertices for body in robot.bodies(link)]) @ T[link][:3, :3].T
        + T[link][:3, 3]
        for link in robot.collision_links
        if link in moved
    }
