"""What must not be touched: named obstacles in the robot's root frame."""

from collections.abc import Iterable
from dataclasses import dataclass, field
import hashlib
from pathlib import Path

import numpy as np

from trajectory_guard.cell.robot import Robot
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.errors import Reason, RobotError, SceneError
from trajectory_guard.shapes.body import ConvexBody, rigid_defect
from trajectory_guard.shapes.mesh import MeshFile
from trajectory_guard.shapes.mesh_formats import READERS
from trajectory_guard.shapes.resource import ANY_MESH, MeshLimits

URDF_SUFFIXES = ('.urdf', '.xml')

# What a pose written with ten digits may lack to be a rotation; the nearest one is then used.
POSE_TOLERANCE = 1e-9

# Reasons that are about a robot, in the words of a scene.
SCENE_REASONS = {
    Reason.ROBOT_INVALID: Reason.SCENE_INVALID,
    Reason.ROBOT_EMPTY: Reason.SCENE_EMPTY,
}


@dataclass(frozen=True, slots=True)
class Obstacle:
    """
    A named thing that the robot must not touch.

    :param name: link of a scene URDF, or stem of a mesh file.
    :param bodies: their union contains it, in the robot's root frame [m].
    """

    name: str
    bodies: tuple[ConvexBody, ...] = field(repr=False)


@dataclass(frozen=True, slots=True)
class Scene:
    """
    Obstacles, at least one, no two of one name.

    :param obstacles: in the order of the files.
    :param digest: SHA-256 of the contents of all files and of the pose, in hex.
    """

    obstacles: tuple[Obstacle, ...]
    digest: str


def load_scene(
    paths: str | Path | Iterable[str | Path],
    pose: np.ndarray | None = None,
    limits: MeshLimits = ANY_MESH,
) -> Scene:
    """
    Read a scene from URDF files, whose joints are all fixed, and mesh files.

    Each link with collision geometry and each mesh file is one obstacle.

    :param paths: one file or several.
    :param pose: pose of the files' root frame in the robot's root frame, (4, 4), rigid within
        1e-9 [m]; None: they are the same.
    :param limits: which mesh files the URDF files may name, and how large any mesh file may be.
    :raises SceneError: a file is missing or unusable, a joint can move, two obstacles have one
        name, or there is none.
    """
    T_root_scene = _rigid(pose)
    digest = hashlib.sha256()
    # Adding 0 makes one zero of the two.
    digest.update((T_root_scene + 0.0).astype('<f8').tobytes())
    obstacles: dict[str, Obstacle] = {}
    for path in [paths] if isinstance(paths, str | Path) else paths:
        try:
            content, found = _read(Path(path), limits)
        except RobotError as error:
            reason = SCENE_REASONS.get(error.reason, error.reason)
            raise SceneError(reason, f'scene {str(path)!r}: {error}') from error
        digest.update(content.encode())
        for name, bodies in found.items():
            if name in obstacles:
                raise SceneError(
                    Reason.DUPLICATE_NAME, f'scene {str(path)!r}: a second obstacle {name!r}'
                )
            obstacles[name] = Obstacle(name, tuple(body.moved(T_root_scene) for body in bodies))
    if not obstacles:
        raise SceneError(Reason.SCENE_EMPTY, 'the scene has no obstacles')
    return Scene(tuple(obstacles.values()), digest.hexdigest())


def _rigid(pose: np.ndarray | None) -> np.ndarray:
    """Return the rigid transform nearest to a pose."""
    if pose is None:
        return np.eye(4)
    T = np.array(pose, dtype=np.float64)
    if not rigid_defect(T) <= POSE_TOLERANCE:
        raise SceneError(Reason.SCENE_INVALID, f'pose is no rigid transform: {T.tolist()}')
    left, _, right = np.linalg.svd(T[:3, :3])
    T[:3, :3] = left @ right
    return T


def _read(path: Path, limits: MeshLimits) -> tuple[str, dict[str, tuple[ConvexBody, ...]]]:
    """Return the hash of a file's content, and the bodies by name in the file's root frame."""
    if not path.is_file():
        raise SceneError(Reason.SCENE_MISSING, f'scene {str(path)!r} does not exist')
    if path.suffix.lower() in READERS:
        loaded = MeshFile(str(path.absolute()), limits=limits._replace(roots=())).load()
        return loaded.content, {path.stem: (loaded.body,)}
    if path.suffix.lower() in URDF_SUFFIXES:
        robot = load_robot(path, limits)
        return robot.digest(), _bodies_in_root(robot)
    known = ', '.join((*URDF_SUFFIXES, *READERS))
    raise SceneError(Reason.SCENE_INVALID, f'scene {str(path)!r} is not one of {known}')


def _bodies_in_root(robot: Robot) -> dict[str, tuple[ConvexBody, ...]]:
    """Return the bodies of all links, moved joint by joint so that each rounding is counted."""
    for joint in robot.movable:
        raise SceneError(
            Reason.SCENE_INVALID,
            f'scene {robot.name!r}: joint {(robot.floating or joint.name)!r} can move; '
            'obstacles must be fixed',
        )
    above = {joint.child: joint for joint in robot.joints}
    found = {}
    for link in robot.collision_links:
        bodies = robot.bodies(link)
        at = link
        while at != robot.root:
            bodies = tuple(body.moved(above[at].T_parent_joint) for body in bodies)
            at = above[at].parent
        found[link] = bodies
    return found
