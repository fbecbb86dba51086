"""A batch on one thread and on two, beside what two processes gain on this machine."""

from collections.abc import Iterator
import dataclasses
import subprocess
import sys
import time

from bench.cases import Bench, settings
from bench.clock import interleaved
from trajectory_guard.batch import judge_all
from trajectory_guard.result import Result

SPEED_UP = 1.8
THREADS = 2

SPIN = 'sum(i * i for i in range(5_000_000))'

# So often a batch has each trajectory, so that starting threads is a small part of it.
REPEAT = 10


def threads(benches: list[Bench]) -> Iterator[dict]:
    """Yield a row a robot."""
    for bench in benches:
        trajectories = [case.trajectory for case in bench.cases] * REPEAT

        def run(n: int, bench=bench, trajectories=trajectories) -> list[Result]:
            return judge_all(bench.cell, trajectories, settings=settings(), threads=n)

        best = interleaved({'1': lambda run=run: run(1), '2': lambda run=run: run(THREADS)}, 3)
        speed_up = best['1'][0] / best['2'][0]
        equal = [timeless(r) for r in best['1'][1]] == [timeless(r) for r in best['2'][1]]
        yield {
            'table': 'threads',
            'robot': bench.name,
            'trajectories': len(trajectories),
            'one_thread_s': best['1'][0],
            'two_threads_s': best['2'][0],
            'speed_up': speed_up,
            'two_processes': machine(),
            'equal': equal,
            'target': f'speed_up >= {SPEED_UP}, equal',
            'met': equal and speed_up >= SPEED_UP,
        }


def machine() -> float:
    """Return how much faster two processes that share nothing are than one after the other."""
    command = [sys.executable, '-c', SPIN]
    alone, together = [], []
    for _ in range(3):
        for count, seconds in ((1, alone), (2, together)):
            begin = time.perf_counter()
            running = [subprocess.Popen(command) for _ in range(count)]
            for process in running:
                process.wait()
            seconds.append(time.perf_counter() - begin)
    return 2.0 * min(alone) / min(together)


def timeless(result: Result) -> Result:
    """Return a result without the time it took."""
    return dataclasses.replace(result, compute_time=0.0)
