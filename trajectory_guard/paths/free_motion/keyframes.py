"""A motion through given poses at given times."""

from collections.abc import Sequence

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.paths.free_motion.quaternion_curve import rigid_motion
from trajectory_guard.paths.free_path import FreePath

INTERPOLATION = 'keyframes: C2 cubic splines of quaternions and positions, at rest at both ends'


def through_poses(
    name: str, times_ns: Sequence[int], positions: np.ndarray, quaternions: np.ndarray
) -> FreePath:
    """
    Return a rational motion through poses, twice differentiable, at rest at both ends.

    Positions and quaternions, each on the side of the one before, are cubic splines in time; the
    quaternions divided by their lengths make a rational motion of degree 9 per segment. The curve
    is what these splines' rounded coefficients say.

    :param name: the floating joint, or the body.
    :param times_ns: P >= 2 rising times [ns].
    :param positions: (P, 3) [m].
    :param quaternions: (P, 4) (x, y, z, w), of any length but 0; they are made unit ones.
    :raises RequestError: naming what does not fit; if neighbours are so far apart that the curve
        of quaternions comes near zero.
    """
    # scipy is slow to import, and nothing else here needs it.
    from scipy.interpolate import CubicSpline

    times = [int(t) for t in times_ns]
    p, q = np.array(positions, float), np.array(quaternions, float)
    if len(times) < 2 or p.shape != (len(times), 3) or q.shape != (len(times), 4):
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'{len(times)} times need positions (P, 3) and quaternions (P, 4), P >= 2, got '
            f'{p.shape} and {q.shape}',
        )
    for i in range(1, len(times)):
        if times[i] <= times[i - 1]:
            raise RequestError(
                Reason.UNSORTED_TIMES,
                f'times_ns[{i}] is {times[i]}, not after {times[i - 1]}',
            )
    lengths = np.sqrt((q * q).sum(axis=1))
    for field, wrong in (
        ('positions', ~np.isfinite(p).all(axis=1)),
        ('quaternions', ~((lengths > 1e-9) & (lengths < 1e9))),
    ):
        if wrong.any():
            i = int(np.argmax(wrong))
            value = (p if field == 'positions' else q)[i].tolist()
            raise RequestError(Reason.INVALID_PARAMETER, f'{field}[{i}] is {value}')
    q /= lengths[:, None]
    for i in range(1, len(q)):
        if q[i] @ q[i - 1] < 0.0:
            q[i] = -q[i]
    # Seconds from the first pose: differences of nanoseconds are exact integers.
    at = np.array([t - times[0] for t in times]) / 1e9
    spline = CubicSpline(at, np.column_stack((p, q)), bc_type='clamped')
    steps = np.diff(at)
    curves = []
    for i, h in enumerate(steps.tolist()):
        c3, c2, c1, c0 = spline.c[:, i]
        # Bernstein coefficients of c0 + c1 t + c2 t^2 + c3 t^3 on [0, h].
        one, two, three = c1 * h, c2 * h * h, c3 * h**3
        control = np.array(
            [c0, c0 + one / 3.0, c0 + (2.0 * one + two) / 3.0, c0 + one + two + three]
        )
        try:
            curves.append(rigid_motion(control[:, 3:], control[:, :3]))
        except RequestError as error:
            raise RequestError(error.reason, f'from pose {i} to pose {i + 1}: {error}') from error
    return FreePath(
        joint_name=name,
        knots_ns=np.array(times, np.int64),
        motions=tuple(curve.motion for curve in curves),
        turn_error=np.array([curve.turn_error for curve in curves]),
        shift_error=np.array([curve.shift_error for curve in curves]),
        interpolation=INTERPOLATION,
        unknown_until_ns=times[0],
    )
