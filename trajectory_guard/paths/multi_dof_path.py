"""The motion between the poses of a message, as rational curves with a bounded error."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from trajectory_guard.errors import Reason, RequestError, TrajectoryError
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.free_motion.quaternion_curve import Rigid, rigid_motion
from trajectory_guard.paths.free_motion.turn import constant_turn, multiplied
from trajectory_guard.paths.free_path import FreePath
from trajectory_guard.paths.multi_dof import MultiDofTrajectory

# No controller of ros2_control plays this message; the rule is the one of MoveIt's floating joint
# where points carry poses only, and Hermite's where they carry more.
INTERPOLATION = 'multi_dof/hermite_slerp'

# Nearer than this to half a turn the axis is a matter of rounding [rad].
HALF_TURN_BAND = 1e-6

# Below this the last velocity counts as none [m/s, rad/s].
REST_VELOCITY = float(np.finfo(np.float32).eps)

_U = 2.0**-53


class _Knot(NamedTuple):
    """A pose and its derivatives, None where the point carries none."""

    position: np.ndarray
    quaternion: np.ndarray
    velocity: np.ndarray | None
    acceleration: np.ndarray | None


def multi_dof_path(
    trajectory: MultiDofTrajectory,
    joint: int = 0,
    *,
    allow_nonzero_end_velocity: bool = False,
) -> FreePath:
    """
    Return the motion of one joint's child frame.

    Per segment a derivative counts only if both points carry it: positions linear, cubic or
    quintic Hermite; orientations without velocities turn at a constant rate about a fixed axis,
    the short way (slerp), else the quaternion is cubic or quintic Hermite, q' = 1/2 omega q, q''
    = 1/2 alpha q - 1/4 |omega|^2 q, and divided by its length. Velocities and accelerations are
    those of the frame's origin and of its turning, in the message's frame.

    Before a first point later than 0 nothing is known.

    :param trajectory: the message.
    :param joint: which of its joints.
    :param allow_nonzero_end_velocity: accept a last point that does not rest.
    :raises TrajectoryError: two orientations are half a turn apart and no velocities tell which
        way it goes, the orientation turns too far for its derivatives, the last point moves, or a
        number is too large.
    """
    if not allow_nonzero_end_velocity:
        _check_end(trajectory, joint)
    times = trajectory.times_ns.tolist()
    knots = [_knot(trajectory, joint, i) for i in range(len(times))]
    if len(knots) == 1:
        still = rigid_motion(knots[0].quaternion[None], knots[0].position[None])
        return _path(trajectory, joint, [times[0], times[0]], [still])
    curves = []
    for i in range(len(knots) - 1):
        h = (times[i + 1] - times[i]) / 1e9
        try:
            # What overflows is refused as too large.
            with np.errstate(over='ignore', invalid='ignore'):
                curves.append(_segment(knots[i], knots[i + 1], h))
        except RequestError as error:
            raise TrajectoryError(
                Reason.TOO_LARGE, f'from point {i} to point {i + 1}: {error}'
            ) from error
        except _HalfTurn as error:
            raise TrajectoryError(
                Reason.AMBIGUOUS_TURN,
                f'from point {i} to point {i + 1} the orientation turns by half a turn, which may '
                'go either way; add a point in between, or angular velocities that tell',
            ) from error
    return _path(trajectory, joint, times, curves)


class _HalfTurn(Exception):
    """Two orientations are half a turn apart."""


def _path(
    trajectory: MultiDofTrajectory, joint: int, times: list[int], curves: list[Rigid]
) -> FreePath:
    first = times[0]
    motions: tuple[RationalMotion, ...] = tuple(curve.motion for curve in curves)
    return FreePath(
        joint_name=trajectory.joint_names[joint],
        knots_ns=np.array(times, np.int64),
        motions=motions,
        turn_error=np.array([curve.turn_error for curve in curves]),
        shift_error=np.array([curve.shift_error for curve in curves]),
        interpolation=INTERPOLATION,
        unknown_until_ns=first,
    )


def _check_end(trajectory: MultiDofTrajectory, joint: int) -> None:
    if not trajectory.has_velocities[-1]:
        return
    worst = float(np.abs(trajectory.velocities[-1, joint]).max())
    if worst > REST_VELOCITY:
        raise TrajectoryError(
            Reason.NONZERO_END_VELOCITY,
            f'the last point moves joint {trajectory.joint_names[joint]!r} at {worst:.9g}',
        )


def _knot(trajectory: MultiDofTrajectory, joint: int, i: int) -> _Knot:
    return _Knot(
        trajectory.positions[i, joint],
        trajectory.quaternions[i, joint],
        trajectory.velocities[i, joint] if trajectory.has_velocities[i] else None,
        trajectory.accelerations[i, joint] if trajectory.has_accelerations[i] else None,
    )


def _segment(a: _Knot, b: _Knot, h: float) -> Rigid:
    """
    Return the curve between two knots, h seconds apart.

    A Hermite control value is a sum of at most four terms, each rounded at most ten times (h,
    its square, the quotient, and for quaternions the products): 64 u of their sizes together.
    """
    p, p_size = _hermite(a, b, h, _positions)
    shift = 64.0 * _U * p_size
    if a.velocity is None or b.velocity is None:
        axis, angle = _short_turn(a.quaternion, b.quaternion)
        q, turn = constant_turn(a.quaternion, axis, angle)
        # The message's quaternions were divided by their lengths, which rounds by 4 u each; the
        # axis and the angle come from their product.
        turn += 256.0 * _U
        direction = 0.0
    else:
        q, size = _hermite(a, _same_side(a, b, h), h, _quaternions)
        turn, direction = 0.0, 64.0 * _U * size
    curve = rigid_motion(q, p).loosened(direction, shift)
    return curve._replace(turn_error=curve.turn_error + turn)


def _hermite(
    a: _Knot, b: _Knot, h: float, derivatives: Callable[[_Knot], list[np.ndarray]]
) -> tuple[np.ndarray, float]:
    """
    Return Bernstein coefficients that match both ends' derivatives, and the size of their terms.

    Degree n = 1, 3, 5 with as many derivatives as both ends have; b_1 = x + h x' / n, b_2 = x +
    2 h x' / n + h^2 x'' / (n (n - 1)), and from the other end likewise with -h.
    """
    ends = [derivatives(a), derivatives(b)]
    orders = min(map(len, ends))
    n = 2 * orders - 1
    rows, size = [], 0.0
    for known, step in zip(ends, (h, -h), strict=True):
        terms = [known[0]]
        if orders > 1:
            terms.append(step * known[1] / n)
        if orders > 2:
            terms.append(step * step * known[2] / (n * (n - 1)))
        rows.append([terms[0]])
        if orders > 1:
            rows[-1].append(terms[0] + terms[1])
        if orders > 2:
            rows[-1].append(terms[0] + 2.0 * terms[1] + terms[2])
        size = max(size, 2.0 * float(sum(np.linalg.norm(term) for term in terms)))
    return np.array([*rows[0], *reversed(rows[1])]), size


def _positions(knot: _Knot) -> list[np.ndarray]:
    """Return position, velocity and acceleration, as many as are known."""
    known = [knot.position]
    if knot.velocity is not None:
        known.append(knot.velocity[:3])
        if knot.acceleration is not None:
            known.append(knot.acceleration[:3])
    return known


def _quaternions(knot: _Knot) -> list[np.ndarray]:
    """Return q, q' = 1/2 omega q and q'' = 1/2 alpha q - 1/4 |omega|^2 q, as many as are known."""
    known = [knot.quaternion]
    if knot.velocity is not None:
        omega = knot.velocity[3:]
        known.append(0.5 * multiplied(np.append(omega, 0.0), knot.quaternion))
        if knot.acceleration is not None:
            alpha = np.append(knot.acceleration[3:], 0.0)
            known.append(
                0.5 * multiplied(alpha, knot.quaternion)
                - 0.25 * float(omega @ omega) * knot.quaternion
            )
    return known


