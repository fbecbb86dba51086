"""A budget of pieces: what it lets be proved stays proved."""

from collections.abc import Iterator

from bench.cases import Bench, settings
from trajectory_guard.certify import certify
from trajectory_guard.errors import Reason
from trajectory_guard.result import NANOSECONDS, Status

SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)


def budget(benches: list[Bench]) -> Iterator[dict]:
    """Yield rows for the free trajectory of each robot that takes the most pieces."""
    for bench in benches:
        if not bench.free:
            continue
        whole = {case.name: certify(bench.cell, case.path, settings()) for case in bench.free}
        case = max(bench.free, key=lambda case: whole[case.name].pieces)
        proved = 0.0
        for share in SHARES:
            most = round(share * whole[case.name].pieces)
            result = certify(bench.cell, case.path, settings(max_pieces=most))
            free = [row for row in result.intervals if row.status == Status.FREE]
            rest = [row for row in result.intervals if row.status != Status.FREE]
            before, proved = proved, sum(r.end_ns - r.start_ns for r in free) / NANOSECONDS
            yield {
                'table': 'budget',
                'robot': bench.name,
                'max_pieces': most,
                'pieces': result.pieces,
                'verdict': result.verdict.name.lower(),
                'free_s': proved,
                'of_s': result.duration_ns / NANOSECONDS,
                'suspect_budget': sum(row.reason == Reason.BUDGET for row in rest),
                'suspect_else': sum(row.reason != Reason.BUDGET for row in rest),
                'target': 'more proves more',
                'met': result.pieces <= most
                and proved >= before
                and all(row.reason == Reason.BUDGET for row in rest)
                and (bool(rest) or share == 1.0),
            }
