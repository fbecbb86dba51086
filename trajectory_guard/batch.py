"""Many trajectories against one workcell, in parallel."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
import os

from trajectory_guard.certify import judge_some
from trajectory_guard.result import Result
from trajectory_guard.settings import Settings
from trajectory_guard.trajectory import JointState, Trajectory
from trajectory_guard.workcell import Workcell

# Trajectories that one call of the kernels takes.
TOGETHER = 16


def judge_all(
    workcell: Workcell,
    trajectories: Sequence[Trajectory],
    starts: Sequence[JointState | None] | None = None,
    settings: Settings | None = None,
    threads: int | None = None,
) -> list[Result]:
    """
    Judge many trajectories; the answers are those of `judge`, to the bit, for any thread count.

    :param workcell: robot and scene.
    :param trajectories: the messages.
    :param starts: where the robot is at time 0 of each; None: unknown for all.
    :param settings: what is asked; the defaults if None.
    :param threads: how many work at once; None: one per core.
    :returns: one result per trajectory, in order.
    """
    states = starts if starts is not None else [None] * len(trajectories)
    jobs = list(zip(trajectories, states, strict=True))
    # Each answer has a deadline of its own; without one a call of the kernels takes several, so
    # that threads seldom wait for the interpreter.
    size = TOGETHER if settings is None or settings.deadline_ns is None else 1
    chunks = [jobs[i : i + size] for i in range(0, len(jobs), size)]

    def some(chunk: list[tuple[Trajectory, JointState | None]]) -> list[Result]:
        return judge_some(workcell, chunk, settings)

    workers = min(threads or os.cpu_count() or 1, len(chunks))
    if workers <= 1:
        return [result for chunk in chunks for result in some(chunk)]
    with ThreadPoolExecutor(workers) as pool:
        return [result for results in pool.map(some, chunks) for result in results]
