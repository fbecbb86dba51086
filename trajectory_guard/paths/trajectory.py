"""Trajectories and joint states as values: what a message said, checked once at the border."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
import hashlib
import json
import math
from operator import index
from typing import NamedTuple

import numpy as np

from trajectory_guard.errors import Reason, TrajectoryError

_INT64_MAX = np.iinfo(np.int64).max


class Point(NamedTuple):
    """
    One point of a trajectory, with the fields of ``trajectory_msgs/JointTrajectoryPoint``.

    :param time_ns: time from the start of the trajectory [ns].
    :param positions: one value a joint [rad or m].
    :param velocities: one value a joint [rad/s or m/s], or empty: the point carries none.
    :param accelerations: one value a joint [rad/s^2 or m/s^2], or empty.
    :param effort: one value a joint, or empty; it does not shape the path.
    """

    time_ns: int
    positions: Sequence[float] = ()
    velocities: Sequence[float] = ()
    accelerations: Sequence[float] = ()
    effort: Sequence[float] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """
    A joint trajectory of P points for J joints, in the order of the message.

    Every construction validates: times are non-negative and strictly increasing, numbers are
    finite, names are distinct, and accelerations come with velocities (without them the
    controller matches none of its interpolation rules and commands zero).

    :param joint_names: J distinct names.
    :param times_ns: (P,) int64, times from start [ns].
    :param positions: (P, J) [rad or m].
    :param velocities: (P, J) [rad/s or m/s]; rows without velocities are not looked at.
    :param has_velocities: (P,) bool, whether the point carries velocities.
    :param accelerations: (P, J) [rad/s^2 or m/s^2].
    :param has_accelerations: (P,) bool.
    :param name: label for reports.
    :raises TrajectoryError: naming the point, the joint and the value.
    """

    joint_names: tuple[str, ...]
    times_ns: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    has_velocities: np.ndarray
    accelerations: np.ndarray
    has_accelerations: np.ndarray
    name: str = ''

    def __post_init__(self) -> None:
        """Freeze the arrays and validate."""
        size = len(self.times_ns)
        if size == 0:
            raise TrajectoryError(Reason.NO_POINTS, 'the trajectory has no points')
        joint_names = _distinct(self.joint_names, 'the trajectory')
        table = (size, len(joint_names))
        _set(self, 'joint_names', joint_names)
        _set(self, 'times_ns', _frozen(_times(self.times_ns), (size,), 'times_ns'))
        for field in ('positions', 'velocities', 'accelerations'):
            _set(self, field, _frozen(_numbers(getattr(self, field), field), table, field))
        for field in ('has_velocities', 'has_accelerations'):
            flags = np.array(getattr(self, field), dtype=np.bool_)
            _set(self, field, _frozen(flags, (size,), field))
        self._check_times()
        self._check_finite('position', self.positions, None)
        self._check_finite('velocity', self.velocities, self.has_velocities)
        self._check_finite('acceleration', self.accelerations, self.has_accelerations)
        if np.count_nonzero(self.has_accelerations > self.has_velocities):
            alone = np.flatnonzero(self.has_accelerations & ~self.has_velocities)
            raise TrajectoryError(
                Reason.ACCELERATIONS_WITHOUT_VELOCITIES,
                f'point {alone[0]} has accelerations but no velocities',
            )

    @classmethod
    def from_points(
        cls, joint_names: Sequence[str], points: Sequence[Point], name: str = ''
    ) -> Trajectory:
        """
        Build a trajectory from points.

        :param joint_names: J names.
        :param points: the points in the order of time.
        :param name: label for reports.
        :raises TrajectoryError: as the class does, and for fields of the wrong size, points
            without positions, and times that are not integers of 64 bits.
        """
        if len(points) == 0:
            raise TrajectoryError(Reason.NO_POINTS, 'the trajectory has no points')
        joint_names = _distinct(joint_names, 'the trajectory')
        dof = len(joint_names)
        times_ns, *columns = zip(*points, strict=True)
        fields = dict(zip(Point._fields[1:], columns, strict=True))
        sizes = _sizes(fields, points, dof)
        tables = {field: _table(rows, dof, field, sizes[field]) for field, rows in fields.items()}
        trajectory = cls(
            joint_names,
            times_ns,  # type: ignore[arg-type]
            tables['positions'][0],
            *tables['velocities'],
            *tables['accelerations'],
            name,
        )
        trajectory._check_finite('effort', *tables['effort'])
        return trajectory

    def digest(self) -> str:
        """
        Return the SHA-256 of what shapes the path, in hex: names, times, points; not the label.

        Values that a point does not carry, and the sign of a zero, do not count.
        """
        digest = hashlib.sha256(json.dumps(['trajectory/1', *self.joint_names]).encode())
        digest.update(self.times_ns.astype('<i8').tobytes())
        every = np.ones(len(self.times_ns), dtype=np.bool_)
        for carried, values in (
            (every, self.positions),
            (self.has_velocities, self.velocities),
            (self.has_accelerations, self.accelerations),
        ):
            digest.update(carried.astype(np.uint8).tobytes())
            # Adding 0 makes one zero of the two.
            digest.update((np.where(carried[:, None], values, 0.0) + 0.0).astype('<f8').tobytes())
        return digest.hexdigest()

    def _check_times(self) -> None:
        times_ns = self.times_ns
        if times_ns[0] < 0:
            raise TrajectoryError(
                Reason.NEGATIVE_TIME, f'point 0 has the negative time {times_ns[0]} ns'
            )
        late = times_ns[1:] <= times_ns[:-1]
        if np.count_nonzero(late):
            i = np.flatnonzero(late)[0] + 1
            raise TrajectoryError(
                Reason.UNSORTED_TIMES,
                f'point {i} at {times_ns[i]} ns does not come after point {i - 1} '
                f'at {times_ns[i - 1]} ns',
            )

    def _check_finite(self, what: str, values: np.ndarray, rows: np.ndarray | None) -> None:
        """Refuse numbers that are not finite; rows: (P,) which rows to look at, None: all."""
        if _all_finite(values):
            return
        wrong = ~np.isfinite(values)
        if rows is not None:
            wrong &= rows[:, None]
        if wrong.any():
            i, j = np.argwhere(wrong)[0]
            raise TrajectoryError(
                Reason.NOT_FINITE,
                f'point {i}, joint {self.joint_names[j]!r}: {what} is {values[i, j]}',
            )


@dataclass(frozen=True, slots=True, eq=False)
class JointState:
    """
    Where the joints are, and how fast they move, when a trajectory starts.

    It may name joints the robot or the trajectory does not have, as a joint state topic does.

    :param joint_names: J distinct names.
    :param positions: (J,) [rad or m].
    :param velocities: (J,) [rad/s or m/s], or None if unknown.
    :raises TrajectoryError: for repeated names, wrong sizes and numbers that are not finite.
    """

    joint_names: tuple[str, ...]
    positions: np.ndarray
    velocities: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays and validate."""
        joint_names = _distinct(self.joint_names, 'the joint state')
        _set(self, 'joint_names', joint_names)
        for what, field in (('position', 'positions'), ('velocity', 'velocities')):
            values = getattr(self, field)
            if values is None and field == 'velocities':
                continue
            what_of = f'joint state {field}'
            array = _frozen(_numbers(values, what_of), (len(joint_names),), what_of)
            _set(self, field, array)
            if _all_finite(array):
                continue
            for name, value in zip(joint_names, array, strict=True):
                if not np.isfinite(value):
                    raise TrajectoryError(
                        Reason.NOT_FINITE, f'joint state of {name!r}: {what} is {value}'
                    )


