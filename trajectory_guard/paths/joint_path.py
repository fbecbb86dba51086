"""What the controller plays: a trajectory message as one curve in joint space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
import math
from typing import NamedTuple

import numpy as np

from trajectory_guard.cell.robot import FLOATING_TYPES, Joint, JointType
from trajectory_guard.errors import Reason, RequestError, RobotError, TrajectoryError
from trajectory_guard.paths.free_path import FreePath
from trajectory_guard.paths.hermite import hermite, Knots
from trajectory_guard.paths.joint_limits import limit_excess
from trajectory_guard.paths.mimic import follow, followers
from trajectory_guard.paths.start_state import with_start
from trajectory_guard.paths.trajectory import JointState, Trajectory

# Splines of ros2_control's joint_trajectory_controller, Jazzy 4.x.
INTERPOLATION = 'joint_trajectory_controller/jazzy'

# Below this the controller itself takes the last velocity for zero [rad/s or m/s].
_REST_VELOCITY = float(np.finfo(np.float32).eps)


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """
    The motion of all movable joints of a robot, S polynomials in time.

    Segment i runs over [knots_ns[i], knots_ns[i + 1]]; there joint j is at
    sum_k coefficients[i, j, k] s^k, s = (t - knots_ns[i]) / (knots_ns[i + 1] - knots_ns[i]).

    :param joint_names: n movable joints in the robot's order, mimic joints included.
    :param in_path: (n,) bool, whether the message commands the joint, or the one it mimics.
    :param knots_ns: (S + 1,) int64, from unknown_until_ns to the last point [ns]; a pose without
        motion is one constant segment and may have equal knots.
    :param coefficients: (S, n, 6) [rad or m].
    :param coefficient_error: (S, n) bound on sum_k |coefficient - exact coefficient|; it holds
        for the value at every s as well [rad or m].
    :param unknown_until_ns: before this time no start state tells where the arm is [ns].
    :param limits_checked: whether the joint limits were enforced.
    :param floating: the motion of the robot's floating joint, segment by segment; None: it has
        none. The coefficients of its two parts are 0.
    :raises RequestError: an array has another shape, or knots do not rise.
    """

    joint_names: tuple[str, ...]
    in_path: np.ndarray
    knots_ns: np.ndarray
    coefficients: np.ndarray
    coefficient_error: np.ndarray
    unknown_until_ns: int
    limits_checked: bool
    floating: FreePath | None = None

    def __post_init__(self) -> None:
        """Check the shapes, which kernels take on trust, and make the arrays read-only."""
        segments, n = len(self.knots_ns) - 1, len(self.joint_names)
        for name, shape, dtype in (
            ('in_path', (n,), np.bool_),
            ('knots_ns', (segments + 1,), np.int64),
            ('coefficients', (segments, n, 6), np.float64),
            ('coefficient_error', (segments, n), np.float64),
        ):
            array = np.ascontiguousarray(getattr(self, name), dtype)
            if array.shape != shape or segments < 1:
                raise RequestError(
                    Reason.INVALID_PARAMETER,
                    f'{name} must have shape {shape} with S >= 1, got {array.shape}',
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if self.floating is not None and len(self.floating.motions) != segments:
            raise RequestError(
                Reason.INVALID_PARAMETER,
                f'floating has {len(self.floating.motions)} segments, the path {segments}',
            )
        knots = self.knots_ns
        # Without length only a pose is a segment: what happens in no time has no interval.
        rises = knots[1:] > knots[:-1] if segments > 1 else knots[1:] >= knots[:-1]
        if not rises.all() or knots[0] < 0:
            raise RequestError(Reason.UNSORTED_TIMES, f'knots_ns must rise, got {self.knots_ns}')
        # Else the time before the first knot would be nobody's.
        if self.unknown_until_ns != int(knots[0]):
            raise RequestError(
                Reason.INVALID_PARAMETER,
                f'unknown_until_ns is {self.unknown_until_ns}, the first knot {knots[0]}',
            )

    @property
    def interpolation(self) -> str:
        """The rule that made the curve."""
        return INTERPOLATION if self.floating is None else self.floating.interpolation

    @property
    def duration_ns(self) -> int:
        """Time of the last point [ns]."""
        return int(self.knots_ns[-1])

    def position(self, time_ns: int) -> np.ndarray:
        """
        Evaluate the path, to rounding.

        :param time_ns: from knots_ns[0] to the end [ns].
        :returns: (n,) [rad or m].
        :raises RequestError: outside that range.
        """
        knots = self.knots_ns
        if not knots[0] <= time_ns <= knots[-1]:
            raise RequestError(
                Reason.INVALID_PARAMETER,
                f'the path is known from {knots[0]} to {knots[-1]} ns, not at {time_ns} ns',
            )
        i = min(int(np.searchsorted(knots, time_ns, side='right')), len(knots) - 1) - 1
        h = int(knots[i + 1]) - int(knots[i])
        s = (int(time_ns) - int(knots[i])) / h if h else 0.0
        q: np.ndarray = self.coefficients[i, :, 5].copy()
        for k in range(4, -1, -1):
            q = q * s + self.coefficients[i, :, k]
        return q


def joint_path(
    robot_joints: Sequence[Joint],
    trajectory: Trajectory,
    start: JointState | None = None,
    *,
    allowed_start_tolerance: float = 0.01,
    joint_limit_tolerance: float = 1e-6,
    check_joint_limits: bool = True,
    allow_nonzero_end_velocity: bool = False,
) -> JointPath:
    """
    Return the curve the controller plays for a trajectory.

    Joints are matched by name. Those the message lacks hold their start position, mimic joints
    follow. A first point later than 0 is approached from the start state, with its velocities if
    it has them, else from rest, and without acceleration; continuous joints turn the short way.
    A first point at 0 must agree with the start state. A start state that gives none of the
    commanded joints says nothing about them, and one that gives only some is refused.

    :param robot_joints: joints of the robot; the path has the movable ones, in this order.
    :param trajectory: the message.
    :param start: where the robot is at time 0; names the robot does not have are ignored.
    :param allowed_start_tolerance: how far the start state may be off [rad or m].
    :param joint_limit_tolerance: how far the curve may leave the position limits [rad or m].
    :param check_joint_limits: False leaves them unchecked, and the path says so.
    :param allow_nonzero_end_velocity: accept a last point that does not rest.
    :raises TrajectoryError: if the controller would refuse the message, if it does not say where
        every joint is, if the curve leaves a joint limit, or if it is too large for doubles.
    :raises RequestError: for a tolerance that is negative or not finite.
    :raises RobotError: for a mimic joint that follows nothing.
    """
    for what, value in (
        ('allowed_start_tolerance', allowed_start_tolerance),
        ('joint_limit_tolerance', joint_limit_tolerance),
    ):
        if not (math.isfinite(value) and value >= 0.0):
            raise RequestError(
                Reason.INVALID_PARAMETER, f'{what} must be finite and not negative, got {value!r}'
            )
    try:
        roles = _roles(tuple(robot_joints), trajectory.joint_names)
    except RobotError:
        # Of the two errors the message's own comes first.
        if not allow_nonzero_end_velocity:
            _check_end_velocity(trajectory)
        raise
    if not allow_nonzero_end_velocity:
        _check_end_velocity(trajectory)
    knots = with_start(
        _knots(trajectory, roles.columns),
        [roles.joints[j] for j in roles.commanded],
        start,
        allowed_start_tolerance,
        roles.followed,
    )
    still = len(knots.times_ns) == 1
    joints = len(roles.joints)
    with np.errstate(all='ignore'):
        coefficients, error = hermite(_pose(knots) if still else knots)
        segments = len(coefficients)
        if len(roles.commanded) < joints:
            curve, curve_error = coefficients, error
            coefficients = np.zeros((segments, joints, 6))
            error = np.zeros((segments, joints))
            coefficients[:, roles.commanded] = curve
            error[:, roles.commanded] = curve_error
        if roles.held:
            coefficients[:, roles.held, 0] = _held_positions(roles, start)
        for j, leader in roles.mimics:
            follow(coefficients, error, roles.joints[j], j, leader)
        path = JointPath(
            joint_names=roles.names,
            in_path=roles.in_path,
            knots_ns=np.repeat(knots.times_ns, 2) if still else knots.times_ns,
            coefficients=coefficients,
            coefficient_error=error,
            unknown_until_ns=int(knots.times_ns[0]),
            limits_checked=check_joint_limits,
        )
        first_end = len(trajectory.times_ns) - segments
        _check_size(path, first_end)
        if check_joint_limits:
            _check_limits(path, roles, joint_limit_tolerance, first_end)
    return path


class _Roles(NamedTuple):
    """
    What the joints of a robot do while a trajectory for some of them is played.

    :param joints: n movable joints in the robot's order.
    :param names: their names.
    :param commanded: indices of those that the trajectory moves.
    :param columns: the trajectory's column of each commanded joint; None: as they come.
    :param held: indices of those that neither the trajectory nor a mimic moves.
    :param mimics: mimic joint and followed joint, as indices, in the order of following.
    :param followed: names of the joints that others mimic.
    :param in_path: (n,) bool, as in the path.
    :param lower: (n,) lower limits to check, -inf where none is [rad or m].
    :param upper: (n,) upper limits to check, inf where none is [rad or m].
    """

    joints: tuple[Joint, ...]
    names: tuple[str, ...]
    commanded: tuple[int, ...]
    columns: tuple[int, ...] | None
    held: tuple[int, ...]
    mimics: tuple[tuple[int, int], ...]
    followed: frozenset[str]
    in_path: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


# A robot is asked about again and again, mostly for the same joints. Clients choose the names, so
# the number of answers kept is bounded.
@lru_cache(maxsize=64)
def _roles(robot_joints: tuple[Joint, ...], names: tuple[str, ...]) -> _Roles:
    """Return the roles of a robot's joints; raises as `joint_path` does."""
    _check_names(robot_joints, names)
    joints = tuple(joint for joint in robot_joints if joint.type is not JointType.FIXED)
    column = {name: i for i, name in enumerate(names)}
    commanded = [j for j, joint in enumerate(joints) if joint.name in column]
    columns = tuple(column[joints[j].name] for j in commanded)
    mimics = followers(joints)
    in_path = np.zeros(len(joints), dtype=np.bool_)
    in_path[commanded] = True
    for j, leader in mimics:
        in_path[j] = in_path[leader]
    limited = [
        inside and joint.type is not JointType.CONTINUOUS
        for inside, joint in zip(in_path.tolist(), joints, strict=True)
    ]
    lower = np.where(limited, [joint.lower for joint in joints], -math.inf)
    upper = np.where(limited, [joint.upper for joint in joints], math.inf)
    for array in (in_path, lower, upper):
        array.setflags(write=False)
    return _Roles(
        joints=joints,
        names=tuple(joint.name for joint in joints),
        commanded=tuple(commanded),
        columns=None if columns == tuple(range(len(names))) else columns,
        held=tuple(
            j for j, joint in enumerate(joints) if joint.mimic is None and joint.name not in column
        ),
        mimics=tuple(mimics),
        followed=frozenset(joints[leader].name for _, leader in mimics),
        in_path=in_path,
        lower=lower,
        upper=upper,
    )


