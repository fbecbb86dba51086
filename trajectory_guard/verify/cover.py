"""Whether proved spans cover what is claimed, in exact time."""

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from trajectory_guard.verify.invalid import invalid
from trajectory_guard.verify.numbers import integer

STATUSES = ('free', 'suspect', 'collision')

# How finely a segment may be cut.
DEEPEST_LEVEL = 61
# Times are integers in units of 2^-DEEPEST_LEVEL ns.
UNIT = 1 << DEEPEST_LEVEL

Span = tuple[int, int]
Interval = tuple[int, int, str]


def spans(pieces: Sequence[Sequence[int]], knots_ns: Sequence[int]) -> list[Span]:
    """
    Return start and end of every piece, exact.

    :param pieces: rows of segment, numerator and level.
    :param knots_ns: ends of the segments [ns].
    """
    found = []
    for i, row in enumerate(pieces):
        if len(row) != 3:
            raise invalid(f'pieces[{i}]: has {len(row)} values')
        segment = integer(row[0], f'pieces[{i}], segment', len(knots_ns) - 2)
        level = integer(row[2], f'pieces[{i}], level', DEEPEST_LEVEL)
        numerator = integer(row[1], f'pieces[{i}], numerator', (1 << level) - 1)
        step = (knots_ns[segment + 1] - knots_ns[segment]) * (UNIT >> level)
        start = knots_ns[segment] * UNIT + numerator * step
        found.append((start, start + step))
    return found


def partition(rows: Sequence[Any], duration_ns: int, verdict: str) -> list[Interval]:
    """
    Return the intervals, if they partition [0, duration] and lead to the verdict.

    Only the last one may have no length: a single point that the robot never reaches in motion.
    """
    found: list[Interval] = []
    end = 0
    for i, row in enumerate(rows):
        where = f'intervals[{i}]'
        if len(row) != 3 or row[2] not in STATUSES:
            raise invalid(f'{where}: {row!r:.80} is not start, end and status')
        start, stop = (integer(value, where, duration_ns) for value in row[:2])
        if start != end or stop < start or (stop == start and i < len(rows) - 1):
            raise invalid(f'{where}: [{start}, {stop}] ns does not go on from {end} ns')
        found.append((start, stop, row[2]))
        end = stop
    if not found or end != duration_ns:
        raise invalid(f'intervals: end at {end} ns, not at the duration {duration_ns} ns')
    statuses = {status for _, _, status in found}
    worst = next(status for status in ('collision', 'suspect', 'free') if status in statuses)
    if verdict != worst:
        raise invalid(f'verdict: {verdict!r}, but the intervals say {worst!r}')
    return found


def check_free(
    intervals: Iterable[Interval],
    pairs: Iterable[tuple[int, int]],
    proved: Mapping[tuple[int, int], Sequence[Span]],
    names: Sequence[Sequence[str]],
) -> None:
    """
    Refuse a free interval in which some pair is not proved apart at every instant.

    :param proved: spans by pair.
    :param names: of the bodies and of the obstacles.
    """
    free = [(start, end) for start, end, status in intervals if status == 'free']
    if not free:
        return
    for body, obstacle in pairs:
        runs = joined(proved.get((body, obstacle), ()))
        for start, end in free:
            if not _covered(start * UNIT, end * UNIT, runs):
                raise invalid(
                    f'intervals: [{start}, {end}] ns is free, but no entries cover body {body} '
                    f'({names[0][body]}) and obstacle {obstacle} ({names[1][obstacle]}) in it'
                )


def check_collision(intervals: Iterable[Interval], proved: Iterable[Span]) -> None:
    """Refuse a colliding interval in which not every instant is proved to collide."""
    runs = joined(proved)
    for start, end, status in intervals:
        if status == 'collision' and not _covered(start * UNIT, end * UNIT, runs):
            raise invalid(f'intervals: [{start}, {end}] ns collides, but no entries cover it')


def joined(proved: Iterable[Span]) -> list[Span]:
    """Return the union of closed spans as disjoint ones, in order."""
    runs: list[Span] = []
    for start, end in sorted(proved):
        if runs and start <= runs[-1][1]:
            runs[-1] = runs[-1][0], max(runs[-1][1], end)
        else:
            runs.append((start, end))
    return runs


def by_pair(rows: Iterable[tuple[int, int, Span]]) -> dict[tuple[int, int], list[Span]]:
    """Return spans by body and obstacle."""
    found = defaultdict(list)
    for body, obstacle, span in rows:
        found[body, obstacle].append(span)
    return found


def _covered(start: int, end: int, runs: Sequence[Span]) -> bool:
    before = bisect_right(runs, start, key=lambda run: run[0])
    return before > 0 and end <= runs[before - 1][1]
