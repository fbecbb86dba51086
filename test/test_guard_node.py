"""The service node over real DDS: its answers are the library's, and nothing brings it down."""

from collections.abc import Callable, Iterator
import dataclasses
import json
import math
from pathlib import Path
import signal

from builtin_interfaces.msg import Duration, Time
from guard_process import (
    ARM,
    Asker,
    asker,
    duration,
    gathered,
    guard_process,
    GuardProcess,
    message,
    parameters,
    PATIENCE,
    request,
    ros_context,
    SCENE,
    spinning,
)
import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue, SetParametersResult
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.executors import MultiThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_guard_interfaces.srv import CertifyTrajectory
from trajectory_msgs.msg import JointTrajectory

from msg_adapters.result import result_from_message
from msg_adapters.trajectory import joint_state_from_message, trajectory_from_message
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certificate import text
from trajectory_guard.certify import judge
from trajectory_guard.demo.files import panda_urdf
from trajectory_guard.errors import Reason
from trajectory_guard.result import Result, Verdict
from trajectory_guard.ros.guard import main
from trajectory_guard.ros.guard_node import Guard
from trajectory_guard.settings import Settings

# What the guard under test is told; nothing less may be asked of it.
MINIMUM = Settings(clearance=0.002, tracking_tolerance=(0.001,))

FREE = message((0.0, [0.0, 0.0]), (1.0, [0.5, 0.5]))
HIT = message((0.0, [1.2, 0.0]), (1.0, [1.9, 0.0]), (2.0, [2.0, 1.0]))
APPROACHED = message((0.5, [1.9, 0.0]), (1.0, [1.9, 0.1]))
APPROACHED.points[0].velocities = [0.0, 0.0]
APPROACHED.points[1].velocities = [0.0, 0.0]
SWAPPED = message((0.0, [0.0, 1.2]), (1.0, [0.0, 1.9]), joints=['elbow', 'shoulder'])
AT_REST = JointState(name=['shoulder', 'elbow', 'gripper'], position=[1.2, -0.1, 7.0])
MOVING = JointState(
    name=['elbow', 'shoulder'], position=[-0.1, 1.2], velocity=[math.nan, 2.0], effort=[math.nan]
)

GOOD = {
    'free': request(FREE),
    'hit': request(HIT),
    'approach from an unknown state': request(APPROACHED),
    'approach from rest': request(APPROACHED, start_state=AT_REST),
    'approach while moving': request(APPROACHED, start_state=MOVING),
    'other joint order': request(SWAPPED),
    'finer': request(HIT, tolerance=1e-6),
    'more clearance': request(FREE, clearance=1.15),
    'more tracking tolerance': request(HIT, tracking_tolerance=[0.03]),
    'each its tracking tolerance': request(HIT, tracking_tolerance=[0.01, 0.0]),
    'just the minimum': request(FREE, clearance=0.002, tracking_tolerance=[0.001, 0.001]),
}


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
def workcell(files: Path) -> Workcell:
    return Workcell(load_robot(files / 'arm.urdf'), load_scene([files / 'scene.urdf']))


@pytest.fixture(scope='module')
def guard(files: Path, ask: Asker) -> Iterator[GuardProcess]:
    arguments = parameters(
        robot_description_file=files / 'arm.urdf',
        scene_files=f'[{files / "scene.urdf"}]',
        clearance=MINIMUM.clearance,
        tracking_tolerance=list(MINIMUM.tracking_tolerance),
        max_points=1000,
        max_joints=10,
        max_requests=64,
        deadline=60.0,
    )
    with guard_process(files, 'arm', *arguments) as process:
        ask.wait('arm', process)
        yield process
        assert process.stop(signal.SIGTERM) == 0
        assert 'Traceback' not in process.said()


def back_and_forth(points: int) -> JointTrajectory:
    """Return a trajectory that hits the post between any two points, which takes time to prove."""
    return message(*((i / 1000, [1.2 + 0.7 * (i % 2), 0.0]) for i in range(points)))