def _check_names(robot_joints: Sequence[Joint], names: Sequence[str]) -> None:
    by_name = {joint.name: joint for joint in robot_joints}
    for name in names:
        joint = by_name.get(name)
        if joint is None:
            free = [j.name for j in robot_joints if j.type is not JointType.FIXED and not j.mimic]
            raise TrajectoryError(
                Reason.UNKNOWN_JOINT,
                f'the robot has no joint {name!r}; it has ' + ', '.join(map(repr, free)),
            )
        if joint.type in FLOATING_TYPES:
            raise TrajectoryError(
                Reason.JOINT_UNSUPPORTED, f'joint {name!r} is a part of a floating joint'
            )
        if joint.type is JointType.FIXED:
            raise TrajectoryError(Reason.FIXED_JOINT, f'joint {name!r} is fixed')
        if joint.mimic is not None:
            raise TrajectoryError(
                Reason.MIMIC_JOINT,
                f'joint {name!r} mimics {joint.mimic.joint!r} and cannot be commanded',
            )


def _check_end_velocity(trajectory: Trajectory) -> None:
    if not trajectory.has_velocities[-1]:
        return
    for name, velocity in zip(
        trajectory.joint_names, trajectory.velocities[-1].tolist(), strict=True
    ):
        if abs(velocity) > _REST_VELOCITY:
            raise TrajectoryError(
                Reason.NONZERO_END_VELOCITY,
                f'the last point moves joint {name!r} at {velocity:.9g}',
            )


