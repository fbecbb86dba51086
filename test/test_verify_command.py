"""The command ``verify``: what it prints and how it ends."""

import json
from pathlib import Path
import subprocess
import sys

from certificate_maker import Maker, sealed
import pytest
from test_verify import ROBOT, SCENE
from typer.testing import CliRunner

from msg_adapters.text import documents
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.command_line.app import app
from trajectory_guard.paths.joint_path import joint_path

PLAN = """
joint_names: [shoulder, elbow]
points:
- {positions: [0.3, 0.0], time_from_start: {sec: 0, nanosec: 0}}
- {positions: [%s, 0.0], time_from_start: {sec: 1, nanosec: 0}}
"""


class Folder:
    """Robot, scene, two plans in one file, and a certificate of each."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.urdf, self.scene = self.file('robot.urdf', ROBOT), self.file('scene.urdf', SCENE)
        self.plans = self.file('plans.yaml', '---'.join(PLAN % end for end in (1.0, 2.5)))
        self.proofs = folder / 'proofs'
        self.proofs.mkdir()
        robot, scene = load_robot(self.urdf), load_scene(self.scene)
        for name, document in zip('ab', documents(self.plans.read_text(), 'plan'), strict=True):
            path = joint_path(robot.movable, document.trajectory)
            made = Maker(robot, scene, path).certificate(document.trajectory)
            (self.proofs / f'{name}.json').write_text(json.dumps(made))

    def file(self, name: str, text: str) -> Path:
        path = self.folder / name
        path.write_text(text)
        return path

    def run(self, *arguments, **options):
        """Run verify, with other files if given."""
        files = {'urdf': self.urdf, 'scene': self.scene, 'trajectory': self.plans, **options}
        named = [word for name, path in files.items() for word in (f'--{name}', path)]
        return CliRunner().invoke(app, ['verify', *map(str, [*arguments, *named])])


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    return Folder(tmp_path_factory.mktemp('verify'))


def test_a_folder_of_certificates_is_read_by_people(folder):
    run = folder.run(folder.proofs)
    assert run.exit_code == 0, run.stdout
    assert run.stderr == ''
    assert 'a.json: HOLDS: ' in run.stdout
    assert ': FREE\n' in run.stdout
    assert ': COLLISION\n' in run.stdout
    assert 'free      0.000000 .. 1.000000 s\n' in run.stdout
    assert '8 pairs' in run.stdout
    assert 'spheres apart' in run.stdout
    assert 'not covered: links of the robot against each other, base against' in run.stdout
    assert run.stdout.count('taken for granted: ') == 1


def test_json_is_one_object_a_certificate(folder):
    run = folder.run(folder.proofs / 'b.json', folder.proofs / 'a.json', '--json')
    assert run.exit_code == 0
    second, first = (json.loads(line) for line in run.stdout.splitlines())
    assert (first['holds'], first['verdict'], first['pairs_checked']) == (True, 'free', 8)
    assert first['intervals'] == [{'start': 0.0, 'end': 1.0, 'status': 'free'}]
    assert second['verdict'] == 'collision'
    assert second['trusted']


def test_a_wrong_certificate_hides_no_other_and_exits_one(folder, tmp_path):
    wrong = json.loads((folder.proofs / 'a.json').read_text())
    wrong['balls'].pop()
    path = tmp_path / 'wrong.json'
    path.write_text(json.dumps(sealed(wrong)))
    run = folder.run(path, folder.proofs / 'a.json')
    assert run.exit_code == 1
    assert f'{path}: DOES NOT HOLD\n  intervals: ' in run.stdout
    assert 'a.json: HOLDS' in run.stdout
    run = folder.run(path, '--json')
    assert json.loads(run.stdout)['reason_code'] == 'certificate_invalid'
    assert run.stderr.startswith(f'error: {path}: intervals: ')


def test_a_certificate_of_something_else_exits_one(folder, tmp_path):
    other = tmp_path / 'other.yaml'
    other.write_text(PLAN % 1.1)
    run = folder.run(folder.proofs, trajectory=other)
    assert run.exit_code == 1
    assert run.stdout.count('trajectory.sha256') == 2
    scene = tmp_path / 'scene.urdf'
    scene.write_text(SCENE.replace('0.3', '0.30'))
    assert 'scene.sha256' in folder.run(folder.proofs / 'a.json', scene=scene).stdout
    pose = folder.run(folder.proofs / 'a.json', '--scene-pose', '0 0 1 0 0 0')
    assert pose.exit_code == 1
    assert 'scene.sha256' in pose.stdout


def test_what_cannot_be_read_is_bad_input(folder, tmp_path):
    for name, data in (('binary', b'\xff\xfe'), ('list', b'[]'), ('empty', b'')):
        path = tmp_path / f'{name}.json'
        path.write_bytes(data)
        run = folder.run(path)
        assert run.exit_code == 2
        assert f'{path}: UNUSABLE' in run.stdout
    assert folder.run(tmp_path / 'missing.json').exit_code == 2
    (tmp_path / 'nothing').mkdir()
    for run in (
        folder.run(tmp_path / 'nothing'),
        folder.run(folder.proofs, trajectory=tmp_path / 'missing.yaml'),
        folder.run(folder.proofs, urdf=folder.plans),
    ):
        assert run.exit_code == 2
        assert run.stdout == ''
        assert run.stderr.startswith('error: ')
        assert run.stderr.count('\n') == 1


def test_no_code_that_proves_is_code_that_checks():
    """Nothing of the certifier's search, kernels and curves is loaded to verify."""
    code = (
        'import sys, trajectory_guard.verify; '
        'print([name for name in sys.modules if name.startswith("trajectory_guard.")])'
    )
    run = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    for name in ('kernels', 'certify', 'motion', 'request', 'timeline', 'joint_path', 'hermite'):
        assert f"'trajectory_guard.{name}" not in run.stdout
    assert "'trajectory_guard.verify.claims'" in run.stdout
