"""Processes that are measured."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import subprocess
import sys
import tempfile

from bench.built import PANDA, SCENE
from trajectory_guard.demo.files import config_file, guard_executable

# How long a process may take to stop before it is killed [s].
GRACE = 5.0

ECHO = Path(__file__).with_name('echo.py')


def own_domain() -> None:
    """Talk to nobody else: for this process and those that it starts."""
    os.environ['ROS_DOMAIN_ID'] = str(1 + os.getpid() % 101)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'] = str(config_file('fastdds.xml'))


def guard_command() -> list[str]:
    """Return the command that starts a guard for the Panda at its shelf."""
    return [
        *(str(guard_executable()), '--ros-args'),
        *('-p', f'robot_description_file:={PANDA}'),
        *('-p', f'scene_files:=[{SCENE}]'),
        # The splines of the set end at rest only up to the last printed digit.
        *('-p', 'allow_nonzero_end_velocity:=true'),
    ]


def gate_command(output: str) -> list[str]:
    """
    Return the command that starts a gate.

    :param output: topic where it passes trajectories on.
    """
    gate = guard_executable().with_name('gate')
    return [str(gate), '--ros-args', '-p', f'output_topic:={output}']


def echo_command() -> list[str]:
    """Return the command that starts a server which does nothing."""
    return [sys.executable, str(ECHO)]


@contextmanager
def running(command: Sequence[str]) -> Iterator[subprocess.Popen[bytes]]:
    """
    Run a process, and stop it in the end.

    :raises RuntimeError: it ended by itself; the message ends with what it printed.
    """
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT
        )
        try:
            yield process
        finally:
            code = process.poll()
            stop(process)
            if code is not None:
                log.seek(0)
                raise RuntimeError(f'{command[0]} ended with code {code}\n{log.read().decode()}')


def stop(process: subprocess.Popen[bytes]) -> None:
    """End a process, the hard way if it does not listen."""
    process.terminate()
    try:
        process.wait(GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process [MB]."""
    pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 1e6