def _knots(trajectory: Trajectory, columns: Sequence[int] | None) -> Knots:
    positions, velocities = trajectory.positions, trajectory.velocities
    accelerations = trajectory.accelerations
    if columns is not None:
        positions = positions.take(columns, axis=1)
        velocities = velocities.take(columns, axis=1)
        accelerations = accelerations.take(columns, axis=1)
    return Knots(
        times_ns=trajectory.times_ns,
        positions=positions,
        velocities=velocities,
        has_velocities=trajectory.has_velocities,
        accelerations=accelerations,
        has_accelerations=trajectory.has_accelerations,
        start_error=np.zeros(positions.shape[1]),
    )


def _pose(knots: Knots) -> Knots:
    """Return a single knot twice, at rest."""
    off = np.zeros(2, dtype=np.bool_)
    return Knots(
        times_ns=np.repeat(knots.times_ns, 2),
        positions=np.repeat(knots.positions, 2, axis=0),
        velocities=np.zeros((2, knots.positions.shape[1])),
        has_velocities=off,
        accelerations=np.zeros((2, knots.positions.shape[1])),
        has_accelerations=off,
        start_error=knots.start_error,
    )


def _held_positions(roles: _Roles, start: JointState | None) -> list[float]:
    """Return the start positions of the joints that neither the message nor a mimic moves."""
    known = {} if start is None else dict(zip(start.joint_names, start.positions, strict=True))
    names = [roles.names[j] for j in roles.held]
    unknown = [repr(name) for name in names if name not in known]
    if unknown:
        raise TrajectoryError(
            Reason.JOINT_POSITION_UNKNOWN,
            'neither the trajectory nor the start state gives ' + ', '.join(unknown),
        )
    return [known[name] for name in names]


