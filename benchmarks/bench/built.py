"""Robots and scenes made for one question."""

from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

import numpy as np

from trajectory_guard.cell.robot import Robot
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.urdf import load_robot, robot_from_urdf
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.result import NANOSECONDS
from trajectory_guard.shapes.primitive import Box

DATA = Path(__file__).parent.parent.parent / 'test' / 'data' / 'bench'
PANDA = DATA / 'panda.urdf'
SCENE = DATA / 'scene.urdf'

# Hand straight down, well in front of the base.
REACHING = (0.0, 0.2, 0.0, -2.2, 0.0, 2.4, 0.785)

ONE_JOINT = """
<robot name="one_joint">
  <link name="base"/>
  <link name="arm">
    <collision>
      <origin xyz="{center}"/><geometry><box size="{size}"/></geometry>
    </collision>
  </link>
  <joint name="turn" type="continuous">
    <parent link="base"/><child link="arm"/><axis xyz="{axis}"/>
  </joint>
</robot>
"""


def panda() -> Robot:
    """Return the Panda of the tests, links as convex hulls, fingers fixed."""
    return load_robot(PANDA)


def panda_with_meshes() -> Path | None:
    """Return the URDF of a Panda with its original meshes, or None without example-robot-data."""
    try:
        files = metadata.files('example-robot-data') or []
    except metadata.PackageNotFoundError:
        return None
    name = 'panda_description/urdf/panda.urdf'
    found = (Path(file.locate()) for file in files if file.as_posix().endswith(name))
    return next((path.resolve() for path in found), None)


def one_joint(axis: str, center: tuple[float, ...], size: tuple[float, ...]) -> Robot:
    """Return a box on a joint whose axis goes through the origin [m]."""

    def words(values: tuple[float, ...]) -> str:
        return ' '.join(map(repr, values))

    return robot_from_urdf(ONE_JOINT.format(axis=axis, center=words(center), size=words(size)))


def box(name: str, size: tuple[float, ...], center: np.ndarray, R: np.ndarray) -> Obstacle:
    """Return a box as an obstacle [m]."""
    shape = Box(tuple(float(x) for x in size)).load().body
    return Obstacle(name, (shape.moved(pose(center, R)),))


def pose(center: Sequence[float], R: np.ndarray | None = None) -> np.ndarray:
    """Return a rigid transform, (4, 4) [m]; not turned if R is None."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.eye(3) if R is None else R, center
    return T


def plate(size: tuple[float, ...], center: tuple[float, ...]) -> Scene:
    """Return a scene of one upright box [m]."""
    return Scene((box('plate', size, np.array(center), np.eye(3)),), digest='')


def from_rest_to_rest(robot: Robot, *waypoints: np.ndarray) -> Trajectory:
    """Return a motion of all movable joints that rests at each waypoint, one second between."""
    names = [joint.name for joint in robot.movable]
    rest = [0.0] * len(names)
    return Trajectory.from_points(
        names, [Point(i * NANOSECONDS, list(q), rest) for i, q in enumerate(waypoints)]
    )
