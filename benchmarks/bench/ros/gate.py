"""What the gate adds to the way of a trajectory."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
import time

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from trajectory_guard_interfaces.msg import GateDecision, GateStatus
from trajectory_msgs.msg import JointTrajectory

from bench.cases import Case
from bench.clock import quantiles
from bench.ros.client import PATIENCE, spinning
from bench.ros.process import gate_command, guard_command, running
from trajectory_guard.demo.ros.client import trajectory_to_message

INPUT, OUTPUT, DIRECT = '/gate/trajectory', '/controller', '/direct'
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STATE_PERIOD = 0.01
WARM_UP = 20


class Rig:
    """
    A planner, a robot that rests at the start of its motion, and its controller, in one node.

    :param node: the node.
    :param executor: that has it.
    """

    def __init__(self, node: Node, executor: SingleThreadedExecutor) -> None:
        self._node, self._executor = node, executor
        self._state = JointState()
        self._states = node.create_publisher(JointState, 'joint_states', 10)
        self._ways = {
            topic: node.create_publisher(JointTrajectory, topic, 10) for topic in (INPUT, DIRECT)
        }
        self.arrived: float | None = None
        self.decision: GateDecision | None = None
        self._status = GateStatus()
        for topic in (OUTPUT, DIRECT):
            node.create_subscription(JointTrajectory, topic, self._arrive, 10)
        node.create_subscription(GateDecision, '/gate/decision', self._decide, 10)
        node.create_subscription(GateStatus, '/gate/status', self._take_status, LATCHED)
        node.create_timer(STATE_PERIOD, self._say_state)

    def _arrive(self, _: JointTrajectory) -> None:
        self.arrived = time.perf_counter()

    def _decide(self, decision: GateDecision) -> None:
        self.decision = decision

    def _take_status(self, status: GateStatus) -> None:
        self._status = status

    def _say_state(self) -> None:
        self._state.header.stamp = self._node.get_clock().now().to_msg()
        self._states.publish(self._state)

    def rest_at_start(self, case: Case) -> None:
        """Put the robot where a motion begins, and wait until everybody knows."""
        trajectory = case.trajectory
        self._state = JointState(
            name=list(trajectory.joint_names),
            position=trajectory.positions[0].tolist(),
            velocity=[0.0] * len(trajectory.joint_names),
        )
        until = time.monotonic() + 5 * STATE_PERIOD
        self.spin(lambda: time.monotonic() > until)
        self.spin(lambda: self._status.ready)

    def ms(self, way: str, case: Case) -> float | None:
        """Return the time from publishing to the controller [ms]; None: it was held."""
        self.arrived = self.decision = None
        message = trajectory_to_message(case.trajectory)
        begin = time.perf_counter()
        self._ways[way].publish(message)
        self.spin(self._arrived_directly if way == DIRECT else self._decided)
        return None if self.arrived is None else 1e3 * (self.arrived - begin)

    def _arrived_directly(self) -> bool:
        return self.arrived is not None

    def _decided(self) -> bool:
        """Say whether the decision is here, and what it passed on."""
        if self.decision is None:
            return False
        return self.decision.decision == GateDecision.HELD or self.arrived is not None

    def spin(self, done: Callable[[], bool]) -> None:
        """
        Serve the node until something holds.

        :raises RuntimeError: it does not.
        """
        deadline = time.monotonic() + PATIENCE
        while not done():
            self._executor.spin_once(STATE_PERIOD)
            if time.monotonic() > deadline:
                raise RuntimeError(f'nothing passes the gate: {self._status.message}')


def gate(cases: Sequence[Case], requests: int) -> Iterator[dict]:
    """
    Yield how free trajectories take the way through the gate, and straight to the controller.

    The gate holds what comes too near for the drift that it allows the robot.

    :param cases: motions; those that collide are left out.
    :param requests: trajectories that count.
    """
    free = [case for case in cases if not case.colliding]
    ms: dict[str, list[float]] = {INPUT: [], DIRECT: []}
    above: list[float] = []
    held: Counter[str] = Counter()
    with spinning() as parts, running(guard_command()), running(gate_command(OUTPUT)):
        rig = Rig(*parts)
        for i in range(WARM_UP + requests):
            case = free[i % len(free)]
            rig.rest_at_start(case)
            took = {way: rig.ms(way, case) for way in (DIRECT, INPUT)}
            if took[INPUT] is None:
                held[rig.decision.reason_code] += 1
            elif i >= WARM_UP:
                above.append(took[INPUT] - 1e3 * rig.decision.result.compute_time)
                for way, found in ms.items():
                    found.append(took[way])
    yield {
        'table': 'gate',
        'way': 'gate',
        'passed': len(above),
        'held': ', '.join(f'{code}: {number}' for code, number in held.items()),
        **(quantiles(ms[INPUT]) | quantiles(above, 'above_') if above else {}),
    }
    if above:
        yield {'table': 'gate', 'way': 'direct', 'passed': len(above), **quantiles(ms[DIRECT])}
