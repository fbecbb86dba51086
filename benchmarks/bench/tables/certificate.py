"""How large certificates are, and how long they take to write and to verify."""

from collections.abc import Iterator
import json
import statistics
import time
from typing import Any

from bench.cases import Bench, Case, settings
from bench.clock import best_ms
from trajectory_guard.certify import judge
from trajectory_guard.errors import TrajectoryGuardError

# Verifying takes longer than proving, so some cases a robot are looked at, and no longer than [s].
MOST_CASES, ENOUGH_S = 6, 8.0


def certificate(benches: list[Bench]) -> Iterator[dict]:
    """Yield two rows a robot, or that there are no certificates."""
    for bench in benches:
        for kind, cases in (('free', bench.free), ('colliding', bench.colliding)):
            row = {'table': 'certificate', 'robot': bench.name, 'cases': kind}
            yield row | measured(bench, cases[:: max(1, len(cases) // MOST_CASES)][:MOST_CASES])


def measured(bench: Bench, cases: list[Case]) -> dict:
    """Return medians over some cases."""
    sizes, written, verified, agreed, begin = [], [], [], [], time.perf_counter()
    for case in cases:
        if time.perf_counter() - begin > ENOUGH_S:
            break
        ms, result = best_ms(
            lambda case=case: judge(
                bench.cell, case.trajectory, settings=settings(want_certificate=True)
            )
        )
        if result.certificate is None:
            return {'note': 'not available: the result has no certificate'}
        written.append(ms)
        sizes.append(len(json.dumps(result.certificate)))
        start = time.perf_counter()
        answer = verified_by(bench, case, result.certificate)
        if isinstance(answer, str):
            return {'note': answer}
        verified.append(time.perf_counter() - start)
        agreed.append(answer.verdict == result.verdict.name.lower())
    if not sizes:
        return {'note': 'no such cases'}
    return {
        'trajectories': len(sizes),
        'median_bytes': statistics.median(sizes),
        'most_bytes': max(sizes),
        'judge_and_write_ms': statistics.median(written),
        'verify_s': statistics.median(verified),
        'slowest_verify_s': max(verified),
        'target': 'the same verdict',
        'met': all(agreed),
    }


def verified_by(bench: Bench, case: Case, found: dict) -> Any:
    """Return what the verifier says, or in words why it says nothing."""
    try:
        from trajectory_guard.verify import verify
    except ImportError as error:
        return f'not available: {error}'
    try:
        return verify(found, bench.cell.robot, bench.cell.scene, case.trajectory)
    except TrajectoryGuardError as error:
        return f'NOT VERIFIED: {case.name}: {error}'
