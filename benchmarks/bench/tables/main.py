"""Ours beside the peers on real robots: verdicts against the truth, times, what they mean."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
import statistics
from typing import Any

import numpy as np

from bench.cases import Bench, Case, settings, waypoints
from bench.clock import interleaved, percentile, RUNS
from bench.peers import FREE, MARGIN
from trajectory_guard.certify import certify, judge
from trajectory_guard.kernels.cover import cover
from trajectory_guard.paths.trajectory import Trajectory
from trajectory_guard.request import motion_path
from trajectory_guard.result import NANOSECONDS, Result, Status
from trajectory_guard.settings import Scope, Settings

# The kernels on a ready curve, as conservative advancement is called; and with Python around them.
OURS_VERDICT, OURS_INTERVALS = 'ours verdict', 'ours intervals'
WHOLE_VERDICT, WHOLE_INTERVALS = 'ours verdict, from waypoints', 'ours intervals, from waypoints'
CA_VERDICT, CA_INTERVALS = 'conservative advancement verdict', 'conservative advancement intervals'
STEPS = {'sampling 0.05 rad': 0.05, 'sampling 0.01 rad': 0.01, 'sampling 0.001 rad': 0.001}
METHODS = (
    *(OURS_VERDICT, OURS_INTERVALS, WHOLE_VERDICT, WHOLE_INTERVALS),
    *(CA_VERDICT, CA_INTERVALS, *STEPS),
)
YARDSTICK = {method: CA_INTERVALS if 'intervals' in method else CA_VERDICT for method in METHODS}
VERDICT, INTERVALS = settings(scope=Scope.VERDICT), settings()

# Ours as fine as conservative advancement, which takes 1 um for contact.
OURS_FINE, FINE = 'ours intervals to 1 um', settings(tolerance=MARGIN)
ASKED = {OURS_VERDICT: VERDICT, OURS_INTERVALS: INTERVALS, OURS_FINE: FINE}

# A method this slow needs fewer runs for a time.
SLOW, SLOW_RUNS = 'sampling 0.001 rad', 1

# Of the cases, the one whose collisions are deep, and what it is called.
DEEP = 'collide'
CALLED = {DEEP: 'deep'}

# One pose's cost is a run's time by its poses; so fine a step makes the rest of a run small.
POSE_STEP = 'sampling 0.01 rad'


@dataclass
class Measured:
    """
    What a method did on a robot's cases, in their order.

    :param ms: best time [ms].
    :param answers: Result, an integer verdict, spans, or Samples.
    """

    ms: list[float] = field(default_factory=list)
    answers: list[Any] = field(default_factory=list)


def main(benches: list[Bench]) -> Iterator[dict]:
    """Yield the main table, then what else the same runs tell."""
    runs = [(bench, measure(bench)) for bench in benches]
    for table in (compared, by_category, contacts, in_poses):
        for bench, measured in runs:
            yield from table(bench, measured)


def measure(bench: Bench, runs: int = RUNS) -> dict[str, Measured]:
    """Run every method on every case; ours and conservative advancement take turns."""
    measured = {method: Measured() for method in (*METHODS, OURS_FINE)}
    for case in bench.cases:
        sampled = {method: sampling(bench, case, step) for method, step in STEPS.items()}
        slow = {SLOW: sampled.pop(SLOW)}
        for method, (seconds, answer) in (
            interleaved(proofs(bench, case), runs)
            | interleaved(sampled, runs)
            | interleaved(slow, min(runs, SLOW_RUNS))
        ).items():
            measured[method].ms.append(1e3 * seconds)
            if method in ASKED:
                answer = certify(bench.cell, case.path, ASKED[method])
            measured[method].answers.append(answer)
    return measured


def proofs(bench: Bench, case: Case) -> dict[str, Callable[[], Any]]:
    """Return how the methods that prove something are called for a case."""
    baseline, spline = bench.baseline, case.spline
    names, points = case.trajectory.joint_names, waypoints(case.trajectory)

    def whole(wish: Settings) -> Result:
        return judge(bench.cell, Trajectory.from_points(names, points), settings=wish)

    return {
        OURS_VERDICT: kernels(bench, case, VERDICT),
        CA_VERDICT: lambda: baseline.verdict(spline),
        OURS_INTERVALS: kernels(bench, case, INTERVALS),
        CA_INTERVALS: lambda: baseline.intervals(spline),
        WHOLE_VERDICT: lambda: whole(VERDICT),
        OURS_FINE: kernels(bench, case, FINE),
        WHOLE_INTERVALS: lambda: whole(INTERVALS),
    }


def kernels(bench: Bench, case: Case, wish: Settings) -> Callable[[], Any]:
    """Return how the kernels are called for a case."""
    still = np.zeros(len(case.path.joint_names))
    arguments = (
        bench.cell.packed,
        motion_path(bench.cell, case.path, still),
        bench.cell.pairs(case.path.in_path).moving,
        *(wish.tolerance, wish.clearance, wish.max_pieces, wish.scope, False),
        np.zeros(1, np.int64),
    )
    return lambda: cover(*arguments)


def sampling(bench: Bench, case: Case, step: float) -> Callable[[], Any]:
    """Return how sampling is called for a case."""
    baseline, spline = bench.baseline, case.spline
    return lambda: baseline.sample(spline, step)


def judged(case: Case, answer: Any) -> tuple[bool, bool]:
    """Return whether an answer missed a collision, and whether it is a false alarm."""
    if is_ours(answer):
        return case.missed(answer), case.false_alarm(answer)
    if isinstance(answer, np.ndarray):
        free = not len(answer)
    elif isinstance(answer, int):
        free = answer == FREE
    else:
        free = not answer.colliding
    return case.colliding and free, not case.colliding and not free


def compared(bench: Bench, measured: dict[str, Measured]) -> Iterator[dict]:
    """Yield a row a method."""
    for method in METHODS:
        ms, answers = measured[method].ms, measured[method].answers
        yard = measured[YARDSTICK[method]].ms
        verdicts = [judged(case, a) for case, a in zip(bench.cases, answers, strict=True)]
        row = {
            'table': 'main',
            'robot': bench.name,
            'method': method,
            'trajectories': len(ms),
            'missed': sum(verdict[0] for verdict in verdicts),
            'colliding': len(bench.colliding),
            'false_alarms': sum(verdict[1] for verdict in verdicts),
            'free': len(bench.free),
            'median_ms': statistics.median(ms),
            'p90_ms': percentile(ms, 0.9),
            'x_ca': statistics.median(ms) / statistics.median(yard),
            'x_ca_p90': percentile(ms, 0.9) / percentile(yard, 0.9),
        }
        yield row | soundness(bench, answers)


def soundness(bench: Bench, answers: list[Any]) -> dict:
    """Return the column that fails the command, for answers of ours."""
    ours = [(case, a) for case, a in zip(bench.cases, answers, strict=True) if is_ours(a)]
    return {'unsound': sum(case.unsound(answer) for case, answer in ours)} if ours else {}


def is_ours(answer: Any) -> bool:
    """Say whether an answer is one of the certifier."""
    return isinstance(answer, Result)


def by_category(bench: Bench, measured: dict[str, Measured]) -> Iterator[dict]:
    """Yield each method's median by kind of case."""
    categories = list(dict.fromkeys(case.category for case in bench.cases))
    for method in METHODS:
        yield {
            'table': 'category',
            'robot': bench.name,
            'method': method,
            **{
                CALLED.get(category, category): statistics.median(
                    ms
                    for case, ms in zip(bench.cases, measured[method].ms, strict=True)
                    if case.category == category
                )
                for category in categories
            },
        }


