"""The guard in a process of its own, and a client that asks it over real DDS."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
import os
from pathlib import Path
import subprocess
import threading
from typing import Any
from unittest import mock

from ament_index_python import get_package_prefix
from builtin_interfaces.msg import Duration
import rclpy
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from trajectory_guard_interfaces.srv import CertifyTrajectory
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.result import result_from_message
from trajectory_guard.result import Result

EXECUTABLE = Path(get_package_prefix('trajectory_guard'), 'lib', 'trajectory_guard', 'guard')

# Nobody else on this machine talks here, nor anybody on others.
DOMAIN = 1 + os.getpid() % 101
ENVIRONMENT = {'ROS_DOMAIN_ID': str(DOMAIN), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}

# The kernels may have to be compiled first, on a busy machine [s].
PATIENCE = 300.0

# An answer that has not come by then is lost [s].
AGAIN = 20.0

# A client keeps this many requests that are not delivered yet; it drops older ones.
QUEUE = QoSProfile(depth=100)

ARM = """
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <collision>
      <origin xyz="0.5 0 0"/>
      <geometry><box size="1.0 0.1 0.1"/></geometry>
    </collision>
  </link>
  <link name="lower">
    <collision>
      <origin xyz="0.4 0 0"/>
      <geometry><box size="0.8 0.08 0.08"/></geometry>
    </collision>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/>
    <child link="upper"/>
    <axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/>
    <child link="lower"/>
    <origin xyz="1 0 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/>
  </joint>
</robot>
"""

SCENE = """
<robot name="scene">
  <link name="post">
    <collision>
      <origin xyz="0 1.5 0"/>
      <geometry><cylinder radius="0.05" length="2"/></geometry>
    </collision>
  </link>
  <link name="wall">
    <collision>
      <origin xyz="-1.2 0 0"/>
      <geometry><box size="0.2 4 2"/></geometry>
    </collision>
  </link>
  <joint name="to_wall" type="fixed"><parent link="post"/><child link="wall"/></joint>
</robot>
"""


class GuardProcess:
    """
    A running guard.

    :param process: the process.
    :param log: file with what it prints.
    """

    def __init__(self, process: subprocess.Popen[bytes], log: Path) -> None:
        self.process = process
        self._log = log

    def stop(self, number: int) -> int:
        """Send a signal and return the exit code."""
        self.process.send_signal(number)
        return self.process.wait(PATIENCE)

    def said(self) -> str:
        """Return what it has printed so far."""
        return self._log.read_text()


@contextmanager
def guard_process(folder: Path, namespace: str, *arguments: str) -> Iterator[GuardProcess]:
    """
    Start the installed executable, and stop it in the end.

    :param folder: where its log goes.
    :param namespace: where its node lives.
    :param arguments: further ROS arguments.
    """
    log = folder / f'{namespace}.log'
    with log.open('wb') as output:
        process = subprocess.Popen(
            [EXECUTABLE, '--ros-args', '-r', f'__ns:=/{namespace}', *arguments],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env=os.environ | ENVIRONMENT,
        )
    try:
        yield GuardProcess(process, log)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()


def parameters(**values: Any) -> list[str]:
    """Return the ROS arguments that set parameters."""
    return [part for name, value in values.items() for part in ('-p', f'{name}:={value}')]


@contextmanager
def ros_context() -> Iterator[Context]:
    """Start ROS in the domain of these tests, and shut it down in the end."""
    context = Context()
    with mock.patch.dict(os.environ, ENVIRONMENT):
        rclpy.init(args=[], context=context, domain_id=DOMAIN)
    try:
        yield context
    finally:
        context.try_shutdown()


@contextmanager
def spinning(executor: Executor) -> Iterator[None]:
    """Run an executor in a thread of its own; its context ends with it."""

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        yield
    finally:
        executor.context.try_shutdown()
        thread.join(PATIENCE)


class Asker:
    """
    Asks guards, each by its namespace.

    :param node: the node to ask from; somebody spins it.
    """

    def __init__(self, node: Node) -> None:
        self.node = node
        self._clients: dict[str, Client] = {}

    def client(self, namespace: str, guard: GuardProcess | None = None) -> Client:
        """
        Return a new client of a guard that listens.

        :param namespace: where the guard's node lives.
        :param guard: its process; if it ends, nobody will listen.
        """
        client = self.node.create_client(
            CertifyTrajectory, f'/{namespace}/guard/certify', qos_profile=QUEUE
        )
        for _ in range(int(PATIENCE)):
            if client.wait_for_service(1.0):
                return client
            assert guard is None or guard.process.poll() is None, guard.said()
        raise AssertionError(f'no service in {namespace}')

    def wait(self, namespace: str, guard: GuardProcess) -> None:
        """Return as soon as a guard listens; fail if it ends instead."""
        self._clients[namespace] = self.client(namespace, guard)

    def ask(
        self, namespace: str, request: CertifyTrajectory.Request
    ) -> CertifyTrajectory.Response:
        """Return the answer to one request."""
        if namespace not in self._clients:
            self._clients[namespace] = self.client(namespace)
        for _ in range(int(PATIENCE / AGAIN)):
            done = threading.Event()
            future = self._clients[namespace].call_async(request)
            future.add_done_callback(lambda _, done=done: done.set())
            # DDS may see a server before that one sees where to answer.
            if done.wait(AGAIN):
                return future.result()
        raise AssertionError(f'no answer from {namespace}')

    def result(self, namespace: str, request: CertifyTrajectory.Request) -> Result:
        """Return the result in the answer to one request."""
        return result_from_message(self.ask(namespace, request).result)


@contextmanager
def asker() -> Iterator[Asker]:
    """Yield a client that runs in a thread of its own."""
    with ros_context() as context:
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node := Node('asker', context=context))
        with spinning(executor):
            yield Asker(node)


def gathered(futures: Sequence[rclpy.Future]) -> list[Any]:
    """Wait for futures that another thread completes, and return their results."""
    results = []
    for future in futures:
        done = threading.Event()
        future.add_done_callback(lambda _, done=done: done.set())
        assert done.wait(PATIENCE), 'no answer'
        results.append(future.result())
    return results


def message(
    *points: tuple[float, Sequence[float]], joints: Sequence[str] = ('shoulder', 'elbow')
) -> JointTrajectory:
    """
    Return a trajectory message.

    :param points: time from start [s] and positions [rad] of each.
    :param joints: their names.
    """
    return JointTrajectory(
        joint_names=list(joints),
        points=[
            JointTrajectoryPoint(time_from_start=duration(time), positions=list(positions))
            for time, positions in points
        ],
    )


def duration(seconds: float) -> Duration:
    """Return a duration of whole milliseconds."""
    milliseconds = round(seconds * 1000)
    return Duration(sec=milliseconds // 1000, nanosec=milliseconds % 1000 * 1_000_000)


def request(trajectory: JointTrajectory, **fields: Any) -> CertifyTrajectory.Request:
    """Return a request for a trajectory."""
    return CertifyTrajectory.Request(trajectory=trajectory, **fields)
