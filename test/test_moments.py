"""Ghosts stand where the link is at the witness, and every marker is one that RViz draws."""

from bench_data import cases, SETTINGS, workcell
from builtin_interfaces.msg import Time
import coal
from coal_judge import shape
from guard_process import ARM, SCENE
from marker_messages import array
import numpy as np
import pytest
from random_robot import link_poses
from test_robot import FILES, ROBOTS
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.marker import changes_from_message
from msg_adapters.moment_markers import moments_to_message
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import load_robot, robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.markers.drawing import link_drawings, MOST_TRIANGLES
from trajectory_guard.markers.link_pose import link_pose
from trajectory_guard.markers.marker import MarkerKind
from trajectory_guard.markers.marker_scene import MarkerScene
from trajectory_guard.markers.moments import Moment, Moments, moments
from trajectory_guard.paths.trajectory import JointState, Point, Trajectory
from trajectory_guard.result import Interval, Result, Status
from trajectory_guard.settings import Settings

STAMP = Time(sec=7, nanosec=8)

# The instant of a witness is rounded to nanoseconds, single precision of meshes is exact [m].
NEAR = 1e-7


def cell(folder):
    """Return the arm and its scene."""
    (folder / 'scene.urdf').write_text(SCENE)
    return Workcell(robot_from_urdf(ARM), load_scene(folder / 'scene.urdf'))


def swing(*places):
    """Return a motion of the arm's shoulder, one place a second."""
    points = [Point(k * 10**9, (place, 0.0)) for k, place in enumerate(places)]
    return Trajectory.from_points(('shoulder', 'elbow'), points)


def check_drawable(message: MarkerArray, frame: str) -> None:
    """Check what RViz needs to draw each marker, and that no two are one."""
    first, *rest = message.markers
    assert (first.action, first.ns) == (Marker.DELETEALL, '')
    assert len({(m.ns, m.id) for m in rest}) == len(rest)
    for m in rest:
        turn = m.pose.orientation
        assert m.action == Marker.ADD
        assert (m.header.frame_id, m.header.stamp) == (frame, STAMP)
        assert m.ns.split('/')[:2] in (
            ['trajectory_guard', 'collision'],
            ['trajectory_guard', 'suspect'],
        )
        assert min(m.scale.x, m.scale.y, m.scale.z) > 0
        assert abs(np.linalg.norm([turn.x, turn.y, turn.z, turn.w]) - 1.0) < 1e-12
        assert 0.0 < m.color.a <= 1.0
        if m.type == Marker.TRIANGLE_LIST:
            assert len(m.points) % 3 == 0 and m.points
        if m.type == Marker.TEXT_VIEW_FACING:
            assert m.text


def ghost_bodies(message: MarkerArray, frame: str, namespace: str) -> list:
    """Return the ghosts as the guard itself would take them for obstacles."""
    ghosts = [m for m in message.markers[1:] if m.ns == namespace]
    scene = MarkerScene().updated(changes_from_message(array(*ghosts)))
    return [body for obstacle in scene.obstacles({frame: ()}) for body in obstacle.bodies]


def apart(bodies, others) -> float:
    """Return coal's least distance of some bodies from others [m]."""

    def placed(body):
        form, T, ball = shape(body)
        return form, coal.Transform3s(T[:3, :3], T[:3, 3]), ball

    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-10
    return min(
        coal.distance(*one[:2], *two[:2], request, coal.DistanceResult()) - one[2] - two[2]
        for one in map(placed, bodies)
        for two in map(placed, others)
    )


@pytest.mark.parametrize('robot', ['panda', 'ur5'])
def test_ghosts_are_as_near_as_the_witness_says(robot):
    bench = workcell(robot)
    obstacles = {obstacle.name: obstacle.bodies for obstacle in bench.scene.obstacles}
    seen = set()
    for trajectory, _, _ in cases(robot)[::3]:
        result = judge(bench, trajectory, None, SETTINGS)
        found = moments(result, bench, trajectory)
        assert len(found.shown) == sum(row.status != Status.FREE for row in result.intervals)
        for moment in found.shown:
            row = moment.interval
            message = moments_to_message(Moments((moment,), 0, found.frame), STAMP)
            check_drawable(message, bench.robot.root)
            namespace = f'trajectory_guard/{row.status.name.lower()}'
            bodies = ghost_bodies(message, bench.robot.root, namespace)
            assert len(bodies) == len(bench.robot.bodies(row.body))
            if row.gap_upper is not None:
                assert apart(bodies, obstacles[row.obstacle]) <= max(row.gap_upper, 0.0) + NEAR
                seen.add(row.status)
            place = [m for m in message.markers if m.ns == f'{namespace}/place']
            assert len(place) == (row.location is not None)
    assert Status.COLLISION in seen


