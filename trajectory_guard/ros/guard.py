"""The guard as the whole of a process: from its arguments to its exit code."""

from collections.abc import Sequence
import os
import threading
import time

from rclpy.executors import MultiThreadedExecutor

from trajectory_guard.ros.guard_node import Guard, NAME
from trajectory_guard.ros.parameters import MOST_REQUESTS
from trajectory_guard.ros.process import LOOK_UP, made, on_signal, run

# Requests beyond the limit find a thread that rejects them, and so do parameters, topics and
# changes of state. A pool starts its threads only when it needs them.
THREADS = MOST_REQUESTS + 16

# How long requests in flight may take to end when the guard stops, and an answer to leave [s].
GRACE = 3.0
SENDING = 0.05


def main(args: Sequence[str] | None = None) -> int:
    """
    Run the guard until SIGINT or SIGTERM, as the whole of this process.

    :param args: command line, the program first; None: that of the process.
    :returns: exit code: 0 stopped, 2 an argument, a parameter or a file cannot be used, 3 the
        guard does not work here.
    """
    return run(NAME, args, _serve)


def _serve() -> None:
    executor = MultiThreadedExecutor(THREADS)
    guard = made(Guard)
    executor.add_node(guard)
    try:
        _answer_until_stopped(executor, guard)
    finally:
        # Callbacks end first: shutting down does not wait for them (rclpy of Jazzy), and one that
        # ends later says so on stderr.
        executor._executor.shutdown()
        executor.shutdown()
        guard.destroy_node()


def _answer_until_stopped(executor: MultiThreadedExecutor, guard: Guard) -> None:
    """Answer requests until a signal comes; what is in flight then has a little time to end."""
    stop = threading.Event()
    on_signal(stop.set)
    started = executor.create_task(guard.start) if guard.configuration.autostart else None
    while not stop.is_set():
        executor.spin_once(timeout_sec=LOOK_UP)
    guard.close()
    end = time.monotonic() + GRACE

    def busy() -> bool:
        return not guard.idle or (started is not None and not started.done())

    # Whoever ends in a hurry stays in the graph, where its namesakes take it for alive.
    while busy() and time.monotonic() < end:
        executor.spin_once(timeout_sec=SENDING)
    # The last answer is made, and leaves; shutting the executor down does not wait for it.
    time.sleep(SENDING)
    if busy():
        # A kernel cannot be interrupted, and Python would wait for its thread.
        os._exit(0)
