"""The gate over real DDS: nothing passes but what is proved, whatever goes wrong around it."""

from collections.abc import Callable, Iterator
import math
from pathlib import Path
import signal
import time

from builtin_interfaces.msg import Duration, Time
from gate_process import Bench, fake_guard, FakeGuard, gate_process, PERIOD, soon
from guard_process import (
    ARM,
    Asker,
    asker,
    guard_process,
    GuardProcess,
    message,
    parameters,
    SCENE,
)
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from trajectory_guard_interfaces.msg import CertificationResult, GateDecision, TimeInterval
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.trajectory import (
    joint_state_from_message,
    stamp_from_message,
    trajectory_from_message,
)
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason
from trajectory_guard.result import Verdict
from trajectory_guard.ros.gate_parameters import DECLARATIONS, GateConfiguration
from trajectory_guard.ros.gate_request import request_for
from trajectory_guard.scene import load_scene
from trajectory_guard.settings import Settings
from trajectory_guard.takeover import Measured, takeover
from trajectory_guard.urdf import load_robot
from trajectory_guard.workcell import Workcell

FREE = message((0.0, [0.0, 0.0]), (1.0, [0.5, 0.5]))
HIT = message((0.0, [0.0, 0.0]), (1.0, [1.9, 0.0]))
APPROACHED = message((1.0, [0.2, 0.2]), (2.0, [0.5, 0.5]))
STOP = JointTrajectory()

READY = ('', 'guard_not_ready')


@pytest.fixture(scope='module')
def ask() -> Iterator[Asker]:
    with asker() as made:
        yield made


@pytest.fixture(scope='module')
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('workcell')
    (folder / 'arm.urdf').write_text(ARM)
    (folder / 'scene.urdf').write_text(SCENE)
    return folder


@pytest.fixture(scope='module')
def workcell(files: Path) -> list[str]:
    return parameters(
        robot_description_file=files / 'arm.urdf', scene_files=f'[{files / "scene.urdf"}]'
    )


@pytest.fixture(scope='module')
def guard(files: Path, ask: Asker, workcell: list[str]) -> Iterator[GuardProcess]:
    with guard_process(files, 'cell', *workcell) as process:
        ask.wait('cell', process)
        yield process


@pytest.fixture(scope='module')
def bench(files: Path, ask: Asker, guard: GuardProcess) -> Iterator[Bench]:
    with gate_process(files, 'cell') as process:
        made = Bench(ask.node, 'cell')
        made.wait(process, *READY)
        yield made
        assert process.stop(signal.SIGTERM) == 0
        assert 'Traceback' not in process.said()


@pytest.fixture(scope='module')
def fake(files: Path) -> Iterator[FakeGuard]:
    with fake_guard('fake') as made:
        yield made


@pytest.fixture(scope='module')
def faked(files: Path, ask: Asker, fake: FakeGuard) -> Iterator[Bench]:
    """A gate that asks the guard that answers at will."""
    arguments = parameters(clearance=0.01, deadline=0.3, max_drift=0.01)
    with gate_process(files, 'fake', *arguments) as process:
        made = Bench(ask.node, 'fake')
        made.wait(process, '')
        yield made
        assert process.stop(signal.SIGINT) == 0
        assert 'Traceback' not in process.said()


@pytest.fixture(autouse=True)
def at_rest(request: pytest.FixtureRequest) -> Iterator[None]:
    """Begin with a robot at rest, and check in the end what holds of all that was passed on."""
    benches = [request.getfixturevalue(n) for n in ('bench', 'faked') if n in request.fixturenames]
    for bench in benches:
        bench.tells = True
        bench.rest([0.0, 0.0])
    yield
    for bench in benches:
        assert_in_order(bench)


