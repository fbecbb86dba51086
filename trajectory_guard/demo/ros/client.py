"""A client of the guard's service."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
import time
from typing import Any

from builtin_interfaces.msg import Duration
import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from trajectory_guard_interfaces.srv import CertifyTrajectory
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.result import result_from_message
from trajectory_guard.demo.answer import Answer
from trajectory_guard.demo.error import DemoError
from trajectory_guard.paths.trajectory import Trajectory
from trajectory_guard.result import NANOSECONDS

# How long one look at the network lasts before the guard is looked at again [s].
_SLICE = 0.2


class GuardClient:
    """
    Asks the guard.

    :param node: node to ask from; the guard's node lives in its namespace.
    :param executor: has that node.
    :param check: called again and again while waiting; it raises if waiting is no use.
    :param timeout: how long an answer may take [s].
    """

    def __init__(
        self, node: Node, executor: Executor, check: Callable[[], None], timeout: float
    ) -> None:
        self._executor = executor
        self._check = check
        self._timeout = timeout
        self._client = node.create_client(CertifyTrajectory, 'guard/certify')

    def wait_for_service(self) -> None:
        """
        Wait until the guard listens; it does once robot and scene are loaded.

        :raises DemoError: it takes too long.
        """
        deadline = time.monotonic() + self._timeout
        while not self._client.wait_for_service(_SLICE):
            self._check()
            if time.monotonic() > deadline:
                raise DemoError(f'no service {self._client.srv_name} after {self._timeout:g} s')

    def certify(
        self, trajectory: Trajectory, start: Mapping[str, float], clearance: float
    ) -> Answer:
        """
        Ask for one trajectory.

        :param trajectory: the trajectory.
        :param start: where the joints are at time 0 [rad or m].
        :param clearance: distance that *free* must exceed [m].
        :raises DemoError: no answer comes.
        """
        request = CertifyTrajectory.Request(
            trajectory=trajectory_to_message(trajectory),
            start_state=JointState(name=list(start), position=list(start.values())),
            clearance=clearance,
        )
        begin = time.perf_counter()
        message = self._ask(request)
        round_trip = time.perf_counter() - begin
        return Answer(result_from_message(message, trajectory.name), round_trip)

    def _ask(self, request: CertifyTrajectory.Request) -> Any:
        """Return the CertificationResult that answers a request."""
        deadline = time.monotonic() + self._timeout
        future = self._client.call_async(request)
        while not future.done():
            # (Spinning until a future is complete leaves something behind at each call.)
            self._executor.spin_once(timeout_sec=_SLICE)
            self._check()
            if not future.done() and time.monotonic() > deadline:
                raise DemoError(f'the guard does not answer within {self._timeout:g} s')
        return future.result().result


@contextmanager
def connected_client(
    namespace: str, check: Callable[[], None], timeout: float
) -> Iterator[GuardClient]:
    """
    Connect to ROS for as long as the context lasts.

    :param namespace: where the guard's node lives.
    :param check: called again and again while waiting; it raises if waiting is no use.
    :param timeout: how long the guard may take to start, or to answer [s].
    """
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = rclpy.create_node('demo', namespace=namespace)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        try:
            yield GuardClient(node, executor, check, timeout)
        finally:
            executor.shutdown()
            node.destroy_node()
    finally:
        rclpy.shutdown()


def trajectory_to_message(trajectory: Trajectory) -> JointTrajectory:
    """
    Return a trajectory as message.

    :param trajectory: the trajectory.
    """
    message = JointTrajectory(joint_names=list(trajectory.joint_names))
    for i, time_ns in enumerate(trajectory.times_ns.tolist()):
        sec, nanosec = divmod(time_ns, NANOSECONDS)
        point = JointTrajectoryPoint(
            positions=trajectory.positions[i].tolist(),
            time_from_start=Duration(sec=sec, nanosec=nanosec),
        )
        if trajectory.has_velocities[i]:
            point.velocities = trajectory.velocities[i].tolist()
        if trajectory.has_accelerations[i]:
            point.accelerations = trajectory.accelerations[i].tolist()
        message.points.append(point)
    return message