def timeless(result: Result) -> Result:
    """Return a result without the one thing that differs each time."""
    return dataclasses.replace(result, compute_time=0.0)


def expected(workcell: Workcell, asked: CertifyTrajectory.Request) -> Result:
    """Return what the library says to a request to a guard with the minimum above."""
    values = list(asked.tracking_tolerance) or [0.0]
    settings = dataclasses.replace(
        MINIMUM,
        tolerance=asked.tolerance or MINIMUM.tolerance,
        clearance=asked.clearance or MINIMUM.clearance,
        tracking_tolerance=tuple(value or MINIMUM.tracking_tolerance[0] for value in values),
        want_certificate=asked.want_certificate,
    )
    start = joint_state_from_message(asked.start_state) if asked.start_state.name else None
    return timeless(judge(workcell, trajectory_from_message(asked.trajectory), start, settings))


# The same answers as from the library


@pytest.mark.parametrize('asked', GOOD.values(), ids=GOOD)
def test_equals_the_library(
    guard: GuardProcess, ask: Asker, workcell: Workcell, asked: CertifyTrajectory.Request
) -> None:
    response = ask.ask('arm', asked)
    assert timeless(result_from_message(response.result)) == expected(workcell, asked)
    assert response.certificate == ''


def test_the_cases_differ(workcell: Workcell) -> None:
    verdicts = {name: expected(workcell, asked).verdict for name, asked in GOOD.items()}
    assert verdicts['free'] is verdicts['just the minimum'] is Verdict.FREE
    assert verdicts['hit'] is Verdict.COLLISION
    assert verdicts['more clearance'] is Verdict.SUSPECT
    assert len(expected(workcell, GOOD['hit']).intervals) > 5
    starts = [expected(workcell, GOOD[name]) for name in GOOD if name.startswith('approach')]
    assert starts[0].intervals[0].reason == Reason.START_STATE_UNKNOWN
    assert len({result.intervals for result in starts}) == 3


def test_certificate_is_that_of_the_library(
    guard: GuardProcess, ask: Asker, workcell: Workcell
) -> None:
    asked = request(HIT, want_certificate=True)
    response = ask.ask('arm', asked)
    assert timeless(result_from_message(response.result)) == expected(workcell, asked)
    trajectory = trajectory_from_message(asked.trajectory)
    settings = dataclasses.replace(MINIMUM, want_certificate=True)
    assert response.certificate == text(judge(workcell, trajectory, None, settings).certificate)
    assert json.loads(response.certificate)['verdict'] == 'collision'


def test_scope_says_how_much_is_asked(guard: GuardProcess, ask: Asker) -> None:
    whole = ask.result('arm', request(HIT))
    first = ask.result('arm', request(HIT, scope=CertifyTrajectory.Request.FIRST))
    assert first.intervals[0] == whole.intervals[0]
    assert first.intervals[-1].reason == Reason.NOT_EXAMINED
    quick = ask.result('arm', request(HIT, scope=CertifyTrajectory.Request.VERDICT))
    assert quick.verdict is whole.verdict is Verdict.COLLISION
    wrong = ask.result('arm', request(FREE, scope=3))
    assert (wrong.verdict, wrong.reason_code) == (Verdict.REJECTED, Reason.INVALID_PARAMETER)
    assert 'scope' in wrong.message


def test_a_request_says_whether_to_look_closer(guard: GuardProcess, ask: Asker) -> None:
    narrow, wide = (
        ask.result('arm', request(HIT, refine=value)).intervals
        for value in (CertifyTrajectory.Request.REFINE_ON, CertifyTrajectory.Request.REFINE_OFF)
    )
    assert narrow == ask.result('arm', request(HIT)).intervals != wide
    wrong = ask.result('arm', request(FREE, refine=3))
    assert (wrong.verdict, wrong.reason_code) == (Verdict.REJECTED, Reason.INVALID_PARAMETER)
    assert 'refine' in wrong.message


