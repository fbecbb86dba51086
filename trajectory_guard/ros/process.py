"""A node as the whole of a process: from its arguments to its exit code."""

from collections.abc import Callable, Sequence
import os
import signal
import sys
from typing import TypeVar

import rclpy
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args, try_shutdown

from trajectory_guard.errors import Reason, RequestError, TrajectoryGuardError

# How long a signal may go unnoticed [s]. (Python handles one when the main thread comes back to
# it, which no signal hastens. The handlers of rclpy wake the executor before the context is
# invalid: it may sleep on for ever.)
LOOK_UP = 0.2

BAD_INPUT = 2
INTERNAL_ERROR = 3

AnyNode = TypeVar('AnyNode', bound=Node)


def run(name: str, args: Sequence[str] | None, serve: Callable[[], None]) -> int:
    """
    Start ROS, serve, and say in one line what went wrong.

    :param name: of the node.
    :param args: command line, the program first; None: that of the process.
    :param serve: returns when a signal has come, see `on_signal`.
    :returns: exit code: 0 stopped, 2 an argument, a parameter or a file cannot be used, 3 the node
        does not work here.
    """
    # There is nothing to end in good order yet.
    on_signal(lambda: os._exit(0))
    try:
        _start_ros(sys.argv if args is None else list(args))
        serve()
    except TrajectoryGuardError as error:
        get_logger(name).fatal(f'{error.reason}: {error}')
        return INTERNAL_ERROR if error.reason is Reason.INTERNAL_ERROR else BAD_INPUT
    finally:
        try_shutdown()
    return 0


def on_signal(action: Callable[[], None]) -> None:
    """
    Do something at SIGINT and at SIGTERM.

    :param action: what; it must not block.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: action())


def made(make: Callable[[], AnyNode]) -> AnyNode:
    """
    Return a new node.

    :param make: makes it.
    :raises TrajectoryGuardError: a parameter cannot be used, or the middleware makes no node; it
        does so where security is asked for that it lacks, or that has no keys for the node.
    """
    try:
        return make()
    except RuntimeError as error:
        raise RequestError(
            Reason.INVALID_PARAMETER, f'ROS makes no node: {" ".join(str(error).split())}'
        ) from error


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
