"""
Runs the guard and the gate together, and starts again whichever ends.

It needs Linux, and neither rclpy nor launch. That one of the two is gone is no danger: without a
guard the gate is closed, and without a gate nothing reaches the controller.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
import contextlib
import ctypes
import os
from pathlib import Path
import signal
import subprocess
import sys
import time
from types import MappingProxyType
from typing import NamedTuple

from ament_index_python import get_package_prefix

from trajectory_guard.errors import Reason, RequestError, TrajectoryGuardError

PACKAGE = 'trajectory_guard'

# A program that ends is started again after the least pause, then after twice the pause each time;
# one that has run for so long has the least pause again [s].
LEAST_PAUSE, MOST_PAUSE = 0.5, 10.0
STEADY = 30.0

# How long a program may take to stop before it is killed [s].
GRACE = 5.0

BAD_INPUT = 2

_STOPPING = (signal.SIGINT, signal.SIGTERM)
_AWAITED = (*_STOPPING, signal.SIGCHLD)
_LONG = 3600.0
_PR_SET_PDEATHSIG = 1


class Program(NamedTuple):
    """
    What is run.

    :param name: what to call it.
    :param command: the executable and its arguments.
    :param meanwhile: what holds as long as it does not run.
    :param environment: variables that it has besides those of this process.
    """

    name: str
    command: Sequence[str | Path]
    meanwhile: str
    environment: Mapping[str, str] = MappingProxyType({})


def main(args: Sequence[str] | None = None) -> int:
    """
    Run guard and gate until SIGINT or SIGTERM.

    :param args: command line, the program first; None: that of the process. Both get all of it.
    :returns: exit code: 0 stopped, 2 an argument, a parameter or a file cannot be used.
    """
    arguments = (sys.argv if args is None else args)[1:]
    try:
        folder = Path(get_package_prefix(PACKAGE), 'lib', PACKAGE)
        return supervise(
            Program(name, [folder / name, *arguments], meanwhile, _enclave(name))
            for name, meanwhile in (
                ('guard', 'the gate is closed until it is ready'),
                ('gate', 'no trajectory reaches the controller until it is ready'),
            )
        )
    except (TrajectoryGuardError, LookupError) as error:
        _say('FATAL', str(error))
        return BAD_INPUT


def _enclave(name: str) -> Mapping[str, str]:
    """Return the variable that gives a program its own keys, where security is on."""
    if os.environ.get('ROS_SECURITY_ENABLE') != 'true':
        return {}
    return {'ROS_SECURITY_ENCLAVE_OVERRIDE': f'/{PACKAGE}/{name}'}


def supervise(programs: Iterable[Program]) -> int:
    """
    Run programs until SIGINT or SIGTERM, as the whole of this process.

    They are stopped in the reverse order, each when the one before has ended. All end with this
    process, even if it is killed: the kernel kills them then.

    :param programs: in the order in which they are started; they share stdout and stderr.
    :returns: 0: stopped.
    :raises RequestError: one cannot be started, or its first run ended with exit code 2.
    """
    # Blocked signals wait until they are asked for: none comes at a wrong moment.
    signal.pthread_sigmask(signal.SIG_BLOCK, _AWAITED)
    children = [_Child(program) for program in programs]
    try:
        while True:
            pause = min(child.tend() for child in children)
            caught = signal.sigtimedwait(_AWAITED, pause)
            if caught is not None and caught.si_signo in _STOPPING:
                _say('INFO', f'stopping on {signal.Signals(caught.si_signo).name}')
                return 0
    finally:
        for child in reversed(children):
            child.stop()


class _Child:
    """A program and its process, if it runs."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._process: subprocess.Popen[bytes] | None = None
        self._runs = 0
        self._pause = LEAST_PAUSE
        # When it was started, or is to be [s, steady clock].
        self._since = time.monotonic()

    def tend(self) -> float:
        """
        Start the program where it is time; return how long it can be left alone [s].

        :raises RequestError: as `supervise` does.
        """
        if self._process is not None:
            code = self._process.poll()
            if code is None:
                return _LONG
            self._ended(code)
        if time.monotonic() >= self._since:
            self._start()
        return _LONG if self._process else max(0.0, self._since - time.monotonic())

    def _start(self) -> None:
        name, command, _, environment = self._program
        self._runs += 1
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                env=os.environ | environment,
                # Ctrl-C goes to a whole session: the order of stopping is ours.
                start_new_session=True,
                preexec_fn=_bind_to(os.getpid()),
            )
        except OSError as error:
            if self._runs == 1:
                raise RequestError(
                    Reason.INVALID_PARAMETER, f'cannot start {name}: {error}'
                ) from error
            self._put_off(f'{name} cannot be started: {error}')
            return
        self._since = time.monotonic()
        again = 'again ' if self._runs > 1 else ''
        _say('INFO', f'{name} started {again}(pid {self._process.pid})')

    def _ended(self, code: int) -> None:
        name = self._program.name
        assert self._process is not None
        who = f'{name} (pid {self._process.pid})'
        self._process = None
        if code == BAD_INPUT and self._runs == 1:
            raise RequestError(
                Reason.INVALID_PARAMETER,
                f'{who} cannot use an argument, a parameter or a file; its last lines say which '
                f'(a parameter of the {name} alone is -p {name}:NAME:=VALUE)',
            )
        ran = time.monotonic() - self._since
        if ran >= STEADY:
            self._pause = LEAST_PAUSE
        how = f'was killed by {_signal_name(-code)}' if code < 0 else f'ended with code {code}'
        self._put_off(f'{who} {how} after {ran:.1f} s')

    def _put_off(self, why: str) -> None:
        """Say what happened, and start later."""
        _say('ERROR', f'{why}; starting it in {self._pause:g} s; {self._program.meanwhile}')
        self._since = time.monotonic() + self._pause
        self._pause = min(2 * self._pause, MOST_PAUSE)

    def stop(self) -> None:
        """End the program, the hard way if it does not listen."""
        if self._process is None:
            return
        self._process.terminate()
        try:
            self._process.wait(GRACE)
        except subprocess.TimeoutExpired:
            _say('WARN', f'{self._program.name} does not stop within {GRACE:g} s: killing it')
            self._process.kill()
            self._process.wait()


def _bind_to(parent: int) -> Callable[[], None]:
    """Return what a new process does first: take signals, and be killed when the parent dies."""
    prctl = ctypes.CDLL(None).prctl

    def bind() -> None:
        signal.pthread_sigmask(signal.SIG_SETMASK, ())
        prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it died before
            os._exit(1)

    return bind


def _signal_name(number: int) -> str:
    """Return the name of a signal; those of real time have none."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f'signal {number}'


def _say(level: str, text: str) -> None:
    """Print a line as ROS does; that nobody reads it is no reason to end."""
    with contextlib.suppress(OSError):
        print(f'[{level}] [{time.time():.9f}] [supervisor]: {text}', file=sys.stderr, flush=True)


if __name__ == '__main__':
    sys.exit(main())
