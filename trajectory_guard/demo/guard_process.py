"""The guard as a process of its own."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import ctypes
import json
import os
from pathlib import Path
import signal
import subprocess
import tempfile
from typing import IO

from trajectory_guard.demo.error import DemoError
from trajectory_guard.demo.files import guard_executable

# How long the guard may take to stop before it is killed [s].
STOP_TIMEOUT = 5.0

_PR_SET_PDEATHSIG = 1
_LOG_LINES = 20


class GuardProcess:
    """
    A running guard; it stops with its context, or when this process dies.

    :param process: the process.
    :param log: what it prints goes here.
    """

    def __init__(self, process: subprocess.Popen[bytes], log: IO[bytes]) -> None:
        self._process = process
        self._log = log

    def check(self) -> None:
        """
        Return if the guard is still running.

        :raises DemoError: it is not; the message ends with what it printed last.
        """
        code = self._process.poll()
        if code is not None:
            raise DemoError(f'the guard stopped with exit code {code}{self._last_words()}')

    def _last_words(self) -> str:
        """Return the last lines that the guard printed, each on a line of its own."""
        self._log.seek(0)
        lines = self._log.read().decode(errors='replace').splitlines()
        return ''.join(f'\n  {line}' for line in lines[-_LOG_LINES:])


@contextmanager
def running_guard(robot: Path, scenes: Sequence[Path], namespace: str) -> Iterator[GuardProcess]:
    """
    Start a guard and stop it in the end.

    :param robot: its robot.
    :param scenes: its scene.
    :param namespace: where its node lives.
    :raises DemoError: it cannot be started.
    """
    command = [
        str(guard_executable()),
        '--ros-args',
        *('--remap', f'__ns:={namespace}'),
        *('--param', f'robot_description_file:={json.dumps(str(robot))}'),
        *('--param', f'scene_files:={json.dumps([str(scene) for scene in scenes])}'),
    ]
    libc = ctypes.CDLL(None)

    def die_with_parent() -> None:
        """Make the kernel stop the guard if this process is killed and cannot."""
        libc.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)

    with tempfile.TemporaryFile() as log:
        try:
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                preexec_fn=die_with_parent,
                env={**os.environ, 'PYTHONUNBUFFERED': '1'},
            )
        except OSError as error:
            raise DemoError(f'cannot run {command[0]}: {error.strerror}') from error
        try:
            yield GuardProcess(process, log)
        finally:
            _stop(process)


def _stop(process: subprocess.Popen[bytes]) -> None:
    """Stop a process, the hard way if it does not listen."""
    process.terminate()
    try:
        process.wait(STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
