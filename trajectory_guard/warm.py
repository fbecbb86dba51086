"""Compile the kernels, or read them from their cache, before the first request comes."""

import sys
import time

import numpy as np

from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason, TrajectoryGuardError
from trajectory_guard.kernels.compiled import COMPILING, is_cold
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.result import Verdict
from trajectory_guard.settings import Cover, Settings
from trajectory_guard.shapes.body import ConvexBody

_ROBOT = """
<robot name="warm_up">
  <link name="base"/>
  <link name="arm"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="elbow" type="continuous"><parent link="base"/><child link="arm"/></joint>
</robot>
"""


def warm_up(cover: Cover = Cover.HULL) -> None:
    """
    Certify a tiny motion, by the same path as every other.

    :param cover: the cover that will be asked for; each has kernels of its own.
    :raises TrajectoryGuardError: the answer is not the known one, so none can be trusted.
    """
    ball = ConvexBody(vertices=np.array([[0.0, 0.0, 2.0]]), ball=0.5)
    workcell = Workcell(robot_from_urdf(_ROBOT), Scene((Obstacle('ball', (ball,)),), digest=''))
    turn = Trajectory.from_points(['elbow'], [Point(0, [0.0]), Point(1, [1.0])])
    result = judge(workcell, turn, settings=Settings(cover=cover))
    if result.verdict != Verdict.FREE:
        raise TrajectoryGuardError(
            Reason.INTERNAL_ERROR,
            f'a free motion was answered {result.verdict.name}: {result.message}',
        )


def main() -> None:
    """Warm up and say how long it took."""
    if is_cold():
        print(f'{COMPILING} ...', file=sys.stderr, flush=True)
    begin = time.perf_counter()
    for cover in Cover:
        warm_up(cover)
    print(f'kernels ready after {time.perf_counter() - begin:.1f} s', file=sys.stderr)


if __name__ == '__main__':
    main()
