"""Leaves of the cover to intervals in nanoseconds that partition [0, T]."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
import math

import numpy as np

from trajectory_guard.errors import Reason
from trajectory_guard.kernels import layout
from trajectory_guard.result import Interval, Status

_REASON = {
    layout.BY_TOLERANCE: Reason.TOLERANCE,
    layout.BY_DEPTH: Reason.DEPTH,
    layout.BY_BUDGET: Reason.BUDGET,
    layout.BY_STOP: Reason.DEADLINE,
    layout.BY_SCOPE: Reason.NOT_EXAMINED,
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
    leaves: np.ndarray,
    link_names: Sequence[str],
    obstacle_names: Sequence[str],
    unknown_until_ns: int = 0,
) -> tuple[Interval, ...]:
    """
    Merge leaves of equal status and round their ends into what is proved.

    A free interval may shrink by rounding, never grow; so may a collision where it meets a suspect
    interval.  The ends of neighbours stay equal.  Where the leaves end before the path does, the
    rest was not examined.

    :param knots_ns: (S + 1,) segment ends [ns].
    :param leaves: (L,) LEAF in time order, see ``kernels.layout``.
    :param link_names: name of the link of each packed body.
    :param obstacle_names: name of each packed obstacle.
    :param unknown_until_ns: end of the leading span without a start state [ns].
    """
    rows: list[Interval] = []
    if unknown_until_ns > 0:
        rows.append(
            Interval(0, unknown_until_ns, Status.SUSPECT, Reason.START_STATE_UNKNOWN.value)
        )
    start_ns, last_ns = int(knots_ns[0]), int(knots_ns[-1])
    groups = _groups(leaves)
    open_end = not _is_whole(leaves, len(knots_ns) - 1)
    for g, group in enumerate(groups):
        status = Status(int(group[0]['status']))
        if g + 1 < len(groups):
            after = groups[g + 1][0]
            following = Status(int(after['status']))
            end_ns = _boundary(status, following, _instant(knots_ns, after, 'start'))
        elif open_end:
            end_ns = _boundary(status, Status.SUSPECT, _instant(knots_ns, group[-1], 'end'))
        else:
            end_ns = last_ns
        end_ns = max(end_ns, start_ns)
        alone = len(groups) == 1 and not open_end and (not rows or status != Status.FREE)
        if end_ns > start_ns or alone:
            rows.append(
                _merged(knots_ns, group, status, start_ns, end_ns, link_names, obstacle_names)
            )
        start_ns = end_ns
    if open_end:
        rows.append(Interval(start_ns, last_ns, Status.SUSPECT, Reason.NOT_EXAMINED.value))
    return tuple(rows)


def _groups(leaves: np.ndarray) -> list[np.ndarray]:
    """Return runs of leaves with one status and one reason."""
    status, reason = leaves['status'], leaves['reason']
    if len(leaves) and (status == layout.FREE).all():
        return [leaves]
    cuts = np.flatnonzero((status[1:] != status[:-1]) | (reason[1:] != reason[:-1])) + 1
    bounds = [0, *cuts.tolist(), len(leaves)]
    return [leaves[a:b] for a, b in pairwise(bounds) if b > a]


def _is_whole(leaves: np.ndarray, segments: int) -> bool:
    """Say whether the leaves reach to the end of the path."""
    if not len(leaves):
        return False
    last = leaves[-1]
    return bool(last['segment'] == segments - 1 and last['end'] == 1 << int(last['level']))


def with_witnesses(leaves: np.ndarray) -> np.ndarray:
    """
    Cut the proved collision out of runs of suspect leaves that contain no other.

    A graze shallower than the tolerance is settled before any whole piece of it is proved to
    collide, but the middle of a leaf may be; the widest such middle stands for the run.

    :param leaves: (L,) LEAF in time order.
    """
    if not leaves['witness'].any():
        return leaves
    changes = np.flatnonzero(np.diff(leaves['status'] == layout.FREE)) + 1
    pieces, done = [], 0
    for first, last in pairwise([0, *changes.tolist(), len(leaves)]):
        run = leaves[first:last]
        known = np.flatnonzero(run['witness'])
        if not len(known) or (run['status'] == layout.COLLISION).any():
            continue
        finest = run['level'][known] + run['witness'][known]
        row = first + int(known[finest.argmin()])
        w = int(leaves['witness'][row])
        cut = np.repeat(leaves[row : row + 1], 3)
        start = int(leaves['start'][row]) << (w + 1)
        middle = start + (1 << w)
        cut['start'] = start, middle - 1, middle + 1
        cut['end'] = middle - 1, middle + 1, int(leaves['end'][row]) << (w + 1)
        cut['level'] += w + 1
        cut['status'][1] = layout.COLLISION
        pieces += [leaves[done:row], cut]
        done = row + 1
    return np.concatenate([*pieces, leaves[done:]]) if pieces else leaves


def _instant(knots_ns: np.ndarray, leaf: np.void, end: str) -> Instant:
    """Return an end of a leaf."""
    segment = int(leaf['segment'])
    knot = int(knots_ns[segment])
    return Instant(knot, int(knots_ns[segment + 1]) - knot, int(leaf[end]), int(leaf['level']))


def _boundary(left: Status, right: Status, instant: Instant) -> int:
    """Return the common end of two intervals [ns]: free shrinks, then collision."""
    if left == Status.FREE:
        return instant.floor_ns
    if right == Status.FREE or left == Status.SUSPECT:
        return instant.ceil_ns
    return instant.floor_ns


def _merged(
    knots_ns: np.ndarray,
    leaves: np.ndarray,
    status: Status,
    start_ns: int,
    end_ns: int,
    link_names: Sequence[str],
    obstacle_names: Sequence[str],
) -> Interval:
    """Return an interval with the pair of the smallest gap among its leaves."""
    if status == Status.FREE:
        return Interval(start_ns, end_ns, status)
    reason = '' if status == Status.COLLISION else _REASON[int(leaves[0]['reason'])].value
    named = leaves[leaves['body'] >= 0]
    if not len(named):
        return Interval(start_ns, end_ns, status, reason)
    leaf = named[int(named['upper'].argmin())]
    segment = int(leaf['segment'])
    knot = int(knots_ns[segment])
    middle = Instant(
        knot,
        int(knots_ns[segment + 1]) - knot,
        int(leaf['start']) + int(leaf['end']),
        int(leaf['level']) + 1,
    )
    x, y, z = leaf['place'].tolist()
    return Interval(
        start_ns,
        end_ns,
        status,
        reason,
        body=link_names[int(leaf['body'])],
        obstacle=obstacle_names[int(leaf['obstacle'])],
        at_ns=min(max(middle.floor_ns, start_ns), end_ns),
        location=(x, y, z),
        gap_lower=_finite(named['lower'].min()),
        gap_upper=_finite(leaf['upper']),
    )


def _finite(value: float) -> float | None:
    """Return a number, or None where nothing is known."""
    return float(value) if math.isfinite(value) else None
