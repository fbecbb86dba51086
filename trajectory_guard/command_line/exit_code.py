"""What the command tells the program that called it."""

from enum import IntEnum

from trajectory_guard.errors import Reason
from trajectory_guard.result import Result, Verdict


class ExitCode(IntEnum):
    """
    Exit codes of every command; of several answers the largest counts.

    `verify` asks whether certificates prove what they claim, whatever that is.
    """

    ALL_FREE = 0
    ALL_PROVED = 0
    NOT_FREE = 1
    NOT_PROVED = 1
    BAD_INPUT = 2
    INTERNAL_ERROR = 3


def exit_code(result: Result) -> ExitCode:
    """
    Return the exit code of one answer.

    :param result: the answer.
    """
    if result.verdict is Verdict.FREE:
        return ExitCode.ALL_FREE
    if result.verdict is not Verdict.REJECTED:
        return ExitCode.NOT_FREE
    if result.reason_code == Reason.INTERNAL_ERROR.value:
        return ExitCode.INTERNAL_ERROR
    return ExitCode.BAD_INPUT
