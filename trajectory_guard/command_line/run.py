"""Run a request: print each answer as it comes, and say how it went."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import TextIOWrapper
import logging
import os
import sys
import traceback
from typing import TYPE_CHECKING

from trajectory_guard.command_line.exit_code import exit_code, ExitCode
from trajectory_guard.command_line.printable import printable
from trajectory_guard.command_line.request import (
    Request,
    SELF_COLLISION_WARNING,
    Verification,
)
from trajectory_guard.errors import TrajectoryGuardError
from trajectory_guard.result import Verdict

if TYPE_CHECKING:
    from trajectory_guard.command_line.json_lines import JsonLines
    from trajectory_guard.command_line.report import Report

# Set it to see where an internal error comes from.
DEBUG_VARIABLE = 'TRAJECTORY_GUARD_DEBUG'


def run(request: Request, json: bool) -> ExitCode:
    """
    Judge, print and return the exit code; whatever goes wrong is said in one line.

    :param request: what to judge, against what.
    :param json: print one JSON object a line on stdout, and nothing else there.
    """
    return _guarded(lambda: _run(request, json))


def run_verify(verification: Verification, json: bool) -> ExitCode:
    """
    Verify certificates, print the findings and return the exit code.

    :param verification: what to verify, against what.
    :param json: print one JSON object a line on stdout, and nothing else there.
    """

    def work() -> ExitCode:
        from trajectory_guard.command_line.verification import verify_all

        return verify_all(verification, json)

    return _guarded(work)


def _guarded(work: Callable[[], ExitCode]) -> ExitCode:
    """Return the exit code of some work; whatever goes wrong is said in one line."""
    debug = bool(os.environ.get(DEBUG_VARIABLE))
    try:
        with _quiet(debug):
            return work()
    except TrajectoryGuardError as error:
        _say(f'error: {error}')
        return ExitCode.BAD_INPUT
    except BrokenPipeError:
        # Nobody reads any more; the caller ends quietly.
        raise
    except Exception as error:
        if debug:
            traceback.print_exc()
        _say(f'internal error: {type(error).__name__}: {error} ({DEBUG_VARIABLE}=1 shows where)')
        return ExitCode.INTERNAL_ERROR


def _run(request: Request, json: bool) -> ExitCode:
    """Print the results and return the exit code."""
    from trajectory_guard.command_line.answer import answers
    from trajectory_guard.kernels.ball import UNIT as BALL_UNIT
    from trajectory_guard.kernels.compiled import COMPILING, is_cold
    from trajectory_guard.settings import Cover

    balls = request.settings.cover is Cover.BALL
    if is_cold() or (balls and is_cold(BALL_UNIT)):
        _say(f'note: {COMPILING}')
    output = _output(json)
    code = ExitCode.ALL_FREE
    judged = rejected = 0
    told = False
    for result in answers(request):
        if SELF_COLLISION_WARNING in result.warnings and not told:
            told = True
            _say(f'note: {SELF_COLLISION_WARNING}')
        output.show(result)
        code = max(code, exit_code(result))
        judged += 1
        if result.verdict is Verdict.REJECTED:
            rejected += 1
            if json:
                _say(f'error: {result.name}: {result.message.removeprefix(result.name + ": ")}')
    output.close()
    if rejected and not json:
        _say(f'error: {rejected} of {judged} trajectories rejected')
    return code


def _output(json: bool) -> JsonLines | Report:
    """Return what prints the results."""
    if json:
        from trajectory_guard.command_line.json_lines import JsonLines

        return JsonLines(sys.stdout)
    from trajectory_guard.command_line.report import Report

    return Report(sys.stdout)


@contextmanager
def _quiet(debug: bool) -> Iterator[None]:
    """Let nothing but the run's own lines out, and let no character stop them."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')
    # The core logs where it met what it did not foresee; the result says what it was.
    log = logging.getLogger('trajectory_guard')
    silent = logging.NullHandler()
    log.addHandler(silent)
    log.propagate, propagated = debug, log.propagate
    try:
        yield
    finally:
        log.propagate = propagated
        log.removeHandler(silent)


def _say(text: str) -> None:
    """Print a line on stderr."""
    print(printable(text), file=sys.stderr, flush=True)
