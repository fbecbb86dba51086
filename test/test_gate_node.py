"""The gate over real DDS: nothing passes but what is proved, whatever goes wrong around it."""

from collections.abc import Callable, Iterator
import math
from pathlib import Path
import signal
import time
from typing import Any

from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from gate_process import Bench, fake_guard, FakeGuard, gate_process, PERIOD, soon
from guard_process import (
    ARM,
    Asker,
    asker,
    guard_process,
    GuardProcess,
    message,
    parameters,
    PATIENCE,
    SCENE,
)
import numpy as np
import pytest
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from trajectory_guard_interfaces.msg import CertificationResult, GateDecision, TimeInterval
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.trajectory import (
    joint_state_from_message,
    stamp_from_message,
    trajectory_from_message,
)
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason
from trajectory_guard.paths.entry import Measured
from trajectory_guard.paths.takeover import takeover
from trajectory_guard.result import Verdict
from trajectory_guard.ros.gate_configuration import GateConfiguration
from trajectory_guard.ros.gate_parameters import DECLARATIONS
from trajectory_guard.ros.gate_request import request_for
from trajectory_guard.settings import Settings

FREE = message((0.0, [0.0, 0.0]), (1.0, [0.5, 0.5]))
HIT = message((0.0, [0.0, 0.0]), (1.0, [1.9, 0.0]))
APPROACHED = message((1.0, [0.2, 0.2]), (2.0, [0.5, 0.5]))
STOP = JointTrajectory()

CONFIG = Path(__file__).parent.parent / 'config'

# The robot of the tests is late on a busy machine.
PATIENT = {'max_state_age': 0.4, 'max_drift': 0.01}


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
    with gate_process(files, 'cell', *parameters(**PATIENT)) as process:
        made = Bench(ask.node, 'cell')
        made.wait(process, '')
        yield made
        assert process.stop(signal.SIGTERM) == 0
        assert 'Traceback' not in process.said()


@pytest.fixture(scope='module')
def fake(files: Path) -> Iterator[FakeGuard]:
    with fake_guard('fake') as made:
        yield made


@pytest.fixture(scope='module')
def faked(files: Path, ask: Asker, fake: FakeGuard) -> Iterator[Bench]:
    """Yield what stands around a gate that asks the guard which answers at will."""
    arguments = parameters(clearance=0.01, deadline=0.3, **PATIENT)
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
    soon(lambda: bench.statuses[-1].reason_code == 'state_stale', 'the status')
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
    # The gate has seen that joint now, and waits for it until its state is not fresh any more.
    assert bench.code(FREE) == 'proved_free'
    bench.rest([0.0, 0.0])
    time.sleep(PATIENT['max_state_age'])


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
    # The guard has answered all the same.
    assert faked.decisions[-1].result.verdict == CertificationResult.FREE


def test_states_stop_meanwhile(files: Path, ask: Asker, fake: FakeGuard) -> None:
    with gate_process(files, 'stopping', *parameters(guard='/fake/guard')) as gate:
        made = Bench(ask.node, 'stopping')
        made.wait(gate, '')
        fake.go.clear()
        asked = len(fake.asked)
        made.send(FREE)
        soon(lambda: len(fake.asked) > asked, 'the request')
        made.tells = False
        time.sleep(0.3)
        fake.go.set()
        soon(lambda: made.decisions, 'a decision')
        assert made.decisions[-1].reason_code == 'state_stale'


@pytest.mark.parametrize(
    ('said', 'code'),
    [
        ({'ready': False}, 'guard_not_ready'),
        ({'ready': True, 'scene_hash': 'another'}, 'scene_changed'),
    ],
)
def test_the_guard_changes_meanwhile(
    faked: Bench, fake: FakeGuard, said: dict[str, Any], code: str
) -> None:
    fake.go.clear()
    count, asked = len(faked.decisions), len(fake.asked)
    faked.send(APPROACHED)
    soon(lambda: len(fake.asked) > asked, 'the request')
    fake.say(**said)
    time.sleep(0.05)
    fake.go.set()
    soon(lambda: len(faked.decisions) > count, 'a decision')
    assert faked.decisions[-1].reason_code == code
    fake.say(ready=True)
    soon(lambda: faked.statuses[-1].ready, 'the status')


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


