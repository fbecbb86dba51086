"""A server of the guard's service that answers at once, and always with the empty answer."""

import signal
import threading

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from trajectory_guard_interfaces.srv import CertifyTrajectory

# How long a signal may go unnoticed [s].
LOOK_UP = 0.2


def main() -> None:
    """Answer until SIGTERM, and leave in good order: nobody shall wait for a dead server."""
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    # The handlers of rclpy wake the executor before the context is invalid: it may sleep on.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = Node('echo')
    node.create_service(CertifyTrajectory, '~/certify', lambda request, response: response)
    executor = rclpy.get_global_executor()
    executor.add_node(node)
    while not stop.is_set():
        executor.spin_once(LOOK_UP)
    rclpy.shutdown()


if __name__ == '__main__':
    main()