def _set(instance: object, field: str, value: object) -> None:
    object.__setattr__(instance, field, value)


def _frozen(array: np.ndarray, shape: tuple[int, ...], field: str) -> np.ndarray:
    if array.shape != shape:
        raise TrajectoryError(
            Reason.SIZE_MISMATCH, f'{field} has shape {array.shape}, expected {shape}'
        )
    array.setflags(write=False)
    return array


def _all_finite(values: np.ndarray) -> bool:
    """Tell at once that all are finite; False says nothing, for squares may overflow."""
    return math.isfinite(np.vdot(values, values))


def _distinct(joint_names: Sequence[str], where: str) -> tuple[str, ...]:
    names = tuple(joint_names)
    if not names:
        raise TrajectoryError(Reason.NO_JOINTS, f'{where} names no joints')
    if set(map(type, names)) == {str} and len(set(names)) == len(names):
        return names
    seen: set[str] = set()
    for name in names:
        if not isinstance(name, str):
            raise TrajectoryError(
                Reason.TRAJECTORY_UNREADABLE, f'{where} has the joint name {name!r}, not a string'
            )
        if name in seen:
            raise TrajectoryError(
                Reason.DUPLICATE_JOINT, f'{where} names joint {name!r} more than once'
            )
        seen.add(name)
    return names