def test_diagnostics(faked: Bench) -> None:
    heard: list[DiagnosticArray] = []
    faked.node.create_subscription(DiagnosticArray, '/diagnostics', heard.append, 10)
    faked.free(FREE)

    def told() -> bool:
        return any(
            status.name == 'fake/gate: gate'
            and status.level == DiagnosticStatus.OK
            and any(value.key == 'outcome passed' for value in status.values)
            for array in heard
            for status in array.status
        )

    soon(told, 'the diagnostics')


# A guard that ends, and clocks


def test_a_guard_that_is_killed_meanwhile(
    monkeypatch: pytest.MonkeyPatch, files: Path, ask: Asker, workcell: list[str]
) -> None:
    monkeypatch.setenv('FASTRTPS_DEFAULT_PROFILES_FILE', str(CONFIG / 'fastdds.xml'))
    with gate_process(files, 'mortal', *parameters(deadline=0.3, **PATIENT)) as gate:
        made = Bench(ask.node, 'mortal')
        made.wait(gate, 'guard_missing')
        assert made.code(FREE) == 'guard_missing'
        with guard_process(files, 'mortal', *workcell) as guard:
            soon(lambda: made.statuses[-1].ready, 'the guard', PATIENCE)
            made.free(FREE)
            guard.process.send_signal(signal.SIGSTOP)
            count = len(made.decisions)
            made.send(FREE)
            time.sleep(0.1)
            guard.process.kill()
            soon(lambda: len(made.decisions) > count, 'a decision')
            assert made.decisions[-1].reason_code == 'guard_silent'
        assert made.code(STOP) == 'stop'
        soon(lambda: made.statuses[-1].reason_code == 'guard_missing', 'the status')
        with guard_process(files, 'mortal', *workcell):
            soon(lambda: made.statuses[-1].ready, 'the guard', PATIENCE)
            made.free(FREE)
        assert_in_order(made)
        assert gate.stop(signal.SIGINT) == 0


def test_states_that_never_came(files: Path, ask: Asker, fake: FakeGuard) -> None:
    arguments = parameters(guard='/fake/guard', joint_states_topic='nobody')
    with gate_process(files, 'without', *arguments) as gate:
        made = Bench(ask.node, 'without')
        soon(lambda: made.statuses and made.statuses[-1].reason_code == 'state_stale', 'a status')
        assert 'no joint state' in made.statuses[-1].message
        soon(lambda: made.sender.get_subscription_count() == 1, 'the gate')
        assert made.code(FREE) == 'state_stale'
        assert gate.process.poll() is None


def test_a_clock_that_jumps(files: Path, ask: Asker) -> None:
    clock = ask.node.create_publisher(Clock, '/simulated/clock', 1)
    remap = ['-r', '/clock:=/simulated/clock', *parameters(use_sim_time=True, **PATIENT)]

    def tell(seconds: int) -> None:
        clock.publish(Clock(clock=Time(sec=seconds)))
        time.sleep(0.1)

    with fake_guard('simulated'), gate_process(files, 'simulated', *remap) as gate:
        made = Bench(ask.node, 'simulated')
        made.wait(gate, 'state_stale')
        soon(lambda: clock.get_subscription_count() == 1, 'the gate')
        # Wall clock stamps while the simulated clock has not begun.
        assert made.code(FREE) == 'state_stale'
        made.stamp_ns = lambda: 1000 * 10**9
        tell(1000)
        made.free(FREE)
        for seconds in (2000, 500, 0, 999):
            tell(seconds)
            assert made.code(FREE) == 'state_stale'
        tell(1000)
        made.free(FREE)
        # The clock stands still, and so do the stamps, but nothing arrives any more.
        made.tells = False
        time.sleep(0.5)
        assert made.code(FREE) == 'state_stale'
        assert_in_order(made)


def test_a_deadline_that_is_too_short(files: Path, ask: Asker, fake: FakeGuard) -> None:
    arguments = parameters(guard='/fake/guard', deadline=0.001, answer_margin=0.0)
    with gate_process(files, 'tight', *arguments) as gate:
        made = Bench(ask.node, 'tight')
        made.wait(gate, '')
        fake.go.clear()
        assert made.code(FREE) == 'guard_silent'
        fake.go.set()


