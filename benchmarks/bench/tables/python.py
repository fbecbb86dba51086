"""What is around the kernels: waypoints in, files in, a process that starts, a cold compile."""

from collections.abc import Callable, Iterator
import contextlib
import os
from pathlib import Path
import statistics
import subprocess
import sys
import tempfile
import time
from typing import Any

from bench.built import PANDA, panda_with_meshes, SCENE
from bench.cases import Bench, settings, waypoints
from bench.clock import best_ms, interleaved, no_collection, RUNS
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.kernels.compiled import library
from trajectory_guard.paths.trajectory import Trajectory

# What a request calls of them.
KERNELS = ('guard_cover', 'guard_touching')

OVERHEAD_MS, LOADING_S, START_S, COMPILE_S = 0.2, 0.3, 1.5, 15.0

FIRST_ANSWER = f"""
from trajectory_guard.certify import judge
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.cell.workcell import Workcell

cell = Workcell(load_robot({str(PANDA)!r}), load_scene({str(SCENE)!r}))
names = [joint.name for joint in cell.robot.movable]
turn = [Point(0, [0.0, -0.6, 0.0, -2.2, 0.0, 1.7, 0.8]), Point(10**9, [0.3, -0.5] + 5 * [0.0])]
turn[1].positions[2:] = turn[0].positions[2:]
print(judge(cell, Trajectory.from_points(names, turn)).verdict.name)
"""


def python(benches: list[Bench]) -> Iterator[dict]:
    """Yield a row a stage, each with its target."""
    for bench in benches:
        yield overhead(bench)
    yield from loading()
    yield starting()
    yield compiling()


def row(what: str, value: float, unit: str, most: float) -> dict:
    """Return a row with its target."""
    target = f'<= {most:g} {unit}'
    return {
        'table': 'python',
        'what': what,
        'value': value,
        'unit': unit,
        'target': target,
        'met': value <= most,
    }


def overhead(bench: Bench) -> dict:
    """Return what waypoints to intervals takes beyond the kernels, the median of the cases."""
    spent = []
    with no_collection(), noted_kernels() as kernels:
        for case in bench.cases:
            names, given = case.trajectory.joint_names, waypoints(case.trajectory)
            outside = []
            for _ in range(RUNS + 1):
                kernels.clear()
                begin = time.perf_counter()
                judge(bench.cell, Trajectory.from_points(names, given), settings=settings())
                # Both times are of one run: the least of the differences counts.
                outside.append(time.perf_counter() - begin - sum(kernels))
            spent.append(1e3 * min(outside))
    what = f'{bench.name}: from_points and judge, outside of the kernels'
    return row(what, statistics.median(spent), 'ms', OVERHEAD_MS)


@contextlib.contextmanager
def noted_kernels() -> Iterator[list[float]]:
    """Yield a list that gets the seconds of each call of a kernel."""
    kernels, seconds = library(), []

    def noted(kernel: Callable) -> Callable:
        def call(*arguments: Any) -> Any:
            begin = time.perf_counter()
            answer = kernel(*arguments)
            seconds.append(time.perf_counter() - begin)
            return answer

        return call

    plain = {name: getattr(kernels, name) for name in KERNELS}
    try:
        for name, kernel in plain.items():
            setattr(kernels, name, noted(kernel))
        yield seconds
    finally:
        for name, kernel in plain.items():
            setattr(kernels, name, kernel)


def loading() -> Iterator[dict]:
    """Yield what it takes to have a workcell from files."""
    for what, urdf in (
        ('load the Panda of hulls and the scene', PANDA),
        ('load the Panda of example-robot-data and the scene', panda_with_meshes()),
    ):
        if urdf is not None:
            ms, _ = best_ms(lambda urdf=urdf: Workcell(load_robot(urdf), load_scene(SCENE)), 3)
            yield row(what, ms / 1e3, 's', LOADING_S)


def starting() -> dict:
    """Return how long a new process takes to its first answer, with compiled kernels."""
    command = [sys.executable, '-c', FIRST_ANSWER]

    def run() -> None:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        if done.stdout != 'FREE\n':
            raise RuntimeError(f'a free motion was answered {done.stdout!r}')

    seconds, _ = interleaved({'start': run}, runs=3)['start']
    return row('process start to first answer', seconds, 's', START_S)


def compiling() -> dict:
    """Return how long the kernels take to compile."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {'TRAJECTORY_GUARD_CACHE': str(Path(folder))}
        begin = time.perf_counter()
        subprocess.run(
            [sys.executable, '-m', 'trajectory_guard.warm'],
            env=environment,
            capture_output=True,
            check=True,
        )
        seconds = time.perf_counter() - begin
    return row('compile the kernels, process start included', seconds, 's', COMPILE_S)
