"""A motion as the ball cover takes it: any object with control points and weights."""

from typing import Protocol

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.kernels.ball import Curve
from trajectory_guard.shapes.body import LARGEST_COORDINATE

# Weights within a factor of this lose nothing to underflow when they are halved and divided.
LARGEST_RATIO = 2.0**200


class Motion(Protocol):
    """
    A rational Bezier curve in the space of affine displacements.

    Attributes ``error`` and ``inflation`` [m], where a motion has them, bound the distance of
    every true image of a point from the curve's; ``turn_error`` [m/m] what is added per distance
    of the point from the origin of the moving frame.
    """

    @property
    def control_points(self) -> np.ndarray:
        """Displacements, rows of [C | t], (K, 3, 4) [-, m]."""

    @property
    def weights(self) -> np.ndarray:
        """Positive Bernstein weights, (K,)."""


def curve_of(motion: Motion) -> Curve:
    """
    Return a motion's curve, checked; the largest weight is scaled to [1, 2), which is exact.

    :param motion: K >= 1 control points.
    :raises RequestError: control_points or weights have another shape, are not finite, too large,
        or not positive.
    """
    points = np.array(motion.control_points, dtype=np.float64, order='C')
    weights = np.array(motion.weights, dtype=np.float64)
    if points.ndim != 3 or points.shape[1:] != (3, 4) or not len(points):
        raise _invalid(f'control_points must have shape (K, 3, 4), K >= 1, got {points.shape}')
    if weights.shape != points.shape[:1]:
        raise _invalid(f'weights must have shape ({len(points)},), got {weights.shape}')
    # Written so that a NaN fails.
    wrong = ~(np.abs(points) <= LARGEST_COORDINATE)
    if wrong.any():
        place = np.unravel_index(wrong.argmax(), wrong.shape)
        raise _invalid(f'control_points{list(map(int, place))} is {points[place]}')
    wrong = ~((weights > 0.0) & (weights < np.inf))
    if wrong.any():
        i = int(wrong.argmax())
        raise _invalid(f'weights[{i}] must be positive and finite, is {weights[i]}')
    scaled = np.ldexp(weights, 1 - int(np.frexp(weights.max())[1]))
    if not scaled.min() * LARGEST_RATIO >= 1.0:
        raise _invalid(f'weights must be within a factor of 2^200, are {weights.tolist()}')
    return Curve(points.reshape(-1, 12), scaled)


def errors_of(motion: Motion) -> tuple[float, float]:
    """
    Return the bounds that a motion carries: shift [m] and turn [m/m].

    :raises RequestError: one is negative or not finite.
    """
    names = ('error', 'inflation', 'turn_error')
    values = [float(getattr(motion, name, 0.0)) for name in names]
    for name, value in zip(names, values, strict=True):
        if not 0.0 <= value < np.inf:
            raise _invalid(f'{name} must be finite and >= 0, got {value}')
    # Up, because the sum of two doubles is rounded.
    return float(np.nextafter(values[0] + values[1], np.inf)), values[2]


def _invalid(message: str) -> RequestError:
    return RequestError(Reason.INVALID_PARAMETER, message)