def _same_side(a: _Knot, b: _Knot, h: float) -> _Knot:
    """
    Return the second knot with the sign of its quaternion nearer to the first's.

    Half a turn apart neither is: the side is then the one that both ends turn to, where q' b at
    the first and -q' a at the second, times h, add up to more; an even turn by pi makes that pi.
    """
    near = float(a.quaternion @ b.quaternion)
    if abs(near) <= 0.5 * HALF_TURN_BAND:
        near = h * float(_quaternions(a)[1] @ b.quaternion - a.quaternion @ _quaternions(b)[1])
        if not abs(near) > HALF_TURN_BAND:
            raise _HalfTurn
    return b if near >= 0.0 else b._replace(quaternion=-b.quaternion)


def _short_turn(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, float]:
    """Return axis and angle of the turn from one unit quaternion to another, the short way."""
    conjugate = a * [-1.0, -1.0, -1.0, 1.0]
    turn = multiplied(b, conjugate)
    if turn[3] < 0.0:
        turn = -turn
    sine = float(np.linalg.norm(turn[:3]))
    angle = 2.0 * float(np.arctan2(sine, turn[3]))
    if angle > np.pi - HALF_TURN_BAND:
        raise _HalfTurn
    axis = turn[:3] / sine if sine > 0.0 else np.array([0.0, 0.0, 1.0])
    return axis, angle