def test_nobody_listens(files: Path, ask: Asker, fake: FakeGuard) -> None:
    arguments = parameters(guard='/fake/guard', output_topic='elsewhere')
    with gate_process(files, 'deaf', *arguments):
        made = Bench(ask.node, 'deaf')
        soon(
            lambda: made.statuses and made.statuses[-1].reason_code == 'controller_missing',
            'the status',
        )
        soon(lambda: made.sender.get_subscription_count() == 1, 'the gate')
        assert made.code(FREE) == 'controller_missing'


# Many


def nonsense(rng: np.random.Generator, bench: Bench) -> JointTrajectory:
    """Return a trajectory of which several things may be wrong, and some are not."""

    def often(good: Any, *bad: Any) -> Any:
        return good if rng.random() < 0.95 else bad[rng.integers(len(bad))]

    names = often(
        ['shoulder', 'elbow'], ['elbow', 'shoulder'], ['elbow'], [], ['a', 'b'], ['', '']
    )
    first = often(0.0, 0.5, 3.0) if rng.random() < 0.5 else 1.0
    carried = rng.integers(0, 3)
    made = JointTrajectory(joint_names=names)
    made.header.stamp = often(Time(), bench.now(1.0), bench.now(-1.0), Time(sec=-1), Time(sec=1))
    for i in range(often(2, 1, 3, 20)):
        size = often(len(names), 1, 3)
        q = 2.0 * rng.uniform(-1, 1) * np.ones(size) if i or first else np.zeros(size)
        point = JointTrajectoryPoint(positions=often(q.tolist(), [], [math.nan] * size, [1e308]))
        if carried:
            point.velocities = often([0.0] * size, [], [1.0] * size, [math.inf] * size)
        if carried == 2:
            point.accelerations = often([0.0] * size, [], [-2.0] * size, [math.nan] * size)
        seconds = often(first + i, 0.0, -1.0, 1e6)
        point.time_from_start = Duration(sec=int(seconds), nanosec=int(seconds % 1 * 1e9))
        made.points.append(point)
    return made


def is_proved(cell: Workcell, trajectory: JointTrajectory, stamp_ns: int, now_ns: int) -> bool:
    """Return whether the library proves what the controller would play, the robot at rest."""
    configuration = GateConfiguration.from_values(
        {name: declaration.default for name, declaration in DECLARATIONS.items()} | PATIENT
    )
    state = {name: Measured(0.0, 0.0, 0) for name in ('shoulder', 'elbow')}
    plan = takeover(
        trajectory_from_message(trajectory), stamp_ns, now_ns, state, configuration.allowance
    )
    asked = request_for(trajectory, plan, [0.0] * len(trajectory.joint_names))
    settings = Settings(tracking_tolerance=tuple(asked.tracking_tolerance))
    start = joint_state_from_message(asked.start_state) if asked.start_state.name else None
    verdict = judge(cell, trajectory_from_message(asked.trajectory), start, settings).verdict
    return verdict is Verdict.FREE


def test_nothing_but_what_is_proved_passes_of_a_thousand(bench: Bench, files: Path) -> None:
    cell = Workcell(load_robot(files / 'arm.urdf'), load_scene([files / 'scene.urdf']))
    rng = np.random.default_rng(7)
    codes: dict[str, int] = {}
    for _ in range(1000):
        trajectory = nonsense(rng, bench)
        code = bench.code(trajectory)
        codes[code] = codes.get(code, 0) + 1
        if code == 'proved_free':
            now_ns = nanoseconds(bench.now())
            assert is_proved(cell, trajectory, stamp_from_message(trajectory), now_ns)
    # The cases are not all alike.
    assert codes['proved_free'] > 50
    assert codes['collision'] > 20
    assert len(codes) > 10


def nanoseconds(stamp: Time) -> int:
    return stamp.sec * 10**9 + stamp.nanosec


def test_a_burst_is_decided_in_order(bench: Bench) -> None:
    count = len(bench.decisions)
    rng = np.random.default_rng(3)
    cases = [FREE, HIT, STOP, APPROACHED]
    for k in rng.integers(0, len(cases), 80):
        bench.send(cases[k])
        time.sleep(0.002 * rng.integers(0, 3))
    soon(lambda: len(bench.decisions) == count + 80, 'all decisions')
    codes = {d.reason_code for d in bench.decisions[count:]}
    assert {'superseded', 'stop', 'proved_free'} <= codes
