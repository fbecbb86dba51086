"""
Deadlines for kernels: a flag that one background thread sets when its time has come.

Kernels cannot read a clock, but they read a flag between two pieces. One thread serves all
requests, because starting one for each costs more than certifying a free motion.
"""

from collections.abc import Iterator
from contextlib import contextmanager
import threading
import time

import numpy as np

from trajectory_guard.result import NANOSECONDS


class _Watch:
    """Flags with their deadlines, and the thread that sets them."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._pending: dict[int, tuple[float, np.ndarray]] = {}
        self._wakes_at = float('inf')
        self._thread: threading.Thread | None = None

    def add(self, due: float, flag: np.ndarray) -> None:
        """Set a flag at a time of the monotonic clock [s]."""
        with self._changed:
            self._pending[id(flag)] = (due, flag)
            # A forked process has the object but not the thread.
            if self._thread is None or not self._thread.is_alive():
                self._thread = threading.Thread(target=self._run, name='deadlines', daemon=True)
                self._thread.start()
            elif due < self._wakes_at:
                self._changed.notify()

    def remove(self, flag: np.ndarray) -> None:
        """Forget a flag."""
        with self._changed:
            self._pending.pop(id(flag), None)

    def _run(self) -> None:
        with self._changed:
            while True:
                now = time.monotonic()
                for key, (due, flag) in list(self._pending.items()):
                    if due <= now:
                        flag[0] = 1
                        del self._pending[key]
                self._wakes_at = min((due for due, _ in self._pending.values()), default=np.inf)
                patience = self._wakes_at - now
                self._changed.wait(None if patience == np.inf else patience)


_watch = _Watch()


@contextmanager
def stop_flag(deadline_ns: int | None) -> Iterator[np.ndarray]:
    """
    Yield a flag that becomes 1 when the deadline has passed.

    :param deadline_ns: from now [ns]; None: never; 0: at once.
    :returns: (1,) int64, zero until then.
    """
    flag = np.zeros(1, np.int64)
    if deadline_ns is None:
        yield flag
    elif deadline_ns == 0:
        flag[0] = 1
        yield flag
    else:
        _watch.add(time.monotonic() + deadline_ns / NANOSECONDS, flag)
        try:
            yield flag
        finally:
            _watch.remove(flag)
