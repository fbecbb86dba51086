"""Many trajectories against one workcell, in parallel."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
import os

from trajectory_guard.certify import judge
from trajectory_guard.result import Result
from trajectory_guard.settings import Settings
from trajectory_guard.trajectory import JointState, Trajectory
from trajectory_guard.workcell import Workcell


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

    def one(job: tuple[Trajectory, JointState | None]) -> Result:
        return judge(workcell, *job, settings)

    workers = min(threads or os.cpu_count() or 1, len(jobs))
    if workers <= 1:
        return [one(job) for job in jobs]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(one, jobs))