def test_deadline_leaves_a_suspect(guard: GuardProcess, ask: Asker) -> None:
    result = ask.result('arm', request(back_and_forth(1000), deadline=Duration(nanosec=1)))
    assert result.verdict is not Verdict.FREE
    assert result.intervals[-1].reason == Reason.DEADLINE
    assert result.intervals[-1].end_ns == result.duration_ns == 999_000_000


def test_real_robot(tmp_path: Path, ask: Asker) -> None:
    (tmp_path / 'scene.urdf').write_text(SCENE)
    joints = [f'panda_joint{i}' for i in range(1, 8)]
    home = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]
    asked = request(
        message((1.0, home), (3.0, [1.5, 1.2, 0.0, -0.5, 0.0, 1.571, 0.785]), joints=joints),
        start_state=JointState(
            name=[*joints, 'panda_finger_joint1', 'panda_finger_joint2'],
            position=[*home[:6], 0.7, 0.02, 0.02],
        ),
    )
    arguments = parameters(
        robot_description_file=panda_urdf(), scene_files=f'[{tmp_path / "scene.urdf"}]'
    )
    with guard_process(tmp_path, 'panda', *arguments) as process:
        ask.wait('panda', process)
        result = ask.result('panda', asked)
        assert process.stop(signal.SIGINT) == 0
        assert 'ready: robot' in process.said()
        assert 'Traceback' not in process.said()
    workcell = Workcell(load_robot(panda_urdf()), load_scene([tmp_path / 'scene.urdf']))
    assert timeless(result) == timeless(
        judge(
            workcell,
            trajectory_from_message(asked.trajectory),
            joint_state_from_message(asked.start_state),
        )
    )
    assert result.verdict is not Verdict.REJECTED
    assert len(result.robot_hash) == len(result.scene_hash) == 64


# Bad input


def bad(change: Callable[[CertifyTrajectory.Request], None]) -> CertifyTrajectory.Request:
    """Return a request that was good before a change."""
    asked = request(message((0.0, [0.0, 0.0]), (1.0, [0.5, 0.5])))
    change(asked)
    return asked


def set_point(index: int, **fields: object) -> Callable[[CertifyTrajectory.Request], None]:
    """Return a change of one point."""

    def change(asked: CertifyTrajectory.Request) -> None:
        for name, value in fields.items():
            setattr(asked.trajectory.points[index], name, value)

    return change


