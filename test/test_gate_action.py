"""The action before the controller's own: what is held says why, what passes comes back."""

from collections.abc import Iterator
from contextlib import contextmanager
import importlib.util
import os
from pathlib import Path
import shutil
import subprocess
import sys
import threading
import time
from typing import Any

from gate_process import Bench, fake_guard, FakeGuard, gate_process, PERIOD, soon
from guard_process import Asker, asker, message, ros_context, spinning
import pytest
from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from trajectory_guard_interfaces.msg import CertificationResult

INSTALLED = importlib.util.find_spec('control_msgs') is not None
PACKAGE = Path(__file__).parent / 'data' / 'control_msgs'

installed = pytest.mark.skipif(not INSTALLED, reason='control_msgs is not installed')

FREE = message((0.0, [0.0, 0.0]), (1.0, [0.5, 0.5]))
LONGER = message((0.0, [0.0, 0.0]), (2.0, [0.5, 0.5]))


@pytest.mark.skipif(INSTALLED, reason='control_msgs is installed')
@pytest.mark.slow
def test_with_messages_of_our_own_making(tmp_path: Path) -> None:
    colcon = [sys.executable, shutil.which('colcon'), '--log-base', tmp_path / 'log', 'build']
    folders = ['--build-base', tmp_path / 'build', '--install-base', tmp_path / 'install']
    options = ['--merge-install', '--base-paths', PACKAGE, '--cmake-args', '-DBUILD_TESTING=OFF']
    subprocess.run([*colcon, *folders, *options], check=True)
    prefix = tmp_path / 'install'
    (packages,) = prefix.glob('lib/python3*/site-packages')
    environment = dict(os.environ)
    for name, path in (
        ('AMENT_PREFIX_PATH', prefix),
        ('LD_LIBRARY_PATH', prefix / 'lib'),
        ('PYTHONPATH', packages),
    ):
        environment[name] = f'{path}:{environment.get(name, "")}'.rstrip(':')
    ran = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-rs', __file__],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert '10 passed, 2 skipped' in ran.stdout, ran.stdout


@pytest.mark.skipif(INSTALLED, reason='control_msgs is installed')
def test_without_the_messages_it_says_so_once(tmp_path: Path) -> None:
    with gate_process(tmp_path, 'alone') as gate:
        soon(lambda: 'control_msgs' in gate.said() and 'not ready' in gate.said(), 'the log')
        time.sleep(0.5)
        assert gate.said().count('control_msgs is not installed') == 1


