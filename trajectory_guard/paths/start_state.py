"""The way from the start state to the first point, which the controller adds by itself."""

from __future__ import annotations

from collections.abc import Collection, Sequence
import math

import numpy as np

from trajectory_guard.cell.robot import Joint, JointType
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.hermite import Knots
from trajectory_guard.paths.trajectory import JointState

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
    if start is None:
        return knots
    column = {name: i for i, name in enumerate(start.joint_names)}
    columns = [column[joint.name] for joint in joints if joint.name in column]
    if not columns:
        return knots
    if len(columns) < len(joints):
        lacking = [joint.name for joint in joints if joint.name not in column]
        raise TrajectoryError(
            Reason.START_STATE_UNKNOWN,
            'the start state lacks commanded joints: ' + ', '.join(map(repr, lacking)),
        )
    measured = start.positions.take(columns).tolist()
    target = knots.positions[0].tolist()
    at_once = bool(knots.times_ns[0] == 0)
    # One joint at a time, as plain floats: they overflow to inf and warn of nothing.
    positions, errors = [], []
    for joint, q, q0 in zip(joints, measured, target, strict=True):
        continuous = joint.type is JointType.CONTINUOUS
        turns = _whole((q0 - q) / _TURN) if continuous else 0.0
        position = q + turns * _TURN
        error = 0.0
        if turns != 0.0:
            error = 4.0 * _UNIT * (abs(q) + abs(q0) + _TURN * (abs(turns) + 1.0))
            if joint.name in followed:
                raise TrajectoryError(
                    Reason.START_STATE_MISMATCH,
                    f'joint {joint.name!r} starts at {q:.9g}, whole turns from point 0 at '
                    f'{q0:.9g}, and other joints mimic it',
                )
        distance = abs(q0 - position) + error
        if at_once and not distance <= allowed_start_tolerance:
            raise TrajectoryError(
                Reason.START_STATE_MISMATCH,
                f'joint {joint.name!r} starts at {q:.9g}, but point 0 at time 0 has '
                f'{q0:.9g}; allowed_start_tolerance is {allowed_start_tolerance:g}',
            )
        if not at_once and continuous and not distance < math.pi - _HALF_TURN_BAND:
            raise TrajectoryError(
                Reason.START_STATE_MISMATCH,
                f'continuous joint {joint.name!r} starts at {q:.9g}, within '
                f'{_HALF_TURN_BAND:g} rad of half a turn from point 0 at {q0:.9g}: it may '
                'turn either way; add a point in between',
            )
        positions.append(position)
        errors.append(error)
    if at_once:
        return knots
    velocity = 0.0 if start.velocities is None else start.velocities.take(columns)
    return Knots(
        times_ns=_after(0, knots.times_ns),
        positions=_after(positions, knots.positions),
        velocities=_after(velocity, knots.velocities),
        has_velocities=_after(knots.has_velocities[0], knots.has_velocities),
        accelerations=_after(0.0, knots.accelerations),
        has_accelerations=_after(knots.has_accelerations[0], knots.has_accelerations),
        start_error=np.array(errors),
    )


def _whole(turns: float) -> float:
    """Round to the nearest integer, ties to even; what is beyond 2^52 is one, or infinite."""
    return float(round(turns)) if abs(turns) < 2.0**52 else turns


def _after(first: object, rows: np.ndarray) -> np.ndarray:
    """Return the rows with one more in front."""
    longer = np.empty((len(rows) + 1, *rows.shape[1:]), rows.dtype)
    longer[0] = first
    longer[1:] = rows
    return longer
