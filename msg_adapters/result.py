"""Results to trajectory_guard_interfaces messages and back."""

import math
from typing import Any, NamedTuple

from msg_adapters.trajectory import nanoseconds_from_message
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.result import Interval, NANOSECONDS, Result, Status, Verdict

# A Duration has no NaN; no instant of a trajectory is negative.
UNKNOWN_INSTANT_NS = -NANOSECONDS


class MessageTypes(NamedTuple):
    """
    The message classes a result is made of.

    :param CertificationResult: trajectory_guard_interfaces/msg/CertificationResult.
    :param TimeInterval: trajectory_guard_interfaces/msg/TimeInterval.
    :param Duration: builtin_interfaces/msg/Duration.
    :param Point: geometry_msgs/msg/Point.
    """

    CertificationResult: type
    TimeInterval: type
    Duration: type
    Point: type


def ros_message_types() -> MessageTypes:
    """Return the classes of the ROS installation."""
    from builtin_interfaces.msg import Duration
    from geometry_msgs.msg import Point
    from trajectory_guard_interfaces.msg import CertificationResult, TimeInterval

    return MessageTypes(CertificationResult, TimeInterval, Duration, Point)


def result_to_message(result: Result, types: MessageTypes | None = None) -> Any:
    """
    Return a result as CertificationResult message.

    What a message cannot leave out is written so: an unknown place or gap bound as NaN, an unknown
    instant as minus one second. The trajectory's label has no place in the message.

    :param result: the result.
    :param types: message classes; None: those of the ROS installation.
    """
    types = types or ros_message_types()
    return types.CertificationResult(
        verdict=int(result.verdict),
        reason_code=result.reason_code,
        message=result.message,
        intervals=[interval_to_message(interval, types) for interval in result.intervals],
        tolerance=float(result.tolerance),
        clearance=float(result.clearance),
        interpolation=result.interpolation,
        robot_hash=result.robot_hash,
        scene_hash=result.scene_hash,
        compute_time=float(result.compute_time),
        pieces=int(result.pieces),
        pairs_checked=int(result.pairs_checked),
        unchecked_pairs=list(result.unchecked_pairs),
        warnings=list(result.warnings),
        duration=nanoseconds_to_message(result.duration_ns, types.Duration),
    )


def interval_to_message(interval: Interval, types: MessageTypes) -> Any:
    """
    Return an interval as TimeInterval message.

    :param interval: the interval.
    :param types: message classes.
    """
    at_ns = UNKNOWN_INSTANT_NS if interval.at_ns is None else interval.at_ns
    x, y, z = interval.location or (math.nan, math.nan, math.nan)
    return types.TimeInterval(
        status=int(interval.status),
        reason=interval.reason,
        start=nanoseconds_to_message(interval.start_ns, types.Duration),
        end=nanoseconds_to_message(interval.end_ns, types.Duration),
        body=interval.body,
        obstacle=interval.obstacle,
        at=nanoseconds_to_message(at_ns, types.Duration),
        location=types.Point(x=float(x), y=float(y), z=float(z)),
        gap_lower=_nan_if_none(interval.gap_lower),
        gap_upper=_nan_if_none(interval.gap_upper),
    )


def nanoseconds_to_message(time_ns: int, duration_type: type) -> Any:
    """
    Return integer nanoseconds as builtin_interfaces/Duration, exactly.

    :param time_ns: time [ns].
    :param duration_type: the message class.
    :raises TrajectoryError: the seconds do not fit the message; writing it would wrap them.
    """
    sec, nanosec = divmod(int(time_ns), NANOSECONDS)
    if not -(2**31) <= sec < 2**31:
        raise TrajectoryError(Reason.TOO_LARGE, f'{sec} s do not fit a Duration message')
    return duration_type(sec=sec, nanosec=nanosec)


def result_from_message(message: Any, name: str = '') -> Result:
    """
    Return the result a CertificationResult message carries.

    :param message: anything with the fields of CertificationResult.
    :param name: label of the trajectory.
    :raises ValueError: the verdict or a status is not one that this version knows.
    """
    return Result(
        verdict=Verdict(message.verdict),
        reason_code=message.reason_code,
        message=message.message,
        intervals=tuple(interval_from_message(interval) for interval in message.intervals),
        tolerance=message.tolerance,
        clearance=message.clearance,
        interpolation=message.interpolation,
        robot_hash=message.robot_hash,
        scene_hash=message.scene_hash,
        compute_time=message.compute_time,
        pieces=message.pieces,
        pairs_checked=message.pairs_checked,
        unchecked_pairs=tuple(message.unchecked_pairs),
        warnings=tuple(message.warnings),
        duration_ns=nanoseconds_from_message(message.duration),
        name=name,
    )


def interval_from_message(message: Any) -> Interval:
    """
    Return the interval a TimeInterval message carries.

    :param message: anything with the fields of TimeInterval.
    :raises ValueError: the status is not one that this version knows.
    """
    at_ns = nanoseconds_from_message(message.at)
    place = (message.location.x, message.location.y, message.location.z)
    return Interval(
        start_ns=nanoseconds_from_message(message.start),
        end_ns=nanoseconds_from_message(message.end),
        status=Status(message.status),
        reason=message.reason,
        body=message.body,
        obstacle=message.obstacle,
        at_ns=None if at_ns < 0 else at_ns,
        location=None if any(math.isnan(value) for value in place) else place,
        gap_lower=_none_if_nan(message.gap_lower),
        gap_upper=_none_if_nan(message.gap_upper),
    )


def _nan_if_none(value: float | None) -> float:
    """Return the number for a float64 field that cannot be left out."""
    return math.nan if value is None else float(value)


def _none_if_nan(value: float) -> float | None:
    """Return the number of a float64 field that could not be left out."""
    return None if math.isnan(value) else value
