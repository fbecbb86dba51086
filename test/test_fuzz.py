"""
Hostile requests: they are judged or refused, never an error, and free is what another judge finds.

The other judge plays the message by scipy's polynomials and measures distances by coal.
"""

from collections import Counter
from collections.abc import Iterator
import dataclasses
from itertools import pairwise
from pathlib import Path
import random
import signal
import socket
import time
from typing import Any, NamedTuple

from guard_process import (
    asker,
    gathered,
    guard_process,
    GuardProcess,
    message,
    parameters,
    SCENE,
)
from hostile_requests import hostile, RANGES, span_ns, URDF
import numpy as np
import pytest
from scipy.interpolate import BPoly
from sensor_msgs.msg import JointState
from sweep import Sweep
from trajectory_guard_interfaces.srv import CertifyTrajectory

from msg_adapters.result import result_from_message, result_to_message
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certificate import text
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason, TrajectoryGuardError
from trajectory_guard.result import Result, Status, Verdict
from trajectory_guard.ros.configuration import Configuration
from trajectory_guard.ros.parameters import DECLARATIONS
from trajectory_guard.ros.question import question_from_request

# What the guard is told; small, so that no request takes long.
TOLD = {'clearance': 0.002, 'tracking_tolerance': [0.0005], 'max_points': 64, 'max_joints': 16}
TOLD |= {'max_pieces': 2000}
CONFIGURATION = Configuration.from_values(
    {name: declaration.default for name, declaration in DECLARATIONS.items()} | TOLD
)

FREE = message((0.0, [0.0, 0.0, 0.1]), (1.0, [0.5, 0.5, 0.1]), joints=[*RANGES])
HIT = message((0.0, [1.2, 0.0, 0.1]), (1.0, [1.9, 0.0, 0.1]), joints=[*RANGES])

FEW, MANY = 3000, 100_000
# Few at once: a guard may refuse more than it has hands for.
SENT, BATCH = 2000, 2
TIME_LIMIT = 90.0  # s
SAMPLES = 48

# What coal may be off by [m], and what the guard takes for resting within a limit [rad or m].
COAL_ERROR = 1e-7
LIMIT_SLACK = 1e-5
LIMITS = {'shoulder': (-3.0, 3.0), 'slide': (0.0, 0.4)}


@pytest.fixture(scope='module')
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('workcell')
    (folder / 'arm.urdf').write_text(URDF)
    (folder / 'scene.urdf').write_text(SCENE)
    return folder


@pytest.fixture(scope='module')
def workcell(files: Path) -> Workcell:
    return Workcell(robot_from_urdf(URDF), load_scene([files / 'scene.urdf']))


@pytest.fixture(scope='module')
def guard(files: Path) -> Iterator[GuardProcess]:
    arguments = parameters(
        robot_description_file=files / 'arm.urdf',
        scene_files=f'[{files / "scene.urdf"}]',
        **TOLD,
    )
    with guard_process(files, 'fuzzed', *arguments) as process:
        yield process
        assert process.stop(signal.SIGTERM) == 0
        assert 'Traceback' not in process.said()


class Curve(NamedTuple):
    """
    The motion of one joint.

    :param pieces: start and end [s] and polynomial of each segment.
    :param rest: position where there is no segment [rad or m].
    """

    pieces: list[tuple[float, float, BPoly]]
    rest: float

    def at(self, seconds: float) -> float:
        """Return the position [rad or m]."""
        for start, end, piece in self.pieces:
            if start <= seconds <= end:
                return float(piece((seconds - start) / (end - start)))
        return self.rest


def curves(request: Any) -> dict[str, Curve]:
    """Return what the controller plays for a request that is free, joint by joint."""
    state = request.start_state
    speeds = [*state.velocity] or [0.0] * len(state.name)
    measured = {
        name: (q, 0.0 if np.isnan(v) else v)
        for name, q, v in zip(state.name, state.position, speeds, strict=True)
    }
    played = {}
    for j, name in enumerate(request.trajectory.joint_names):
        knots = []
        for point in request.trajectory.points:
            values = [point.positions[j]]
            values += [point.velocities[j]] if len(point.velocities) else []
            values += [point.accelerations[j]] if len(point.accelerations) else []
            knots.append((span_ns(point.time_from_start), values))
        if knots[0][0] > 0:
            q, v = measured[name]
            if name == 'elbow':
                q += 2 * np.pi * np.round((knots[0][1][0] - q) / (2 * np.pi))
            knots.insert(0, (0, [q, v, 0.0]))
        pieces = []
        for (start, left), (end, right) in pairwise(knots):
            # Derivatives by the segment's own time, from 0 to 1: durations may be a nanosecond.
            order, h = min(len(left), len(right)), (end - start) * 1e-9
            ends = [[d * h**k for k, d in enumerate(side[:order])] for side in (left, right)]
            pieces.append((start * 1e-9, end * 1e-9, BPoly.from_derivatives([0.0, 1.0], ends)))
        played[name] = Curve(pieces, knots[-1][1][0])
    for name in RANGES:
        if name not in played:
            played[name] = Curve([], measured[name][0])
    return played


