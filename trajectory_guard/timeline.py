"""Leaves of the cover to intervals in nanoseconds that partition [0, T]."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
import math

import numpy as np

from trajectory_guard.errors import Reason
from trajectory_guard.kernels import leaf as leaves
from trajectory_guard.result import Interval, Status

_STATUS = {
    leaves.FREE: Status.FREE,
    leaves.SUSPECT: Status.SUSPECT,
    leaves.COLLISION: Status.COLLISION,
}
_REASON = {
    leaves.BY_TOLERANCE: Reason.TOLERANCE,
    leaves.BY_DEPTH: Reason.DEPTH,
    leaves.BY_BUDGET: Reason.BUDGET,
    leaves.BY_STOP: Reason.DEADLINE,
}


@dataclass(frozen=True, slots=True)
class Instant:
    """
    An exact time: (knot_ns << level) + duration_ns * numerator, over 2^level.

    :param knot_ns: start of the segment [ns].
    :param duration_ns: length of the segment [ns].
    :param numerator: dyadic numerator within the segment.
    :param level: its power of two.
    """

    knot_ns: int
    duration_ns: int
    numerator: int
    level: int

    @property
    def floor_ns(self) -> int:
        """The largest integer not after the instant [ns]."""
        return self.knot_ns + ((self.duration_ns * self.numerator) >> self.level)

    @property
    def ceil_ns(self) -> int:
        """The smallest integer not before the instant [ns]."""
        return self.knot_ns - ((-self.duration_ns * self.numerator) >> self.level)


def intervals(
    knots_ns: np.ndarray,
    ints: np.ndarray,
    floats: np.ndarray,
    link_names: Sequence[str],
    obstacle_names: Sequence[str],
    unknown_until_ns: int = 0,
) -> tuple[Interval, ...]:
    """
    Merge leaves of equal status and round their ends into what is proved.

    A free interval may shrink by rounding, never grow; so may a collision where it meets a suspect
    interval.  The ends of neighbours stay equal.

    :param knots_ns: (S + 1,) segment ends [ns].
    :param ints: (L, 9) leaves in time order, see ``kernels.leaf``.
    :param floats: (L, 7) their gap bounds and places.
    :param link_names: name of the link of each packed body.
    :param obstacle_names: name of each packed obstacle.
    :param unknown_until_ns: end of the leading span without a start state [ns].
    """
    rows: list[Interval] = []
    if unknown_until_ns > 0:
        rows.append(
            Interval(0, unknown_until_ns, Status.SUSPECT, Reason.START_STATE_UNKNOWN.value)
        )
    ints, floats = _with_witnesses(ints, floats)
    cuts = (
        np.flatnonzero(
            (np.diff(ints[:, leaves.STATUS]) != 0) | (np.diff(ints[:, leaves.REASON]) != 0)
        )
        + 1
    )
    firsts = [0, *cuts.tolist()]
    lasts = [*cuts.tolist(), len(ints)]
    start_ns = int(knots_ns[0])
    for g, (first, last) in enumerate(zip(firsts, lasts, strict=True)):
        row = _merged(knots_ns, ints[first:last], floats[first:last], link_names, obstacle_names)
        if g + 1 < len(firsts):
            end_ns = _boundary(
                row.status,
                _STATUS[int(ints[last, leaves.STATUS])],
                _instant(knots_ns, ints[last], leaves.START),
            )
        else:
            end_ns = int(knots_ns[-1])
        end_ns = max(end_ns, start_ns)
        if end_ns > start_ns or (len(firsts) == 1 and (not rows or row.status != Status.FREE)):
            at_ns = None if row.at_ns is None else min(max(row.at_ns, start_ns), end_ns)
            rows.append(replace(row, start_ns=start_ns, end_ns=end_ns, at_ns=at_ns))
        start_ns = end_ns
    return tuple(rows)


def _with_witnesses(ints: np.ndarray, floats: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """
    Cut the proved collision out of runs of suspect leaves that contain no other.

    A graze shallower than the tolerance is settled before any whole piece of it is proved to
    collide, but the middle of a leaf may be; the widest such middle stands for the run.
    """
    changes = np.flatnonzero(np.diff(ints[:, leaves.STATUS] == leaves.FREE)) + 1
    bounds = [0, *changes.tolist(), len(ints)]
    pieces_i, pieces_f, done = [], [], 0
    for first, last in pairwise(bounds):
        run = ints[first:last]
        known = np.flatnonzero(run[:, leaves.WITNESS])
        if not len(known) or (run[:, leaves.STATUS] == leaves.COLLISION).any():
            continue
        finest = run[known, leaves.LEVEL] + run[known, leaves.WITNESS]
        row = first + int(known[finest.argmin()])
        w = int(ints[row, leaves.WITNESS])
        cut = np.repeat(ints[row : row + 1], 3, axis=0)
        start = int(ints[row, leaves.START]) << (w + 1)
        middle = start + (1 << w)
        cut[:, leaves.START] = start, middle - 1, middle + 1
        cut[:, leaves.END] = middle - 1, middle + 1, int(ints[row, leaves.END]) << (w + 1)
        cut[:, leaves.LEVEL] += w + 1
        cut[1, leaves.STATUS] = leaves.COLLISION
        pieces_i += [ints[done:row], cut]
        pieces_f += [floats[done:row], np.repeat(floats[row : row + 1], 3, axis=0)]
        done = row + 1
    if not pieces_i:
        return ints, floats
    return np.concatenate([*pieces_i, ints[done:]]), np.concatenate([*pieces_f, floats[done:]])


def _instant(knots_ns: np.ndarray, leaf: np.ndarray, column: int) -> Instant:
    """Return an end of a leaf."""
    segment = int(leaf[leaves.SEGMENT])
    knot = int(knots_ns[segment])
    return Instant(
        knot, int(knots_ns[segment + 1]) - knot, int(leaf[column]), int(leaf[leaves.LEVEL])
    )


def _boundary(left: Status, right: Status, instant: Instant) -> int:
    """Return the common end of two intervals [ns]: free shrinks, then collision."""
    if left == Status.FREE:
        return instant.floor_ns
    if right == Status.FREE or left == Status.SUSPECT:
        return instant.ceil_ns
    return instant.floor_ns


def _merged(
    knots_ns: np.ndarray,
    ints: np.ndarray,
    floats: np.ndarray,
    link_names: Sequence[str],
    obstacle_names: Sequence[str],
) -> Interval:
    """Return an interval, ends still open, with the pair of the smallest gap among the leaves."""
    status = _STATUS[int(ints[0, leaves.STATUS])]
    if status == Status.FREE:
        return Interval(0, 0, status)
    reason = '' if status == Status.COLLISION else _REASON[int(ints[0, leaves.REASON])].value
    named = np.flatnonzero(ints[:, leaves.BODY] >= 0)
    if not len(named):
        return Interval(0, 0, status, reason)
    worst = int(named[floats[named, leaves.UPPER].argmin()])
    leaf = ints[worst]
    middle = Instant(
        *_segment(knots_ns, leaf),
        int(leaf[leaves.START]) + int(leaf[leaves.END]),
        int(leaf[leaves.LEVEL]) + 1,
    )
    x, y, z = floats[worst, leaves.X : leaves.Z + 1].tolist()
    return Interval(
        0,
        0,
        status,
        reason,
        body=link_names[int(leaf[leaves.BODY])],
        obstacle=obstacle_names[int(leaf[leaves.OBSTACLE])],
        at_ns=middle.floor_ns,
        location=(x, y, z),
        gap_lower=_finite(floats[named, leaves.LOWER].min()),
        gap_upper=_finite(floats[worst, leaves.UPPER]),
    )


def _segment(knots_ns: np.ndarray, leaf: np.ndarray) -> tuple[int, int]:
    """Return start and length of a leaf's segment [ns]."""
    segment = int(leaf[leaves.SEGMENT])
    return int(knots_ns[segment]), int(knots_ns[segment + 1]) - int(knots_ns[segment])


def _finite(value: float) -> float | None:
    """Return a number, or None where nothing is known."""
    return float(value) if math.isfinite(value) else None
