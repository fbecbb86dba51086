"""Trajectories of poses as values: what a MultiDOFJointTrajectory said, checked at the border."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import hashlib
import json
from operator import index
from typing import NamedTuple

import numpy as np

from trajectory_guard.errors import Reason, TrajectoryError

# How far from 1 the length of a message's quaternion may be; it is divided by it.
LENGTH_TOLERANCE = 1e-3

_INT64_MAX = np.iinfo(np.int64).max


class PosePoint(NamedTuple):
    """
    One point, with the fields of ``trajectory_msgs/MultiDOFJointTrajectoryPoint``.

    :param time_ns: time from the start of the trajectory [ns].
    :param transforms: for each joint x, y, z and the quaternion x, y, z, w: its child frame in the
        message's frame [m].
    :param velocities: for each joint the linear and the angular velocity of the child frame in
        the message's frame, or empty: the point carries none [m/s, rad/s].
    :param accelerations: likewise [m/s^2, rad/s^2].
    """

    time_ns: int
    transforms: Sequence[Sequence[float]] = ()
    velocities: Sequence[Sequence[float]] = ()
    accelerations: Sequence[Sequence[float]] = ()


@dataclass(frozen=True, slots=True, eq=False)
class MultiDofTrajectory:
    """
    A trajectory of P poses for each of J floating joints, in the order of the message.

    Every construction validates: times are non-negative and strictly increasing, numbers are
    finite, names are distinct, quaternions are nearly of length 1, and accelerations come with
    velocities.

    :param joint_names: J distinct names.
    :param times_ns: (P,) int64, times from start [ns].
    :param positions: (P, J, 3) [m].
    :param quaternions: (P, J, 4) unit quaternions (x, y, z, w), rounded.
    :param velocities: (P, J, 6) linear and angular [m/s, rad/s]; rows without are not looked at.
    :param has_velocities: (P,) bool, whether the point carries velocities.
    :param accelerations: (P, J, 6) [m/s^2, rad/s^2].
    :param has_accelerations: (P,) bool.
    :param name: label for reports.
    :param frame_id: the frame that all of it is in, '' if the message does not say.
    :raises TrajectoryError: naming the point, the joint and the value.
    """

    joint_names: tuple[str, ...]
    times_ns: np.ndarray
    positions: np.ndarray
    quaternions: np.ndarray
    velocities: np.ndarray
    has_velocities: np.ndarray
    accelerations: np.ndarray
    has_accelerations: np.ndarray
    name: str = ''
    frame_id: str = ''

    @classmethod
    def from_points(
        cls,
        joint_names: Sequence[str],
        points: Sequence[PosePoint],
        name: str = '',
        frame_id: str = '',
    ) -> MultiDofTrajectory:
        """
        Build a trajectory from points.

        :param joint_names: J names.
        :param points: the points in the order of time.
        :param name: label for reports.
        :param frame_id: the frame that all of it is in.
        :raises TrajectoryError: as the class does, and for fields of the wrong size.
        """
        names = tuple(joint_names)
        _check_names(names)
        if not len(points):
            raise TrajectoryError(Reason.NO_POINTS, 'the trajectory has no points')
        times = _times([point.time_ns for point in points])
        poses, every = _table(points, 'transforms', names, 7)
        if not every.all():
            i = int(np.argmin(every))
            raise TrajectoryError(Reason.MISSING_POSITIONS, f'point {i} has no transforms')
        velocities, moving = _table(points, 'velocities', names, 6)
        accelerations, pushed = _table(points, 'accelerations', names, 6)
        if (pushed > moving).any():
            i = int(np.argmax(pushed > moving))
            raise TrajectoryError(
                Reason.ACCELERATIONS_WITHOUT_VELOCITIES,
                f'point {i} has accelerations but no velocities',
            )
        arrays = (
            times,
            poses[:, :, :3].copy(),
            _unit(poses[:, :, 3:], names),
            velocities,
            moving,
            accelerations,
            pushed,
        )
        for array in arrays:
            array.setflags(write=False)
        return cls(names, *arrays, name, frame_id)

    def digest(self) -> str:
        """Return the SHA-256 of what shapes the path, in hex: frame, names, times, points."""
        names = json.dumps(['multi_dof/1', self.frame_id, *self.joint_names])
        digest = hashlib.sha256(names.encode())
        digest.update(self.times_ns.astype('<i8').tobytes())
        for values in (self.positions, self.quaternions):
            digest.update((values + 0.0).astype('<f8').tobytes())
        for carried, values in (
            (self.has_velocities, self.velocities),
            (self.has_accelerations, self.accelerations),
        ):
            digest.update(carried.astype(np.uint8).tobytes())
            known = np.where(carried[:, None, None], values, 0.0) + 0.0
            digest.update(known.astype('<f8').tobytes())
        return digest.hexdigest()


def _check_names(names: tuple[str, ...]) -> None:
    if not names:
        raise TrajectoryError(Reason.NO_JOINTS, 'the trajectory names no joints')
    for i, name in enumerate(names):
        if not isinstance(name, str):
            raise TrajectoryError(
                Reason.TRAJECTORY_UNREADABLE, f'joint_names[{i}] is {name!r}, not a string'
            )
        if name in names[:i]:
            raise TrajectoryError(
                Reason.DUPLICATE_JOINT, f'the trajectory names joint {name!r} more than once'
            )


def _times(times_ns: Sequence[int]) -> np.ndarray:
    last = -1
    for i, time_ns in enumerate(times_ns):
        try:
            value = index(time_ns)
        except TypeError as error:
            raise TrajectoryError(
                Reason.TRAJECTORY_UNREADABLE,
                f'point {i} has the time {time_ns!r}, not an integer of nanoseconds',
            ) from error
        if value < 0:
            raise TrajectoryError(
                Reason.NEGATIVE_TIME, f'point {i} has the negative time {value} ns'
            )
        if value > _INT64_MAX:
            raise TrajectoryError(
                Reason.TOO_LARGE, f'point {i} has the time {value} ns, beyond 64 bits'
            )
        if value <= last:
            raise TrajectoryError(
                Reason.UNSORTED_TIMES,
                f'point {i} at {value} ns does not come after point {i - 1} at {last} ns',
            )
        last = value
    return np.array(times_ns, np.int64)


def _table(
    points: Sequence[PosePoint], field: str, names: tuple[str, ...], columns: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return (P, J, columns) values, zeros where there are none, and (P,) where there are some."""
    table = np.zeros((len(points), len(names), columns))
    present = np.zeros(len(points), np.bool_)
    for i, point in enumerate(points):
        rows = getattr(point, field)
        if not len(rows):
            continue
        present[i] = True
        if len(rows) != len(names):
            raise TrajectoryError(
                Reason.SIZE_MISMATCH,
                f'point {i} has {len(rows)} {field} for {len(names)} joints',
            )
        for j, row in enumerate(rows):
            try:
                table[i, j] = row
            except (TypeError, ValueError) as error:
                raise TrajectoryError(
                    Reason.TRAJECTORY_UNREADABLE,
                    f'point {i}, joint {names[j]!r}: {field} {row!r} are no {columns} numbers',
                ) from error
    wrong = ~np.isfinite(table)
    if wrong.any():
        i, j, k = np.argwhere(wrong)[0].tolist()
        raise TrajectoryError(
            Reason.NOT_FINITE,
            f'point {i}, joint {names[j]!r}: {field}[{k}] is {table[i, j, k]}',
        )
    return table, present


def _unit(quaternions: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """Return the quaternions divided by their lengths."""
    with np.errstate(over='ignore'):
        lengths = np.sqrt((quaternions**2).sum(axis=2))
    wrong = ~(np.abs(lengths - 1.0) <= LENGTH_TOLERANCE)
    if wrong.any():
        i, j = np.argwhere(wrong)[0].tolist()
        raise TrajectoryError(
            Reason.TRAJECTORY_UNREADABLE,
            f'point {i}, joint {names[j]!r}: the quaternion {quaternions[i, j].tolist()} has the '
            f'length {lengths[i, j]:g}, not 1',
        )
    unit: np.ndarray = quaternions / lengths[:, :, None]
    return unit
