"""What precision costs: tolerances from 10 mm to 1 um on the colliding trajectories."""

from collections.abc import Iterator
import itertools
import statistics
from typing import NamedTuple

from bench.cases import Bench, Case, settings
from bench.clock import interleaved
from trajectory_guard.certify import certify
from trajectory_guard.errors import Reason
from trajectory_guard.result import NANOSECONDS, Result, Status
from trajectory_guard.settings import Scope

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
FIRST_CONTACT_MS = 0.5
RUNS = 3

# Logarithmic cost adds the same for each decade. A cost that doubles by the decade adds more than
# twice the mean in the last of four.
MOST_OF_MEAN = 2.0


class Found(NamedTuple):
    """How long a case took [s], and what was answered."""

    seconds: float
    result: Result
    case: Case


def tolerance(benches: list[Bench]) -> Iterator[dict]:
    """Yield a row a robot, scope and tolerance, and one for how the cost grows."""
    for bench in benches:
        if not bench.colliding:
            continue
        measured, growth = sweep(bench), []
        for scope in (Scope.ALL, Scope.FIRST):
            rows = [
                {'table': 'tolerance', 'robot': bench.name, 'scope': scope.name.lower()}
                | {'tolerance_mm': 1e3 * t}
                | summary(measured[scope, t])
                for t in TOLERANCES
            ]
            yield from rows[:-1]
            if scope is Scope.FIRST:
                rows[-1]['target'] = f'ms <= {FIRST_CONTACT_MS}'
                rows[-1]['met'] = rows[-1]['ms'] <= FIRST_CONTACT_MS
            yield rows[-1]
            added = [b['pieces'] - a['pieces'] for a, b in itertools.pairwise(rows)]
            mean = sum(added) / len(added)
            growth.append(
                {
                    'table': 'growth',
                    'robot': bench.name,
                    'scope': scope.name.lower(),
                    'pieces_added_a_decade': ', '.join(f'{count:g}' for count in added),
                    'target': f'none above {MOST_OF_MEAN:g} x their mean',
                    'met': max(added) <= MOST_OF_MEAN * max(mean, 1.0),
                }
            )
        yield from growth


def sweep(bench: Bench) -> dict[tuple[Scope, float], list[Found]]:
    """Return what was found for every colliding case, by what was asked."""
    asked = {
        (scope, t): settings(scope=scope, tolerance=t, refine=False)
        for scope in (Scope.ALL, Scope.FIRST)
        for t in TOLERANCES
    }
    measured: dict = {key: [] for key in asked}
    for case in bench.colliding:
        calls = {
            key: lambda case=case, wish=wish: certify(bench.cell, case.path, wish)
            for key, wish in asked.items()
        }
        for key, (seconds, result) in interleaved(calls, RUNS).items():
            measured[key].append(Found(seconds, result, case))
    return measured


def summary(found: list[Found]) -> dict:
    """Return medians over the cases."""
    early = [of.case.contact[0][0] - first_not_free(of.result) for of in found]
    return {
        'ms': 1e3 * statistics.median(of.seconds for of in found),
        'pieces': statistics.median(of.result.pieces for of in found),
        'suspect_ms': 1e3 * statistics.median(suspect(of.result) for of in found),
        'not_free_before_contact_us': 1e6 * statistics.median(early),
        'unsound': sum(of.case.unsound(of.result) for of in found),
    }


def suspect(result: Result) -> float:
    """Return how long the answer was looked for and not found [s]."""
    rows = [row for row in result.intervals if row.status == Status.SUSPECT]
    looked_at = [row for row in rows if row.reason != Reason.NOT_EXAMINED]
    return sum(row.end_ns - row.start_ns for row in looked_at) / NANOSECONDS


def first_not_free(result: Result) -> float:
    """Return when the proof first ends [s]."""
    for row in result.intervals:
        if row.status != Status.FREE:
            return row.start_ns / NANOSECONDS
    return result.duration_ns / NANOSECONDS
