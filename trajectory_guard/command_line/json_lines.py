"""Results for programs: one JSON object a line."""

import json
import math
from typing import Any, TextIO

from trajectory_guard.result import Result


class JsonLines:
    """
    Prints results as JSON, each as soon as it is known.

    :param file: where to.
    """

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def show(self, result: Result) -> None:
        """
        Print one result.

        :param result: the result.
        """
        print(json.dumps(_finite(result.to_dict())), file=self._file, flush=True)

    def close(self) -> None:
        """Print nothing: a reader counts the lines itself."""


def _finite(value: Any) -> Any:
    """Return a value with None for the numbers that JSON does not have."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