def assert_in_order(bench: Bench) -> None:
    """Check that every decision was published, in order, and what was passed on is what passed."""
    assert [d.number for d in bench.decisions] == [*range(1, len(bench.decisions) + 1)]
    passed = sum(d.decision == GateDecision.PASSED for d in bench.decisions)
    soon(lambda: len(bench.received) >= passed, 'what was passed on')
    assert len(bench.received) == passed
    rest = iter(bench.sent)
    assert all(raw in rest for raw in bench.received), 'not in the order of arrival'


# What passes


def test_what_is_proved_free_passes_unchanged(bench: Bench) -> None:
    bench.free(FREE)
    decision = bench.decisions[-1]
    assert decision.result.verdict == CertificationResult.FREE
    assert decision.result.duration == Duration(sec=1)
    assert 0.0 < decision.latency < 1.0
    assert decision.stamp.sec > 0


def test_an_approach_is_certified(bench: Bench) -> None:
    bench.free(APPROACHED)
    assert bench.decisions[-1].result.duration == Duration(sec=2)
    # The way from there leads through the post.
    bench.rest([2.2, 0.0])
    assert bench.code(APPROACHED) == 'collision'


def test_a_stop_passes_always(bench: Bench) -> None:
    bench.tells = False
    time.sleep(0.2)
    assert bench.code(STOP) == 'stop'
    assert bench.code(FREE) == 'state_stale'
    assert bench.code(JointTrajectory(joint_names=['x', 'x'])) == 'stop'


# What does not


def with_stamp(trajectory: JointTrajectory, stamp: Time) -> JointTrajectory:
    made = deserialize_message(serialize_message(trajectory), JointTrajectory)
    made.header.stamp = stamp
    return made


def test_what_is_not_free_is_held(bench: Bench) -> None:
    assert bench.code(HIT) == 'collision'
    decision = bench.decisions[-1]
    assert decision.result.verdict == CertificationResult.COLLISION
    assert 'post' in decision.message


@pytest.mark.parametrize(
    ('trajectory', 'code'),
    [
        (message((0.0, [0.0, 0.0]), joints=['shoulder', 'knee']), Reason.STATE_STALE),
        (message((0.0, [0.0, 0.0]), joints=['elbow', 'elbow']), Reason.DUPLICATE_JOINT),
        (message((0.0, [0.0]), (1.0, [0.1])), Reason.SIZE_MISMATCH),
        (message((0.0, [math.nan, 0.0])), Reason.NOT_FINITE),
        (message((1.0, [0.0, 0.0]), (0.5, [0.1, 0.0])), Reason.UNSORTED_TIMES),
        (message((0.0, [0.02, 0.0]), (1.0, [0.1, 0.0])), Reason.START_STATE_MISMATCH),
        (message((0.0, [0.0, 0.0]), (1.0, [0.0, 3.1])), Reason.JOINT_LIMIT),
    ],
)
def test_what_nobody_could_play_is_held(
    bench: Bench, trajectory: JointTrajectory, code: Reason
) -> None:
    assert bench.code(trajectory) == code


def test_a_joint_that_the_robot_lacks(bench: Bench) -> None:
    bench.q['knee'] = 0.0
    time.sleep(5 * PERIOD)
    trajectory = message((0.0, [0.0, 0.0]), joints=['shoulder', 'knee'])
    assert bench.code(trajectory) == 'unknown_joint'
    # The gate has seen that joint now, and waits for it.
    assert bench.code(FREE) == 'proved_free'


def test_bytes_that_are_no_message(bench: Bench) -> None:
    count = len(bench.decisions)
    bench.sender.publish(b'\x00\x01\x00\x00' + b'\xff' * 40)
    soon(lambda: len(bench.decisions) > count, 'a decision')
    assert bench.decisions[-1].reason_code == 'trajectory_unreadable'
    bench.free(FREE)


# When it begins


def test_a_stamp_in_the_future_lengthens_the_approach(bench: Bench) -> None:
    bench.free(with_stamp(FREE, bench.now(1.0)))
    assert 1.9 < bench.decisions[-1].result.duration.sec + 1.0 <= 3.0
    bench.rest([2.2, 0.0])
    assert bench.code(with_stamp(FREE, bench.now(1.0))) == 'collision'


