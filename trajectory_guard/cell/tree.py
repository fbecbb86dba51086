"""A robot's movable joints as kernel arrays: fixed joints folded away, axes turned to z."""

from dataclasses import dataclass

import numpy as np

from trajectory_guard.cell.robot import Joint, JointType, Robot
from trajectory_guard.kernels.layout import Chain, PRISMATIC, REVOLUTE, ROTATION, TRANSLATION
from trajectory_guard.shapes.body import rigid_defect, RIGID_TOLERANCE

_KIND = {
    JointType.REVOLUTE: REVOLUTE,
    JointType.CONTINUOUS: REVOLUTE,
    JointType.PRISMATIC: PRISMATIC,
    JointType.TRANSLATION: TRANSLATION,
    JointType.ROTATION: ROTATION,
}


@dataclass(frozen=True, slots=True, eq=False)
class Tree:
    """
    Nodes of a robot and where its links hang on them.

    :param chain: one node per movable joint, in the order of ``Robot.movable``.
    :param link_node: node that carries a link, -1 for the root.
    :param link_pose: pose of a link in its node's frame, (4, 4) [m].
    :param link_path: sum of the lengths of all joint origins from the root to a link [m].
    """

    chain: Chain
    link_node: dict[str, int]
    link_pose: dict[str, np.ndarray]
    link_path: dict[str, float]


def tree(robot: Robot) -> Tree:
    """
    Fold a robot's fixed joints into its movable ones.

    A node's frame has the joint axis as z: T_link_node = A with A z = axis, so the turn about the
    axis is A Rz(q) A^T and A^T is folded into whatever the node carries.  ``depth`` counts every
    rounded transform on the way, fixed joints and alignments included, so that the kernels' margin
    covers the folding.

    :param robot: the robot.
    """
    node = {robot.root: -1}
    pose = {robot.root: np.eye(4)}
    path = {robot.root: 0.0}
    steps = {robot.root: 0}
    deepest: dict[int, int] = {}
    parent: list[int] = []
    kind: list[int] = []
    transform: list[np.ndarray] = []
    for joint in robot.joints:
        above = _rigid(pose[joint.parent] @ joint.T_parent_joint)
        steps[joint.child] = steps[joint.parent] + 1
        path[joint.child] = path[joint.parent] + float(np.linalg.norm(joint.T_parent_joint[:3, 3]))
        if joint.type is JointType.FIXED:
            node[joint.child] = node[joint.parent]
            pose[joint.child] = above
        else:
            align = _alignment(joint)
            node[joint.child] = len(parent)
            pose[joint.child] = align.T
            parent.append(node[joint.parent])
            kind.append(_KIND[joint.type])
            transform.append(_rigid(above @ align)[:3].ravel())
            steps[joint.child] += 1
        carrier = node[joint.child]
        deepest[carrier] = max(deepest.get(carrier, 0), steps[joint.child])
    chain = Chain(
        parent=np.array(parent, np.int64),
        kind=np.array(kind, np.int64),
        transform=np.array(transform, np.float64).reshape(-1, 12),
        depth=np.array([deepest[j] for j in range(len(parent))], np.int64),
    )
    return Tree(chain, node, pose, path)


def _alignment(joint: Joint) -> np.ndarray:
    """Return a rotation whose z column is the joint's axis; the identity for z itself."""
    z = joint.axis
    align = np.eye(4)
    if tuple(z) != (0.0, 0.0, 1.0):
        x = np.zeros(3)
        x[np.abs(z).argmin()] = 1.0
        y = np.cross(z, x)
        y /= np.linalg.norm(y)
        align[:3, 0] = np.cross(y, z)
        align[:3, 1] = y
        align[:3, 2] = z
    return align


def _rigid(T: np.ndarray) -> np.ndarray:
    """Return the matrix, or the nearest rigid one when many products have worn it."""
    if rigid_defect(T) <= 0.5 * RIGID_TOLERANCE:
        return T
    u, _, vt = np.linalg.svd(T[:3, :3])
    nearest = T.copy()
    nearest[:3, :3] = u @ vt
    return nearest
