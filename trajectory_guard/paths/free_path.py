"""A free body's path: rational motions end to end in time, with what they may be off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.motions.motion import RationalMotion


@dataclass(frozen=True, slots=True, eq=False)
class FreePath:
    """
    The motion of a rigid or affine body in time, S rational motions.

    Segment i runs over [knots_ns[i], knots_ns[i + 1]]; there the child frame in its parent frame
    is motions[i] at s = (t - knots_ns[i]) / (knots_ns[i + 1] - knots_ns[i]), and at every instant
    every point x of the child frame is within shift_error[i] + turn_error[i] |x| of where that
    puts it. Segments need not join: both poses at a knot are looked at, and an interval
    that ends there speaks of the one before.

    :param joint_name: the floating joint, or the body.
    :param knots_ns: (S + 1,) int64, strictly increasing [ns]; a pose without motion is one
        segment of degree 0 and may have equal knots.
    :param motions: S motions; their own ``error`` is 0, for it speaks of one body only.
    :param turn_error: (S,) [rad].
    :param shift_error: (S,) [m].
    :param interpolation: the rule that made the curve from its data.
    :param unknown_until_ns: the first knot; before it nothing tells where the body is [ns].
    :raises RequestError: naming the field, for another shape, knots that do not rise, errors that
        are negative or not finite.
    """

    joint_name: str
    knots_ns: np.ndarray
    motions: tuple[RationalMotion, ...]
    turn_error: np.ndarray
    shift_error: np.ndarray
    interpolation: str
    unknown_until_ns: int = 0

    def __post_init__(self) -> None:
        """Validate, and make the arrays read-only."""
        object.__setattr__(self, 'motions', tuple(self.motions))
        segments = len(self.motions)
        if not segments:
            raise RequestError(Reason.INVALID_PARAMETER, 'motions must not be empty')
        for name, shape, dtype in (
            ('knots_ns', (segments + 1,), np.int64),
            ('turn_error', (segments,), np.float64),
            ('shift_error', (segments,), np.float64),
        ):
            given = np.asarray(getattr(self, name))
            if given.shape != shape or not np.can_cast(given.dtype, dtype):
                raise RequestError(
                    Reason.INVALID_PARAMETER,
                    f'{name} must be {np.dtype(dtype)} of shape {shape} for {segments} motions, '
                    f'got {given.dtype} of shape {given.shape}',
                )
            array = np.array(given, dtype)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        self._check_knots()
        for i, motion in enumerate(self.motions):
            if motion.error or motion.inflation:
                raise RequestError(
                    Reason.INVALID_PARAMETER, f'motions[{i}] has an error of its own'
                )
        for name in ('turn_error', 'shift_error'):
            bounds = getattr(self, name)
            wrong = ~((bounds >= 0.0) & np.isfinite(bounds))
            if wrong.any():
                i = int(np.argmax(wrong))
                raise RequestError(
                    Reason.INVALID_PARAMETER,
                    f'{name}[{i}] must be finite and not negative, got {bounds[i]}',
                )

    def _check_knots(self) -> None:
        knots = self.knots_ns
        still = len(self.motions) == 1 and self.motions[0].degree == 0
        rises = knots[1:] >= knots[:-1] if still else knots[1:] > knots[:-1]
        if not rises.all() or knots[0] < 0:
            raise RequestError(Reason.UNSORTED_TIMES, f'knots_ns must rise from 0, got {knots}')
        # Else the time before the first knot would be nobody's.
        if self.unknown_until_ns != int(knots[0]):
            raise RequestError(
                Reason.INVALID_PARAMETER,
                f'unknown_until_ns is {self.unknown_until_ns}, the first knot {knots[0]}',
            )

    @classmethod
    def exact(
        cls, motions: Sequence[RationalMotion], knots_ns: Sequence[int], joint_name: str = 'body'
    ) -> FreePath:
        """
        Return the path that control points themselves define, so nothing is off.

        :param motions: S motions, one a segment.
        :param knots_ns: S + 1 times [ns].
        :param joint_name: the floating joint, or the body.
        """
        zero = np.zeros(len(motions))
        knots = np.array(knots_ns)
        return cls(
            joint_name,
            knots,
            tuple(motions),
            zero,
            zero,
            'control points',
            unknown_until_ns=int(knots[0]),
        )

    @property
    def duration_ns(self) -> int:
        """Time of the last knot [ns]."""
        return int(self.knots_ns[-1])

    def pose(self, time_ns: int) -> np.ndarray:
        """
        Evaluate the path, to rounding.

        :param time_ns: from knots_ns[0] to the end [ns].
        :returns: (3, 4) pose of the child frame in the parent frame.
        :raises RequestError: outside that range.
        """
        knots = self.knots_ns
        if not knots[0] <= time_ns <= knots[-1]:
            raise RequestError(
                Reason.INVALID_PARAMETER,
                f'the path is known from {knots[0]} to {knots[-1]} ns, not at {time_ns} ns',
            )
        i = min(int(np.searchsorted(knots, time_ns, side='right')), len(knots) - 1) - 1
        h = int(knots[i + 1]) - int(knots[i])
        return self.motions[i].pose((int(time_ns) - int(knots[i])) / h if h else 0.0)
