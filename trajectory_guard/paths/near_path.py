"""How far a joint position is off a trajectory's path during a span of time."""

from itertools import pairwise
from math import comb

import numpy as np

from trajectory_guard.paths.hermite import hermite, Knots
from trajectory_guard.paths.trajectory import Trajectory

# Shifting a polynomial of degree 5 by m in [0, 1] sums at most 6 terms with weights up to 10, the
# powers of m and of the half width each rounded a few times: below 2^-40 of all the magnitudes.
_ROUNDING = 2.0**-40


def farthest(trajectory: Trajectory, q: np.ndarray, window_ns: tuple[int, int]) -> np.ndarray:
    """
    Bound the largest distance of a position from the path over a window of time.

    In each segment that the window touches the polynomial is written about the middle of what it
    touches: q(m + x) = sum_k c_k x^k with |x| <= r, so |q - q(m + x)| <= |q - c_0| + sum c_k r^k.

    :param trajectory: P points; before the first and after the last it stands still.
    :param q: (J,) position, in the trajectory's order [rad or m].
    :param window_ns: first and last instant, of the trajectory's time [ns].
    :returns: (J,) upper bounds [rad or m]; inf or NaN where numbers overflow.
    """
    times_ns = trajectory.times_ns.tolist()
    low, high = (min(max(t, times_ns[0]), times_ns[-1]) for t in window_ns)
    if len(times_ns) == 1:
        return np.abs(trajectory.positions[0] - q)
    with np.errstate(all='ignore'):
        coefficients, error = hermite(_knots(trajectory))
        bounds = [
            _in_segment(coefficients[i], error[i], q, (low - a) / (b - a), (high - a) / (b - a))
            for i, (a, b) in enumerate(pairwise(times_ns))
            if a <= high and b >= low
        ]
    largest: np.ndarray = np.max(bounds, axis=0)
    return largest


def _in_segment(
    c: np.ndarray, error: np.ndarray, q: np.ndarray, low: float, high: float
) -> np.ndarray:
    """Bound |q - polynomial| for s in [low, high], cut to [0, 1]; c: (J, 6), error: (J,)."""
    low, high = max(low, 0.0), min(high, 1.0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    shifted = [
        sum(comb(i, k) * middle ** (i - k) * c[:, i] for i in range(k, 6)) for k in range(6)
    ]
    spread = sum(np.abs(shifted[k]) * half**k for k in range(1, 6))
    rounding = _ROUNDING * (np.abs(q) + np.abs(c).sum(axis=1))
    bound: np.ndarray = np.abs(q - shifted[0]) + spread + error + rounding
    return bound


def _knots(trajectory: Trajectory) -> Knots:
    return Knots(
        times_ns=trajectory.times_ns,
        positions=trajectory.positions,
        velocities=trajectory.velocities,
        has_velocities=trajectory.has_velocities,
        accelerations=trajectory.accelerations,
        has_accelerations=trajectory.has_accelerations,
        start_error=np.zeros(len(trajectory.joint_names)),
    )
