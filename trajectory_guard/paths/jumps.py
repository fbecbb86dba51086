"""Where a path's segments do not join (trusted)."""

import math

import numpy as np

from trajectory_guard.kernels.layout import Floating, Path, SHIFT_ERROR, TURN_ERROR

# The norms below are a few roundings off.
ROUNDED = 1.0 + 2.0**-40


def jumps(path: Path) -> np.ndarray:
    """
    Return the segments that do not begin where the one before ends.

    Both poses of a knot are known up to the errors of their segments. Let every joint, and every
    image of a point under the floating one, be apart by no more than both errors together. On the
    straight way from one pose to the other nothing then leaves the one tube before it is in the
    other, and what holds in both tubes holds on the way: the segments join.

    Sums of coefficients are rounded once, so a difference is too small by a factor at most.

    :param path: the motion of a request.
    :returns: (k,) int64, rising; 0 is none of them.
    """
    c = path.coefficients
    ends = c[:-1].reshape(-1, c.shape[2]).tolist()
    starts = c[1:, :, 0].ravel().tolist()
    apart = np.array([abs(math.fsum((*a, -b))) for a, b in zip(ends, starts, strict=True)])
    allowed = path.rounding[:-1] + path.rounding[1:]
    joined = (apart.reshape(allowed.shape) * ROUNDED <= allowed).all(axis=1)
    if path.floating is not None:
        joined &= _joined(path.floating)
    return np.flatnonzero(~joined) + 1


def _joined(curves: Floating) -> np.ndarray:
    """Tell of each inner knot whether the curves meet there; they end in their control points."""
    knots = curves.first[1:-1]
    off = (curves.control[knots] - curves.control[knots - 1]).reshape(-1, 4, 4)
    turn = np.sqrt(np.square(off[:, :3]).sum(axis=(1, 2))) * ROUNDED
    shift = np.sqrt(np.square(off[:, 3]).sum(axis=1)) * ROUNDED
    allowed = curves.bounds[:-1] + curves.bounds[1:]
    joined: np.ndarray = (turn <= allowed[:, TURN_ERROR]) & (shift <= allowed[:, SHIFT_ERROR])
    return joined
