"""The gate over real DDS: nothing passes but what is proved, whatever goes wrong around it."""

from collections.abc import Iterator
from pathlib import Path

from gate_process import Bench, gate_process
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
import pytest
from rclpy.node import Node
from trajectory_msgs.msg import JointTrajectory

FREE = message((0.0, [0.0, 0.0]), (1.0, [0.5, 0.5]))
HIT = message((0.0, [0.0, 0.0]), (1.0, [1.9, 0.0]))
APPROACHED = message((1.0, [0.2, 0.2]), (2.0, [0.5, 0.5]))
STOP = JointTrajectory()


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
def gate(files: Path, guard: GuardProcess) -> Iterator[GuardProcess]:
    with gate_process(files, 'cell') as process:
        yield process
        assert process.process.poll() is None
        assert 'Traceback' not in process.said()


@pytest.fixture(scope='module')
def bench(ask: Asker, gate: GuardProcess) -> Bench:
    made = Bench(ask.node, 'cell')
    made.wait(gate, '', 'guard_not_ready')
    return made


@pytest.fixture(autouse=True)
def at_rest(request: pytest.FixtureRequest) -> None:
    if 'bench' in request.fixturenames:
        bench = request.getfixturevalue('bench')
        bench.tells = True
        bench.rest([0.0, 0.0])


def test_smoke(bench: Bench, gate) -> None:
    for t in (FREE, HIT, APPROACHED, STOP):
        print(bench.code(t), bench.decisions[-1].message, bench.decisions[-1].latency)
    print(bench.statuses[-1])
    print(gate.said())
    assert 0