class Controller:
    """
    A controller that plays nothing.

    :param node: where it lives.
    """

    def __init__(self, node: Node) -> None:
        from control_msgs.action import FollowJointTrajectory

        self.action = FollowJointTrajectory
        self.goals: list[Any] = []
        self.accepts = True
        self.fails = False
        self.go = threading.Event()
        self.go.set()
        self._server = ActionServer(
            node,
            FollowJointTrajectory,
            'joint_trajectory_controller/follow_joint_trajectory',
            self._play,
            goal_callback=lambda _: GoalResponse.ACCEPT if self.accepts else GoalResponse.REJECT,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    def _play(self, handle: Any) -> Any:
        self.goals.append(handle.request)
        handle.publish_feedback(self.action.Feedback(joint_names=['fed', 'back']))
        while not self.go.wait(0.01):
            if handle.is_cancel_requested:
                handle.canceled()
                return self.action.Result(error_string='canceled by the controller')
        if self.fails:
            handle.abort()
            code = self.action.Result.GOAL_TOLERANCE_VIOLATED
            return self.action.Result(error_code=code, error_string='missed')
        handle.succeed()
        return self.action.Result(error_string='reached')


@contextmanager
def controller(namespace: str) -> Iterator[Controller]:
    """Run a controller in threads of its own."""
    with ros_context() as context:
        executor = MultiThreadedExecutor(4, context=context)
        node = Node('joint_trajectory_controller_node', namespace=namespace, context=context)
        made = Controller(node)
        executor.add_node(node)
        with spinning(executor):
            try:
                yield made
            finally:
                made.go.set()


class Goals:
    """
    Sends goals to the gate.

    :param ask: whose node is used.
    """

    def __init__(self, ask: Asker) -> None:
        from control_msgs.action import FollowJointTrajectory

        self.action = FollowJointTrajectory
        self.feedback: list[Any] = []
        self.client = ActionClient(
            ask.node, FollowJointTrajectory, '/act/gate/follow_joint_trajectory'
        )
        assert self.client.wait_for_server(20.0)

    def send(self, trajectory: Any, **fields: Any) -> Any:
        """Send a goal, and return its handle once it is accepted."""
        goal = self.action.Goal(trajectory=trajectory, **fields)
        future = self.client.send_goal_async(goal, lambda m: self.feedback.append(m.feedback))
        soon(future.done, 'the goal to be accepted')
        assert future.result().accepted
        return future.result()

    def result(self, handle: Any) -> tuple[int, int, str]:
        """Return status, error code and error string of a goal."""
        future = handle.get_result_async()
        soon(future.done, 'a result')
        response = future.result()
        return response.status, response.result.error_code, response.result.error_string


@pytest.fixture(scope='module')
def ask() -> Iterator[Asker]:
    with asker() as made:
        yield made


@pytest.fixture(scope='module')
def guard() -> Iterator[FakeGuard]:
    with fake_guard('act') as made:
        yield made


@pytest.fixture(scope='module')
def jtc() -> Iterator[Controller]:
    with controller('act') as made:
        yield made


@pytest.fixture(scope='module')
def bench(tmp_path_factory: Any, ask: Asker, guard: FakeGuard, jtc: Controller) -> Iterator[Bench]:
    folder = tmp_path_factory.mktemp('gate')
    with gate_process(folder, 'act') as process:
        made = Bench(ask.node, 'act')
        made.wait(process, '')
        yield made
        assert 'Traceback' not in process.said(), process.said()


@pytest.fixture(scope='module')
def goals(ask: Asker, bench: Bench) -> Goals:
    return Goals(ask)


@pytest.fixture(autouse=True)
def later() -> None:
    """Let the gate hear of the robot after the controller began with the goal before."""
    time.sleep(10 * PERIOD)


SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


@installed
def test_what_is_proved_free_is_played(goals: Goals, jtc: Controller, bench: Bench) -> None:
    from control_msgs.msg import JointTolerance

    count = len(jtc.goals)
    tolerances = {'goal_tolerance': [JointTolerance(name='elbow', position=0.5)]}
    handle = goals.send(FREE, **tolerances)
    assert goals.result(handle) == (SUCCEEDED, 0, 'reached')
    assert jtc.goals[count:] == [goals.action.Goal(trajectory=FREE, **tolerances)]
    soon(lambda: goals.feedback, 'feedback')
    assert goals.feedback[-1].joint_names == ['fed', 'back']
    assert bench.decisions[-1].reason_code == 'proved_free'


@installed
def test_what_the_controller_aborts_is_aborted(goals: Goals, jtc: Controller) -> None:
    jtc.fails = True
    try:
        assert goals.result(goals.send(FREE)) == (ABORTED, -5, 'missed')
    finally:
        jtc.fails = False


@installed
def test_what_is_held_says_why(goals: Goals, guard: FakeGuard, jtc: Controller) -> None:
    def collide(result: CertificationResult) -> None:
        result.verdict = CertificationResult.COLLISION
        result.message = 'arm and post'

    count = len(jtc.goals)
    guard.change = collide
    try:
        held = goals.result(goals.send(FREE))
    finally:
        guard.change = lambda result: None
    assert held == (ABORTED, goals.action.Result.INVALID_GOAL, 'collision: arm and post')
    assert len(jtc.goals) == count


@installed
def test_what_the_controller_rejects_is_aborted(goals: Goals, jtc: Controller) -> None:
    jtc.accepts = False
    try:
        status, code, text = goals.result(goals.send(FREE))
    finally:
        jtc.accepts = True
    assert (status, code) == (ABORTED, goals.action.Result.INVALID_GOAL)
    assert 'rejects' in text


@installed
def test_poses_are_not_certified(goals: Goals, jtc: Controller) -> None:
    from trajectory_msgs.msg import MultiDOFJointTrajectory

    count = len(jtc.goals)
    poses = MultiDOFJointTrajectory(joint_names=['body'])
    status, _, text = goals.result(goals.send(FREE, multi_dof_trajectory=poses))
    assert status == ABORTED
    assert text.startswith('multi_dof: ')
    assert len(jtc.goals) == count


def held_up(guard: FakeGuard, goals: Goals, trajectory: Any = FREE) -> Any:
    """Send a goal that is still being certified when this returns."""
    asked = len(guard.asked)
    guard.go.clear()
    handle = goals.send(trajectory)
    soon(lambda: len(guard.asked) > asked, 'the request')
    return handle


@installed
def test_a_cancellation_during_the_certification(
    goals: Goals, guard: FakeGuard, jtc: Controller, bench: Bench
) -> None:
    count = len(jtc.goals)
    handle = held_up(guard, goals)
    handle.cancel_goal_async()
    try:
        status, _, text = goals.result(handle)
    finally:
        guard.go.set()
    assert status == CANCELED
    assert text.startswith('canceled: ')
    assert bench.decisions[-1].reason_code == 'canceled'
    time.sleep(0.1)
    assert len(jtc.goals) == count


@installed
def test_a_cancellation_during_the_motion(goals: Goals, jtc: Controller) -> None:
    count = len(jtc.goals)
    jtc.go.clear()
    handle = goals.send(FREE)
    soon(lambda: len(jtc.goals) > count, 'the motion')
    handle.cancel_goal_async()
    try:
        assert goals.result(handle) == (CANCELED, 0, 'canceled by the controller')
    finally:
        jtc.go.set()


@installed
def test_a_newer_goal_supersedes(goals: Goals, guard: FakeGuard, jtc: Controller) -> None:
    count = len(jtc.goals)
    older = held_up(guard, goals)
    newer = goals.send(LONGER)
    status, _, text = goals.result(older)
    assert status == ABORTED
    assert text.startswith('superseded: ')
    guard.go.set()
    assert goals.result(newer)[0] == SUCCEEDED
    assert [goal.trajectory for goal in jtc.goals[count:]] == [LONGER]


@installed
def test_a_stop_by_topic_voids_a_goal(
    goals: Goals, guard: FakeGuard, jtc: Controller, bench: Bench
) -> None:
    count = len(jtc.goals)
    handle = held_up(guard, goals)
    bench.send(type(FREE)())
    try:
        assert goals.result(handle)[2].startswith('stopped: ')
    finally:
        guard.go.set()
    time.sleep(0.1)
    assert len(jtc.goals) == count


@installed
def test_the_topic_works_beside(bench: Bench, goals: Goals) -> None:
    bench.free(FREE)
