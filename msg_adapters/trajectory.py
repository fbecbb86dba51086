"""JointTrajectory, MultiDOFJointTrajectory and JointState messages to core values."""

import math
import operator
from typing import Any

import numpy as np

from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.multi_dof import MultiDofTrajectory, PosePoint
from trajectory_guard.paths.trajectory import JointState, Point, Trajectory
from trajectory_guard.result import NANOSECONDS


def nanoseconds_from_message(duration: Any) -> int:
    """
    Return a builtin_interfaces Duration or Time as integer nanoseconds, exactly.

    :param duration: anything with integer ``sec`` and ``nanosec``.
    :raises TrajectoryError: one of them is missing or no integer.
    """
    try:
        return operator.index(duration.sec) * NANOSECONDS + operator.index(duration.nanosec)
    except (AttributeError, TypeError) as error:
        raise TrajectoryError(
            Reason.TRAJECTORY_UNREADABLE, f'not a duration of sec and nanosec: {error}'
        ) from error


def trajectory_from_message(message: Any, name: str = '') -> Trajectory:
    """
    Return the trajectory a JointTrajectory message describes.

    The header is not read; see :func:`stamp_from_message`.

    :param message: anything with the fields of trajectory_msgs/JointTrajectory.
    :param name: label of the trajectory in the result.
    :raises TrajectoryError: a field is missing, or the trajectory is not one that can be played.
    """
    points = []
    for index, point in enumerate(_field(message, 'points', 'the trajectory')):
        owner = f'points[{index}]'
        points.append(
            Point(
                time_ns=nanoseconds_from_message(_field(point, 'time_from_start', owner)),
                positions=_field(point, 'positions', owner),
                velocities=_field(point, 'velocities', owner),
                accelerations=_field(point, 'accelerations', owner),
                effort=_field(point, 'effort', owner),
            )
        )
    joint_names = tuple(_field(message, 'joint_names', 'the trajectory'))
    return Trajectory.from_points(joint_names, points, name=name)


def multi_dof_from_message(message: Any, name: str = '') -> MultiDofTrajectory:
    """
    Return the poses in time that a MultiDOFJointTrajectory message describes.

    Of the header the frame is read; for the stamp see :func:`stamp_from_message`.

    :param message: anything with the fields of trajectory_msgs/MultiDOFJointTrajectory; the header
        may be missing.
    :param name: label of the trajectory in the result.
    :raises TrajectoryError: a field is missing, or the trajectory is not one that can be played.
    """
    points = []
    for index, point in enumerate(_field(message, 'points', 'the trajectory')):
        owner = f'points[{index}]'
        points.append(
            PosePoint(
                nanoseconds_from_message(_field(point, 'time_from_start', owner)),
                _rows(point, 'transforms', owner, (('translation', 'xyz'), ('rotation', 'xyzw'))),
                _rows(point, 'velocities', owner, _TWIST),
                _rows(point, 'accelerations', owner, _TWIST),
            )
        )
    joint_names = tuple(_field(message, 'joint_names', 'the trajectory'))
    frame_id = getattr(getattr(message, 'header', None), 'frame_id', '')
    return MultiDofTrajectory.from_points(joint_names, points, name=name, frame_id=str(frame_id))


_TWIST = (('linear', 'xyz'), ('angular', 'xyz'))


def _rows(
    point: Any, name: str, owner: str, parts: tuple[tuple[str, str], ...]
) -> list[list[float]]:
    """Return the numbers of each transform or twist of a point, in their order."""
    rows = []
    for k, item in enumerate(_field(point, name, owner)):
        place = f'{owner}.{name}[{k}]'
        try:
            rows.append(
                [
                    float(_field(_field(item, part, place), key, f'{place}.{part}'))
                    for part, keys in parts
                    for key in keys
                ]
            )
        except (TypeError, ValueError) as error:
            raise TrajectoryError(Reason.TRAJECTORY_UNREADABLE, f'{place}: {error}') from error
    return rows


def stamp_from_message(message: Any) -> int:
    """
    Return when a message says its motion begins; 0 is "when it arrives" [ns].

    The controller leaves for the first point when the message arrives and reaches it
    ``time_from_start`` after the stamp, so a stamp changes how long that takes.

    :param message: anything with the fields of trajectory_msgs/JointTrajectory; the header may be
        missing.
    :raises TrajectoryError: the header is none.
    """
    header = getattr(message, 'header', None)
    return 0 if header is None else nanoseconds_from_message(_field(header, 'stamp', 'the header'))


def joint_state_from_message(message: Any) -> JointState:
    """
    Return the measured state a JointState message describes; effort is not used.

    NaN is how joint_state_broadcaster writes "not measured": a joint without a position is left
    out, a missing velocity counts as zero, and without any velocity the state has none.

    :param message: anything with the fields of sensor_msgs/JointState.
    :raises TrajectoryError: the fields have different lengths, or a value is no finite number.
    """
    names = list(_field(message, 'name', 'the joint state'))
    positions = _numbers(message, 'position', names)
    velocities = _numbers(message, 'velocity', names) or [math.nan] * len(names)
    rows = zip(names, positions, velocities, strict=True)
    measured = [row for row in rows if not math.isnan(row[1])]
    has_velocities = any(not math.isnan(velocity) for _, _, velocity in measured)
    speeds = [0.0 if math.isnan(velocity) else velocity for _, _, velocity in measured]
    return JointState(
        joint_names=tuple(name for name, _, _ in measured),
        positions=np.array([position for _, position, _ in measured]),
        velocities=np.array(speeds) if has_velocities else None,
    )


def _numbers(message: Any, name: str, joint_names: list[str]) -> list[float]:
    """
    Return a field of the joint state as floats, one per joint.

    :raises TrajectoryError: no numbers, or not as many; only ``velocity`` may be empty.
    """
    try:
        values = [float(value) for value in _field(message, name, 'the joint state')]
    except (TypeError, ValueError) as error:
        raise TrajectoryError(
            Reason.TRAJECTORY_UNREADABLE, f'{name} of the joint state: {error}'
        ) from error
    if len(values) != len(joint_names) and (values or name != 'velocity'):
        raise TrajectoryError(
            Reason.SIZE_MISMATCH,
            f'the joint state names {len(joint_names)} joints but has {len(values)} in {name}',
        )
    return values


def _field(message: Any, name: str, owner: str) -> Any:
    """
    Return a field by its name.

    :raises TrajectoryError: the message has no such field.
    """
    try:
        return getattr(message, name)
    except AttributeError as error:
        raise TrajectoryError(
            Reason.TRAJECTORY_UNREADABLE, f'{owner} has no field {name!r}'
        ) from error
