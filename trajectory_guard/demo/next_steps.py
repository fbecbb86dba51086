"""Commands to try after the demo."""

import os
from pathlib import Path
import shlex
from typing import NamedTuple

from trajectory_guard.demo.case import FINGERS, SCENE
from trajectory_guard.demo.files import CHECKOUT, config_file


class Step(NamedTuple):
    """
    A command and what it is for.

    :param purpose: what it shows.
    :param command: its lines.
    """

    purpose: str
    command: tuple[str, ...]


def next_steps(robot: Path) -> list[Step]:
    """
    Return commands that work in the current folder.

    :param robot: URDF of the demo's robot.
    """
    scene, near, free = (
        _shown(config_file(name)) for name in (SCENE, 'demo_near.yaml', 'demo_free.yaml')
    )
    start = ','.join(f'{joint}={value}' for joint, value in FINGERS.items())
    bringup = CHECKOUT / 'bringup'
    door = _shown(bringup) if bringup.is_file() else ''
    run = f'{door} run ' if door else ''
    check = (
        f'{run}python -m trajectory_guard check --urdf "$panda" \\',
        f'  --scene {scene} --start {start} \\',
    )
    steps = [
        Step('the robot of the demo', (f'panda={_shown(robot)}',)),
        Step(
            'ask for more clearance than there is',
            (*check, f'  --clearance 0.003 {near}'),
        ),
        Step(
            'let every joint be off by 2 mrad, and have the answer as JSON',
            (*check, f'  --tracking-tolerance 0.002 --json {free}'),
        ),
        Step(
            'run the guard, for your own client of /guard/certify',
            (
                (f'{door} guard \\' if door else 'ros2 run trajectory_guard guard --ros-args \\'),
                f'  -p robot_description_file:="$panda" -p scene_files:="[{scene}]"',
            ),
        ),
    ]
    if door:
        steps.append(Step('run all tests', (f'{door} test',)))
    return steps


def _shown(path: Path) -> str:
    """Return a path for the shell, relative if that leads down from the current folder."""
    here = Path.cwd()
    if not path.is_relative_to(here):
        return shlex.quote(str(path))
    relative = shlex.quote(os.fspath(path.relative_to(here)))
    return f'./{relative}' if path.parent == here else relative
