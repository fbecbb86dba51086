"""Poses in time: from a message to a motion that another implementation agrees with."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
from scipy.interpolate import BPoly
from scipy.spatial.transform import Rotation, Slerp
from typer.testing import CliRunner

from msg_adapters.text import documents
from msg_adapters.trajectory import multi_dof_from_message
from trajectory_guard.cell.free_body import free_body
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.command_line.app import app
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.multi_dof import MultiDofTrajectory, PosePoint
from trajectory_guard.paths.multi_dof_path import INTERPOLATION, multi_dof_path
from trajectory_guard.result import Status, Verdict
from trajectory_guard.settings import Settings
from trajectory_guard.shapes.primitive import Box

SECOND = 10**9
LEVEL = (0.0, 0.0, 0.0, 1.0)
STORE = get_typestore(Stores.ROS2_JAZZY)


def point(time_ns: int, xyz=(0.0, 0.0, 0.0), turn=LEVEL, velocity=None, acceleration=None):
    rows = [() if row is None else [tuple(row)] for row in (velocity, acceleration)]
    return PosePoint(time_ns, [(*xyz, *turn)], *rows)


def trajectory(*points: PosePoint, name: str = 'base') -> MultiDofTrajectory:
    return MultiDofTrajectory.from_points((name,), points)


def random_points(
    rng: np.random.Generator, derivatives: int, unit: int = SECOND, size: float = 1.0
):
    turns = Rotation.from_rotvec(np.cumsum(0.5 * rng.normal(size=(4, 3)), axis=0))
    points = []
    for t, turn in zip((0, 1, 3, 4), turns.as_quat(), strict=True):
        rows = [0.4 * rng.normal(size=6) * [size, size, size, 1, 1, 1] for _ in range(derivatives)]
        points.append(point(t * unit, size * rng.uniform(-1.0, 1.0, 3), turn, *rows))
    return points


@pytest.mark.parametrize('size', [1e-6, 1.0, 1e6])
def test_poses_alone_are_joined_by_lines_and_slerp(size: float) -> None:
    rng = np.random.default_rng(1)
    points = random_points(rng, 0, size=size)
    path = multi_dof_path(trajectory(*points))
    assert path.interpolation == INTERPOLATION
    times = [p.time_ns / SECOND for p in points]
    slerp = Slerp(times, Rotation.from_quat([p.transforms[0][3:] for p in points]))
    places = np.array([p.transforms[0][:3] for p in points])
    for t in np.linspace(0.0, 4.0, 81):
        i = min(int(np.searchsorted(path.knots_ns, t * SECOND, side='right')) - 1, 2)
        pose = path.pose(int(t * SECOND))
        t = int(t * SECOND) / SECOND
        off = np.linalg.norm(pose[:, :3] - slerp(t).as_matrix(), 2)
        assert off <= path.turn_error[i] + 1e-14
        assert path.turn_error[i] < 2e-9
        line = [np.interp(t, times, places[:, k]) for k in range(3)]
        assert np.allclose(pose[:, 3], line, atol=1e-13 * size)


@pytest.mark.parametrize('derivatives', [1, 2])
def test_derivatives_are_met_at_both_ends(derivatives: int) -> None:
    """Positions are Hermite's; the orientation turns at the given rate, in the message's frame."""
    rng = np.random.default_rng(5)
    points = random_points(rng, derivatives)
    path = multi_dof_path(trajectory(*points), allow_nonzero_end_velocity=True)
    places = [
        np.column_stack(
            [p.transforms[0][:3], *(r[0][:3] for r in (p.velocities, p.accelerations) if len(r))]
        ).T
        for p in points
    ]
    hermite = BPoly.from_derivatives([0.0, 1.0, 3.0, 4.0], places)
    h = 1e-5
    for i, motion in enumerate(path.motions):
        length = (path.knots_ns[i + 1] - path.knots_ns[i]) / SECOND
        for s in (0.0, 0.3, 1.0):
            t = path.knots_ns[i] / SECOND + s * length
            assert np.allclose(motion.pose(s)[:, 3], hermite(t), atol=1e-12)
        for s, p in ((0.0, points[i]), (1.0, points[i + 1])):
            pose = motion.pose(s)[:, :3]
            assert np.allclose(
                pose, Rotation.from_quat(p.transforms[0][3:]).as_matrix(), atol=1e-12
            )
            near = motion.pose(s + (h if s == 0.0 else -h))[:, :3]
            rate = (near - pose) @ pose.T / (h if s == 0.0 else -h) / length
            spin = np.array([rate[2, 1], rate[0, 2], rate[1, 0]])
            assert np.allclose(spin, p.velocities[0][3:], atol=1e-3)
        if derivatives == 2:
            assert angular_acceleration(motion, length) == pytest.approx(
                np.array(points[i].accelerations[0][3:]), abs=2e-2
            )


def angular_acceleration(motion, length: float) -> np.ndarray:
    """Return it at the start, from three turns about the middle of short spans."""
    h = 2e-4

    def spin(s: float) -> np.ndarray:
        before, after = motion.pose(s)[:, :3], motion.pose(s + h)[:, :3]
        return Rotation.from_matrix(after @ before.T).as_rotvec() / h / length

    one, two, three = spin(0.0), spin(h), spin(2.0 * h)
    # The spins are those at h/2, 3h/2 and 5h/2.
    return (-2.0 * one + 3.0 * two - three) / h / length


@pytest.mark.parametrize('unit', [1, 10**17])
def test_any_duration_will_do(unit: int) -> None:
    rng = np.random.default_rng(2)
    path = multi_dof_path(trajectory(*random_points(rng, 0, unit)))
    assert path.duration_ns == 4 * unit
    assert (path.turn_error < 2e-9).all()


def test_a_single_pose_stands() -> None:
    path = multi_dof_path(trajectory(point(0, (1.0, 2.0, 3.0))))
    assert path.duration_ns == 0
    assert path.pose(0)[:, 3].tolist() == [1.0, 2.0, 3.0]


HALF_TURN = (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize('rate', [-np.pi, np.pi])
@pytest.mark.parametrize('off', [-1e-17, 0.0, 1e-17])
def test_half_a_turn_goes_where_the_velocities_go(rate: float, off: float) -> None:
    """However the real part of the quaternion is rounded."""
    turning = [0, 0, 0, rate, 0, 0]
    points = [point(0, velocity=turning), point(SECOND, turn=(1, 0, 0, off), velocity=turning)]
    path = multi_dof_path(trajectory(*points), allow_nonzero_end_velocity=True)
    middle = Rotation.from_matrix(path.pose(SECOND // 2)[:, :3]).as_rotvec()
    assert middle == pytest.approx([rate / 2.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize(
    ('points', 'reason', 'named'),
    [
        ([], Reason.NO_POINTS, 'no points'),
        ([point(-1)], Reason.NEGATIVE_TIME, 'point 0'),
        ([point(5), point(5)], Reason.UNSORTED_TIMES, 'point 1'),
        ([point(2.5)], Reason.TRAJECTORY_UNREADABLE, '2.5'),
        ([point(2**63)], Reason.TOO_LARGE, 'beyond 64 bits'),
        ([point(0, (np.nan, 0, 0))], Reason.NOT_FINITE, 'transforms[0] is nan'),
        ([point(0, turn=(0, 0, 0, 0))], Reason.TRAJECTORY_UNREADABLE, 'length 0'),
        ([point(0, turn=(0, 0, 0, 1.01))], Reason.TRAJECTORY_UNREADABLE, 'length 1.01'),
        ([point(0, turn=(0, 0, 0, 1e200))], Reason.TRAJECTORY_UNREADABLE, 'length inf'),
        ([PosePoint(0)], Reason.MISSING_POSITIONS, 'point 0'),
        ([PosePoint(0, [LEVEL, LEVEL])], Reason.SIZE_MISMATCH, '2 transforms for 1'),
        ([PosePoint(0, [LEVEL])], Reason.TRAJECTORY_UNREADABLE, 'no 7 numbers'),
        ([point(0, velocity=[np.inf] * 6)], Reason.NOT_FINITE, 'velocities[0] is inf'),
        ([point(0, acceleration=[0.0] * 6)], Reason.ACCELERATIONS_WITHOUT_VELOCITIES, 'point 0'),
        ([point(0), point(1, velocity=[0.1] * 6)], Reason.NONZERO_END_VELOCITY, "'base'"),
        ([point(0), point(1, turn=HALF_TURN)], Reason.AMBIGUOUS_TURN, 'point 0 to point 1'),
        (
            # From rest to rest either way will do.
            [point(0, velocity=[0.0] * 6), point(1, turn=HALF_TURN, velocity=[0.0] * 6)],
            Reason.AMBIGUOUS_TURN,
            'point 0 to point 1',
        ),
        (
            # Each end would go the other way.
            [
                point(0, velocity=[0, 0, 0, 3, 0, 0]),
                point(SECOND, turn=HALF_TURN, velocity=[0, 0, 0, -3, 0, 0]),
                point(2 * SECOND, turn=HALF_TURN),
            ],
            Reason.AMBIGUOUS_TURN,
            'point 0 to point 1',
        ),
        ([point(0), point(1, (1e300, 0, 0))], Reason.TOO_LARGE, 'positions[1, 0]'),
        (
            # Backwards by a half turn on the way to nearly a half turn forwards.
            [
                point(0, velocity=[0, 0, 0, -8, 0, 0]),
                point(SECOND, turn=(0.9999, 0, 0, 0.01), velocity=[0, 0, 0, -8, 0, 0]),
                point(2 * SECOND, turn=(0.9999, 0, 0, 0.01), velocity=[0.0] * 6),
            ],
            Reason.TOO_LARGE,
            'turns too fast',
        ),
    ],
)
def test_what_cannot_be_played_is_refused_by_name(points, reason: Reason, named: str) -> None:
    with pytest.raises(TrajectoryError) as caught:
        multi_dof_path(trajectory(*points))
    assert caught.value.reason is reason
    assert named in str(caught.value)


@pytest.mark.parametrize(
    ('names', 'reason'),
    [
        ((), Reason.NO_JOINTS),
        (('a', 'a'), Reason.DUPLICATE_JOINT),
        ((3,), Reason.TRAJECTORY_UNREADABLE),
    ],
)
def test_names_are_checked(names, reason: Reason) -> None:
    with pytest.raises(TrajectoryError) as caught:
        MultiDofTrajectory.from_points(names, [PosePoint(0, [(0, 0, 0, *LEVEL)] * len(names))])
    assert caught.value.reason is reason


def test_the_digest_is_of_what_shapes_the_path() -> None:
    base = [point(0, (1, 2, 3)), point(SECOND)]
    same = trajectory(*base).digest()
    assert MultiDofTrajectory.from_points(('base',), base, 'label').digest() == same
    others = [
        trajectory(point(0, (1, 2, 3.5)), point(SECOND)),
        trajectory(point(0, (1, 2, 3)), point(SECOND + 1)),
        trajectory(point(0, (1, 2, 3)), point(SECOND, velocity=[0.0] * 6)),
        trajectory(*base, name='other'),
        MultiDofTrajectory.from_points(('base',), base, frame_id='odom'),
    ]
    assert len({same, *(other.digest() for other in others)}) == 6


def work(at=(0.0, 0.0, 0.0)) -> Workcell:
    T = np.eye(4)
    T[:3, 3] = at
    box = Box((0.2, 0.2, 0.2)).load().body.moved(T)
    return Workcell(free_body('part', Box((0.2, 0.2, 0.2))), Scene((Obstacle('box', (box,)),), ''))


def test_poses_are_judged_like_any_trajectory() -> None:
    through = trajectory(point(0, (-1, 0, 0)), point(2 * SECOND, (1, 0, 0)))
    result = judge(work(), through)
    assert result.verdict is Verdict.COLLISION
    hit = next(row for row in result.intervals if row.status is Status.COLLISION)
    assert hit.start_ns == pytest.approx(0.8 * SECOND, rel=1e-3)
    assert result.interpolation == INTERPOLATION
    assert judge(work((0, 1, 0)), through).verdict is Verdict.FREE
    late = trajectory(point(SECOND, (-1, 1, 0)), point(2 * SECOND, (1, 1, 0)))
    first, second = judge(work(), late).intervals
    assert (first.status, first.reason) == (Status.SUSPECT, 'start_state_unknown')
    assert (second.status, second.start_ns) == (Status.FREE, SECOND)


def test_no_certificate_is_promised_of_poses() -> None:
    result = judge(work(), trajectory(point(0)), settings=Settings(want_certificate=True))
    assert (result.verdict, result.reason_code) == (Verdict.REJECTED, 'invalid_parameter')


def test_two_bodies_in_a_message_are_refused() -> None:
    both = MultiDofTrajectory.from_points(('a', 'b'), [PosePoint(0, [(0, 0, 0, *LEVEL)] * 2)])
    result = judge(work(), both)
    assert (result.verdict, result.reason_code) == (Verdict.REJECTED, 'unknown_joint')
    assert "'a', 'b'" in result.message


def message(points: list[PosePoint]) -> object:
    """Return a real message."""
    kinds = STORE.types
    vector = kinds['geometry_msgs/msg/Vector3']
    twist = kinds['geometry_msgs/msg/Twist']

    def twists(rows):
        return [twist(linear=vector(*r[:3]), angular=vector(*r[3:])) for r in rows]

    return kinds['trajectory_msgs/msg/MultiDOFJointTrajectory'](
        header=kinds['std_msgs/msg/Header'](
            stamp=kinds['builtin_interfaces/msg/Time'](0, 0), frame_id='map'
        ),
        joint_names=['base'],
        points=[
            kinds['trajectory_msgs/msg/MultiDOFJointTrajectoryPoint'](
                transforms=[
                    kinds['geometry_msgs/msg/Transform'](
                        translation=vector(*row[:3]),
                        rotation=kinds['geometry_msgs/msg/Quaternion'](*row[3:]),
                    )
                    for row in p.transforms
                ],
                velocities=twists(p.velocities),
                accelerations=twists(p.accelerations),
                time_from_start=kinds['builtin_interfaces/msg/Duration'](
                    *divmod(p.time_ns, SECOND)
                ),
            )
            for p in points
        ],
    )


def plain(value: object) -> object:
    """Return a message as the plain value that is printed of it."""
    if isinstance(value, list):
        return [plain(item) for item in value]
    if hasattr(value, '__msgtype__'):
        fields = [f for f in value.__dataclass_fields__ if f != '__msgtype__']
        return {f: plain(getattr(value, f)) for f in fields}
    return value.item() if isinstance(value, np.generic) else value


@pytest.mark.parametrize('derivatives', [0, 1, 2])
def test_messages_and_their_text_say_the_same(derivatives: int) -> None:
    points = random_points(np.random.default_rng(3), derivatives)
    told = message(points)
    wanted = MultiDofTrajectory.from_points(('base',), points, frame_id='map').digest()
    assert multi_dof_from_message(told).digest() == wanted
    (document,) = documents(json.dumps(plain(told)), 'poses.json')
    assert isinstance(document.trajectory, MultiDofTrajectory)
    assert document.trajectory.digest() == wanted


@pytest.mark.parametrize(
    ('change', 'named'),
    [
        (lambda p: p.pop('time_from_start'), 'points[0]: expected a mapping with time_from_start'),
        (lambda p: p.update(positions=[]), "unknown key 'positions'"),
        (lambda p: p['transforms'][0].pop('rotation'), 'points[0].transforms[0]: expected'),
        (lambda p: p['transforms'][0]['rotation'].pop('w'), 'rotation: expected x, y, z, w'),
        (lambda p: p['transforms'][0]['rotation'].update(w='1'), 'rotation[3]: expected a number'),
        (lambda p: p['transforms'].append('...'), 'cut short'),
        (lambda p: p.update(velocities=[{}]), 'velocities[0]: expected linear and angular'),
    ],
)
def test_broken_text_is_refused_by_name(change, named: str) -> None:
    value = plain(message([point(0), point(1)]))
    change(value['points'][0])
    (document,) = documents(json.dumps(value), 'poses.json')
    assert isinstance(document.trajectory, TrajectoryError)
    assert named in str(document.trajectory)


def test_points_of_both_kinds_are_refused() -> None:
    value = plain(message([point(0), point(1)]))
    value['points'][1] = {'time_from_start': {'sec': 1, 'nanosec': 0}, 'positions': [0.0]}
    (document,) = documents(json.dumps(value))
    assert isinstance(document.trajectory, TrajectoryError)
    assert 'points[1]' in str(document.trajectory)


def test_a_message_without_a_field_is_refused() -> None:
    told = SimpleNamespace(joint_names=['a'], points=[SimpleNamespace(time_from_start=None)])
    with pytest.raises(TrajectoryError) as caught:
        multi_dof_from_message(told)
    assert caught.value.reason is Reason.TRAJECTORY_UNREADABLE


def write_stl(path: Path, half: float) -> Path:
    """Write a closed cube."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = ['solid cube']
    for a, b, c, d in quads:
        for triple in ((a, b, c), (a, c, d)):
            lines += ['facet normal 0 0 0', 'outer loop']
            lines += [f'vertex {x:g} {y:g} {z:g}' for x, y, z in corners[list(triple)]]
            lines += ['endloop', 'endfacet']
    path.write_text('\n'.join([*lines, 'endsolid cube']))
    return path