BAD = {
    'zero message': (CertifyTrajectory.Request(), Reason.NO_POINTS),
    'no joints': (bad(lambda r: r.trajectory.joint_names.clear()), Reason.NO_JOINTS),
    'no points': (bad(lambda r: r.trajectory.points.clear()), Reason.NO_POINTS),
    'NaN': (bad(set_point(1, positions=[0.5, math.nan])), Reason.NOT_FINITE),
    'infinite': (bad(set_point(1, velocities=[0.0, math.inf])), Reason.NOT_FINITE),
    'unsorted': (bad(set_point(0, time_from_start=duration(2.0))), Reason.UNSORTED_TIMES),
    'equal times': (bad(set_point(0, time_from_start=duration(1.0))), Reason.UNSORTED_TIMES),
    'negative time': (bad(set_point(0, time_from_start=duration(-1.0))), Reason.NEGATIVE_TIME),
    'time beyond a Duration': (
        bad(set_point(1, time_from_start=Duration(sec=2**31 - 1, nanosec=2**32 - 1))),
        Reason.TOO_LARGE,
    ),
    'unknown joint': (
        request(message((0.0, [0.0, 0.0]), joints=['shoulder', 'knee'])),
        Reason.UNKNOWN_JOINT,
    ),
    'repeated joint': (
        request(message((0.0, [0.0, 0.0]), joints=['shoulder', 'shoulder'])),
        Reason.DUPLICATE_JOINT,
    ),
    'too few positions': (bad(set_point(1, positions=[0.5])), Reason.SIZE_MISMATCH),
    'too many velocities': (bad(set_point(1, velocities=[0.0] * 3)), Reason.SIZE_MISMATCH),
    'no positions': (bad(set_point(1, positions=[])), Reason.MISSING_POSITIONS),
    'effort only': (bad(set_point(1, positions=[], effort=[1.0, 1.0])), Reason.EFFORT_ONLY),
    'accelerations without velocities': (
        bad(set_point(1, accelerations=[0.0, 0.0])),
        Reason.ACCELERATIONS_WITHOUT_VELOCITIES,
    ),
    'beyond the limits': (bad(set_point(1, positions=[0.0, 3.1])), Reason.JOINT_LIMIT),
    'too many points': (
        request(message(*((i / 1000, [0.0, 0.0]) for i in range(1001)))),
        Reason.TOO_LARGE,
    ),
    'too many joints': (
        request(message((0.0, [0.0] * 11), joints=[f'j{i}' for i in range(11)])),
        Reason.TOO_LARGE,
    ),
    'partial, and no start': (
        request(message((0.0, [0.0]), (1.0, [0.5]), joints=['shoulder'])),
        Reason.JOINT_POSITION_UNKNOWN,
    ),
    'starts elsewhere': (request(FREE, start_state=AT_REST), Reason.START_STATE_MISMATCH),
    'half a start': (
        request(APPROACHED, start_state=JointState(name=['elbow'], position=[0.0])),
        Reason.START_STATE_UNKNOWN,
    ),
    'start without names': (
        request(FREE, start_state=JointState(position=[0.0, 0.0])),
        Reason.SIZE_MISMATCH,
    ),
    'infinite start': (
        request(FREE, start_state=JointState(name=['elbow'], position=[math.inf])),
        Reason.NOT_FINITE,
    ),
    'too large a start': (
        request(FREE, start_state=JointState(name=[f'j{i}' for i in range(11)])),
        Reason.TOO_LARGE,
    ),
    'too many positions at the start': (
        request(FREE, start_state=JointState(name=['elbow'], position=[0.0] * 11)),
        Reason.TOO_LARGE,
    ),
    'a stamp': (
        bad(lambda r: setattr(r.trajectory.header, 'stamp', Time(sec=1))),
        Reason.INVALID_PARAMETER,
    ),
    # The controller's type of time raises at negative seconds.
    'a stamp whose parts add up to 0': (
        bad(lambda r: setattr(r.trajectory.header, 'stamp', Time(sec=-1, nanosec=10**9))),
        Reason.INVALID_PARAMETER,
    ),
    'negative tolerance': (request(FREE, tolerance=-1e-4), Reason.INVALID_TOLERANCE),
    'NaN tolerance': (request(FREE, tolerance=math.nan), Reason.INVALID_TOLERANCE),
    'negative clearance': (request(FREE, clearance=-0.1), Reason.INVALID_CLEARANCE),
    'NaN clearance': (request(FREE, clearance=math.nan), Reason.INVALID_CLEARANCE),
    'less clearance': (request(FREE, clearance=0.001), Reason.BELOW_MINIMUM),
    'negative tracking tolerance': (
        request(FREE, tracking_tolerance=[0.01, -0.01]),
        Reason.INVALID_TRACKING_TOLERANCE,
    ),
    'NaN tracking tolerance': (
        request(FREE, tracking_tolerance=[math.nan]),
        Reason.INVALID_TRACKING_TOLERANCE,
    ),
    'less tracking tolerance': (
        request(FREE, tracking_tolerance=[0.01, 0.0009]),
        Reason.BELOW_MINIMUM,
    ),
    'three tracking tolerances': (
        request(FREE, tracking_tolerance=[0.01] * 3),
        Reason.INVALID_TRACKING_TOLERANCE,
    ),
    'a hundred tracking tolerances': (
        request(FREE, tracking_tolerance=[0.01] * 100),
        Reason.TOO_LARGE,
    ),
    'negative deadline': (request(FREE, deadline=Duration(sec=-1)), Reason.INVALID_DEADLINE),
}


