"""Deadlines: a flag is set when its time has come, not before, and is then forgotten."""

import threading
import time

from trajectory_guard import deadline
from trajectory_guard.deadline import stop_flag

MILLISECOND = 1_000_000


def wait_for(flag, seconds=10.0):
    """Wait until a flag is set; say whether it was."""
    end = time.monotonic() + seconds
    while not flag[0] and time.monotonic() < end:
        time.sleep(0.001)
    return bool(flag[0])


def test_flags_are_set_in_their_own_time():
    """A later deadline that was added first does not hold up an earlier one."""
    with stop_flag(3_600_000 * MILLISECOND) as late, stop_flag(20 * MILLISECOND) as early:
        assert early[0] == 0
        assert wait_for(early)
        assert late[0] == 0


def test_none_and_zero():
    """No deadline never sets it, a deadline of zero has passed."""
    with stop_flag(None) as never, stop_flag(0) as now:
        assert (never[0], now[0]) == (0, 1)


def test_what_is_done_is_forgotten():
    """Requests that end early leave nothing behind, however long their deadline was."""
    before = len(deadline._watch._pending)
    for _ in range(100):
        with stop_flag(3_600_000 * MILLISECOND):
            pass
    assert len(deadline._watch._pending) == before


def test_many_threads_share_one_watch():
    """Every flag of many threads is set."""
    missed = []

    def ask(milliseconds):
        with stop_flag(milliseconds * MILLISECOND) as flag:
            if not wait_for(flag):
                missed.append(milliseconds)

    threads = [threading.Thread(target=ask, args=(5 + k,)) for k in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not missed