def moved_links(commanded: list[str]) -> set[str]:
    """Return the links that some joints move."""
    chain = ['shoulder', 'elbow', 'slide']
    first = min(chain.index(name) for name in commanded)
    return {'upper', 'lower', 'hand', 'finger'} - set(['upper', 'lower'][:first])


def check_free(sweep: Sweep, request: Any, result: Result, rng: np.random.Generator) -> None:
    """Raise an AssertionError if a free answer is not what the other judge finds."""
    end_ns = span_ns(request.trajectory.points[-1].time_from_start)
    assert result.duration_ns == end_ns
    assert [row.status for row in result.intervals] == [Status.FREE] * len(result.intervals)
    ends = [0, *(row.end_ns for row in result.intervals)]
    assert [row.start_ns for row in result.intervals] == ends[:-1]
    assert ends[-1] == end_ns
    assert result.clearance == max(request.clearance, TOLD['clearance'])

    knots = [span_ns(point.time_from_start) for point in request.trajectory.points]
    times = np.concatenate([rng.uniform(0.0, end_ns, SAMPLES), knots]) * 1e-9
    names = request.trajectory.joint_names
    played = curves(request)
    asked = [*request.tracking_tolerance] or [0.0]
    asked = dict(zip(names, asked * (len(names) if len(asked) == 1 else 1), strict=True))
    columns = {}
    for name, curve in played.items():
        q = np.array([curve.at(t) for t in times])
        if name in LIMITS and name in names:
            low, high = LIMITS[name]
            assert low - LIMIT_SLACK <= q.min()
            assert q.max() <= high + LIMIT_SLACK
        slack = (asked[name] or TOLD['tracking_tolerance'][0]) if name in names else 0.0
        off = rng.uniform(-1.0, 1.0, len(times))
        off[::2] = np.sign(off[::2])
        columns[name] = q + slack * off
    columns['grip'] = 0.1 - 0.5 * columns['slide']
    q = np.column_stack([columns[joint.name] for joint in sweep.robot.movable])
    gaps, _ = sweep.gaps(q, moved_links(names), result.clearance + 1e-3)
    assert gaps.min() > result.clearance - COAL_ERROR, request


def answered(workcell: Workcell, request: Any) -> Result:
    """Return what the guard answers, by the way its node takes."""
    try:
        return judge(workcell, *question_from_request(request, CONFIGURATION))
    except TrajectoryGuardError as error:
        assert error.reason in Reason
        return Result.rejected(error, CONFIGURATION.settings)


def hostile_requests(seed: int, count: int, **options: bool) -> Iterator[Any]:
    """Yield hostile requests."""
    rng = random.Random(seed)
    for _ in range(count):
        yield hostile(rng, **options)


@pytest.mark.filterwarnings('error')
def test_overflow_is_refused_in_silence(workcell: Workcell) -> None:
    huge = message((0.0, [0.0]), (1.0, [1.2e308]), (2.0, [-0.4e308]), joints=['elbow'])
    state = JointState(name=[*RANGES], position=[0.0, 0.0, 0.1])
    result = answered(workcell, CertifyTrajectory.Request(trajectory=huge, start_state=state))
    assert result.reason_code == Reason.TOO_LARGE


def fuzzed(workcell: Workcell, seed: int, count: int) -> Counter[str]:
    """Judge many requests, and return how often each verdict and each reason was given."""
    sweep, rng = Sweep(workcell), np.random.default_rng(seed)
    seen: Counter[str] = Counter()
    end = time.monotonic() + TIME_LIMIT
    for request in hostile_requests(seed, count):
        result = answered(workcell, request)
        message = result_to_message(result)
        assert result.reason_code != Reason.INTERNAL_ERROR, (result.message, request)
        assert result.reason_code or result.verdict in (Verdict.FREE, Verdict.COLLISION)
        back = result_from_message(message)
        assert (back.verdict, len(back.intervals)) == (result.verdict, len(result.intervals))
        if result.certificate is not None:
            assert text(result.certificate)
        if result.verdict is Verdict.FREE:
            check_free(sweep, request, result, rng)
        seen.update({result.verdict.name: 1, f'{result.verdict.name} {result.reason_code}': 1})
        if time.monotonic() > end:
            break
    return seen