def test_ghosts_of_primitives_are_primitives(tmp_path):
    arm = cell(tmp_path)
    trajectory = swing(1.2, 1.9)
    result = judge(arm, trajectory)
    found = moments(result, arm, trajectory)
    (hit,) = [m for m in found.shown if m.interval.status == Status.COLLISION]
    (ghost,) = hit.ghost
    assert (ghost.kind, ghost.scale) == (MarkerKind.CUBE, (0.8, 0.08, 0.08))
    angle = 1.2 + 0.7 * hit.interval.at_ns / 1e9
    assert np.allclose(ghost.T[:3, 0], [np.cos(angle), np.sin(angle), 0.0], rtol=0, atol=1e-9)
    message = moments_to_message(found, STAMP)
    check_drawable(message, 'base')
    (text,) = [m.text for m in message.markers if m.ns == 'trajectory_guard/collision/text']
    assert 'lower and post' in text and 'mm' in text


def test_the_pose_of_a_link_agrees_with_another_walk():
    for name in FILES:
        robot = load_robot(ROBOTS / FILES[name])
        q = np.random.default_rng(0).uniform(-1.0, 1.0, len(robot.movable))
        positions = dict(zip((joint.name for joint in robot.movable), q, strict=True))
        poses = link_poses(robot, q)
        for link in robot.links:
            assert np.abs(link_pose(robot, link, positions) - poses[link]).max() < 1e-12


def test_drawings_of_real_meshes_lie_in_their_bodies_and_are_few():
    robot, meshes = load_robot(ROBOTS / FILES['panda']), 0
    for link in robot.collision_links:
        for drawing, body in zip(link_drawings(robot, link), robot.bodies(link), strict=True):
            if drawing.kind is not MarkerKind.TRIANGLE_LIST:
                continue
            meshes += 1
            points = drawing.points @ drawing.T[:3, :3].T + drawing.T[:3, 3]
            off = np.linalg.norm(points - body.center, axis=1)
            assert off.max() <= body.radius + NEAR
            assert off.max() > 0.9 * body.radius
            assert len(points) <= 3 * max(MOST_TRIANGLES, 2 * len(body.vertices))
    assert meshes >= 8


def test_only_the_first_are_shown_and_the_last_says_how_many_follow(tmp_path):
    arm = cell(tmp_path)
    trajectory = swing(1.2, 1.9, 1.2, 1.9, 1.2)
    result = judge(arm, trajectory)
    every = moments(result, arm, trajectory)
    some = moments(result, arm, trajectory, most=2)
    assert len(every.shown) > 2 and every.left_out == 0
    assert [m.interval for m in some.shown] == [m.interval for m in every.shown[:2]]
    assert some.left_out == len(every.shown) - 2
    texts = [m.text for m in moments_to_message(some, STAMP).markers if m.text]
    assert ['not shown' in text for text in texts] == [False, True]
    assert f'{some.left_out} more' in texts[-1]


def test_nothing_to_see_removes_what_was_shown(tmp_path):
    arm = cell(tmp_path)
    free = swing(0.0, 0.5)
    rejected = Result.rejected(RequestError(Reason.NOT_READY, 'no'))
    for result in (judge(arm, free), rejected):
        message = moments_to_message(moments(result, arm, free), STAMP)
        assert [m.action for m in message.markers] == [Marker.DELETEALL]


def test_what_is_unknown_is_left_out_not_guessed(tmp_path):
    arm = cell(tmp_path)
    trajectory = Trajectory.from_points(('shoulder', 'elbow'), [Point(10**9, (0.0, 0.0))])
    # Without a start state nothing tells where the arm is before the first point.
    result = judge(arm, trajectory)
    (moment,) = moments(result, arm, trajectory).shown
    assert moment.ghost == ()
    check_drawable(moments_to_message(Moments((moment,), 0, 'base'), STAMP), 'base')
    row = Interval(0, 1, Status.SUSPECT, 'budget', 'upper', 'post', None, (np.nan, 0.0, 0.0))
    check_drawable(moments_to_message(Moments((Moment(row, ()),), 3, 'base'), STAMP), 'base')


def test_the_start_state_counts(tmp_path):
    arm = cell(tmp_path)
    trajectory = Trajectory.from_points(('elbow',), [Point(0, (0.1,)), Point(10**9, (-0.1,))])
    start = JointState(('shoulder', 'elbow'), np.array([np.pi / 2, 0.1]))
    result = judge(arm, trajectory, start, Settings())
    for moment in moments(result, arm, trajectory, start).shown:
        for ghost in moment.ghost:
            assert ghost.T[1, 3] > 1.0
    assert moments(result, arm, trajectory, start).shown
