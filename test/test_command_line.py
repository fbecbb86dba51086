"""The command line: what it prints, where, and with which exit code."""

import io
import json
import os
from pathlib import Path
import resource
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
from typer.testing import CliRunner

from trajectory_guard.command_line import answer, start
from trajectory_guard.command_line.app import app
from trajectory_guard.command_line.exit_code import exit_code, ExitCode
from trajectory_guard.command_line.json_lines import JsonLines
from trajectory_guard.command_line.report import MAX_ROWS, Report
from trajectory_guard.errors import Reason, TrajectoryGuardError
from trajectory_guard.paths.trajectory import JointState, Point, Trajectory
from trajectory_guard.result import Interval, Result, Status, Verdict

NOTE = 'note: links of the robot are not checked against each other'
STORE = get_typestore(Stores.ROS2_JAZZY)

# Two links of 0.5 m and 0.4 m that turn about z; their slides and ends are far from the post.
ROBOT = """
<robot name="arm">
  <link name="base"/>
  <link name="upper"><collision><origin xyz="0.25 0 0"/>
    <geometry><box size="0.5 0.05 0.05"/></geometry></collision></link>
  <link name="fore"><collision><origin xyz="0.2 0 0"/>
    <geometry><box size="0.4 0.04 0.04"/></geometry></collision></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>
"""
# A post on the y axis: the straight arm meets it at a shoulder angle of 90 degrees.
SCENE = """
<robot name="scene">
  <link name="world"/>
  <link name="post"><collision><origin xyz="0 0.8 0"/>
    <geometry><box size="0.1 0.1 0.5"/></geometry></collision></link>
  <joint name="fixed" type="fixed"><parent link="world"/><child link="post"/></joint>
</robot>
"""


def document(*points: tuple[float, list[float]], **velocities: list[float]) -> str:
    """Return a trajectory as YAML: times [s] and positions."""
    lines = ['joint_names: [shoulder, elbow]', 'points:']
    for index, (time, positions) in enumerate(points):
        sec, nanosec = divmod(round(time * 1e9), 10**9)
        lines.append(f'- positions: {positions}'.replace('nan', '.nan'))
        lines.append(f'  velocities: {velocities.get(f"v{index}", [])}')
        lines.append(f'  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}')
    return '\n'.join([*lines, ''])


FREE = document((0, [0.0, 0.0]), (1, [0.5, 0.3]))
HIT = document((0, [0.0, 0.0]), (2.5, [2.5, 0.0]))
LATE = document((1, [0.0, 0.0]), (2, [0.5, 0.0]))
WRONG = document((0, [0.0, 0.0]), (1, [0.5, float('nan')]))


