"""The gate in a process of its own, before a controller and behind a robot that the tests play."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import math
import os
from pathlib import Path
import subprocess
import threading
import time
from typing import Any

from builtin_interfaces.msg import Time
from guard_process import (
    ENVIRONMENT,
    EXECUTABLE,
    GuardProcess,
    PATIENCE,
    ros_context,
    spinning,
)
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from trajectory_guard_interfaces.msg import (
    CertificationResult,
    GateDecision,
    GateStatus,
    GuardStatus,
    TimeInterval,
)
from trajectory_guard_interfaces.srv import CertifyTrajectory
from trajectory_msgs.msg import JointTrajectory

from trajectory_guard.paths.joint_path import INTERPOLATION

GATE = EXECUTABLE.with_name('gate')

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
QUEUE = QoSProfile(depth=2000)

JOINTS = ('shoulder', 'elbow')

# How often the robot tells its state [s].
PERIOD = 0.01


@contextmanager
def gate_process(folder: Path, namespace: str, *arguments: str) -> Iterator[GuardProcess]:
    """
    Start the installed executable, and stop it in the end.

    :param folder: where its log goes.
    :param namespace: where its node lives.
    :param arguments: further ROS arguments.
    """
    log = folder / f'gate_{namespace}.log'
    with log.open('wb') as output:
        process = subprocess.Popen(
            [GATE, '--ros-args', '-r', f'__ns:=/{namespace}', *arguments],
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


def soon(condition: Callable[[], Any], what: str, patience: float = 20.0) -> Any:
    """Wait until another thread has made something true, and return it."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.002)
    raise AssertionError(f'in vain: {what}')


class FakeGuard:
    """
    A guard that answers at will.

    :param context: ROS.
    :param namespace: where it lives.
    """

    def __init__(self, context: Context, namespace: str) -> None:
        self.node = Node('guard', namespace=namespace, context=context)
        self.node.declare_parameter('tracking_tolerance', [0.0])
        self.node.declare_parameter('tracking_tolerance_joints', [''])
        self.asked: list[CertifyTrajectory.Request] = []
        self.change: Callable[[CertificationResult], None] = lambda result: None
        self.go = threading.Event()
        self.go.set()
        self.node.create_service(
            CertifyTrajectory,
            '~/certify',
            self._answer,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )
        self._status = self.node.create_publisher(GuardStatus, '~/status', LATCHED)
        self.say(ready=True)

    def say(self, ready: bool, scene_hash: str = 's') -> None:
        """Say how it is."""
        words = {} if ready else {'reason_code': 'not_ready', 'message': 'so it is'}
        self._status.publish(
            GuardStatus(ready=ready, robot_hash='r', scene_hash=scene_hash, **words)
        )

    def _answer(
        self, request: CertifyTrajectory.Request, response: CertifyTrajectory.Response
    ) -> CertifyTrajectory.Response:
        self.asked.append(request)
        self.go.wait(PATIENCE)
        end = request.trajectory.points[-1].time_from_start
        response.result = CertificationResult(
            verdict=CertificationResult.FREE,
            intervals=[TimeInterval(status=TimeInterval.FREE, end=end)],
            clearance=request.clearance,
            interpolation=INTERPOLATION,
            robot_hash='r',
            scene_hash='s',
            duration=end,
        )
        self.change(response.result)
        return response


@contextmanager
def fake_guard(namespace: str) -> Iterator[FakeGuard]:
    """Run a guard that answers at will, in threads of its own."""
    with ros_context() as context:
        executor = MultiThreadedExecutor(4, context=context)
        guard = FakeGuard(context, namespace)
        executor.add_node(guard.node)
        with spinning(executor):
            try:
                yield guard
            finally:
                guard.go.set()
                executor.remove_node(guard.node)
                guard.node.destroy_node()