SCENE = """<robot name="s"><link name="root"/><link name="wall"><collision><geometry>
<box size="0.2 4 4"/></geometry></collision></link><joint name="j" type="fixed">
<parent link="root"/><child link="wall"/><origin xyz="1 0 0"/></joint></robot>"""

CART = """<robot name="cart"><link name="map"/><link name="cart"><collision><geometry>
<box size="0.2 0.2 0.2"/></geometry></collision></link><joint name="base" type="floating">
<parent link="map"/><child link="cart"/></joint></robot>"""


@pytest.mark.parametrize('body', ['part.stl', 'cart.urdf'])
def test_the_command_line_checks_poses(tmp_path: Path, body: str) -> None:
    """A mesh file or a robot with a floating base, text and a real bag, one line for each."""
    write_stl(tmp_path / 'part.stl', 0.1)
    (tmp_path / 'cart.urdf').write_text(CART)
    (tmp_path / 'scene.urdf').write_text(SCENE)
    away = message([point(0, (0, 0, 0)), point(SECOND, (0.5, 0.3, 0), (0, 0, 0.6, 0.8))])
    into = message([point(0, (0, 0, 0)), point(SECOND, (1, 0, 0))])
    (tmp_path / 'poses.json').write_text(json.dumps([plain(away), plain(into)]))
    with Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        kind = 'trajectory_msgs/msg/MultiDOFJointTrajectory'
        topic = writer.add_connection('/poses', kind, typestore=STORE)
        writer.write(topic, 5, STORE.serialize_cdr(away, kind))
    given = ['--urdf', str(tmp_path / body), '--scene', str(tmp_path / 'scene.urdf'), '--json']
    run = CliRunner().invoke(app, ['check', *given, str(tmp_path / 'poses.json')])
    assert run.exit_code == 1, run.stderr
    free, hit = map(json.loads, run.stdout.splitlines())
    assert (free['verdict'], hit['verdict']) == ('free', 'collision')
    # The cube's face reaches the wall's at x = 0.8.
    assert hit['intervals'][0]['end'] == pytest.approx(0.8, abs=1e-3)
    run = CliRunner().invoke(app, ['replay', *given, str(tmp_path / 'bag')])
    assert run.exit_code == 0, run.stderr
    assert json.loads(run.stdout)['verdict'] == 'free'
    run = CliRunner().invoke(
        app, ['check', *given, '--certificate', f'{tmp_path}/c/', str(tmp_path / 'poses.json')]
    )
    assert run.exit_code == 2
    assert 'joint trajectories only' in run.stderr


