"""A pose as people write it: x, y, z and roll, pitch, yaw."""

from collections.abc import Sequence
import math

import numpy as np


def pose_matrix(xyz: Sequence[float], rpy: Sequence[float]) -> np.ndarray:
    """
    Return a pose as a matrix; every entry of the rotation is within 16 * 2^-53 of the exact one.

    :param xyz: translation [m].
    :param rpy: roll, pitch, yaw about the fixed axes x, y, z in turn, as in URDF [rad].
    :returns: (4, 4).
    """
    (cr, cp, cy), (sr, sp, sy) = (tuple(map(f, rpy)) for f in (math.cos, math.sin))
    T = np.eye(4)
    T[:3, :3] = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    T[:3, 3] = xyz
    return T