class Bench:
    """
    What stands around a gate: who sends trajectories, the robot, and the controller.

    :param node: somebody spins it.
    :param namespace: where the gate lives.
    """

    def __init__(self, node: Node, namespace: str) -> None:
        self.node = node
        self.q = dict.fromkeys(JOINTS, 0.0)
        self.dq = dict.fromkeys(JOINTS, 0.0)
        self.tells = True
        self.stamp_ns: Callable[[], int] = lambda: node.get_clock().now().nanoseconds
        self.decisions: list[GateDecision] = []
        self.statuses: list[GateStatus] = []
        self.sent: list[bytes] = []
        self.received: list[bytes] = []
        self.sender = node.create_publisher(
            JointTrajectory, f'/{namespace}/gate/trajectory', QUEUE
        )
        self._states = node.create_publisher(JointState, f'/{namespace}/joint_states', 1)
        for kind, topic, qos, append in (
            (GateDecision, 'gate/decision', QUEUE, self.decisions.append),
            (GateStatus, 'gate/status', LATCHED, self.statuses.append),
        ):
            node.create_subscription(kind, f'/{namespace}/{topic}', append, qos)
        self.controller = node.create_subscription(
            JointTrajectory,
            f'/{namespace}/joint_trajectory_controller/joint_trajectory',
            self.received.append,
            QUEUE,
            raw=True,
        )
        node.create_timer(PERIOD, self._tell)

    def wait(self, gate: GuardProcess, *codes: str) -> None:
        """
        Return as soon as all that is around the gate has met it.

        :param gate: its process; if it ends, nobody is met.
        :param codes: one of them is the reason that its status then gives.
        """

        def met() -> bool:
            assert gate.process.poll() is None, gate.said()
            return (
                self.sender.get_subscription_count() == 1
                and self._states.get_subscription_count() >= 1
                and self.node.count_publishers(self.controller.topic_name) == 1
                and bool(self.statuses)
                and self.statuses[-1].reason_code in codes
            )

        try:
            soon(met, 'the gate', PATIENCE)
        except AssertionError:
            raise AssertionError((self.statuses, gate.said())) from None

    def send(self, trajectory: JointTrajectory) -> None:
        """Send a trajectory to the gate."""
        self.sent.append(serialize_message(trajectory))
        self.sender.publish(self.sent[-1])

    def decide(self, trajectory: JointTrajectory) -> GateDecision:
        """Send a trajectory, and return the next decision."""
        count = len(self.decisions)
        self.send(trajectory)
        soon(lambda: len(self.decisions) > count, 'a decision')
        return self.decisions[count]

    def code(self, trajectory: JointTrajectory) -> str:
        """Send a trajectory, and return the code of the next decision, which must fit."""
        received = len(self.received)
        decision = self.decide(trajectory)
        if decision.decision == GateDecision.PASSED:
            soon(lambda: len(self.received) > received, 'the controller to receive it')
            assert self.received[received:] == [self.sent[-1]]
        else:
            assert decision.decision == GateDecision.HELD
            assert decision.message
        return decision.reason_code

    def now(self, later: float = 0.0) -> Time:
        """Return a stamp: now, or so much later [s]."""
        time_ns = self.node.get_clock().now().nanoseconds + round(later * 1e9)
        return Time(sec=time_ns // 10**9, nanosec=time_ns % 10**9)

    def free(self, trajectory: JointTrajectory) -> None:
        """Fail unless the trajectory passes."""
        assert self.code(trajectory) == 'proved_free', self.decisions[-1].message

    def rest(self, q: Sequence[float]) -> None:
        """
        Put the robot there at once, at rest, and return when the gate should know.

        What was passed on before has begun by then.
        """
        self.q = dict(zip(JOINTS, q, strict=True))
        self.dq = dict.fromkeys(JOINTS, 0.0)
        time.sleep(10 * PERIOD)

    def _tell(self) -> None:
        if not self.tells:
            return
        time_ns = self.stamp_ns()
        message = JointState(name=list(self.q), position=list(self.q.values()))
        message.velocity = [self.dq.get(name, math.nan) for name in self.q]
        message.header.stamp = Time(sec=time_ns // 10**9, nanosec=time_ns % 10**9)
        self._states.publish(message)
