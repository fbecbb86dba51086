"""The guard among other nodes: its life, what it hears, and whatever goes wrong around it."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
import signal
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
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
    SCENE,
)
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
import pytest
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from trajectory_guard_interfaces.msg import GuardStatus
from trajectory_guard_interfaces.srv import CertifyTrajectory
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.result import result_from_message
from trajectory_guard.errors import Reason
from trajectory_guard.result import Result, Verdict

# What has been published is known by so long after [s].
SOON = 20.0

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
FREE = request(message((0.0, [0.0, 0.0]), (1.0, [0.5, 0.5])))
LATER = request(message((0.5, [0.0, 0.0]), (1.0, [0.5, 0.5])))
SHOULDER = request(message((0.0, [0.0]), (1.0, [0.5]), joints=['shoulder']))
LONG = request(
    message(*((i / 1000, [1.2 + 0.7 * (i % 2), 0.0]) for i in range(3000))),
    tolerance=1e-8,
    deadline=duration(3.0),
)


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


class Manager:
    """
    Calls the services of a guard's lifecycle and parameters.

    :param ask: has the node to call from.
    :param namespace: of the guard.
    """

    def __init__(self, ask: Asker, namespace: str) -> None:
        self._node = ask.node
        self._name = f'/{namespace}/guard'
        self._clients: dict[str, Any] = {}
        self.statuses: list[GuardStatus] = []
        self._seen = 0
        self._node.create_subscription(
            GuardStatus, f'{self._name}/status', self.statuses.append, LATCHED
        )

    def call(self, type_: Any, name: str, asked: Any) -> Any:
        """Return the response of a service of the guard."""
        if name not in self._clients:
            self._clients[name] = self._node.create_client(type_, f'{self._name}/{name}')
            assert self._clients[name].wait_for_service(PATIENCE)
        (response,) = gathered([self._clients[name].call_async(asked)])
        return response

    def change(self, transition: int) -> bool:
        """Ask for a transition; tell whether it was made."""
        asked = ChangeState.Request(transition=Transition(id=transition))
        return bool(self.call(ChangeState, 'change_state', asked).success)

    def state(self) -> int:
        """Return the state of the lifecycle."""
        return int(self.call(GetState, 'get_state', GetState.Request()).current_state.id)

    def set(self, **values: Any) -> str:
        """Change parameters together; return why not, or ''."""
        changed = [
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
        ]
        asked = SetParametersAtomically.Request(parameters=changed)
        result = self.call(SetParametersAtomically, 'set_parameters_atomically', asked).result
        return '' if result.successful else result.reason or 'refused'

    def says(self, wanted: Callable[[GuardStatus], bool]) -> GuardStatus:
        """Return the first status that is as wanted, from the one returned last on."""

        def found() -> int | None:
            later = range(self._seen, len(self.statuses))
            return next((i for i in later if wanted(self.statuses[i])), None)

        # Another guard of the name may have said something after it.
        self._seen = eventually(found, lambda _: True)
        return self.statuses[self._seen]


def eventually(value: Callable[[], Any], wanted: Callable[[Any], bool]) -> Any:
    """Return a value as soon as it is as wanted."""
    end = time.monotonic() + SOON
    while time.monotonic() < end:
        found = value()
        if found is not None and wanted(found):
            return found
        time.sleep(0.02)
    raise AssertionError(f'not in time: {value()}')


def rejection(result: Result) -> str:
    """Return the reason code of a result that says nothing else."""
    assert result.verdict is Verdict.REJECTED
    assert result.intervals == ()
    return result.reason_code


# A manager of lifecycle nodes drives it


@pytest.fixture(scope='module')
def managed(files: Path, ask: Asker) -> Iterator[GuardProcess]:
    arguments = parameters(
        autostart='false',
        robot_description_file='no.urdf',
        scene_files=f'[{files / "scene.urdf"}]',
        max_requests=3,
        max_pieces=100_000_000,
    )
    with guard_process(files, 'managed', *arguments) as process:
        yield process
        assert process.process.poll() is None, process.said()
        assert 'Traceback' not in process.said()


@pytest.fixture(scope='module')
def manager(managed: GuardProcess, ask: Asker) -> Manager:
    return Manager(ask, 'managed')


def test_life(managed: GuardProcess, manager: Manager, ask: Asker, files: Path) -> None:
    assert manager.state() == State.PRIMARY_STATE_UNCONFIGURED
    assert not manager.says(lambda said: bool(said.reason_code)).ready
    # A bad file says why, and changes nothing.
    assert not manager.change(Transition.TRANSITION_CONFIGURE)
    assert 'ERROR' in managed.said() and 'no.urdf' in managed.said()
    assert manager.state() == State.PRIMARY_STATE_UNCONFIGURED
    # What its state does not have is refused, and does not end it.
    assert not manager.change(Transition.TRANSITION_ACTIVATE)
    assert not manager.change(123)
    assert manager.set(robot_description_file=str(files / 'arm.urdf')) == ''
    assert manager.change(Transition.TRANSITION_CONFIGURE)
    assert manager.state() == State.PRIMARY_STATE_INACTIVE

    inactive = ask.result('managed', FREE)
    assert rejection(inactive) == Reason.NOT_READY and 'inactive' in inactive.message
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    free = ask.result('managed', FREE)
    assert free.verdict is Verdict.FREE
    said = manager.says(lambda said: said.ready)
    assert (said.robot_hash, said.scene_hash) == (free.robot_hash, free.scene_hash)

    # What is in use cannot change now, but for the next time.
    other = {'scene_pose': [0.0, 0.0, 0.0, 0.0, 0.0, -1.0]}
    assert 'scene_pose' in manager.set(**other)
    assert manager.set(autostart=True)
    assert manager.change(Transition.TRANSITION_DEACTIVATE)
    assert rejection(ask.result('managed', FREE)) == Reason.NOT_READY
    assert 'inactive' in manager.says(lambda said: not said.ready).message
    assert manager.set(**other) == ''
    # It would answer by what was loaded, not by what its parameters say.
    assert not manager.change(Transition.TRANSITION_ACTIVATE)
    assert manager.state() == State.PRIMARY_STATE_INACTIVE
    assert 'scene_pose' in managed.said()
    assert manager.change(Transition.TRANSITION_CLEANUP)
    assert rejection(ask.result('managed', FREE)) == Reason.NOT_READY
    assert manager.change(Transition.TRANSITION_CONFIGURE)
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    turned = ask.result('managed', FREE)
    assert turned.verdict is Verdict.COLLISION
    assert turned.scene_hash != free.scene_hash

    for _ in range(2):
        manager.change(Transition.TRANSITION_DEACTIVATE)
        assert manager.change(Transition.TRANSITION_CLEANUP)
        assert manager.set(scene_pose=[0.0] * 6) == ''
        assert manager.change(Transition.TRANSITION_CONFIGURE)
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    assert ask.result('managed', FREE).scene_hash == free.scene_hash


def test_long_requests_hold_nothing_up(
    managed: GuardProcess, manager: Manager, ask: Asker
) -> None:
    long = [ask.client('managed').call_async(LONG) for _ in range(2)]
    time.sleep(0.3)
    begin = time.monotonic()
    assert ask.result('managed', FREE).verdict is Verdict.FREE
    assert manager.state() == State.PRIMARY_STATE_ACTIVE
    names = GetParameters.Request(names=['max_requests'])
    assert manager.call(GetParameters, 'get_parameters', names).values[0].integer_value == 3
    assert manager.set(tolerance=1e-4) == ''
    took = time.monotonic() - begin
    assert not any(future.done() for future in long)
    long.append(ask.client('managed').call_async(LONG))
    time.sleep(0.3)
    begin = time.monotonic()
    busy = ask.result('managed', FREE)
    assert rejection(busy) == Reason.BUSY and 'max_requests is 3' in busy.message
    took = max(took, time.monotonic() - begin)
    assert not any(future.done() for future in long)
    assert took < 1.5
    for response in gathered(long):
        assert response.result.verdict == Verdict.COLLISION


def test_what_was_in_flight_is_rejected_when_deactivated(manager: Manager, ask: Asker) -> None:
    long = ask.client('managed').call_async(LONG)
    time.sleep(0.3)
    assert manager.change(Transition.TRANSITION_DEACTIVATE)
    assert not long.done()
    (response,) = gathered([long])
    assert rejection(result_from_message(response.result)) == Reason.NOT_READY
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    assert ask.result('managed', FREE).verdict is Verdict.FREE


def test_what_was_in_flight_is_rejected_when_configured_anew(manager: Manager, ask: Asker) -> None:
    long = ask.client('managed').call_async(LONG)
    time.sleep(0.3)
    for transition in (
        Transition.TRANSITION_DEACTIVATE,
        Transition.TRANSITION_CLEANUP,
        Transition.TRANSITION_CONFIGURE,
        Transition.TRANSITION_ACTIVATE,
    ):
        assert manager.change(transition)
    assert not long.done()
    (response,) = gathered([long])
    # It is about a robot and a scene that are not there any more.
    assert rejection(result_from_message(response.result)) == Reason.NOT_READY
    assert ask.result('managed', FREE).verdict is Verdict.FREE


def test_a_thousand_at_once_are_all_answered(manager: Manager, ask: Asker) -> None:
    depth = QoSProfile(depth=1000)
    client = ask.node.create_client(CertifyTrajectory, '/managed/guard/certify', qos_profile=depth)
    assert client.wait_for_service(PATIENCE)
    answers = gathered([client.call_async(FREE) for _ in range(1000)])
    codes = {(answer.result.verdict, answer.result.reason_code) for answer in answers}
    assert (Verdict.FREE, '') in codes
    assert codes <= {(Verdict.FREE, ''), (Verdict.REJECTED, 'busy')}
    ask.node.destroy_client(client)


def test_deadlines_of_nothing(managed: GuardProcess, ask: Asker) -> None:
    asked = request(LONG.trajectory)
    asked.deadline.nanosec = 1
    result = ask.result('managed', asked)
    assert result.verdict is not Verdict.FREE
    assert result.intervals[-1].reason == Reason.DEADLINE


def test_introspection_records_requests(manager: Manager, ask: Asker) -> None:
    events: list[Any] = []
    ask.node.create_subscription(
        CertifyTrajectory.Event, '/managed/guard/certify/_service_event', events.append, 100
    )
    assert manager.set(introspection='all')
    for level, contents in (('metadata', 0), ('contents', 1)):
        assert manager.set(introspection=level) == ''
        eventually(
            lambda: ask.ask('managed', FREE) and events[-1:],
            lambda last, n=contents: bool(last) and len(last[0].request or last[0].response) == n,
        )
    recorded = eventually(lambda: [e for e in events if len(e.request)], bool)
    assert recorded[-1].request[0].trajectory == FREE.trajectory
    assert manager.set(introspection='off') == ''


def test_a_mesh_that_vanishes(
    managed: GuardProcess, manager: Manager, ask: Asker, files: Path
) -> None:
    def configure(file: str) -> bool:
        manager.change(Transition.TRANSITION_DEACTIVATE)
        manager.change(Transition.TRANSITION_CLEANUP)
        assert manager.set(robot_description_file=str(files / file)) == ''
        return manager.change(Transition.TRANSITION_CONFIGURE)

    mesh = files / 'tip.obj'
    mesh.write_text('v 0 0 0\nv .8 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n')
    box = '<box size="0.8 0.08 0.08"/>'
    assert box in ARM
    (files / 'mesh.urdf').write_text(ARM.replace(box, '<mesh filename="tip.obj"/>'))
    assert configure('mesh.urdf')
    assert manager.change(Transition.TRANSITION_ACTIVATE)
    before = ask.result('managed', FREE)
    mesh.unlink()
    after = ask.result('managed', FREE)
    assert before.verdict is after.verdict is Verdict.FREE
    assert before.robot_hash == after.robot_hash
    assert not configure('mesh.urdf')
    assert 'mesh_missing' in managed.said() and 'tip.obj' in managed.said()
    assert rejection(ask.result('managed', FREE)) == Reason.NOT_READY
    assert configure('arm.urdf')
    assert manager.change(Transition.TRANSITION_ACTIVATE)


def test_says_what_it_decides(manager: Manager, ask: Asker) -> None:
    markers: list[MarkerArray] = []
    ask.node.create_subscription(MarkerArray, '/managed/guard/moments', markers.append, LATCHED)
    statuses: list[DiagnosticStatus] = []
    ask.node.create_subscription(
        DiagnosticArray, '/diagnostics', lambda array: statuses.extend(array.status), 10
    )
    ask.result('managed', request(message((0.0, [1.2, 0.0]), (1.0, [1.9, 0.0]))))
    drawn = eventually(lambda: markers, lambda m: bool(m) and len(m[-1].markers) > 1)[-1]
    assert any('post' in marker.text for marker in drawn.markers)

    def last() -> DiagnosticStatus | None:
        mine = [status for status in statuses if status.name == 'managed/guard: certify']
        return mine[-1] if mine else None

    ok = eventually(last, lambda status: status.level == DiagnosticStatus.OK)
    assert 'busy' in str(ok.values) and 'free' in str(ok.values)
    assert manager.change(Transition.TRANSITION_DEACTIVATE)
    eventually(last, lambda status: status.level == DiagnosticStatus.WARN)
    assert manager.change(Transition.TRANSITION_ACTIVATE)


# What it hears of the robot


def test_joint_states_stand_in_for_a_start_state(manager: Manager, ask: Asker) -> None:
    publish = {
        part: ask.node.create_publisher(JointState, '/managed/joint_states', 10).publish
        for part in ('shoulder', 'elbow')
    }

    def say(part: str, position: float = 0.0, stamp: int = 0) -> None:
        state = JointState(name=[part], position=[position])
        state.header.stamp.sec = stamp
        publish[part](state)

    def saying(asked: CertifyTrajectory.Request, *parts: str, stamp: int = 0) -> Result:
        """Return the answer while some parts say where they are."""
        for part in parts:
            say(part, stamp=stamp)
        time.sleep(0.05)
        return ask.result('managed', asked)

    def unknown() -> Result:
        return ask.result('managed', LATER)

    assert unknown().intervals[0].reason == Reason.START_STATE_UNKNOWN
    assert rejection(ask.result('managed', SHOULDER)) == Reason.JOINT_POSITION_UNKNOWN
    both = eventually(
        lambda: saying(LATER, 'shoulder', 'elbow'), lambda r: r.verdict is Verdict.FREE
    )
    assert '/managed/joint_states' in both.warnings[-1]
    assert saying(SHOULDER, 'elbow').verdict is Verdict.FREE
    # A motion from time 0 of all joints asks for nothing.
    assert not any('joint_states' in warning for warning in saying(FREE, 'elbow').warnings)

    # They stop.
    time.sleep(0.6)
    assert unknown().intervals[0].reason == Reason.START_STATE_UNKNOWN
    assert rejection(ask.result('managed', SHOULDER)) == Reason.JOINT_POSITION_UNKNOWN
    # Half of them, or none that is a state, or one from another time.
    assert saying(LATER, 'elbow').intervals[0].reason == Reason.START_STATE_UNKNOWN
    time.sleep(0.6)
    for stamp in (1, 2**31 - 1):
        stale = saying(LATER, 'shoulder', 'elbow', stamp=stamp)
        assert stale.intervals[0].reason == Reason.START_STATE_UNKNOWN
    publish['elbow'](JointState(name=['shoulder', 'elbow'], position=[0.0]))
    say('shoulder', float('nan'))
    say('elbow', float('inf'))
    time.sleep(0.05)
    assert unknown().intervals[0].reason == Reason.START_STATE_UNKNOWN


# What it hears of the scene


def cube(x: float, **fields: Any) -> MarkerArray:
    """Return an array with one cube of 0.2 m at height 0 on the x axis."""
    marker = Marker(ns='box', id=1, type=Marker.CUBE, **fields)
    marker.header.frame_id = marker.header.frame_id or 'base'
    marker.pose.position.x = x
    marker.pose.orientation.w = 1.0
    marker.scale.x = marker.scale.y = marker.scale.z = 0.2
    marker.color.a = 1.0
    return MarkerArray(markers=[marker])


def test_live_scene_and_two_of_one_name(ask: Asker, files: Path) -> None:
    publish = ask.node.create_publisher(MarkerArray, '/live/guard/scene', LATCHED).publish
    arguments = parameters(
        robot_description_file=files / 'arm.urdf',
        scene_files=f'[{files / "scene.urdf"}]',
        live_scene='true',
        joint_states_topic="''",
        max_pieces=100_000_000,
    )
    with guard_process(files, 'live', *arguments) as first:
        ask.wait('live', first)
        manager = Manager(ask, 'live')
        waiting = ask.result('live', FREE)
        assert rejection(waiting) == Reason.NOT_READY and '/live/guard/scene' in waiting.message

        publish(cube(5.0))
        far = eventually(
            lambda: ask.result('live', FREE), lambda r: r.verdict is not Verdict.REJECTED
        )
        assert far.verdict is Verdict.FREE
        publish(cube(1.5))
        near = eventually(
            lambda: ask.result('live', FREE), lambda r: r.scene_hash != far.scene_hash
        )
        assert near.verdict is Verdict.COLLISION and near.intervals[0].obstacle == 'box/1'
        assert (
            near.scene_hash
            == manager.says(lambda s: s.ready and s.scene_hash != far.scene_hash).scene_hash
        )

        # A marker that cannot be used: nothing is said any more until it is replaced.
        bad = cube(5.0)
        bad.markers[0].scale.x = -1.0
        publish(bad)
        unusable = eventually(
            lambda: ask.result('live', FREE), lambda r: r.verdict is Verdict.REJECTED
        )
        assert rejection(unusable) == Reason.NOT_READY and 'box/1' in unusable.message
        publish(cube(5.0))
        eventually(lambda: ask.result('live', FREE), lambda r: r.verdict is Verdict.FREE)

        # One that changes meanwhile: the answer says by which it is.
        long = ask.client('live').call_async(LONG)
        time.sleep(0.3)
        publish(cube(1.5))
        eventually(lambda: ask.result('live', FREE), lambda r: r.scene_hash == near.scene_hash)
        assert not long.done()
        (response,) = gathered([long])
        assert response.result.scene_hash == far.scene_hash
        publish(cube(5.0))
        eventually(lambda: ask.result('live', FREE), lambda r: r.verdict is Verdict.FREE)

        # One that gets too old meanwhile.
        assert manager.set(max_scene_age=0.5) == ''
        publish(cube(5.0))
        eventually(lambda: ask.result('live', FREE), lambda r: r.verdict is Verdict.FREE)
        long = ask.client('live').call_async(LONG)
        manager.says(lambda said: said.reason_code == Reason.SCENE_STALE)
        assert not long.done()
        (response,) = gathered([long])
        assert rejection(result_from_message(response.result)) == Reason.SCENE_STALE

        # The scene stops.
        assert manager.set(max_scene_age=0.3) == ''
        eventually(lambda: ask.result('live', FREE), lambda r: r.reason_code == Reason.SCENE_STALE)
        manager.says(lambda said: said.reason_code == Reason.SCENE_STALE)
        publish(cube(5.0))
        eventually(lambda: ask.result('live', FREE), lambda r: r.verdict is Verdict.FREE)
        assert manager.set(max_scene_age=0.0) == ''

        # Another of the same name is refused, or both refuse to answer if it is seen too late.
        with guard_process(files, 'live', *arguments) as second:
            eventually(lambda: 'there is another node' in second.said(), bool)
            # One that is killed would stay in the graph; one that ends, ends by itself.
            if '[FATAL]' not in second.said():
                second.process.send_signal(signal.SIGTERM)
            assert second.process.wait(PATIENCE) in (2, 0)
        for _ in range(2):  # longer than the middleware counts one that ended in a hurry
            with suppress(AssertionError):
                eventually(lambda: ask.result('live', FREE), lambda r: r.verdict is Verdict.FREE)
        assert ask.result('live', FREE).verdict is Verdict.FREE

        # One that is there all the same stops the first, as long as it lives.
        with guard_process(files, 'live', *arguments, *parameters(autostart='false')) as second:
            eventually(
                lambda: ask.result('live', FREE),
                lambda r: r.reason_code == Reason.DUPLICATE_NAME,
            )
            manager.says(lambda said: said.reason_code == Reason.DUPLICATE_NAME)
            assert second.stop(signal.SIGTERM) == 0
        eventually(lambda: ask.result('live', FREE), lambda r: r.verdict is Verdict.FREE)
        manager.says(lambda said: said.ready)

        # Killed, there is no answer, and who takes its place need not wait for its ghost to go.
        lost = ask.client('live').call_async(LONG)
        time.sleep(0.3)
        first.stop(signal.SIGKILL)
        assert not lost.done()
    begin = time.monotonic()
    with guard_process(files, 'live', *arguments) as third:
        again = eventually(
            lambda: third.process.poll() is None and 'ready: robot' in third.said(), bool
        )
        assert again
        assert time.monotonic() - begin < 15.0
        assert not lost.done()


def test_stopped_in_the_middle(ask: Asker, files: Path) -> None:
    arguments = parameters(
        robot_description_file=files / 'arm.urdf',
        scene_files=f'[{files / "scene.urdf"}]',
        max_pieces=100_000_000,
        max_requests=2,
    )
    with guard_process(files, 'stopped', *arguments) as process:
        ask.wait('stopped', process)
        client = ask.client('stopped')
        short, long = (
            client.call_async(request(LONG.trajectory, tolerance=1e-8, deadline=duration(seconds)))
            for seconds in (1.5, 30.0)
        )
        eventually(lambda: ask.result('stopped', FREE).reason_code, lambda c: c == Reason.BUSY)
        process.process.send_signal(signal.SIGTERM)
        eventually(
            lambda: ask.result('stopped', FREE).message, lambda said: 'shutting down' in said
        )
        begin = time.monotonic()
        assert process.process.wait(PATIENCE) == 0
        assert time.monotonic() - begin < 5.0
        (response,) = gathered([short])
        assert response.result.verdict == Verdict.COLLISION
        assert not long.done() or long.result().result.verdict == Verdict.COLLISION