def _check_size(path: JointPath, first_end: int) -> None:
    # A sum of squares is finite only if all of them are.
    squares = (np.vdot(array, array) for array in (path.coefficients, path.coefficient_error))
    if all(map(math.isfinite, squares)):
        return
    finite = np.isfinite(path.coefficients).all(axis=-1) & np.isfinite(path.coefficient_error)
    if not finite.all():
        i, j = np.argwhere(~finite)[0]
        raise TrajectoryError(
            Reason.TOO_LARGE,
            f'the motion of joint {path.joint_names[j]!r} to point {first_end + i} is too large '
            'for double precision',
        )


def _check_limits(path: JointPath, roles: _Roles, tolerance: float, first_end: int) -> None:
    excess = limit_excess(
        path.coefficients, path.coefficient_error, roles.lower, roles.upper, tolerance
    )
    if excess is None:
        return
    begin, end = path.knots_ns[excess.segment : excess.segment + 2]
    time = (begin + excess.s * (end - begin)) / 1e9
    upper = excess.value > excess.limit
    raise TrajectoryError(
        Reason.JOINT_LIMIT,
        f'joint {roles.names[excess.joint]!r} reaches {excess.value:.9g} at '
        f'{time:.9g} s, on the way to point {first_end + excess.segment}; its '
        f'{"upper" if upper else "lower"} limit is {excess.limit:.9g}, '
        f'joint_limit_tolerance {tolerance:g}',
    )
