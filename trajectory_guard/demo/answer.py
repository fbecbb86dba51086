"""What the guard answered, and how long that took."""

from typing import NamedTuple

from trajectory_guard.result import Result


class Answer(NamedTuple):
    """
    One answer of the guard.

    :param result: what it says.
    :param round_trip: wall-clock time from sending the request to having the answer [s].
    """

    result: Result
    round_trip: float
