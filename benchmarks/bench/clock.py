"""Seconds of calls that take turns, so that a change of the machine's load meets all of them."""

from collections.abc import Callable, Iterator, Mapping
import contextlib
import gc
import statistics
import time
from typing import Any

RUNS = 5


@contextlib.contextmanager
def no_collection() -> Iterator[None]:
    """Keep the garbage collector out of the time of a block."""
    enabled = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def interleaved(
    calls: Mapping[str, Callable[[], Any]], runs: int = RUNS
) -> dict[str, tuple[float, Any]]:
    """
    Call each in turn, several times over.

    :param calls: what to call, by name.
    :param runs: runs that count; one more, to warm up, goes ahead.
    :returns: least time [s] and last answer, by name.
    """
    best = dict.fromkeys(calls, float('inf'))
    answers = {}
    with no_collection():
        for run in range(runs + 1):
            for name, call in calls.items():
                begin = time.perf_counter()
                answers[name] = call()
                seconds = time.perf_counter() - begin
                if run:
                    best[name] = min(best[name], seconds)
    return {name: (best[name], answers[name]) for name in calls}


def best_ms(call: Callable[[], Any], runs: int = RUNS) -> tuple[float, Any]:
    """Return the least time of a call [ms], warm, and its answer."""
    seconds, answer = interleaved({'': call}, runs)['']
    return 1e3 * seconds, answer


def percentile(values: list[float], share: float) -> float:
    """Return the value below which a share of the values lies."""
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def quantiles(ms: list[float], what: str = '') -> dict[str, float]:
    """
    Return columns with the median and the upper percentiles of times.

    :param ms: times [ms].
    :param what: what the names of the columns begin with.
    """
    return {
        f'{what}median_ms': statistics.median(ms),
        f'{what}p90_ms': percentile(ms, 0.9),
        f'{what}p99_ms': percentile(ms, 0.99),
    }
