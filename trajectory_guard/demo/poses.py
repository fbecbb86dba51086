"""
A check of single poses, as planners do it, that shares no kinematics or geometry with the guard.

Pinocchio reads the robot and moves it, Coal makes hulls of the meshes and measures distances.
"""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from statistics import median
import time
from typing import NamedTuple

import coal
import numpy as np
import pinocchio as pin

from trajectory_guard.paths.trajectory import Trajectory
from trajectory_guard.result import NANOSECONDS

# Times are medians of so many runs.
REPETITIONS = 10

# Samples between two waypoints are chosen from so many instants.
_INSTANTS = 10_001


class Sampled(NamedTuple):
    """
    What a check of some poses says.

    :param times: (n,) instants of the poses [s].
    :param distances: (n,) smallest distance between robot and scene in each, negative: their
        overlap [m].
    :param hits: (n,) bool, whether robot and scene touch.
    :param check_time: wall-clock time of the check for touching alone, median [s].
    """

    times: np.ndarray
    distances: np.ndarray
    hits: np.ndarray
    check_time: float


class PoseChecker:
    """
    Robot and scene for checks of single poses; the base is not checked, nothing moves it.

    :param robot: URDF in its package, with mesh paths of the form ``package://NAME/...``.
    :param scene: URDF without movable joints, in the robot's root frame.
    """

    def __init__(self, robot: Path, scene: Path) -> None:
        kind = pin.GeometryType.COLLISION
        self._model = pin.buildModelFromUrdf(str(robot))
        self._data = self._model.createData()
        self._geometry = pin.buildGeomFromUrdf(
            self._model, str(robot), kind, package_dirs=[str(folder) for folder in robot.parents]
        )
        moving = []
        for number, body in enumerate(self._geometry.geometryObjects):
            if isinstance(body.geometry, coal.BVHModelBase):
                body.geometry.buildConvexRepresentation(False)
                body.geometry = body.geometry.convex
            if body.parentJoint > 0:
                moving.append(number)
        scene_model = pin.buildModelFromUrdf(str(scene))
        for obstacle in pin.buildGeomFromUrdf(scene_model, str(scene), kind).geometryObjects:
            number = self._geometry.addGeometryObject(
                pin.GeometryObject(obstacle.name, 0, 0, obstacle.placement, obstacle.geometry)
            )
            for body_number in moving:
                self._geometry.addCollisionPair(pin.CollisionPair(body_number, number))
        self._geometry_data = self._geometry.createData()

    def check(
        self, trajectory: Trajectory, held: Mapping[str, float], times: np.ndarray
    ) -> Sampled:
        """
        Check some poses of a trajectory.

        :param trajectory: the trajectory.
        :param held: joints that it does not move [rad or m].
        :param times: (n,) instants [s].
        """
        names = [*trajectory.joint_names, *held]
        columns = [names.index(name) for name in list(self._model.names)[1:]]
        values = np.hstack(
            [positions(trajectory, times), np.tile([*held.values()], (len(times), 1))]
        )
        poses = values[:, columns]
        check_times = []
        for _ in range(REPETITIONS):
            begin = time.perf_counter()
            hits = np.array([self._touches(pose) for pose in poses])
            check_times.append(time.perf_counter() - begin)
        distances = np.array([self._distance(pose) for pose in poses])
        return Sampled(times, distances, hits, median(check_times))

    def _touches(self, pose: np.ndarray) -> bool:
        """Return whether robot and scene touch in a pose."""
        return pin.computeCollisions(
            self._model, self._data, self._geometry, self._geometry_data, pose, True
        )

    def _distance(self, pose: np.ndarray) -> float:
        """Return the smallest distance between robot and scene in a pose [m]."""
        geometry_data = self._geometry_data
        pin.computeDistances(self._model, self._data, self._geometry, geometry_data, pose)
        return min(result.min_distance for result in geometry_data.distanceResults)


def positions(trajectory: Trajectory, times: np.ndarray) -> np.ndarray:
    """
    Return the joint positions that the controller plays: cubics in Hermite form.

    :param trajectory: every point has velocities, none has accelerations.
    :param times: (n,) instants [s].
    :returns: (n, J) [rad or m].
    """
    knots = trajectory.times_ns / NANOSECONDS
    i = np.clip(np.searchsorted(knots, times, side='right') - 1, 0, len(knots) - 2)
    h = (knots[i + 1] - knots[i])[:, None]
    s = (times - knots[i])[:, None] / h
    p0, p1 = trajectory.positions[i], trajectory.positions[i + 1]
    v0, v1 = trajectory.velocities[i], trajectory.velocities[i + 1]
    return (
        (1 + 2 * s) * (1 - s) ** 2 * p0
        + s**2 * (3 - 2 * s) * p1
        + h * s * (1 - s) * ((1 - s) * v0 - s * v1)
    )


def waypoint_times(trajectory: Trajectory) -> np.ndarray:
    """
    Return the instants of the waypoints [s].

    :param trajectory: the trajectory.
    """
    return trajectory.times_ns / NANOSECONDS


def sample_times(trajectory: Trajectory, step: float) -> np.ndarray:
    """
    Return the instants at which a sampling in joint space looks at the played motion [s].

    These are the waypoints, and from each to the next the last instants at which no joint has
    moved by more than the step since the instant before.

    :param trajectory: the trajectory.
    :param step: largest motion of any joint between two samples [rad or m].
    """
    knots = waypoint_times(trajectory)
    times = []
    for start, end in pairwise(knots):
        grid = np.linspace(start, end, _INSTANTS)
        q = positions(trajectory, grid)
        k = 0
        while k < len(grid) - 1:
            times.append(grid[k])
            beyond = (np.abs(q[k + 1 :] - q[k]) > step).any(axis=1)
            k += max(int(beyond.argmax()), 1) if beyond.any() else len(grid) - 1 - k
    return np.array([*times, knots[-1]])
