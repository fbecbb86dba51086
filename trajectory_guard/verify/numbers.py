"""Numbers of a certificate, each checked where it is read."""

from typing import Any

from trajectory_guard.verify.invalid import invalid

LARGEST_NUMBER = 1e12


def integer(value: Any, where: str, most: int) -> int:
    """Return an integer from 0 to `most`."""
    if type(value) is not int or not 0 <= value <= most:
        raise invalid(f'{where}: {value!r:.40} is no integer from 0 to {most}')
    return value


def number(value: Any, where: str) -> float:
    """Return a finite number."""
    if type(value) not in (int, float) or not abs(value) <= LARGEST_NUMBER:
        raise invalid(f'{where}: {value!r:.40} is no number of at most {LARGEST_NUMBER:g}')
    return float(value)


def positive(value: Any, where: str) -> float:
    """Return a finite number that is not negative."""
    if number(value, where) < 0.0:
        raise invalid(f'{where}: {value!r} is negative')
    return float(value)
