"""Random robots, paths and an independent forward kinematics (scipy rotations)."""

import math

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from trajectory_guard.cell.robot import Collision, Joint, JointType, Loaded, Mimic, Robot
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.paths.joint_path import JointPath
from trajectory_guard.shapes.body import ConvexBody


class Given:
    """A shape whose body is known."""

    def __init__(self, body):
        self.body = body

    def load(self):
        """Return the body."""
        return Loaded(self.body, '')


def pose(xyz, rotation=None):
    """Return a (4, 4) pose."""
    T = np.eye(4)
    T[:3, 3] = xyz
    if rotation is not None:
        T[:3, :3] = rotation.as_matrix()
    return T


def hull_body(points):
    """Return the convex body of points, with faces."""
    hull = ConvexHull(points)
    planes = np.unique(np.round(hull.equations, 12), axis=0)
    norms = np.linalg.norm(planes[:, :3], axis=1)
    slack = 1e-9 * np.abs(points).max()
    faces = np.column_stack([planes[:, :3] / norms[:, None], -planes[:, 3] / norms - slack])
    return ConvexBody(np.asarray(points)[hull.vertices], faces=faces)


def box_body(size, center=(0.0, 0.0, 0.0)):
    """Return an axis-aligned box."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    faces = [
        (*(sign * np.eye(3)[k]), 0.5 * size[k] + sign * center[k])
        for k in range(3)
        for sign in (-1.0, 1.0)
    ]
    return ConvexBody(corners * size + np.asarray(center), faces=np.array(faces))


def random_body(rng, size=0.1):
    """Return a hull, a ball or a cylinder, somewhere near the origin."""
    shift = rng.normal(size=3) * size
    kind = rng.integers(3)
    if kind == 0:
        return hull_body(rng.normal(size=(20, 3)) * size + shift)
    if kind == 1:
        return ConvexBody(shift[None], ball=size * rng.uniform(0.1, 1.0))
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    return ConvexBody(
        shift + np.outer([-1.0, 1.0], axis) * size * rng.uniform(0.2, 2.0),
        disc_radius=size * rng.uniform(0.1, 1.0),
        disc_axis=axis,
    )


def random_robot(rng, joints=5, scale=1.0):
    """Return a robot with every kind of joint, any axes, a branch and a mimic joint."""
    kinds = [JointType.REVOLUTE, JointType.CONTINUOUS, JointType.PRISMATIC, JointType.FIXED]
    made, collisions = [], {}
    for j in range(joints):
        axis = rng.normal(size=3)
        parent = 'l0' if j == 0 else f'l{j if rng.random() < 0.8 else rng.integers(j + 1)}'
        mimic = None
        kind = kinds[rng.integers(4)] if j else JointType.REVOLUTE
        if j == joints - 1:
            kind, mimic = JointType.REVOLUTE, Mimic('j0', -0.7, 0.2)
        made.append(
            Joint(
                f'j{j}',
                kind,
                parent,
                f'l{j + 1}',
                pose(rng.normal(size=3) * 0.2 * scale, Rotation.random(random_state=rng)),
                axis / np.linalg.norm(axis),
                -math.inf,
                math.inf,
                mimic,
            )
        )
        collisions[f'l{j + 1}'] = (Collision(np.eye(4), Given(random_body(rng, 0.1 * scale))),)
    return Robot('random', 'l0', tuple(made), collisions, b'')


def random_path(rng, robot, segments=2, spread=1.0):
    """Return a path of random polynomials of random degree, mimic joints following."""
    movable = robot.movable
    n = len(movable)
    coefficients = np.zeros((segments, n, 6))
    for s in range(segments):
        degree = rng.choice([1, 3, 5])
        coefficients[s, :, : degree + 1] = rng.normal(size=(n, degree + 1)) * spread
    index = {joint.name: j for j, joint in enumerate(movable)}
    for j, joint in enumerate(movable):
        if joint.mimic:
            leader = index[joint.mimic.joint]
            coefficients[:, j] = joint.mimic.multiplier * coefficients[:, leader]
            coefficients[:, j, 0] += joint.mimic.offset
    return JointPath(
        tuple(joint.name for joint in movable),
        np.ones(n, bool),
        np.arange(segments + 1, dtype=np.int64) * 10**9,
        coefficients,
        np.zeros((segments, n)),
        0,
        True,
    )


def far_scene(distance=1e3):
    """Return a scene that nothing reaches."""
    return Scene((Obstacle('far', (box_body(np.ones(3), (distance, 0.0, 0.0)),)),), 'far')


def random_workcell(rng, joints=5, scale=1.0):
    """Return a random robot far from anything."""
    return Workcell(random_robot(rng, joints, scale), far_scene())


def link_poses(robot, q):
    """Return the pose of every link, (4, 4), computed joint by joint with scipy's rotations."""
    positions = dict(zip((joint.name for joint in robot.movable), q, strict=True))
    T = {robot.root: np.eye(4)}
    for joint in robot.joints:
        motion = np.eye(4)
        value = positions.get(joint.name, 0.0)
        if joint.type is JointType.PRISMATIC:
            motion[:3, 3] = value * joint.axis
        elif joint.type is not JointType.FIXED:
            motion[:3, :3] = Rotation.from_rotvec(value * joint.axis).as_matrix()
        T[joint.child] = T[joint.parent] @ joint.T_parent_joint @ motion
    return T


def core(body, rng, count=30):
    """Return points of a body's core: its vertices, and rim points of its disc about them."""
    if not body.disc_radius:
        return body.vertices
    across = np.cross(body.disc_axis, rng.normal(size=(count, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    return np.concatenate([body.vertices, *(v + body.disc_radius * across for v in body.vertices)])
