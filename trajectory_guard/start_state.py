"""The way from the start state to the first point, which the controller adds by itself."""

from __future__ import annotations

from collections.abc import Collection, Sequence
import math

import numpy as np

from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.hermite import Knots
from trajectory_guard.robot import Joint, JointType
from trajectory_guard.trajectory import JointState

_TURN = 2.0 * math.pi
_UNIT = 2.0**-53

# Nearer than this to half a turn from point 0 the direction is open: the state that the controller
# reads when it starts may lie on the other side. As much as a start state may be off by default,
# and far more than the band in which the controller goes by the sign, not the shorter way [rad].
_HALF_TURN_BAND = 0.01


def with_start(
    knots: Knots,
    joints: Sequence[Joint],
    start: JointState | None,
    allowed_start_tolerance: float,
    followed: Collection[str],
) -> Knots:
    """
    Put the start state before the first point, or compare the two if that point is at time 0.

    The start state takes the derivatives that point 0 carries: its own velocities if it has
    them, else zero, and zero accelerations. It is moved by whole turns of a continuous joint to
    within half a turn of point 0. With k turns the float q + k 2 pi, and the one the controller
    computes, err by at most 4 u (|q| + |q0| + 2 pi (|k| + 1)): three roundings of the sums, one
    of the product, and that of 2 pi itself, which the controller uses k times.

    :param knots: the points of the message.
    :param joints: their joints, in the order of the columns.
    :param start: the state at time 0; None, or one that names none of the joints: unknown.
    :param allowed_start_tolerance: how far the start state may be off [rad or m].
    :param followed: joints that others mimic. Turned by whole turns they would leave the others
        elsewhere, so that is refused.
    :returns: the knots from time 0 on, or unchanged if the start is unknown or point 0 is there.
    :raises TrajectoryError: the start state lacks some of the joints, does not agree with a point
        0 at time 0, or leaves open which way round a continuous joint will turn.
    """
    column = {} if start is None else {name: i for i, name in enumerate(start.joint_names)}
    lacking = [joint.name for joint in joints if joint.name not in column]
    if start is None or len(lacking) == len(joints):
        return knots
    if lacking:
        raise TrajectoryError(
            Reason.START_STATE_UNKNOWN,
            'the start state lacks commanded joints: ' + ', '.join(map(repr, lacking)),
        )
    columns = [column[joint.name] for joint in joints]
    measured, target = start.positions[columns], knots.positions[0]
    continuous = np.array([joint.type is JointType.CONTINUOUS for joint in joints])
    with np.errstate(all='ignore'):
        turns = np.where(continuous, np.rint((target - measured) / _TURN), 0.0)
        position = measured + turns * _TURN
        error = 4.0 * _UNIT * (np.abs(measured) + np.abs(target) + _TURN * (np.abs(turns) + 1.0))
        error = np.where(turns != 0.0, error, 0.0)
        distance = np.abs(target - position) + error
    at_once = knots.times_ns[0] == 0
    for i, joint in enumerate(joints):
        if turns[i] != 0.0 and joint.name in followed:
            raise TrajectoryError(
                Reason.START_STATE_MISMATCH,
                f'joint {joint.name!r} starts at {measured[i]:.9g}, whole turns from point 0 at '
                f'{target[i]:.9g}, and other joints mimic it',
            )
        if at_once and not distance[i] <= allowed_start_tolerance:
            raise TrajectoryError(
                Reason.START_STATE_MISMATCH,
                f'joint {joint.name!r} starts at {measured[i]:.9g}, but point 0 at time 0 has '
                f'{target[i]:.9g}; allowed_start_tolerance is {allowed_start_tolerance:g}',
            )
        if not at_once and continuous[i] and not distance[i] < math.pi - _HALF_TURN_BAND:
            raise TrajectoryError(
                Reason.START_STATE_MISMATCH,
                f'continuous joint {joint.name!r} starts at {measured[i]:.9g}, within '
                f'{_HALF_TURN_BAND:g} rad of half a turn from point 0 at {target[i]:.9g}: it may '
                'turn either way; add a point in between',
            )
    if at_once:
        return knots
    rest = np.zeros(len(joints))
    velocity = rest if start.velocities is None else start.velocities[columns]
    return Knots(
        times_ns=np.concatenate([[0], knots.times_ns]),
        positions=np.vstack([position, knots.positions]),
        velocities=np.vstack([velocity, knots.velocities]),
        has_velocities=np.concatenate([knots.has_velocities[:1], knots.has_velocities]),
        accelerations=np.vstack([rest, knots.accelerations]),
        has_accelerations=np.concatenate([knots.has_accelerations[:1], knots.has_accelerations]),
        start_error=error,
    )