@pytest.mark.parametrize(('asked', 'reason'), BAD.values(), ids=BAD)
def test_bad_request_is_rejected(
    guard: GuardProcess, ask: Asker, asked: CertifyTrajectory.Request, reason: Reason
) -> None:
    result = ask.result('arm', asked)
    assert (result.verdict, result.reason_code) == (Verdict.REJECTED, reason), result.message
    assert result.message
    assert result.intervals == ()
    assert ask.result('arm', request(FREE)).verdict is Verdict.FREE


def test_parallel_requests(guard: GuardProcess, ask: Asker, workcell: Workcell) -> None:
    wanted = {name: expected(workcell, asked) for name, asked in GOOD.items()}
    clients = [ask.client('arm') for _ in range(8)]
    names = [[*GOOD][i % len(GOOD)] for i in range(50)]
    futures = [clients[i % 8].call_async(GOOD[name]) for i, name in enumerate(names)]
    for name, response in zip(names, gathered(futures), strict=True):
        assert timeless(result_from_message(response.result)) == wanted[name]


def set_parameters(ask: Asker, **values: ParameterValue) -> SetParametersResult:
    """Change parameters of the guard together."""
    client = ask.node.create_client(
        SetParametersAtomically, '/arm/guard/set_parameters_atomically'
    )
    assert client.wait_for_service(PATIENCE)
    changed = [ParameterMessage(name=name, value=value) for name, value in values.items()]
    (response,) = gathered(
        [client.call_async(SetParametersAtomically.Request(parameters=changed))]
    )
    return response.result


def number(value: float) -> ParameterValue:
    return ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)


def test_parameters_change_together_or_not_at_all(
    guard: GuardProcess, ask: Asker, workcell: Workcell
) -> None:
    refused = set_parameters(ask, clearance=number(0.5), tolerance=number(math.nan))
    assert not refused.successful
    assert 'tolerance' in refused.reason
    assert timeless(ask.result('arm', request(HIT))) == expected(workcell, request(HIT))

    try:
        assert set_parameters(ask, clearance=number(0.5), tolerance=number(1e-3)).successful
        result = ask.result('arm', request(FREE, clearance=0.4))
        assert (result.verdict, result.reason_code) == (Verdict.REJECTED, Reason.BELOW_MINIMUM)
        result = ask.result('arm', request(FREE))
        assert (result.clearance, result.tolerance) == (0.5, 1e-3)
    finally:
        set_parameters(ask, clearance=number(MINIMUM.clearance), tolerance=number(1e-4))
    assert timeless(ask.result('arm', request(HIT))) == expected(workcell, request(HIT))


# Start and stop


@pytest.fixture
def kept_signals() -> Iterator[None]:
    kept = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in kept.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures('kept_signals')
def test_cannot_start(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'arm.urdf').write_text(ARM)
    (tmp_path / 'moves.urdf').write_text(ARM)
    (tmp_path / 'broken.yaml').write_text('guard: [')
    arm = {'robot_description_file': tmp_path / 'arm.urdf'}
    scene = {'scene_files': f'[{tmp_path / "moves.urdf"}]'}
    bad = {
        'no such robot': (parameters(robot_description_file='no.urdf'), 'no.urdf'),
        'no such scene': (parameters(**arm, scene_files='[no.stl]'), 'no.stl'),
        'no scene': (parameters(**arm, **scene), 'can move'),
        'no number': (parameters(tolerance='fine'), 'tolerance'),
        'out of range': (parameters(clearance=-0.5), 'clearance'),
        'no pose': (parameters(scene_pose='[1.0, 2.0]'), 'scene_pose'),
        'misspelt': (parameters(clearence=0.05), 'clearence'),
        'no topic': (parameters(robot_description_topic='a b'), 'robot_description_topic'),
        'no parameters': (['--params-file', str(tmp_path / 'broken.yaml')], 'broken.yaml'),
        'not for ROS': (['--', 'extra'], 'extra'),
    }
    for name, (arguments, word) in bad.items():
        assert main(['guard', '--ros-args', *arguments]) == 2, name
        said = capfd.readouterr().err.strip().splitlines()
        assert 'FATAL' in said[-1] and word in said[-1], said
        assert 'Traceback' not in ' '.join(said)


