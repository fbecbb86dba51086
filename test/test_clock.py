"""A whole guard and a whole gate on a simulated clock: it ticks, jumps and stands still."""

from collections.abc import Iterator
from pathlib import Path
import signal
import time
from typing import NamedTuple

from builtin_interfaces.msg import Time
from gate_process import Bench, fake_guard, gate_process, PERIOD, soon
from guard_process import (
    ARM,
    Asker,
    asker,
    guard_process,
    message,
    parameters,
    request,
    SCENE,
)
from marker_messages import array, marker
import pytest
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from trajectory_guard.errors import Reason
from trajectory_guard.result import Result, Verdict
from trajectory_guard.ros.live_scene import MARKERS

FREE = message((0.0, [0.0, 0.0]), (1.0, [0.5, 0.5]))
HIT = message((0.0, [0.0, 0.0]), (1.0, [1.9, 0.0]))
# The guard has to know where the robot is.
LATER = request(message((0.5, [0.0, 0.0]), (1.0, [0.5, 0.5])))

SECOND = 10**9
TICK = 0.01
HOUR = 3600 * SECOND

# What comes is fresh for so long [s]: nothing here is in time on a busy machine.
AGE = 1.0

# Arguments of a gate.
PATIENT = parameters(max_drift=0.05, deadline=10.0, answer_margin=10.0)


def clocked(namespace: str) -> list[str]:
    """Return the arguments of a node on a clock of its own."""
    return ['-r', f'/clock:=/{namespace}/clock', *parameters(use_sim_time=True, max_state_age=AGE)]


class Simulation:
    """
    A clock, a robot that stamps by it, and a scene that is told again and again.

    :param node: somebody spins it.
    :param bench: has the robot.
    :param namespace: of the guard.
    """

    def __init__(self, node: Node, bench: Bench, namespace: str) -> None:
        self.now_ns = HOUR
        self.ticks = self.shows = True
        self._late_ns = 0
        bench.stamp_ns = lambda: self.now_ns - self._late_ns
        self._clock = node.create_publisher(Clock, f'/{namespace}/clock', 1)
        self._scene = node.create_publisher(MarkerArray, f'/{namespace}/guard/scene', MARKERS)
        self._timers = [node.create_timer(TICK, self._tick), node.create_timer(0.1, self._show)]

    def stop(self) -> None:
        """Say nothing any more."""
        for timer in self._timers:
            timer.cancel()

    def jump(self, by_ns: int) -> None:
        """Let the clock jump, and the robot go on as if it had not."""
        self._late_ns += by_ns
        self.now_ns += by_ns

    def follow(self) -> None:
        """Let the robot know of all jumps."""
        self._late_ns = 0

    def stamped(self, trajectory: JointTrajectory, later: float) -> JointTrajectory:
        """Return a trajectory that is to begin later [s]."""
        made = JointTrajectory(joint_names=trajectory.joint_names, points=trajectory.points)
        made.header.stamp = stamp(self.now_ns + round(later * SECOND))
        return made

    def _tick(self) -> None:
        self.now_ns += round(TICK * SECOND) * self.ticks
        self._clock.publish(Clock(clock=stamp(self.now_ns)))

    def _show(self) -> None:
        if self.shows:
            self._scene.publish(array(marker(position=(5.0, 5.0, 5.0))))


