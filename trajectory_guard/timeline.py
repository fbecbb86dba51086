"""Leaves of the cover to intervals in nanoseconds that partition [0, T]."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
import math
from typing import NamedTuple

import numpy as np

from trajectory_guard.errors import Reason
from trajectory_guard.kernels import layout
from trajectory_guard.result import Interval, Status

_STATUS = {int(status): status for status in Status}
_REASON = {
    layout.BY_TOLERANCE: Reason.TOLERANCE,
    layout.BY_DEPTH: Reason.DEPTH,
    layout.BY_BUDGET: Reason.BUDGET,
    layout.BY_STOP: Reason.DEADLINE,
    layout.BY_SCOPE: Reason.NOT_EXAMINED,
    layout.BY_HULL: Reason.NOT_EXAMINED,
    layout.BY_ENCLOSURE: Reason.ENCLOSURE,
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
    knots = knots_ns.tolist()
    table = _Table(*(leaves[name].tolist() for name in _Table._fields))
    start_ns, last_ns = knots[0], knots[-1]
    bounds = _bounds(table)
    open_end = not _is_whole(table, len(knots) - 1)
    for first, last in pairwise(bounds):
        status = _STATUS[table.status[first]]
        if last < len(leaves):
            following = _STATUS[table.status[last]]
            end_ns = _boundary(status, following, _instant(knots, table, last, table.start))
        elif open_end:
            end = _instant(knots, table, last - 1, table.end)
            end_ns = _boundary(status, Status.SUSPECT, end)
        else:
            end_ns = last_ns
        end_ns = max(end_ns, start_ns)
        alone = len(bounds) == 2 and not open_end and (not rows or status is not Status.FREE)
        if end_ns > start_ns or alone:
            if status is Status.FREE:
                rows.append(Interval(start_ns, end_ns, status))
            else:
                worst = _worst(table, first, last)
                place = leaves['place'][worst].tolist()
                rows.append(
                    _merged(
                        knots,
                        table,
                        (first, last, worst),
                        (start_ns, end_ns),
                        place,
                        link_names,
                        obstacle_names,
                    )
                )
        start_ns = end_ns
    if open_end:
        rows.append(Interval(start_ns, last_ns, Status.SUSPECT, Reason.NOT_EXAMINED.value))
    return tuple(rows)


class _Table(NamedTuple):
    """The columns of the leaves that make intervals, as plain numbers."""

    segment: list[int]
    start: list[int]
    end: list[int]
    level: list[int]
    status: list[int]
    reason: list[int]
    body: list[int]
    obstacle: list[int]
    lower: list[float]
    upper: list[float]


def _bounds(table: _Table) -> list[int]:
    """Return where runs of leaves with one status and one reason begin, and the end."""
    kinds = list(zip(table.status, table.reason, strict=True))
    cuts = [i for i in range(1, len(kinds)) if kinds[i] != kinds[i - 1]]
    return [0, *cuts, len(kinds)] if kinds else []


def _is_whole(table: _Table, segments: int) -> bool:
    """Say whether the leaves reach to the end of the path."""
    return bool(
        table.segment
        and table.segment[-1] == segments - 1
        and table.end[-1] == 1 << table.level[-1]
    )


def with_witnesses(leaves: np.ndarray) -> np.ndarray:
    """
    Cut the proved collision out of runs of suspect leaves that contain no other.

    A graze shallower than the tolerance is settled before any whole piece of it is proved to
    collide, but the middle of a leaf may be; the widest such middle stands for the run.

    :param leaves: (L,) LEAF in time order.
    """
    witness = leaves['witness'].tolist()
    if not any(witness):
        return leaves
    status, level = leaves['status'].tolist(), leaves['level'].tolist()
    chosen = []
    first = 0
    for last in range(1, len(status) + 1):
        if last < len(status) and (status[last] == layout.FREE) == (status[first] == layout.FREE):
            continue
        known = [i for i in range(first, last) if witness[i] > 0]
        if known and layout.COLLISION not in status[first:last]:
            chosen.append(min(known, key=lambda i: level[i] + witness[i]))
        first = last
    rows = sorted([*range(len(status)), *chosen, *chosen])
    cut = leaves[rows]
    for k, row in enumerate(chosen):
        w = witness[row]
        start = int(leaves['start'][row]) << (w + 1)
        middle = start + (1 << w)
        three = slice(row + 2 * k, row + 2 * k + 3)
        cut['start'][three] = start, middle - 1, middle + 1
        cut['end'][three] = middle - 1, middle + 1, int(leaves['end'][row]) << (w + 1)
        cut['level'][three] = level[row] + w + 1
        cut['status'][row + 2 * k + 1] = layout.COLLISION
    return cut


def _instant(knots: list[int], table: _Table, row: int, numerators: list[int]) -> Instant:
    """Return an end of a leaf."""
    segment = table.segment[row]
    knot = knots[segment]
    return Instant(knot, knots[segment + 1] - knot, numerators[row], table.level[row])


def _boundary(left: Status, right: Status, instant: Instant) -> int:
    """Return the common end of two intervals [ns]: free shrinks, then collision."""
    if left == Status.FREE:
        return instant.floor_ns
    if right == Status.FREE or left == Status.SUSPECT:
        return instant.ceil_ns
    return instant.floor_ns


def _worst(table: _Table, first: int, last: int) -> int:
    """Return the leaf of a run with the smallest gap, or the first if no pair is named."""
    named = [i for i in range(first, last) if table.body[i] >= 0]
    return min(named, key=table.upper.__getitem__) if named else first


def _merged(
    knots: list[int],
    table: _Table,
    run: tuple[int, int, int],
    ends_ns: tuple[int, int],
    place: list[float],
    link_names: Sequence[str],
    obstacle_names: Sequence[str],
) -> Interval:
    """Return the interval of a run of leaves, with the pair of the smallest gap among them."""
    first, last, worst = run
    status = _STATUS[table.status[first]]
    reason = '' if status is Status.COLLISION else _REASON[table.reason[first]].value
    if table.body[worst] < 0:
        return Interval(*ends_ns, status, reason)
    segment = table.segment[worst]
    knot = knots[segment]
    middle = Instant(
        knot,
        knots[segment + 1] - knot,
        table.start[worst] + table.end[worst],
        table.level[worst] + 1,
    )
    x, y, z = place
    lowest = min(table.lower[i] for i in range(first, last) if table.body[i] >= 0)
    return Interval(
        *ends_ns,
        status,
        reason,
        body=link_names[table.body[worst]],
        obstacle=obstacle_names[table.obstacle[worst]],
        at_ns=min(max(middle.floor_ns, ends_ns[0]), ends_ns[1]),
        location=(x, y, z),
        gap_lower=_finite(lowest),
        gap_upper=_finite(table.upper[worst]),
    )


def _finite(value: float) -> float | None:
    """Return a number, or None where nothing is known."""
    return value if math.isfinite(value) else None
