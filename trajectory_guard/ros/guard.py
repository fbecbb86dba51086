"""The guard as the whole of a process: from its arguments to its exit code."""

from collections.abc import Callable, Sequence
import os
import signal
import sys
import threading
import time

import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args, try_shutdown

from trajectory_guard.errors import Reason, RequestError, TrajectoryGuardError
from trajectory_guard.ros.guard_node import Guard, NAME
from trajectory_guard.ros.parameters import MOST_REQUESTS

# Requests beyond the limit find a thread that rejects them, and so do parameters, topics and
# changes of state. A pool starts its threads only when it needs them.
THREADS = MOST_REQUESTS + 16

# How long a signal may go unnoticed [s].
LOOK_UP = 0.2

# How long requests in flight may take to end when the guard stops, and an answer to leave [s].
GRACE = 3.0
SENDING = 0.05

BAD_INPUT = 2
INTERNAL_ERROR = 3


def main(args: Sequence[str] | None = None) -> int:
    """
    Run the guard until SIGINT or SIGTERM, as the whole of this process.

    :param args: command line, the program first; None: that of the process.
    :returns: exit code: 0 stopped, 2 an argument, a parameter or a file cannot be used, 3 the
        guard does not work here.
    """
    # There is nothing to end in good order yet.
    _on_signal(lambda: os._exit(0))
    try:
        _start_ros(sys.argv if args is None else list(args))
        _serve()
    except TrajectoryGuardError as error:
        get_logger(NAME).fatal(f'{error.reason}: {error}')
        return INTERNAL_ERROR if error.reason is Reason.INTERNAL_ERROR else BAD_INPUT
    finally:
        try_shutdown()
    return 0


def _on_signal(action: Callable[[], None]) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: action())


def _start_ros(args: list[str]) -> None:
    try:
        unknown = remove_ros_args(args)[1:]
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        raise RequestError(Reason.INVALID_PARAMETER, ' '.join(str(error).split())) from error
    if unknown:
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'unknown arguments {unknown}; ROS arguments come after --ros-args',
        )


def _serve() -> None:
    executor = MultiThreadedExecutor(THREADS)
    guard = Guard()
    executor.add_node(guard)
    try:
        _answer_until_stopped(executor, guard)
    finally:
        executor.shutdown()
        guard.destroy_node()


def _answer_until_stopped(executor: MultiThreadedExecutor, guard: Guard) -> None:
    """Answer requests until a signal comes; what is in flight then has a little time to end."""
    stop = threading.Event()
    _on_signal(stop.set)
    started = executor.create_task(guard.start) if guard.configuration.autostart else None
    # Python handles a signal when the main thread comes back to it, which no signal hastens. (The
    # handlers of rclpy wake the executor before the context is invalid: it may sleep on for ever.)
    while not stop.is_set():
        executor.spin_once(timeout_sec=LOOK_UP)
    guard.close()
    end = time.monotonic() + GRACE
    while not guard.idle and time.monotonic() < end:
        executor.spin_once(timeout_sec=SENDING)
    # The last answer is made, and leaves; shutting the executor down does not wait for it.
    time.sleep(SENDING)
    if not guard.idle or (started is not None and not started.done()):
        # A kernel cannot be interrupted, and Python would wait for its thread.
        os._exit(0)