class Cell:
    """A folder with a robot, a scene and trajectories, and the command to judge them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.urdf = self.file('robot.urdf', ROBOT)
        self.scene = self.file('scene.urdf', SCENE)

    def file(self, name: str, text: str) -> Path:
        path = self.folder / name
        path.write_text(text)
        return path

    def arguments(self, command: str, *arguments: Any) -> list[str]:
        fixed = (command, '--urdf', self.urdf, '--scene', self.scene)
        return [str(argument) for argument in (*fixed, *arguments)]

    def run(self, *arguments: Any, command: str = 'check') -> Any:
        """Run without the note about links against links."""
        return CliRunner().invoke(
            app, self.arguments(command, '--no-self-collision', *arguments), catch_exceptions=False
        )

    def check(self, text: str, *arguments: Any) -> Any:
        return self.run(self.file('plan.yaml', text), *arguments)

    def results(self, text: str, *arguments: Any) -> list[dict]:
        run = self.check(text, '--json', *arguments)
        return [json.loads(line) for line in run.stdout.splitlines()]


@pytest.fixture
def cell(tmp_path: Path) -> Cell:
    return Cell(tmp_path)


def test_a_free_trajectory_is_reported_and_exits_zero(cell: Cell) -> None:
    run = cell.check(FREE)
    assert run.exit_code == 0
    assert run.stderr == ''
    assert run.stdout.startswith(f'{cell.folder}/plan.yaml: FREE\n')
    assert '0.000000000   1.000000000   free' in run.stdout
    assert 'not checked: links of the robot against each other' in run.stdout
    assert '\x1b' not in run.stdout


def test_a_collision_names_pair_and_place_and_exits_one(cell: Cell) -> None:
    run = cell.check(HIT)
    assert run.exit_code == 1
    assert run.stderr == ''
    assert 'plan.yaml: COLLISION\n' in run.stdout
    for word in ('fore', 'post', 'collision', 'gap [mm]'):
        assert word in run.stdout
    (result,) = cell.results(HIT)
    assert result['verdict'] == 'collision'
    inside = next(row for row in result['intervals'] if row['status'] == 'collision')
    assert (inside['body'], inside['obstacle']) == ('fore', 'post')
    assert 1.3 < inside['at'] < 1.8


def test_json_is_all_there_is_on_stdout(cell: Cell) -> None:
    run = cell.check('---\n'.join([FREE, HIT, WRONG]), '--json')
    assert run.exit_code == 2
    first, second, third = (json.loads(line) for line in run.stdout.splitlines())
    assert [r['trajectory'] for r in (first, second, third)] == [
        f'{cell.folder}/plan.yaml#{k}' for k in (1, 2, 3)
    ]
    assert [r['verdict'] for r in (first, second, third)] == ['free', 'collision', 'rejected']
    assert third['reason_code'] == 'not_finite'
    assert first['duration'] == 1.0
    for row, after in zip(second['intervals'], second['intervals'][1:], strict=False):
        assert row['end'] == after['start']
    assert run.stderr == (
        f"error: {cell.folder}/plan.yaml#3: point 1, joint 'elbow': position is nan\n"
    )


def test_one_bad_document_hides_no_other(cell: Cell) -> None:
    run = cell.check('---\n'.join([WRONG, 'points: [\n', FREE]))
    assert run.exit_code == 2
    assert 'plan.yaml#1: REJECTED\n  not_finite: ' in run.stdout
    assert 'plan.yaml#2: REJECTED\n  trajectory_unreadable: line ' in run.stdout
    assert 'plan.yaml#3: FREE' in run.stdout
    assert '3 trajectories: 2 rejected, 1 free' in run.stdout
    assert run.stderr == 'error: 2 of 3 trajectories rejected\n'


def test_one_bad_path_hides_no_other(cell: Cell) -> None:
    run = cell.run(cell.folder / 'nothing.yaml', cell.file('plan.yaml', HIT))
    assert run.exit_code == 2
    assert 'nothing.yaml: REJECTED\n  trajectory_unreadable: no such file or folder' in run.stdout
    assert 'plan.yaml: COLLISION' in run.stdout


@pytest.mark.parametrize(
    ('name', 'content', 'said'),
    [
        ('plan.yaml', b'', 'no trajectory in it'),
        ('plan.yaml', b'---\n', 'no trajectory in it'),
        ('plan.json', b'[]', 'no trajectory in it'),
        ('plan.yaml', b'\xff\xfe', 'nor text'),
        ('plan.bag', b'#ROSBAG V2.0\n', 'rosbags-convert'),
        ('plan.mcap', b'', 'seems to be empty'),
        ('plan.db3', b'', 'plan.db3'),
        ('bench.json', b'{"format": "x", "robots": {}}', 'joint_names and points'),
        ('robot.xml', b'<robot/>', 'joint_names and points'),
    ],
)
def test_a_file_without_a_trajectory_is_bad_input(
    cell: Cell, name: str, content: bytes, said: str
) -> None:
    path = cell.folder / name
    path.write_bytes(content)
    run = cell.run(path, '--json')
    assert run.exit_code == 2
    (line,) = run.stdout.splitlines()
    assert json.loads(line)['verdict'] == 'rejected'
    assert said in json.loads(line)['message']
    assert run.stderr.startswith(f'error: {path}: ')
    assert said in run.stderr


def test_links_against_links_are_said_to_be_unchecked(cell: Cell) -> None:
    arguments = cell.arguments('check', cell.file('plan.yaml', FREE), '--json')
    run = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert run.exit_code == 0
    assert run.stderr.startswith(NOTE)
    assert run.stderr.count('\n') == 1
    result = json.loads(run.stdout)
    assert any('--no-self-collision' in warning for warning in result['warnings'])
    assert any('against each other' in pair for pair in result['unchecked_pairs'])
    (accepted,) = cell.results(FREE)
    assert accepted['warnings'] == []
    assert accepted['unchecked_pairs'] == result['unchecked_pairs']


def test_the_start_closes_the_time_before_the_first_point(cell: Cell) -> None:
    run = cell.check(LATE)
    assert run.exit_code == 1
    assert 'start_state_unknown' in run.stdout
    assert '--start' in run.stdout
    assert cell.check(LATE, '--start', 'shoulder=-0.5,elbow=0').exit_code == 0
    assert cell.check(LATE, '--start', 'shoulder=2.5, elbow=-1e-3').exit_code == 1
    (result,) = cell.results(FREE, '--start', 'shoulder=0.5,elbow=0')
    assert result['reason_code'] == 'start_state_mismatch'


def test_the_scene_goes_where_its_pose_says(cell: Cell) -> None:
    assert cell.check(HIT, '--scene-pose', '0 0 1 0 0 0').exit_code == 0
    # The post turns from the y axis to the x axis, where the arm begins.
    (result,) = cell.results(HIT, '--scene-pose', '0 0 0 0 0 -1.5707963267948966')
    assert result['intervals'][0]['status'] == 'collision'
    # Roll comes first: y goes to z, where yaw leaves it; the other order would leave it on x.
    turned = '0 0 0 1.5707963267948966 0 -1.5707963267948966'
    assert cell.check(HIT, '--scene-pose', turned).exit_code == 0


def test_two_scenes_are_one(cell: Cell) -> None:
    second = cell.file(
        'second.urdf', SCENE.replace('post', 'pole').replace('0 0.8 0', '0.8 0.4 0')
    )
    run = cell.check(FREE, '--scene', second, '--json')
    assert run.exit_code == 1
    assert '"obstacle": "pole"' in run.stdout


def test_clearance_and_tracking_tolerance_are_part_of_the_proof(cell: Cell) -> None:
    near = document((0, [0.0, 0.0]), (1, [1.4, 0.0]))
    assert cell.check(near).exit_code == 0
    assert cell.check(near, '--clearance', '0.1').exit_code == 1
    assert cell.check(near, '--tracking-tolerance', '0.1').exit_code == 1
    (result,) = cell.results(near, '--clearance', '0.02', '--tolerance', '0.001')
    assert (result['clearance'], result['tolerance']) == (0.02, 0.001)


def test_limits_and_end_velocity_are_checked_unless_told(cell: Cell) -> None:
    beyond = document((0, [0.0, 0.0]), (1, [-3.1, 0.0]))
    (result,) = cell.results(beyond)
    assert result['reason_code'] == 'joint_limit'
    run = cell.check(beyond, '--no-joint-limits')
    assert run.exit_code == 0
    assert 'warning: joint limits were not checked' in run.stdout
    moving = document((0, [0.0, 0.0]), (1, [0.1, 0.0]), v0=[0.0, 0.0], v1=[0.1, 0.0])
    (result,) = cell.results(moving)
    assert result['reason_code'] == 'nonzero_end_velocity'
    assert cell.check(moving, '--allow-end-velocity').exit_code == 0


def test_what_is_not_decided_in_time_is_not_free(cell: Cell) -> None:
    (result,) = cell.results(FREE, '--deadline', '0')
    assert result['verdict'] == 'suspect'
    assert result['reason_code'] == 'deadline'
    assert cell.check(FREE, '--deadline', '60').exit_code == 0


@pytest.mark.parametrize(
    ('arguments', 'said'),
    [
        (['--tolerance', 'nan'], ["'--tolerance'", 'nan']),
        (['--tolerance', '-1'], ["'--tolerance'", '-1']),
        (['--tolerance', '0'], ["'--tolerance'", '0.0']),
        (['--tolerance', 'thin'], ["'--tolerance'", 'thin']),
        (['--clearance', '-0.5'], ["'--clearance'", '-0.5']),
        (['--clearance', 'inf'], ["'--clearance'", 'inf']),
        (['--tracking-tolerance', '-1'], ["'--tracking-tolerance'", '-1']),
        (['--tracking-tolerance', 'nan'], ["'--tracking-tolerance'", 'nan']),
        (['--deadline', '-1'], ["'--deadline'", '-1']),
        (['--deadline', 'soon'], ["'--deadline'", 'soon']),
        (['--deadline', '1e300'], ["'--deadline'", '1e300']),
        (['--start', 'shoulder=abc'], ["'--start'", 'shoulder=abc']),
        (['--start', 'shoulder'], ["'--start'", 'JOINT=VALUE', "'shoulder'"]),
        (['--start', '=1'], ["'--start'", "'=1'"]),
        (['--start', ''], ["'--start'", "''"]),
        (['--start', 'shoulder=nan'], ["'--start'", 'shoulder=nan']),
        (['--start', 'shoulder=1,shoulder=1'], ["'--start'", "'shoulder' is given twice"]),
        (['--start', 'panda_joint1=1'], ["'--start'", "'panda_joint1'", 'shoulder, elbow']),
        (['--scene-pose', '1 2 3'], ["'--scene-pose'", '1 2 3', 'six']),
        (['--scene-pose', '0 0 0 0 0 x'], ["'--scene-pose'", 'x is not']),
        (['--scene-pose', '0 0 0 0 0 inf'], ["'--scene-pose'", 'inf']),
        (['--scene', 'nothing.urdf'], ["'--scene'", 'nothing.urdf']),
        (['--urdf', 'nothing.urdf'], ["'--urdf'", 'nothing.urdf']),
        (['--nonsense'], ['--nonsense']),
    ],
)
def test_usage_errors_name_option_and_value(
    cell: Cell, arguments: list[str], said: list[str]
) -> None:
    run = cell.check(FREE, *arguments)
    assert run.exit_code == 2
    assert run.stdout == ''
    for part in said:
        assert part in run.stderr


def test_what_is_missing_is_named(cell: Cell) -> None:
    for command in ('check', 'replay'):
        for arguments in (['x', '--urdf', str(cell.urdf)], ['x', '--scene', str(cell.scene)]):
            run = CliRunner().invoke(app, [command, *arguments])
            assert run.exit_code == 2
            assert 'Missing option' in run.stderr
        run = CliRunner().invoke(app, cell.arguments(command))
        assert run.exit_code == 2
        assert 'Missing argument' in run.stderr
    assert CliRunner().invoke(app, ['nonsense']).exit_code == 2
    assert CliRunner().invoke(app, []).exit_code == 2


@pytest.mark.parametrize(
    ('robot', 'scene', 'said'),
    [
        ('<robot', SCENE, 'robot.urdf'),
        (
            ROBOT.replace('name="elbow" type="revolute"', 'name="elbow" type="planar"'),
            SCENE,
            'planar',
        ),
        (ROBOT, ROBOT, "'shoulder' can move"),
        (ROBOT, '<robot name="x"><link name="a"/></robot>', 'no link has collision geometry'),
        (ROBOT, SCENE.replace('<box size="0.1 0.1 0.5"/>', '<mesh filename="no.stl"/>'), 'no.stl'),
        (
            ROBOT.replace('<box size="0.5 0.05 0.05"/>', '<mesh filename="no.stl"/>'),
            SCENE,
            'no.stl',
        ),
    ],
)
def test_a_bad_robot_or_scene_is_one_line(cell: Cell, robot: str, scene: str, said: str) -> None:
    cell.urdf.write_text(robot)
    cell.scene.write_text(scene)
    run = cell.check(FREE, '--json')
    assert run.exit_code == 2
    assert run.stdout == ''
    assert run.stderr.startswith('error: ')
    assert run.stderr.count('\n') == 1
    assert said in run.stderr


def test_certificates_are_written_and_hold(cell: Cell) -> None:
    """Of one trajectory a file, of several a folder; `verify` proves them again."""
    one = cell.folder / 'one.json'
    assert cell.check(FREE, '--certificate', one).exit_code == 0
    folder = f'{cell.folder}/proofs/new/'
    plans = cell.file('plans.yaml', '---\n'.join([FREE, WRONG, HIT, LATE]))
    run = cell.run(plans, '--certificate', folder, '--json')
    assert run.exit_code == 2
    assert len(run.stdout.splitlines()) == 4
    assert sorted(path.name for path in Path(folder).iterdir()) == [
        f'000{k}-plans.yaml-{k}.json' for k in (1, 3, 4)
    ]
    for proofs, plan, verdicts in (
        (one, cell.folder / 'plan.yaml', ['free']),
        (folder, plans, ['free', 'collision', 'suspect']),
    ):
        arguments = cell.arguments('verify', proofs, '--trajectory', plan, '--json')
        found = CliRunner().invoke(app, arguments, catch_exceptions=False)
        assert found.exit_code == 0, found.output
        assert [json.loads(line)['verdict'] for line in found.stdout.splitlines()] == verdicts


def test_a_file_is_not_enough_for_several_certificates(cell: Cell) -> None:
    """Nothing is judged or written then, and what stands there stays."""
    target = cell.file('proof.json', 'mine')
    run = cell.check('---\n'.join([FREE, HIT]), '--certificate', target)
    assert run.exit_code == 2
    assert run.stdout == ''
    assert f"'{target}' is one file" in run.stderr
    assert target.read_text() == 'mine'
    # But a rejected trajectory leaves no certificate of an earlier run behind.
    assert cell.check(WRONG, '--certificate', target).exit_code == 2
    assert not target.exists()


@pytest.mark.parametrize('target', ['missing/proof.json', 'plan.yaml/', 'pipe'])
def test_a_certificate_that_cannot_be_written_is_bad_input(cell: Cell, target: str) -> None:
    os.mkfifo(cell.folder / 'pipe')
    run = cell.check(FREE, '--certificate', f'{cell.folder}/{target}')
    assert run.exit_code == 2
    assert 'error: --certificate: cannot write' in run.stderr
    assert run.stderr.count('\n') == 1
    assert not list(cell.folder.glob('.*'))
    assert (cell.folder / 'pipe').is_fifo()


@pytest.mark.parametrize('target', ['proof.json', 'proofs/'])
def test_a_disk_that_is_full_leaves_no_half_certificate(cell: Cell, target: str) -> None:
    plan = cell.file('plan.yaml', FREE)
    least, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    # As on a full disk, writing begins well and then fails.
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, most))
    try:
        run = cell.run(plan, '--certificate', f'{cell.folder}/{target}')
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (least, most))
    assert run.exit_code == 2
    assert 'error: --certificate: cannot write' in run.stderr
    assert not [*cell.folder.rglob('*.json'), *cell.folder.rglob('.*')]


def test_contacts_are_named(cell: Cell) -> None:
    run = cell.check(HIT, '--contacts')
    assert run.exit_code == 1
    begins, ends = (line for line in run.stdout.splitlines() if 'contact ' in line)
    # Each side of the arm meets an upright edge of the post along an edge.
    assert 'contact begins at 1.' in begins
    assert 'contact ends at 1.' in ends
    assert 'ns): fore - post, edge of the link, ' in begins
    (result,) = cell.results(HIT, '--contacts')
    for contact, suspect in zip(result['contacts'], result['intervals'][1::2], strict=True):
        assert suspect['start'] <= contact['latest']
        assert contact['earliest'] <= suspect['end']


@pytest.mark.parametrize(
    ('options', 'said'),
    [
        (('--contacts', '--clearance', 0.01), 'contacts are named without clearance'),
        (('--cover', 'ball', '--certificate', 'x.json'), 'certificates are written of the cover'),
    ],
)
def test_options_that_do_not_go_together(cell: Cell, options: Any, said: str) -> None:
    run = cell.check(FREE, *options)
    assert run.exit_code == 2
    assert said in ' '.join(run.stderr.split())
    assert 'Traceback' not in run.stderr


def test_scope_leaves_the_rest_unexamined(cell: Cell) -> None:
    (whole,), (first,), (verdict,) = (
        cell.results(HIT, '--scope', scope) for scope in ('all', 'first', 'verdict')
    )
    assert first['intervals'][0] == whole['intervals'][0]
    assert first['intervals'][-1]['reason'] == 'not_examined'
    assert first['pieces'] < whole['pieces']
    assert verdict['verdict'] == whole['verdict'] == 'collision'
    wrong = cell.check(HIT, '--scope', 'most')
    assert wrong.exit_code == 2
    assert "'most' is not one of all, first, verdict" in wrong.output


def test_help_lists_what_there_is_and_nothing_else() -> None:
    run = CliRunner().invoke(app, ['check', '--help'])
    assert run.exit_code == 0
    for option in ('--urdf', '--scene', '--start', '--deadline', '--json', '--scene-pose'):
        assert option in run.stdout
    for option in ('--certificate', '--scope'):
        assert option in run.stdout
    for later in ('--srdf', '--report'):
        assert later not in run.stdout


def header() -> Any:
    stamp = STORE.types['builtin_interfaces/msg/Time'](sec=0, nanosec=0)
    return STORE.types['std_msgs/msg/Header'](stamp=stamp, frame_id='')


def write_bag(path: Path, storage: StoragePlugin) -> Path:
    """
    Write a bag of the same motion thrice, each approached from elsewhere.

    Nothing is known before the first; the second starts beside, the third beyond the post.
    """
    point = STORE.types['trajectory_msgs/msg/JointTrajectoryPoint']
    duration = STORE.types['builtin_interfaces/msg/Duration']
    state_type, plan_type = 'sensor_msgs/msg/JointState', 'trajectory_msgs/msg/JointTrajectory'
    none = np.array([])
    names = ['shoulder', 'elbow']
    plan = STORE.types[plan_type](
        header(),
        names,
        [
            point(np.array([position, 0.0]), none, none, none, duration(sec=sec, nanosec=0))
            for sec, position in ((1, 0.0), (2, 0.5))
        ],
    )
    with Writer(path, version=9, storage_plugin=storage) as writer:
        plans = writer.add_connection('/arm/plan', plan_type, typestore=STORE)
        states = {
            topic: writer.add_connection(topic, state_type, typestore=STORE)
            for topic in ('/joint_states', '/measured')
        }
        for time, topic, position in (
            (1, '/measured', -0.4),
            (1, '/arm/plan', None),
            (2, '/joint_states', -0.5),
            (3, '/arm/plan', None),
            (4, '/joint_states', 2.5),
            (5, '/arm/plan', None),
        ):
            if position is None:
                writer.write(plans, time, STORE.serialize_cdr(plan, plan_type))
                continue
            state = STORE.types[state_type](header(), names, np.array([position, 0.0]), none, none)
            writer.write(states[topic], time, STORE.serialize_cdr(state, state_type))
    return path


def verdicts(run: Any) -> list[str]:
    return [json.loads(line)['verdict'] for line in run.stdout.splitlines()]


@pytest.mark.parametrize('storage', list(StoragePlugin))
def test_a_replay_starts_from_what_was_measured(cell: Cell, storage: StoragePlugin) -> None:
    bag = write_bag(cell.folder / 'bag', storage)
    run = cell.run(bag, '--json', command='replay')
    assert run.exit_code == 1
    first, second, third = (json.loads(line) for line in run.stdout.splitlines())
    assert [r['verdict'] for r in (first, second, third)] == ['suspect', 'free', 'collision']
    assert second['trajectory'] == f'{bag}:/arm/plan@0.000000003'
    assert 'no joint state was recorded' in first['warnings'][0]
    assert second['warnings'] == []
    assert third['intervals'][-1]['status'] == 'free'

    assert verdicts(cell.run(bag, '--json')) == verdicts(run)
    asked = cell.run(bag, '--json', '--joint-states', '/measured', command='replay')
    assert verdicts(asked) == ['free', 'free', 'free']
    given = cell.run(bag, '--json', '--start', 'shoulder=-1,elbow=0', command='replay')
    assert verdicts(given) == ['free', 'free', 'collision']
    chosen = cell.run(bag, '--json', '--topic', '/arm/plan', command='replay')
    assert verdicts(chosen) == verdicts(run)


def test_a_replay_of_what_is_not_there_is_bad_input(cell: Cell) -> None:
    bag = write_bag(cell.folder / 'bag', StoragePlugin.MCAP)
    for arguments, said in (
        ([bag, '--topic', '/nope'], '/nope'),
        ([bag, '--joint-states', '/nope'], '/nope'),
        ([cell.folder / 'nothing'], 'no such file'),
        ([cell.file('plan.yaml', FREE)], 'not a bag'),
        ([cell.folder], 'metadata.yaml'),
    ):
        run = cell.run(*arguments, '--json', command='replay')
        assert run.exit_code == 2
        assert verdicts(run) == ['rejected']
        assert said in run.stderr


def test_a_damaged_bag_gives_what_it_has_and_bad_input(cell: Cell) -> None:
    bag = write_bag(cell.folder / 'bag', StoragePlugin.MCAP)
    (file,) = bag.glob('*.mcap')
    file.write_bytes(file.read_bytes()[:-20])
    run = cell.run(bag, '--json', command='replay')
    assert run.exit_code == 2
    assert verdicts(run) == ['suspect', 'free', 'collision', 'rejected']
    assert 'ends early' in run.stderr


def test_joints_that_were_not_measured_can_be_given() -> None:
    measured = JointState(('shoulder',), np.array([0.25]), np.array([0.5]))
    state = start.completed(measured, {'shoulder': 9.0, 'elbow': 1.0})
    assert state is not None
    assert state.joint_names == ('shoulder', 'elbow')
    assert state.positions.tolist() == [0.25, 1.0]
    assert state.velocities is not None
    assert state.velocities.tolist() == [0.5, 0.0]
    assert start.completed(measured, {'shoulder': 9.0}) is measured
    assert start.completed(None, {}) is None
    rest = start.without(state, ['shoulder'])
    assert rest is not None
    assert (rest.joint_names, rest.positions.tolist()) == (('elbow',), [1.0])
    assert start.without(measured, ['shoulder']) is None


def test_a_stamp_leaves_a_moving_approach_open(cell: Cell) -> None:
    """How long the way to the first point takes changes its curve, unless both ends rest."""
    options = ('--start', 'shoulder=-0.5,elbow=0')
    stamp = 'header: {stamp: {sec: 17, nanosec: 0}, frame_id: world}\n'
    rest = document((1, [0.0, 0.0]), (2, [0.5, 0.0]), v0=[0.0, 0.0], v1=[0.0, 0.0])
    moving = document((1, [0.0, 0.0]), (2, [0.5, 0.0]), v0=[0.1, 0.0], v1=[0.0, 0.0])
    for text in (LATE, rest, moving):
        (result,) = cell.results(text, *options)
        assert (result['verdict'], result['warnings']) == ('free', [])
    for text in (LATE, rest):
        (result,) = cell.results(stamp + text, *options)
        assert result['verdict'] == 'free'
        assert result['warnings'] == [answer.STAMPED]
    (result,) = cell.results(stamp + moving, *options)
    assert result['intervals'][0]['reason'] == 'start_state_unknown'
    assert result['intervals'][1]['status'] == 'free'
    assert result['warnings'] == [answer.STAMPED, answer.APPROACH_UNKNOWN]
    (result,) = cell.results(stamp.replace('17', '0') + moving, *options)
    assert result['warnings'] == []


@pytest.mark.parametrize(
    ('point', 'measured', 'expected'),
    [
        ({}, [1.0], False),
        ({'velocities': [0.0]}, None, False),
        ({'velocities': [0.0]}, [0.0], False),
        ({'velocities': [0.0]}, [0.1], True),
        ({'velocities': [0.1]}, None, True),
        ({'velocities': [0.0], 'accelerations': [0.1]}, None, True),
    ],
)
def test_only_derivatives_make_the_approach_depend_on_its_duration(
    point: dict, measured: list[float] | None, expected: bool
) -> None:
    for time_ns in (0, 1):
        trajectory = Trajectory.from_points(['a'], [Point(time_ns, [0.0], **point)])
        velocities = None if measured is None else np.array(measured)
        state = JointState(('a',), np.array([0.0]), velocities)
        assert start.depends_on_duration(trajectory, state) == (expected and time_ns > 0)
        assert not start.depends_on_duration(trajectory, None)


@pytest.mark.parametrize('debug', ['', '1'])
def test_the_unforeseen_is_one_line_and_exits_three(
    cell: Cell, monkeypatch: pytest.MonkeyPatch, debug: str
) -> None:
    def fail(*_: Any) -> None:
        raise ZeroDivisionError('deep inside')

    monkeypatch.setenv('TRAJECTORY_GUARD_DEBUG', debug)
    monkeypatch.setattr(answer, 'judge', fail)
    run = cell.check(FREE)
    assert run.exit_code == 3
    assert 'internal error: ZeroDivisionError: deep inside' in run.stderr
    assert ('Traceback' in run.stderr) == bool(debug)
    assert debug or run.stderr.count('\n') == 1


def test_what_the_core_did_not_foresee_exits_three(
    cell: Cell, monkeypatch: pytest.MonkeyPatch
) -> None:
    error = TrajectoryGuardError(Reason.INTERNAL_ERROR, 'internal error')
    monkeypatch.setattr(answer, 'judge', lambda *_: Result.rejected(error))
    run = cell.check('---\n'.join([FREE, WRONG]), '--json')
    assert run.exit_code == 3
    assert verdicts(run) == ['rejected', 'rejected']


def test_the_worst_answer_decides_the_exit_code() -> None:
    bad = TrajectoryGuardError(Reason.NO_POINTS, '')
    internal = TrajectoryGuardError(Reason.INTERNAL_ERROR, '')
    codes = [
        exit_code(Result(Verdict.FREE)),
        exit_code(Result(Verdict.SUSPECT)),
        exit_code(Result(Verdict.COLLISION)),
        exit_code(Result.rejected(bad)),
        exit_code(Result.rejected(internal)),
    ]
    assert codes == [0, 1, 1, 2, 3]
    assert max(codes) is ExitCode.INTERNAL_ERROR


def collision(**changes: Any) -> Result:
    intervals = (
        Interval(0, 1_250_000_000, Status.FREE),
        Interval(
            1_250_000_000,
            12_250_000_001,
            Status.SUSPECT,
            reason='tolerance',
            body='panda_leftfinger',
            obstacle='kitchen_shelf_board_2_left',
            at_ns=12_250_000_000,
            location=(-0.1234, 0.5, -10.0),
            gap_lower=-1.2,
            gap_upper=0.0001,
        ),
        Interval(12_250_000_001, 13_000_000_000, Status.SUSPECT, reason='start_state_unknown'),
    )
    fields = {'intervals': intervals, 'duration_ns': 13_000_000_000, 'name': 'plan', **changes}
    return Result(Verdict.SUSPECT, tolerance=1e-4, **fields)


def reported(*results: Result, width: int | None = None) -> str:
    file = io.StringIO()
    report = Report(file, width)
    for result in results:
        report.show(result)
    report.close()
    return file.getvalue()


@pytest.mark.parametrize('width', [80, 100, 120, None])
def test_a_report_keeps_to_its_width_and_loses_nothing(width: int | None) -> None:
    text = reported(collision(), width=width)
    assert max(map(len, text.splitlines())) <= (width or 160)
    said = ['1.250000', '12.250000', 'suspect', 'tolerance', 'panda_leftfinger', '-1200.000']
    for word in [*said, '0.100', '-0.123 0.500 -10.000', 'start_state_unknown', '--start']:
        assert word in text
    assert 'kitchen_shelf_board_2_left' in text.replace('\n', '') or width == 100


def test_a_report_of_many_intervals_ends() -> None:
    rows = tuple(Interval(k, k + 1, Status.FREE) for k in range(5 * MAX_ROWS))
    text = reported(collision(intervals=rows))
    assert text.count('free') == MAX_ROWS
    assert f'{4 * MAX_ROWS} more' in text


def test_names_cannot_steer_the_terminal() -> None:
    text = reported(
        collision(name='a\x1b[31mb\nc', warnings=('\x9b2J',), unchecked_pairs=('\r[bold]x[/]',))
    )
    assert '\x1b' not in text
    assert '\x9b' not in text
    assert '\r' not in text
    assert 'b\N{REPLACEMENT CHARACTER}c: SUSPECT' in text
    assert '[bold]x[/]' in text


def test_json_has_no_number_that_is_not_json() -> None:
    file = io.StringIO()
    row = Interval(0, 1, Status.SUSPECT, gap_lower=float('-inf'), gap_upper=float('nan'))
    JsonLines(file).show(Result(Verdict.SUSPECT, intervals=(row,), compute_time=float('inf')))
    value = json.loads(file.getvalue(), parse_constant=lambda name: pytest.fail(name))
    assert value['intervals'][0]['gap'] == [None, None]
    assert value['compute_time'] is None


def python(*arguments: Any, **environment: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        capture_output=True,
        env={**os.environ, **environment},
        text=True,
        timeout=300,
        check=False,
    )


def test_the_module_runs_without_ros(cell: Cell) -> None:
    """Also where a name cannot be printed in the encoding of the terminal."""
    path = cell.file('plän\N{GREEK SMALL LETTER PI}.yaml', '---\n'.join([FREE, HIT]))
    code = (
        'import runpy, sys; sys.modules["rclpy"] = None; sys.argv[0] = "trajectory_guard"; '
        'runpy.run_module("trajectory_guard", run_name="__main__")'
    )
    run = python('-c', code, *cell.arguments('check', path), PYTHONIOENCODING='ascii')
    assert run.returncode == 1
    assert 'FREE' in run.stdout
    assert 'COLLISION' in run.stdout
    assert run.stderr.startswith(NOTE)
    assert 'Traceback' not in run.stderr


def test_help_imports_nothing_heavy() -> None:
    code = (
        'import sys, trajectory_guard.command_line.app; '
        'print({"numpy", "scipy", "flint", "rosbags", "yaml", "rclpy"} & set(sys.modules))'
    )
    assert python('-c', code).stdout == 'set()\n'
    run = python('-m', 'trajectory_guard', '--help')
    assert run.returncode == 0
    assert 'python -m trajectory_guard' in run.stdout


def test_a_reader_that_goes_away_is_no_traceback(cell: Cell) -> None:
    path = cell.file('plan.yaml', '---\n'.join([FREE] * 2000))
    command = [sys.executable, '-m', 'trajectory_guard', *cell.arguments('check', path, '--json')]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline().startswith(b'{')
        process.stdout.close()
        assert b'Traceback' not in process.stderr.read()
    assert process.returncode != 0
