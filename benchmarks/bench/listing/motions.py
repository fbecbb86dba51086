"""
Rational motions of degree 8: a quartic curve of quaternions turns, a curve of degree 8 shifts.

With q(s) of degree 4 the matrix |q|^2 R(q) and the weight |q|^2 have degree 8; the control points
of the translation are free. Motions of one experiment differ by a constant translation.
"""

import numpy as np

from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.free_motion.quaternion_curve import rotation_over


def turned(quaternions: np.ndarray, path: np.ndarray) -> RationalMotion:
    """
    Return the motion of a quartic quaternion curve.

    :param quaternions: (5, 4) control points x, y, z, w.
    :param path: (9, 3) control points of the translation.
    """
    rows, weights = rotation_over(quaternions)
    control = np.empty((9, 3, 4))
    control[:, :, :3] = np.moveaxis(np.array(rows) / weights, -1, 0)
    control[:, :, 3] = path
    return RationalMotion(control, weights)


def octagon_motion(shift: tuple[float, float, float]) -> RationalMotion:
    """Return a slide along the fixed octagon with a wobble, as near as the translation puts it."""
    k, j = np.arange(5) - 2.0, np.arange(9) - 4.0
    quaternions = np.stack([0.1 * k, 0.1 - 0.05 * k**2, 0.3 * k, np.ones(5)], axis=1)
    path = np.stack([0.25 * j, 0.1 * j, 0.02 * j**2], axis=1)
    return turned(quaternions, path + shift)


def square_motion(height: float) -> RationalMotion:
    """
    Return a turn of 34 degrees about the vertical, tilted by 0.6 rad, while a corner comes down.

    :param height: of the corner above the fixed square at its lowest.
    """
    turn = 0.6 * (np.arange(5) / 4.0 - 0.5)
    tilt = np.full(5, np.sin(0.3) * np.sqrt(0.5))
    quaternions = np.stack([tilt, -tilt, np.sin(turn), np.cos(0.3) * np.cos(turn)], axis=1)
    j = np.arange(9) - 4.0
    rise = (j / 8.0) ** 2 + height - LOWEST
    path = np.stack([0.05 + 0.12 * j, 0.05 + 0.06 * j, rise], axis=1)
    return turned(quaternions, path)


# Of the corners of the unit square under the motion before it is lifted.
LOWEST = -0.37151