def stamp(time_ns: int) -> Time:
    return Time(sec=time_ns // SECOND, nanosec=time_ns % SECOND)


class World(NamedTuple):
    """What the tests turn, and what they look at."""

    simulation: Simulation
    bench: Bench
    ask: Asker

    def open(self) -> None:
        """Return as soon as both know where the robot is; what is free passes then."""
        soon(lambda: self.bench.code(FREE) == 'proved_free', 'a gate that knows the robot')
        soon(lambda: self.asked().verdict is Verdict.FREE, 'a guard that knows the robot')
        # What was passed on has begun by then.
        time.sleep(10 * PERIOD)

    def closed(self) -> None:
        """Return as soon as neither knows where the robot is; nothing passes then."""
        soon(lambda: self.bench.statuses[-1].reason_code == Reason.STATE_STALE, 'a closed gate')
        assert self.bench.code(FREE) == Reason.STATE_STALE
        soon(
            lambda: [i.reason for i in self.asked().intervals][:1] == [Reason.START_STATE_UNKNOWN],
            'a guard that does not know the robot',
        )

    def asked(self) -> Result:
        """Return what the guard says without a gate."""
        return self.ask.result('simulated', LATER)


@pytest.fixture(scope='module')
def ask() -> Iterator[Asker]:
    with asker() as made:
        yield made


@pytest.fixture(scope='module')
def whole(tmp_path_factory: pytest.TempPathFactory, ask: Asker) -> Iterator[World]:
    files = tmp_path_factory.mktemp('simulated')
    (files / 'arm.urdf').write_text(ARM)
    (files / 'scene.urdf').write_text(SCENE)
    common = clocked('simulated')
    workcell = parameters(
        robot_description_file=files / 'arm.urdf',
        scene_files=f'[{files / "scene.urdf"}]',
        live_scene=True,
        max_scene_age=AGE,
    )
    with (
        guard_process(files, 'simulated', *common, *workcell) as guard,
        gate_process(files, 'simulated', *common, *PATIENT) as gate,
    ):
        bench = Bench(ask.node, 'simulated')
        simulation = Simulation(ask.node, bench, 'simulated')
        ask.wait('simulated', guard)
        bench.wait(gate, '')
        yield World(simulation, bench, ask)
        for process in (gate, guard):
            assert process.stop(signal.SIGTERM) == 0
            assert 'Traceback' not in process.said()


@pytest.fixture
def world(whole: World) -> World:
    """Return the world as it should be."""
    whole.simulation.ticks = whole.simulation.shows = whole.bench.tells = True
    whole.simulation.follow()
    whole.open()
    return whole


def test_a_clock_that_ticks(world: World) -> None:
    assert world.bench.code(HIT) == 'collision'
    assert world.bench.code(world.simulation.stamped(FREE, 50.0)) == 'proved_free'
    assert world.bench.code(world.simulation.stamped(HIT, 50.0)) == 'collision'
    assert world.bench.code(world.simulation.stamped(FREE, -50.0)) == Reason.ENDS_IN_PAST


@pytest.mark.parametrize('by_ns', [HOUR, -100 * SECOND, 10 * SECOND])
def test_a_clock_that_jumps_makes_states_stale_until_they_follow(world: World, by_ns: int) -> None:
    world.simulation.jump(by_ns)
    world.closed()
    world.simulation.follow()
    world.open()


def test_a_clock_that_begins_anew(world: World) -> None:
    world.simulation.jump(-world.simulation.now_ns)
    world.closed()
    world.simulation.follow()
    world.open()
    assert world.bench.code(HIT) == 'collision'


@pytest.mark.parametrize(('namespace', 'by_ns'), [('ahead', HOUR), ('back', -HOUR)])
def test_a_clock_that_jumps_during_a_certification(
    tmp_path: Path, ask: Asker, namespace: str, by_ns: int
) -> None:
    """The robot follows at once, but the instant of the stamp is not where it was."""
    arguments = [*clocked(namespace), *PATIENT]
    with fake_guard(namespace) as fake, gate_process(tmp_path, namespace, *arguments) as gate:
        bench = Bench(ask.node, namespace)
        simulation = Simulation(ask.node, bench, namespace)
        bench.wait(gate, '')
        fake.go.clear()
        bench.send(simulation.stamped(FREE, 50.0))
        soon(lambda: fake.asked, 'a question')
        simulation.jump(by_ns)
        soon(lambda: bench.statuses[-1].reason_code == Reason.STATE_STALE, 'a closed gate')
        simulation.follow()
        soon(lambda: bench.statuses[-1].ready, 'a gate that is ready')
        assert not bench.decisions
        fake.go.set()
        soon(lambda: bench.decisions, 'a decision')
        assert bench.decisions[0].reason_code == Reason.STAMP_UNCERTAIN
        assert 'the clock went' in bench.decisions[0].message
        simulation.stop()


def test_a_clock_that_stands_still_keeps_nothing_fresh(world: World) -> None:
    world.simulation.ticks = False
    world.open()
    world.bench.tells = False
    world.closed()
    world.bench.tells = True
    world.open()
    world.simulation.shows = False
    soon(lambda: world.asked().reason_code == Reason.SCENE_STALE, 'a scene that is stale')
    soon(lambda: world.bench.statuses[-1].reason_code == 'guard_not_ready', 'a closed gate')
    assert world.bench.code(FREE) == 'guard_not_ready'
    assert Reason.SCENE_STALE in world.bench.decisions[-1].message
