"""A body without a robot: an AGV, a part on a feeder, a tool; it moves as it is told."""

from pathlib import Path

import numpy as np

from trajectory_guard.cell.robot import Collision, floating_joint, Robot, Shape
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.motions.floating_path import ANY_NAME
from trajectory_guard.shapes.mesh import MeshFile
from trajectory_guard.shapes.mesh_formats import READERS

ROOT = 'world'


def free_body(name: str, *shapes: Shape) -> Robot:
    """
    Return a robot of one link on a floating joint.

    :param name: of the link.
    :param shapes: the link's collision geometry, in its frame.
    """
    # Where a mesh file lies says nothing of the body; its content is hashed with the rest.
    told = [shape.scale if isinstance(shape, MeshFile) else shape for shape in shapes]
    collisions = tuple(Collision(np.eye(4), shape) for shape in shapes)
    return Robot(
        name=name,
        root=ROOT,
        joints=floating_joint(ANY_NAME, ROOT, name, np.eye(4)),
        collisions={name: collisions},
        source=repr(told).encode(),
    )


def load_moving(path: str | Path) -> Robot:
    """
    Read what moves: a URDF, or a mesh file of a free body.

    :raises RobotError: the file cannot be read, or describes nothing that can be judged.
    """
    path = Path(path)
    if path.suffix.lower() not in READERS:
        return load_robot(path)
    body = free_body(path.stem, MeshFile(str(path.absolute())))
    body.bodies(path.stem)
    return body