def _without_positions(i: int, point: Point) -> TrajectoryError:
    if len(point.effort) and not len(point.velocities) and not len(point.accelerations):
        return TrajectoryError(Reason.EFFORT_ONLY, f'point {i} has effort but no positions')
    return TrajectoryError(Reason.MISSING_POSITIONS, f'point {i} has no positions')


def _sizes(
    fields: Mapping[str, Sequence[Sequence[float]]], points: Sequence[Point], dof: int
) -> dict[str, set[int]]:
    """
    Return the sizes that the rows of each field have, which are dof and 0.

    :param fields: of each field the rows of all points.
    :param points: the points.
    :param dof: number of joints.
    :raises TrajectoryError: for the first row of another size, and for one without positions.
    """
    try:
        sizes = {field: set(map(len, rows)) for field, rows in fields.items()}
        if 0 not in sizes['positions'] and all(each <= {0, dof} for each in sizes.values()):
            return sizes
    except TypeError:
        pass
    for field, rows in fields.items():
        for i, row in enumerate(rows):
            size = _size(row, field, i)
            if size == 0 and field == 'positions':
                raise _without_positions(i, points[i])
            if size not in (0, dof):
                raise TrajectoryError(
                    Reason.SIZE_MISMATCH, f'point {i} has {size} {field} for {dof} joints'
                )
    raise AssertionError('one of the rows must be wrong')


def _size(row: Sequence[float], field: str, i: int) -> int:
    try:
        return len(row)
    except TypeError as error:
        raise TrajectoryError(
            Reason.TRAJECTORY_UNREADABLE, f'point {i}: {field} is {row!r}, not a list'
        ) from error


def _times(times_ns: Sequence[int] | np.ndarray) -> np.ndarray:
    """Return an int64 copy of integers, which numpy alone would also take from floats."""
    try:
        array = np.array(times_ns)
    except (TypeError, ValueError, OverflowError):
        array = np.array('')
    if array.dtype == np.int64 and array.ndim == 1 and array.min() >= -_INT64_MAX:
        return array
    for i, time_ns in enumerate(times_ns):
        try:
            value = index(time_ns)
        except TypeError as error:
            raise TrajectoryError(
                Reason.TRAJECTORY_UNREADABLE,
                f'point {i} has the time {time_ns!r}, not an integer of nanoseconds',
            ) from error
        if abs(value) > _INT64_MAX:
            raise TrajectoryError(
                Reason.TOO_LARGE, f'point {i} has the time {value} ns, beyond 64 bits'
            )
    return np.array(times_ns, dtype=np.int64)


def _numbers(values: Sequence[float] | Sequence[Sequence[float]], field: str) -> np.ndarray:
    """Return a float64 copy of what numpy reads as numbers; it would also read text."""
    try:
        array = np.array(values, order='C')
    except (TypeError, ValueError, OverflowError):
        array = np.array('')
    if array.dtype == np.float64:
        return array
    if array.dtype.kind not in 'iuf' and array.size:
        raise TrajectoryError(Reason.TRAJECTORY_UNREADABLE, f'{field}: not all are numbers')
    return array.astype(np.float64, order='C')


def _table(
    rows: Sequence[Sequence[float]], dof: int, field: str, sizes: Collection[int]
) -> tuple[np.ndarray, np.ndarray]:
    """
    Stack one field of all points.

    :param rows: one row a point, of dof values or empty.
    :param dof: number of joints.
    :param field: what they are, for the message.
    :param sizes: the sizes that occur.
    :returns: (P, dof) values with zeros for empty rows, and (P,) which rows are not empty.
    """
    table = np.zeros((len(rows), dof))
    present = np.zeros(len(rows), dtype=np.bool_)
    if dof not in sizes:
        return table, present
    if 0 in sizes:
        present[:] = [len(row) > 0 for row in rows]
        rows = [row for row in rows if len(row) > 0]
    else:
        present[:] = True
    values = _numbers(rows, field)
    if values.shape != (len(rows), dof):
        raise TrajectoryError(Reason.TRAJECTORY_UNREADABLE, f'{field}: rows are not flat')
    if 0 not in sizes:
        return values, present
    table[present] = values
    return table, present
