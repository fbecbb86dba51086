"""The guard and a client that shares nothing with it, over the wire: another vendor's DDS."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import dataclasses
from importlib.util import find_spec
import json
import os
from pathlib import Path
import random
import resource
import struct
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

from guard_process import ARM, DOMAIN, guard_process, GuardProcess, parameters, SCENE
import pytest

from msg_adapters.result import result_from_message
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.result import Result, Status, Verdict
from trajectory_guard.settings import Settings

pytestmark = pytest.mark.skipif(
    find_spec('cyclonedds') is None, reason='needs another DDS (pip install cyclonedds)'
)

CLIENT = Path(__file__).with_name('foreign_client.py')

FREE = [(0, [0.0, 0.0]), (1, [0.5, 0.5])]
HIT = [(0, [1.2, 0.0]), (1, [1.9, 0.0]), (2, [2.0, 1.0])]

# What the guard may take of memory in these tests: four times of what it needs [bytes].
ADDRESS_SPACE = 4 << 30

Asking = Callable[..., Any]


@pytest.fixture(scope='module')
def guard(tmp_path_factory: pytest.TempPathFactory) -> Iterator[GuardProcess]:
    folder = tmp_path_factory.mktemp('foreign')
    (folder / 'scene.urdf').write_text(SCENE)
    arguments = parameters(scene_files=f'[{folder / "scene.urdf"}]')
    with guard_process(folder, 'foreign', *arguments) as process:
        yield process


@contextmanager
def foreign_client(namespace: str) -> Iterator[Asking]:
    """Yield what gives the client a task and returns its answer."""
    with subprocess.Popen(
        [sys.executable, CLIENT, str(DOMAIN), namespace, ARM],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:

        def answer(**task: Any) -> Any:
            process.stdin.write(json.dumps(task) + '\n')
            process.stdin.flush()
            line = process.stdout.readline()
            assert line, 'the client failed'
            return json.loads(line, object_hook=lambda fields: SimpleNamespace(**fields))

        yield answer
        process.stdin.close()


@pytest.fixture(scope='module')
def client(guard: GuardProcess) -> Iterator[Asking]:
    with foreign_client('foreign') as answer:
        yield answer


@pytest.fixture(scope='module')
def workcell(tmp_path_factory: pytest.TempPathFactory) -> Workcell:
    file = tmp_path_factory.mktemp('scene') / 'scene.urdf'
    file.write_text(SCENE)
    return Workcell(robot_from_urdf(ARM), load_scene([file]))


def timeless(result: Result) -> Result:
    """Return a result without the one thing that differs each time."""
    return dataclasses.replace(result, compute_time=0.0)


@pytest.mark.parametrize(
    ('points', 'verdict'), [(FREE, Verdict.FREE), (HIT, Verdict.COLLISION)], ids=['free', 'hit']
)
def test_the_answer_is_the_librarys(
    client: Asking, workcell: Workcell, points: list[Any], verdict: Verdict
) -> None:
    result = result_from_message(client(points=points))
    trajectory = Trajectory.from_points(
        ('shoulder', 'elbow'), [Point(sec * 10**9, q) for sec, q in points]
    )
    expected = judge(workcell, trajectory, None, Settings(tolerance=result.tolerance))
    assert timeless(result) == timeless(expected)
    assert result.verdict is verdict


def payloads(seed: int) -> list[str]:
    """
    Return what is no request, in hexadecimal: noise, cut and damaged requests, false lengths.

    The sender puts four bytes in front: the seconds of the stamp.
    """
    rng = random.Random(seed)
    request = good_payload()
    noise = [rng.randbytes(rng.randrange(400)) for _ in range(100)]
    cut = [request[:size] for size in range(0, len(request), 3)]
    damaged = []
    for _ in range(300):
        some = bytearray(request)
        for _ in range(rng.randint(1, 6)):
            some[rng.randrange(len(some))] = rng.randrange(256)
        damaged.append(bytes(some))
    lengths = [
        request[:at] + struct.pack('<I', size) + request[at + 4 :]
        for at in range(0, len(request) - 3, 4)
        for size in (0x01000000, 0x10000000, 0x7FFFFFFF, 0xFFFFFFFF)
    ]
    return [some.hex() for some in (*noise, *cut, *damaged, *lengths)]


def good_payload() -> bytes:
    """Return the trajectory FREE as plain CDR behind the seconds of its stamp, written by hand."""
    out = bytearray(4)

    def put(form: str, *values: Any) -> None:
        for value in values:
            size = struct.calcsize('<' + form)
            out.extend(bytes(-len(out) % size))
            out.extend(struct.pack('<' + form, value))

    def text(value: str) -> None:
        data = value.encode() + b'\0'
        put('I', len(data))
        out.extend(data)

    def numbers(values: list[float]) -> None:
        put('I', len(values))
        put('d', *values)

    put('I', 0)
    text('')
    put('I', 2)
    text('shoulder')
    text('elbow')
    put('I', len(FREE))
    for sec, q in FREE:
        for values in (q, [], [], []):
            numbers(values)
        put('I', sec, 0)
    put('I', 0, 0)
    text('')
    put('I', 0, 0, 0, 0)
    put('d', 0.0, 0.0)
    put('I', 0, 0, 0)
    put('B', 0, 0, 0)
    return bytes(out[4:])


def test_no_payload_brings_the_guard_down(client: Asking, guard: GuardProcess) -> None:
    assert client(points=FREE).verdict == Verdict.FREE
    resource.prlimit(guard.process.pid, resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    sent = payloads(seed=1)
    assert client(garbage=sent) == len(sent)
    assert client(points=HIT).verdict == Verdict.COLLISION
    assert client(points=FREE).verdict == Verdict.FREE
    assert guard.process.poll() is None
    assert 'Traceback' not in guard.said()


def test_a_foreign_scene_is_checked(tmp_path: Path) -> None:
    cylinder, cube = 3, 1
    post = (1, cylinder, [0.0, 1.5, 0.0], [0.1, 0.1, 2.0])
    wall = (2, cube, [-1.2, 0.0, 0.0], [0.2, 4.0, 2.0])
    with (
        guard_process(tmp_path, 'shown', *parameters(live_scene='true')),
        foreign_client('shown') as answer,
    ):
        status = answer(markers=[post, wall])
        assert status.ready
        assert answer(points=FREE).verdict == Verdict.FREE
        hit = answer(points=HIT)
        assert hit.verdict == Verdict.COLLISION
        assert hit.scene_hash == status.scene_hash
        named = {row.obstacle for row in hit.intervals if row.status == Status.COLLISION}
        assert named == {'seen/1', 'seen/2'}
        assert answer(moments=True) > 0


def test_the_client_shares_nothing() -> None:
    environment = {name: value for name, value in os.environ.items() if name != 'PYTHONPATH'}
    environment['PYTHONPATH'] = os.pathsep.join(
        [str(CLIENT.parent), str(Path(find_spec('cyclonedds').origin).parents[1])]
    )
    program = (
        'import foreign_client, sys; '
        'sys.exit(any(n.split(".")[0] in {"rclpy", "trajectory_guard", "msg_adapters", '
        '"trajectory_guard_interfaces"} for n in sys.modules))'
    )
    subprocess.run([sys.executable, '-c', program], env=environment, check=True)