def test_a_stamp_in_the_past_is_where_the_robot_must_be(bench: Bench) -> None:
    slow = message((0.0, [-0.1, 0.0]), (100.0, [0.1, 0.0]))
    # At the origin after 50 s, at 2 mrad/s.
    bench.free(with_stamp(slow, bench.now(-50.0)))
    assert bench.code(with_stamp(slow, bench.now(-40.0))) == 'start_state_mismatch'
    assert bench.code(with_stamp(slow, bench.now(-101.0))) == 'ends_in_past'
    assert bench.code(with_stamp(slow, bench.now())) == 'stamp_uncertain'
    assert bench.code(with_stamp(slow, Time(sec=-5))) == 'stamp_invalid'


# What changes meanwhile


def test_a_newer_trajectory_supersedes(faked: Bench, fake: FakeGuard) -> None:
    fake.go.clear()
    count, asked = len(faked.decisions), len(fake.asked)
    faked.send(FREE)
    soon(lambda: len(fake.asked) > asked, 'the request')
    faked.send(APPROACHED)
    soon(lambda: len(faked.decisions) > count, 'a decision')
    assert faked.decisions[-1].reason_code == 'superseded'
    fake.go.set()
    soon(lambda: len(faked.decisions) > count + 1, 'the other decision')
    assert faked.decisions[-1].reason_code == 'proved_free'
    assert faked.received[-1] == faked.sent[-1]


def test_a_stop_passes_during_a_certification_and_voids_it(faked: Bench, fake: FakeGuard) -> None:
    fake.go.clear()
    count, asked = len(faked.decisions), len(fake.asked)
    faked.send(FREE)
    soon(lambda: len(fake.asked) > asked, 'the request')
    faked.send(STOP)
    soon(lambda: len(faked.decisions) == count + 2, 'both decisions')
    assert [d.reason_code for d in faked.decisions[count:]] == ['stopped', 'stop']
    assert faked.received[-1] == faked.sent[-1]
    fake.go.set()
    time.sleep(0.1)
    assert len(faked.decisions) == count + 2


@pytest.mark.parametrize(
    ('change', 'code'),
    [
        (lambda bench: bench.q.update(elbow=0.005), 'proved_free'),
        (lambda bench: bench.q.update(elbow=0.02), 'state_changed'),
        (lambda bench: bench.dq.update(elbow=0.5), 'state_changed'),
        (lambda bench: setattr(bench, 'tells', False), 'state_stale'),
    ],
)
def test_the_robot_moves_meanwhile(
    faked: Bench, fake: FakeGuard, change: Callable[[Bench], None], code: str
) -> None:
    fake.go.clear()
    count, asked = len(faked.decisions), len(fake.asked)
    faked.send(APPROACHED)
    soon(lambda: len(fake.asked) > asked, 'the request')
    change(faked)
    time.sleep(0.15)
    fake.go.set()
    soon(lambda: len(faked.decisions) > count, 'a decision')
    assert faked.decisions[-1].reason_code == code


def test_a_late_answer_counts_for_nothing(faked: Bench, fake: FakeGuard) -> None:
    fake.go.clear()
    begin = time.monotonic()
    assert faked.code(FREE) == 'guard_silent'
    assert 0.4 < time.monotonic() - begin < 0.6
    count = len(faked.decisions)
    fake.go.set()
    time.sleep(0.1)
    assert len(faked.decisions) == count
    faked.free(FREE)


def test_what_is_asked(faked: Bench, fake: FakeGuard) -> None:
    faked.free(APPROACHED)
    asked = fake.asked[-1]
    assert asked.clearance == 0.01
    assert 0.2 < asked.deadline.nanosec / 1e9 <= 0.3
    assert [list(p.positions) for p in asked.trajectory.points] == [[0, 0], [0.2, 0.2], [0.5, 0.5]]
    assert dict(zip(asked.start_state.name, asked.start_state.position, strict=True)) == faked.q
    np.testing.assert_allclose(asked.tracking_tolerance, 0.01)


