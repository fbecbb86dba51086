"""Many trajectories against one workcell, in parallel."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
import os

from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge_some
from trajectory_guard.paths.trajectory import JointState, Trajectory
from trajectory_guard.result import Result
from trajectory_guard.settings import Settings

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
    # that threads seldom wait for the interpreter. They are dealt out like cards, because what is
    # dear often comes in a row.
    size = TOGETHER if settings is None or settings.deadline_ns is None else 1
    hands = -(-len(jobs) // size)
    results: list[Result | None] = [None] * len(jobs)

    def judge_hand(hand: int) -> None:
        results[hand::hands] = judge_some(workcell, jobs[hand::hands], settings)

    workers = min(threads or os.cpu_count() or 1, hands)
    if workers <= 1:
        for hand in range(hands):
            judge_hand(hand)
    else:
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(judge_hand, range(hands)))
    return [result for result in results if result is not None]