def test_the_other_judge_objects(workcell: Workcell) -> None:
    sweep, rng = Sweep(workcell), np.random.default_rng(0)
    request = CertifyTrajectory.Request(trajectory=FREE)
    free = answered(workcell, request)
    check_free(sweep, request, free, rng)
    with pytest.raises(AssertionError):
        check_free(sweep, CertifyTrajectory.Request(trajectory=HIT), free, rng)


@pytest.mark.filterwarnings('error::RuntimeWarning')
def test_hostile_requests_are_judged_or_refused(workcell: Workcell) -> None:
    seen = fuzzed(workcell, seed=1, count=FEW)
    for verdict in Verdict:
        assert seen[verdict.name] >= FEW // 100, seen
    assert sum(name.startswith('REJECTED ') for name in seen) >= 20, seen


@pytest.mark.slow
@pytest.mark.filterwarnings('error::RuntimeWarning')
def test_many_hostile_requests(workcell: Workcell) -> None:
    seen = fuzzed(workcell, seed=2, count=MANY)
    assert seen['FREE'] >= 1000, seen


def hurried(request: Any) -> bool:
    """Say whether the time that an answer takes may change it."""
    return 0 < span_ns(request.deadline) < 10**9


def timeless(result: Result) -> Result:
    """Return a result without the one thing that differs each time."""
    return dataclasses.replace(result, compute_time=0.0)


def assert_right(namespace: str) -> None:
    """Ask a guard from a new node what is free and what is not."""
    with asker() as ask:
        for trajectory, verdict in ((FREE, Verdict.FREE), (HIT, Verdict.COLLISION)):
            request = CertifyTrajectory.Request(trajectory=trajectory)
            assert ask.result(namespace, request).verdict is verdict


def test_the_guard_answers_hostile_requests_as_the_library_does(
    guard: GuardProcess, workcell: Workcell
) -> None:
    sent = list(hostile_requests(3, SENT, sendable=True))
    with asker() as ask:
        ask.wait('fuzzed', guard)
        client = ask.client('fuzzed')
        responses = []
        for first in range(0, SENT, BATCH):
            responses += gathered(
                [client.call_async(request) for request in sent[first : first + BATCH]]
            )
    for request, response in zip(sent, responses, strict=True):
        result = result_from_message(response.result)
        assert result.reason_code != Reason.INTERNAL_ERROR, request
        if not hurried(request):
            assert timeless(result) == timeless(answered(workcell, request)), request
    assert_right('fuzzed')


def datagrams(seed: int, count: int) -> Iterator[bytes]:
    """Yield noise: some of it pure, most of it behind a header and submessages of RTPS."""
    rng = random.Random(seed)
    kinds = (0x01, 0x06, 0x07, 0x08, 0x09, 0x0C, 0x0D, 0x0E, 0x0F, 0x12, 0x13, 0x15, 0x16, 0x80)
    entities = (0x000100C2, 0x000100C7, 0x000003C2, 0x000003C7, 0x000004C2, 0x00001204, 0)
    for _ in range(count):
        if rng.random() < 0.1:
            yield rng.randbytes(rng.randrange(1400))
            continue
        packet = bytearray(b'RTPS\x02\x03\x01\x0f' + rng.randbytes(12))
        for _ in range(rng.randint(1, 5)):
            body = bytearray(rng.randbytes(rng.choice((0, 3, 4, 20, 24, 40, 200))))
            if len(body) >= 20:
                body[2:4] = (16).to_bytes(2, 'little')
                body[4:8] = rng.choice(entities).to_bytes(4, 'big')
                body[8:12] = rng.choice(entities).to_bytes(4, 'big')
            size = rng.choice((len(body), len(body), 0, 0xFFFF))
            packet += bytes((rng.choice(kinds), rng.randrange(16))) + size.to_bytes(2, 'little')
            packet += body
        yield bytes(packet)


def udp_ports(pid: int) -> set[int]:
    """Return the ports that a process of this machine listens to."""
    held = {str(entry.readlink()) for entry in Path(f'/proc/{pid}/fd').iterdir()}
    rows = [line.split() for line in Path(f'/proc/{pid}/net/udp').read_text().splitlines()[1:]]
    return {int(row[1].split(':')[1], 16) for row in rows if f'socket:[{row[9]}]' in held}


def test_the_guard_survives_noise_on_its_ports(guard: GuardProcess) -> None:
    assert_right('fuzzed')
    ports = udp_ports(guard.process.pid)
    # Of discovery and of what is sent, to one and to all.
    assert len(ports) >= 3
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for packet in datagrams(4, 5000):
            for port in ports:
                sender.sendto(packet, ('127.0.0.1', port))
    assert guard.process.poll() is None, guard.said()
    assert_right('fuzzed')