def test_exit_code(tmp_path: Path) -> None:
    with guard_process(tmp_path, 'bad', *parameters(robot_description_file='no.urdf')) as process:
        assert process.process.wait(PATIENCE) == 2
        (line,) = process.said().strip().splitlines()
        assert 'FATAL' in line and 'no.urdf' in line


def test_stops_while_busy(files: Path, ask: Asker) -> None:
    arguments = parameters(
        robot_description_file=files / 'arm.urdf', scene_files=f'[{files / "scene.urdf"}]'
    )
    with guard_process(files, 'busy', *arguments) as process:
        ask.wait('busy', process)
        client = ask.client('busy')
        long = request(back_and_forth(3000), tolerance=1e-8, deadline=duration(1.0))
        futures = [client.call_async(long) for _ in range(3)]
        assert ask.result('busy', request(FREE)).verdict is Verdict.FREE
        assert process.stop(signal.SIGTERM) == 0
        assert 'Traceback' not in process.said()
    for future in futures:
        assert not future.done() or future.result().result.verdict == Verdict.COLLISION


# The robot from its topic


def test_robot_from_topic(files: Path, ask: Asker) -> None:
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    publish = {
        name: ask.node.create_publisher(String, f'/{name}/robot_description', latched).publish
        for name in ['early', 'late']
    }
    scene = Parameter('scene_files', value=[str(files / 'scene.urdf')])
    publish['early'](String(data=ARM))
    with ros_context() as context:
        executor = MultiThreadedExecutor(8, context=context)
        for name in publish:
            options = {'context': context, 'namespace': name, 'cli_args': ['--ros-args']}
            guard = Guard(parameter_overrides=[scene], **options)
            executor.add_node(guard)
            executor.create_task(guard.start)
        with spinning(executor):
            # A robot published before the node was there.
            robot = load_robot(files / 'arm.urdf')
            assert until(ask, 'early', Verdict.FREE).robot_hash == robot.digest()

            result = ask.result('late', request(FREE, want_certificate=True))
            assert (result.verdict, result.reason_code) == (Verdict.REJECTED, Reason.NOT_READY)
            assert '/late/robot_description' in result.message
            assert 'robot_description_file' in result.message

            publish['late'](String(data=ARM.replace('</joint>', '', 1)))
            until(ask, 'late', Verdict.REJECTED, 'broken XML')
            publish['late'](String(data=ARM))
            assert until(ask, 'late', Verdict.FREE).robot_hash == robot.digest()

            # Another robot of the same name, and then one that is none: the one before is gone.
            publish['late'](String(data=ARM.replace('1.0 0.1 0.1', '1.0 3.2 0.1')))
            until(ask, 'late', Verdict.COLLISION)
            publish['late'](String(data='<robot name="arm"/>'))
            until(ask, 'late', Verdict.REJECTED, 'no link')


def until(ask: Asker, namespace: str, verdict: Verdict, text: str = '') -> Result:
    """Ask until the answer is as wanted; whatever is rejected before is for a lack of a robot."""
    for _ in range(10_000):
        result = ask.result(namespace, request(FREE))
        if result.verdict is verdict and text in result.message:
            return result
        assert result.verdict is not Verdict.REJECTED or result.reason_code == Reason.NOT_READY
    raise AssertionError(result)
