"""How many requests are being answered, and whether more are let in."""

from collections.abc import Iterator
from contextlib import contextmanager
import threading

from trajectory_guard.errors import Reason, RequestError


class Admission:
    """Counts requests in flight; nothing waits at this door."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = self._unsent = 0
        self._closed = False

    @contextmanager
    def entered(self, most: int) -> Iterator[None]:
        """
        Let one request in until its answer is made.

        :param most: requests that may be inside, this one included.
        :raises RequestError: BUSY, NOT_READY when closed.
        """
        with self._lock:
            if self._closed:
                raise RequestError(Reason.NOT_READY, 'the guard is shutting down')
            if self._inside >= most:
                raise RequestError(
                    Reason.BUSY, f'{self._inside} requests are in flight, max_requests is {most}'
                )
            self._inside += 1
        try:
            yield
        finally:
            with self._lock:
                self._inside -= 1

    def taken(self) -> None:
        """Count a request, let in or not, until its answer has left."""
        with self._lock:
            self._unsent += 1

    def sent(self) -> None:
        """Tell that the answer to one has left."""
        with self._lock:
            self._unsent -= 1

    def close(self) -> None:
        """Let nobody in any more."""
        with self._lock:
            self._closed = True

    @property
    def closed(self) -> bool:
        """Whether nobody is let in any more."""
        return self._closed

    @property
    def empty(self) -> bool:
        """Whether nobody is inside, and no answer has yet to leave."""
        return not (self._inside or self._unsent)
