"""
Paths of a rigid body through the space of positions and quaternions.

A configuration (x, Q) first rotates a body about the origin of its frame by Q = (q0, q), scalar
first, then displaces it by x [Canny 1984, sec. 2]. With

    Rot(y, Q) = (q0^2 - q.q) y + 2 (q.y) q + 2 q0 q x y = |Q|^2 R y                          (5)

Q need not be a unit: R is the rotation by 2 atan2(|q|, q0) about q for every multiple of Q but 0.
Dividing by q0 puts Q into the hyperplane q0 = 1 (sec. 3), where q = tan(angle / 2) axis. That
leaves out rotations by exactly 180 degrees; a motion here may use any curve Q(s) that avoids 0,
so also a line in another hyperplane, which is q0 = 1 seen from a rotated ("recentred") frame.
"""

from dataclasses import dataclass
import math
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike

from trajectory_guard.canny.integers import exponent, scaled
from trajectory_guard.canny.polynomial import dot_product, from_bernstein
from trajectory_guard.canny.root import isolate
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.shapes.body import LARGEST_COORDINATE, read_only

# Quaternions are taken in this range so that no product of them overflows or vanishes in doubles.
SMALLEST_QUATERNION = 2.0**-40
LARGEST_QUATERNION = 2.0**40

# A path of a higher degree is refused, so that binomials are exact in doubles.
LARGEST_DEGREE = 8


@dataclass(frozen=True, slots=True, eq=False)
class Configuration:
    """
    Where a body is.

    :param position: x, (3,) [m].
    :param quaternion: Q, scalar first, (4,); of any length but 0.
    """

    position: ArrayLike = (0.0, 0.0, 0.0)
    quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """
    A polynomial path x(s), Q(s), s in [0, 1], given by Bernstein coefficients taken as exact.

    :param positions: (n + 1, 3) coefficients of x [m].
    :param quaternions: (m + 1, 4) coefficients of Q, scalar first.
    :raises RequestError: a shape, a size or a degree is wrong, or Q(s) vanishes somewhere.
    """

    positions: np.ndarray
    quaternions: np.ndarray

    def __post_init__(self) -> None:
        """Check the values."""
        for name, width, largest in (
            ('positions', 3, LARGEST_COORDINATE),
            ('quaternions', 4, LARGEST_QUATERNION),
        ):
            array = read_only(getattr(self, name))
            object.__setattr__(self, name, array)
            if array.ndim != 2 or array.shape[1] != width or not len(array):
                _refuse(name, f'shape {array.shape} is not (n, {width})')
            if not np.abs(array).max() <= largest:
                _refuse(name, f'one exceeds {largest:g} or is not finite')
            if len(array) > LARGEST_DEGREE + 1:
                _refuse(name, f'degree {len(array) - 1} exceeds {LARGEST_DEGREE}')
        if not np.abs(self.quaternions).max() >= SMALLEST_QUATERNION:
            _refuse('quaternions', f'all are below {SMALLEST_QUATERNION:g}')
        k = exponent(self.quaternions)
        Q = [from_bernstein(column) for column in zip(*scaled(self.quaternions, k), strict=True)]
        square = dot_product(Q, Q)
        if square(0) == 0 or square(1) == 0 or isolate(square):
            _refuse('quaternions', 'Q(s) vanishes on the path, which is no rotation')

    def pose(self, s: float) -> np.ndarray:
        """
        Return the pose at s, to rounding.

        :param s: place on the path, [0, 1].
        :returns: (3, 4) rows of [R | x].
        """
        x, Q = (_evaluate(c, s) for c in (self.positions, self.quaternions))
        return np.column_stack((rotation(Q), x))


def rotation(quaternion: np.ndarray) -> np.ndarray:
    """
    Return the rotation matrix of a quaternion of any length but 0, to rounding.

    :param quaternion: scalar first, (4,).
    """
    # Between ends of opposite signs a curve may come so near to 0 that squares underflow.
    near_unit = quaternion / np.abs(quaternion).max()
    w, x, y, z = near_unit / np.linalg.norm(near_unit)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def still(configuration: Configuration | None = None) -> Motion:
    """Return the motion of a body that stands, at the origin by default."""
    where = configuration or Configuration()
    return Motion(np.atleast_2d(where.position), np.atleast_2d(where.quaternion))


def straight(start: Configuration, end: Configuration) -> Motion:
    """
    Return a straight line in (x, q) with q0 = 1 [Canny 1984, sec. 5].

    The body translates uniformly and turns almost so. The rounding of q / q0 makes another motion,
    which is then taken as exact.

    :raises RequestError: an end is turned by 180 degrees, a point at infinity of q0 = 1; see
        :func:`recentred`.
    """
    quaternions = []
    for where in (start, end):
        Q = np.asarray(where.quaternion, dtype=np.float64)
        with np.errstate(all='ignore'):
            Q = Q / Q[0]
        if not np.abs(Q).max() <= LARGEST_QUATERNION:
            _refuse(
                'quaternions', f'{where.quaternion} has no image in q0 = 1 (turned by 180 deg)'
            )
        quaternions.append(Q)
    return Motion(np.array([start.position, end.position]), np.array(quaternions))


def recentred(start: Configuration, end: Configuration) -> Motion:
    """
    Return the line in the hyperplane q0 = 1 of a frame that is turned half way between the ends.

    There Q and -Q are chosen less than 180 degrees apart, and the ends have equal q0, so the line
    is the one between the unit quaternions themselves.

    :raises RequestError: the ends are 180 degrees apart, so that there is no shorter way.
    """
    a, b = (
        np.asarray(where.quaternion, dtype=np.float64) / np.linalg.norm(where.quaternion)
        for where in (start, end)
    )
    if not abs(a @ b) > SMALLEST_QUATERNION:
        _refuse('quaternions', 'the ends are 180 degrees apart: give a configuration between')
    return Motion(
        np.array([start.position, end.position]), np.array([a, math.copysign(1.0, a @ b) * b])
    )


def _evaluate(coefficients: np.ndarray, s: float) -> np.ndarray:
    while len(coefficients) > 1:
        coefficients = (1.0 - s) * coefficients[:-1] + s * coefficients[1:]
    return coefficients[0]


def _refuse(name: str, what: str) -> NoReturn:
    raise RequestError(Reason.INVALID_PARAMETER, f'motion.{name}: {what}')