def not_free(answer: Any) -> float:
    """Return how long an answer is not free [s]."""
    if is_ours(answer):
        spans = [row for row in answer.intervals if row.status != Status.FREE]
        return sum(row.end_ns - row.start_ns for row in spans) / NANOSECONDS
    return float((answer[:, 1] - answer[:, 0]).sum())


def contacts(bench: Bench, measured: dict[str, Measured]) -> Iterator[dict]:
    """Yield what a contact costs, and how much longer than it the answer is not free."""
    for method in (OURS_INTERVALS, OURS_FINE, CA_INTERVALS):
        both = list(zip(bench.cases, measured[method].ms, measured[method].answers, strict=True))
        deep = [(case, ms) for case, ms, _ in both if case.category == DEEP and case.contact]
        beyond = [
            1e3 * (not_free(answer) - sum(end - begin for begin, end in case.contact))
            for case, _, answer in both
            if case.colliding
        ]
        if not beyond:
            continue
        row = {'table': 'contact', 'robot': bench.name, 'method': method}
        if deep:
            count = sum(len(case.contact) for case, _ in deep)
            row['deep_contacts'] = count
            row['ms_per_deep_contact'] = sum(ms for _, ms in deep) / count
        row['beyond_contact_median_ms'] = statistics.median(beyond)
        row['beyond_contact_worst_ms'] = max(beyond)
        yield row | soundness(bench, measured[method].answers)


def in_poses(bench: Bench, measured: dict[str, Measured]) -> Iterator[dict]:
    """Yield ours in the unit of one pose that coal checks, kinematics and culling included."""
    sampled = measured[POSE_STEP]
    free = [i for i, case in enumerate(bench.cases) if not case.colliding]
    if not free:
        return
    pose = statistics.median(sampled.ms[i] / sampled.answers[i].poses for i in free)
    yield {
        'table': 'pose',
        'robot': bench.name,
        'pose_check_ms': pose,
        **{
            f'{method.replace(" ", "_")}_{kind}': statistics.median(ms[i] for i in which) / pose
            for method in (OURS_VERDICT, OURS_INTERVALS)
            for ms in [measured[method].ms]
            for kind, which in (('free', free), ('all', range(len(bench.cases))))
        },
    }