def test_the_guard_wants_more_tracking_tolerance(faked: Bench, fake: FakeGuard) -> None:
    from rclpy.parameter import Parameter

    def set_to(values: list[float], joints: list[str]) -> None:
        fake.node.set_parameters_atomically(
            [
                Parameter('tracking_tolerance', value=values),
                Parameter('tracking_tolerance_joints', value=joints),
            ]
        )

    set_to([0.5, 0.25], ['elbow', 'shoulder'])
    faked.free(APPROACHED)
    np.testing.assert_allclose(fake.asked[-1].tracking_tolerance, [0.26, 0.51])
    set_to([0.5], ['elbow'])
    assert faked.code(APPROACHED) == 'invalid_tracking_tolerance'
    set_to([0.0], [''])


def set_interval(**fields: object) -> Callable[[CertificationResult], None]:
    def change(result: CertificationResult) -> None:
        for name, value in fields.items():
            setattr(result.intervals[0], name, value)

    return change


def set_result(**fields: object) -> Callable[[CertificationResult], None]:
    def change(result: CertificationResult) -> None:
        for name, value in fields.items():
            setattr(result, name, value)

    return change


@pytest.mark.parametrize(
    ('change', 'code'),
    [
        (set_result(intervals=[]), 'answer_invalid'),
        (set_interval(status=TimeInterval.SUSPECT), 'answer_invalid'),
        (set_interval(status=TimeInterval.UNKNOWN), 'answer_invalid'),
        (set_interval(status=77), 'answer_invalid'),
        (set_interval(start=Duration(nanosec=1)), 'answer_invalid'),
        (set_interval(end=Duration(nanosec=999_999_999)), 'answer_invalid'),
        (set_result(duration=Duration(sec=2)), 'answer_invalid'),
        (set_result(clearance=0.009), 'answer_invalid'),
        (set_result(clearance=math.nan), 'answer_invalid'),
        (set_result(robot_hash=''), 'answer_invalid'),
        (set_result(scene_hash=''), 'answer_invalid'),
        (set_result(interpolation='linear'), 'answer_invalid'),
        (set_result(verdict=9), 'answer_invalid'),
        (set_result(verdict=CertificationResult.REJECTED), 'rejected'),
        (set_result(verdict=CertificationResult.SUSPECT, reason_code='budget'), 'budget'),
        (set_result(verdict=CertificationResult.COLLISION), 'collision'),
    ],
)
def test_an_answer_that_proves_nothing(
    faked: Bench, fake: FakeGuard, change: Callable[[CertificationResult], None], code: str
) -> None:
    fake.change = lambda result: (change(result), set_result(message='so it is')(result))
    try:
        assert faked.code(FREE) == code
    finally:
        fake.change = lambda result: None


def test_two_guards_are_none(faked: Bench, fake: FakeGuard) -> None:
    with fake_guard('fake') as other:
        soon(lambda: faked.statuses[-1].reason_code == 'guard_ambiguous', 'the status')
        assert faked.code(FREE) == 'guard_ambiguous'
        assert faked.code(STOP) == 'stop'
        assert not other.asked
    soon(lambda: faked.statuses[-1].ready, 'the status')
    faked.free(FREE)


def test_status_follows(faked: Bench) -> None:
    soon(lambda: faked.statuses[-1].ready, 'ready')
    faked.tells = False
    soon(lambda: faked.statuses[-1].reason_code == 'state_stale', 'stale')
    assert 'max_state_age' in faked.statuses[-1].message
    faked.tells = True
    soon(lambda: faked.statuses[-1].ready, 'ready again')
    counts = faked.statuses[-1]
    assert counts.passed + counts.stops + counts.held == len(faked.decisions)
