"""What it costs to know when a contact of a real robot begins and ends, and with what."""

from collections.abc import Iterator
import statistics

from bench.built import DATA
from bench.cases import Bench, Case, load, settings
from bench.clock import interleaved
from trajectory_guard.certify import judge
from trajectory_guard.result import Result, Status

PIN_MS = 2.0  # for entry and exit of one contact
PIN_NS = 1000.0


def pin() -> Iterator[dict]:
    """Yield time and open intervals of trajectories with one contact, asked in three ways."""
    ways = {
        'tolerance 0.1 mm': settings(refine=False),
        'refine': settings(),
        'refine, contacts named': settings(want_contacts=True),
    }
    for bench in load(DATA):
        seconds: dict[str, list[float]] = {way: [] for way in ways}
        open_ns: dict[str, list[float]] = {way: [] for way in ways}
        contact_ns: list[float] = []
        for case in _single(bench):
            calls = {
                way: lambda cell=bench.cell, case=case, asked=asked: judge(
                    cell, case.trajectory, None, asked
                )
                for way, asked in ways.items()
            }
            for way, (best, result) in interleaved(calls).items():
                seconds[way].append(best)
                open_ns[way] += _open(result)
                contact_ns += [one.latest_ns - one.earliest_ns for one in result.contacts]
        for way in ways:
            row = {
                'table': 'pin',
                'robot': bench.name,
                'asked': way,
                'contacts': len(seconds[way]),
                'median_ms': 1e3 * statistics.median(seconds[way]),
                'most_ms': 1e3 * max(seconds[way]),
                'open_ns': statistics.median(open_ns[way]),
                'most_open_ns': max(open_ns[way]),
            }
            if way == 'refine':
                row['target'] = f'<= {PIN_MS:.0f} ms, {PIN_NS:.0f} ns'
                row['met'] = row['median_ms'] <= PIN_MS and row['open_ns'] <= PIN_NS
            if 'named' in way:
                row['contact_ns'] = statistics.median(contact_ns)
            yield row


def _single(bench: Bench) -> list[Case]:
    """Return the trajectories that begin and end free, with one collision between."""
    wanted = [Status.FREE, Status.SUSPECT, Status.COLLISION, Status.SUSPECT, Status.FREE]
    return [
        case
        for case in bench.colliding
        if [row.status for row in judge(bench.cell, case.trajectory, None, settings()).intervals]
        == wanted
    ]


def _open(result: Result) -> list[int]:
    return [row.end_ns - row.start_ns for row in result.intervals if row.status is Status.SUSPECT]
