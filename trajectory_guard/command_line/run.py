"""Run a request: print each answer as it comes, and say how it went."""

from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOWrapper
import logging
import os
import sys
import traceback

from trajectory_guard.command_line.exit_code import exit_code, ExitCode
from trajectory_guard.command_line.printable import printable
from trajectory_guard.command_line.request import Request, SELF_COLLISION_WARNING
from trajectory_guard.errors import TrajectoryGuardError
from trajectory_guard.result import Verdict

# Set it to see where an internal error comes from.
DEBUG_VARIABLE = 'TRAJECTORY_GUARD_DEBUG'


def run(request: Request, json: bool) -> ExitCode:
    """
    Judge, print and return the exit code; whatever goes wrong is said in one line.

    :param request: what to judge, against what.
    :param json: print one JSON object a line on stdout, and nothing else there.
    """
    debug = bool(os.environ.get(DEBUG_VARIABLE))
    try:
        with _quiet(debug):
            return _run(request, json)
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
    from trajectory_guard.command_line.json_lines import JsonLines
    from trajectory_guard.command_line.report import Report
    from trajectory_guard.kernels.compiled import COMPILING, is_cold

    if request.self_collision:
        _say(f'note: {SELF_COLLISION_WARNING}')
    if is_cold():
        _say(f'note: {COMPILING}')
    output = JsonLines(sys.stdout) if json else Report(sys.stdout)
    code = ExitCode.ALL_FREE
    judged = rejected = 0
    for result in answers(request):
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
