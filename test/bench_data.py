"""The benchmark trajectories on real robots, with certified truth (``data/bench``)."""

import functools
import json
from pathlib import Path

from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.settings import Settings

BENCH = Path(__file__).parent / 'data' / 'bench'
ROBOTS = ('panda', 'ur5')
# The splines of the set end at rest only up to the last printed digit.
SETTINGS = Settings(tolerance=1e-4, allow_nonzero_end_velocity=True)


@functools.cache
def workcell(robot):
    """Return the workcell of a robot of the set."""
    return Workcell(load_robot(BENCH / f'{robot}.urdf'), load_scene([BENCH / 'scene.urdf']))


@functools.cache
def cases(robot):
    """Return (trajectory, truth, category) of every case of a robot."""
    data = json.loads((BENCH / 'trajectories.json').read_text())['robots'][robot]
    return [
        (
            Trajectory.from_points(
                data['joint_names'],
                [
                    Point(round(1e9 * t), p, v)
                    for t, p, v in zip(
                        case['times'], case['positions'], case['velocities'], strict=True
                    )
                ],
                name=f'{robot}-{n}',
            ),
            case['truth'],
            case['category'],
        )
        for n, case in enumerate(data['trajectories'])
    ]
