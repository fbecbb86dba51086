"""The demo, from the start of the guard to its end."""

from collections.abc import Iterator
from contextlib import contextmanager
import os
import sys
from typing import TextIO

from rich.console import Console

from trajectory_guard.demo.case import CASES, FINGERS, SCENE
from trajectory_guard.demo.files import config_file, panda_urdf
from trajectory_guard.demo.guard_process import running_guard
from trajectory_guard.demo.next_steps import next_steps
from trajectory_guard.demo.poses import PoseChecker, REPETITIONS, sample_times, waypoint_times
from trajectory_guard.demo.report import DemoReport
from trajectory_guard.demo.ros.client import connected_client

# The very first start compiles the kernels; on a busy machine that takes minutes [s].
TIMEOUT = 600.0

# What planners commonly step by [rad].
SAMPLE_STEP = 0.05


def run(file: TextIO) -> int:
    """
    Run the demo.

    :param file: where to print.
    :returns: exit code: 0 all answers are as promised, 1 they are not.
    :raises DemoError: the guard cannot be started, or does not answer.
    """
    robot, scene = panda_urdf(), config_file(SCENE)
    # Other guards of this machine, or of the network, are not to be asked.
    namespace = f'/demo_{os.getpid()}'
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    report = DemoReport(file)
    report.introduce()
    problems = []
    with (
        running_guard(robot, [scene], namespace) as guard,
        connected_client(namespace, guard.check, TIMEOUT) as client,
    ):
        with _waiting('starting the guard (the very first start takes about a minute) ...'):
            checker = PoseChecker(robot, scene)
            client.wait_for_service()
        for number, case in enumerate(CASES, 1):
            trajectory, start = case.trajectory(), case.start()
            answers = [
                client.certify(trajectory, start, case.clearance) for _ in range(REPETITIONS)
            ]
            wider = None
            if case.too_much is not None:
                wider = client.certify(trajectory, start, case.too_much).result
            checks = {
                'waypoints': checker.check(trajectory, FINGERS, waypoint_times(trajectory)),
                f'every {SAMPLE_STEP:g} rad': checker.check(
                    trajectory, FINGERS, sample_times(trajectory, SAMPLE_STEP)
                ),
            }
            report.show(number, case, answers, wider, checks)
            problems += case.problems([answer.result for answer in answers], wider, checks)
    report.close(problems, next_steps(robot))
    return 1 if problems else 0


@contextmanager
def _waiting(text: str) -> Iterator[None]:
    """Say on stderr what is waited for, and take it back from a terminal."""
    if sys.stderr.isatty():
        with Console(stderr=True).status(text):
            yield
    else:
        print(text, file=sys.stderr, flush=True)
        yield