def test_a_joint_trajectory_is_no_motion_of_a_free_body(tmp_path: Path) -> None:
    (tmp_path / 'cart.urdf').write_text(CART)
    (tmp_path / 'scene.urdf').write_text(SCENE)
    (tmp_path / 'joints.json').write_text(
        json.dumps(
            {
                'joint_names': ['base'],
                'points': [{'positions': [0.0], 'time_from_start': {'sec': 0, 'nanosec': 0}}],
            }
        )
    )
    given = ['--urdf', str(tmp_path / 'cart.urdf'), '--scene', str(tmp_path / 'scene.urdf')]
    run = CliRunner().invoke(app, ['check', *given, str(tmp_path / 'joints.json')])
    assert run.exit_code == 2
    assert "no joint 'base'" in run.output


@pytest.mark.parametrize(
    ('frame_id', 'verdict'),
    [('', 'free'), ('map', 'free'), ('/map', 'free'), ('odom', 'rejected'), ('cart', 'rejected')],
)
def test_poses_in_another_frame_are_refused_by_name(frame_id: str, verdict: str) -> None:
    robot = robot_from_urdf(CART)
    scene = Scene((Obstacle('box', (Box((0.2, 0.2, 0.2)).load().body,)),), '')
    told = message([point(0, (3, 0, 0)), point(SECOND, (4, 0, 0))])
    told.header.frame_id = frame_id
    result = judge(Workcell(robot, scene), multi_dof_from_message(told))
    assert result.verdict.name.lower() == verdict
    if verdict == 'rejected':
        assert result.reason_code == 'frame_unknown'
        assert repr(frame_id) in result.message
    (document,) = documents(json.dumps(plain(told)))
    assert document.trajectory.frame_id == frame_id


def test_a_frame_that_the_joints_origin_makes_another_is_refused() -> None:
    origin = '<origin xyz="0 0 1"/></joint>'
    robot = robot_from_urdf(CART.replace('</joint>', origin))
    scene = Scene((Obstacle('box', (Box((0.2, 0.2, 0.2)).load().body,)),), '')
    poses = [point(0, (3, 0, 0)), point(SECOND, (4, 0, 0))]
    for frame_id, reason in (('', ''), ('map', 'frame_unknown')):
        told = MultiDofTrajectory.from_points(('base',), poses, frame_id=frame_id)
        assert judge(Workcell(robot, scene), told).reason_code == reason
