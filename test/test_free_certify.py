"""Free bodies are certified as robots are: free, colliding or suspect, with the same meaning."""

import coal
import numpy as np
import pytest
from rational_curves import random_rigid_motion

from trajectory_guard.cell.free_body import free_body
from trajectory_guard.cell.robot import Shape
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import certify
from trajectory_guard.errors import Reason, TrajectoryError, TrajectoryGuardError
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.free_path import FreePath
from trajectory_guard.paths.joint_path import JointPath
from trajectory_guard.result import Status, Verdict
from trajectory_guard.settings import Settings
from trajectory_guard.shapes.primitive import Box, Cylinder, Sphere

SECOND = 10**9
SHAPES = [Box((0.3, 0.2, 0.1)), Sphere(0.1), Cylinder(0.05, 0.4)]


def cell(moving: Shape, obstacle: Shape, at: tuple[float, float, float] = (0.0, 0.0, 0.0)):
    T = np.eye(4)
    T[:3, 3] = at
    body = obstacle.load().body.moved(T)
    return Workcell(free_body('part', moving), Scene((Obstacle('thing', (body,)),), ''))


def path(*motions: RationalMotion) -> FreePath:
    n = len(motions)
    return FreePath('part', SECOND * np.arange(n + 1), motions, np.zeros(n), np.zeros(n), 'given')


def straight(start: np.ndarray, end: np.ndarray, linear: np.ndarray | None = None):
    """Return the motion along a line, with a constant linear part or from I to another one."""
    points = np.zeros((2, 3, 4))
    points[:, :, :3] = np.eye(3)
    if linear is not None:
        points[1, :, :3] = linear
    points[0, :, 3], points[1, :, 3] = start, end
    return RationalMotion(points, np.ones(2))


def judged(shape: Shape) -> coal.CollisionGeometry:
    if isinstance(shape, Box):
        return coal.Box(*shape.size)
    if isinstance(shape, Sphere):
        return coal.Sphere(shape.radius)
    assert isinstance(shape, Cylinder)
    return coal.Cylinder(shape.radius, shape.length)


@pytest.mark.parametrize('shape', SHAPES, ids=lambda shape: type(shape).__name__)
def test_another_library_agrees_at_every_sample(shape: Shape) -> None:
    """No free instant collides, no colliding one is free, and most motions are decided."""
    rng = np.random.default_rng(2)
    seen = dict.fromkeys(Status, 0)
    for _ in range(60):
        obstacle = Box(tuple(rng.uniform(0.05, 0.4, 3)))
        motion = random_rigid_motion(rng)
        result = certify(cell(shape, obstacle), path(motion))
        assert result.intervals[0].start_ns == 0
        assert result.intervals[-1].end_ns == SECOND
        one, other = judged(shape), judged(obstacle)
        for row in result.intervals:
            seen[row.status] += 1
            for s in np.linspace(row.start_ns, row.end_ns, 25) / SECOND:
                pose = motion.pose(s)
                gap = coal.distance(
                    one,
                    coal.Transform3s(pose[:, :3], pose[:, 3]),
                    other,
                    coal.Transform3s(),
                    coal.DistanceRequest(),
                    coal.DistanceResult(),
                )
                assert not (row.status is Status.FREE and gap < -1e-7)
                assert not (row.status is Status.COLLISION and gap > 1e-6)
    assert seen[Status.FREE] > 60
    assert seen[Status.COLLISION] > 5


@pytest.mark.parametrize('size', [1e-5, 1.0, 1e4])
def test_a_gap_above_the_tolerance_is_free_and_a_touch_is_not(size: float) -> None:
    """A box slides past another at a small distance, and at none."""
    box = Box((size, size, size))
    work = cell(box, box)
    settings = Settings(tolerance=1e-4 * size)
    for gap, verdict in ((2e-4 * size, Verdict.FREE), (0.0, Verdict.SUSPECT)):
        ends = np.array([[-3.0 * size, size + gap, 0.0], [3.0 * size, size + gap, 0.0]])
        result = certify(work, path(straight(*ends)), settings)
        assert result.verdict is verdict
        assert result.pieces < 300


def test_a_swelling_ball_is_not_free() -> None:
    """An affine motion scales the ball by three, and only then it touches."""
    ball = Sphere(0.1)
    work = cell(ball, Box((1.0, 1.0, 1.0)))
    ends = np.array([[0.0, 0.0, 0.75], [0.0, 0.0, 0.75]])
    swelling = certify(work, path(straight(*ends, linear=3.0 * np.eye(3))))
    assert swelling.verdict is Verdict.SUSPECT
    first = swelling.intervals[0]
    # Radius 0.1 (1 + 2 s) reaches 0.25 at s = 0.75.
    assert first.status is Status.FREE
    assert 0.74 * SECOND < first.end_ns <= 0.75 * SECOND
    shrinking = certify(work, path(straight(*ends, linear=0.3 * np.eye(3))))
    assert shrinking.verdict is Verdict.FREE


def test_an_affine_motion_never_claims_a_collision() -> None:
    """Depths are measured in the body, and its image has others."""
    work = cell(Box((0.2, 0.2, 0.2)), Box((1.0, 1.0, 1.0)))
    flat = np.diag([1.0, 1.0, 1e-3])
    ends = np.array([[0.0, 0.0, 0.59], [0.0, 0.0, 0.59]])
    result = certify(work, path(straight(*ends, linear=flat)))
    assert all(row.status is not Status.COLLISION for row in result.intervals)
    assert result.intervals[0].status is Status.SUSPECT
    assert result.intervals[-1].status is Status.FREE


def test_segments_are_checked_one_after_the_other() -> None:
    work = cell(Sphere(0.1), Box((0.2, 0.2, 0.2)))
    away, through = np.array([1.0, 0.0, 0.5]), np.array([0.0, 0.0, 0.0])
    result = certify(
        work, path(straight(2 * away, away), straight(away, through), straight(through, away))
    )
    assert [row.status for row in result.intervals if row.status is not Status.SUSPECT] == [
        Status.FREE,
        Status.COLLISION,
        Status.FREE,
    ]
    assert SECOND < result.intervals[0].end_ns < 2 * SECOND
    assert result.interpolation == 'given'


def test_errors_and_tolerances_are_kept_away() -> None:
    """What the motion may be off, the tracking tolerance and the clearance are added up."""
    work = cell(Box((0.2, 0.2, 0.2)), Box((0.2, 0.2, 0.2)))
    motion = straight(np.array([-1.0, 0.25, 0.0]), np.array([1.0, 0.25, 0.0]))

    def verdict(shift: float = 0.0, turn: float = 0.0, **settings) -> Verdict:
        free = FreePath(
            'part', np.array([0, SECOND]), (motion,), np.array([turn]), np.array([shift]), 'given'
        )
        return certify(work, free, Settings(**settings)).verdict

    corner = np.sqrt(3) * 0.1
    assert verdict() is Verdict.FREE
    assert verdict(shift=0.049) is Verdict.FREE
    assert verdict(shift=0.051) is not Verdict.FREE
    assert verdict(turn=0.049 / corner) is Verdict.FREE
    assert verdict(turn=0.051 / corner) is not Verdict.FREE
    assert verdict(clearance=0.051) is not Verdict.FREE
    assert verdict(shift=0.02, clearance=0.02, tracking_tolerance=(0.005, 0.0)) is Verdict.FREE
    assert verdict(shift=0.02, clearance=0.02, tracking_tolerance=(0.011, 0.0)) is not Verdict.FREE
    assert verdict(tracking_tolerance=(0.0, 0.051 / corner)) is not Verdict.FREE


ROBOT = """<robot name="r"><link name="map"/><link name="cart"><collision><geometry>
<box size="0.4 0.4 0.2"/></geometry></collision></link>
<link name="tip"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="drive" type="floating"><parent link="map"/><child link="cart"/>
<origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/></joint>
<joint name="lift" type="prismatic"><parent link="cart"/><child link="tip"/>
<axis xyz="0 0 1"/><origin xyz="0.5 0 0"/><limit lower="0" upper="2"/></joint></robot>"""


def test_a_link_beyond_a_moving_base_is_checked_too() -> None:
    """The tip, 0.5 m ahead of the cart and turned with it, is what hits."""
    from trajectory_guard.motions.floating_path import floating_path
    from trajectory_guard.paths.trajectory import JointState

    robot = robot_from_urdf(ROBOT)
    assert robot.floating == 'drive'
    post = (
        Box((0.1, 0.1, 3.0))
        .load()
        .body.moved(np.array([[1, 0, 0, 0], [0, 1, 0, 0.95], [0, 0, 1, 1.0], [0, 0, 0, 1.0]]))
    )
    work = Workcell(robot, Scene((Obstacle('post', (post,)),), ''))
    # Along x of the joint's frame, which is y of the root.
    drive = straight(np.zeros(3), np.array([0.6, 0.0, 0.0]))
    free = FreePath('drive', np.array([0, SECOND]), (drive,), np.zeros(1), np.zeros(1), 'given')
    with pytest.raises(TrajectoryError, match="'lift'") as caught:
        certify(work, free)
    assert caught.value.reason is Reason.JOINT_POSITION_UNKNOWN
    held = floating_path(robot, free, JointState(('lift',), np.array([0.5])))
    result = certify(work, held)
    hit = next(row for row in result.intervals if row.status is Status.COLLISION)
    assert (hit.body, hit.obstacle) == ('tip', 'post')
    # The tip reaches 0.5 + 0.6 s + 0.05 = 0.9.
    assert result.intervals[0].end_ns == pytest.approx(SECOND * 0.35 / 0.6, rel=1e-3)


def test_a_floating_joint_is_not_a_joint_of_trajectories() -> None:
    robot = robot_from_urdf(ROBOT)
    work = Workcell(robot, Scene((Obstacle('x', (Sphere(0.1).load().body,)),), ''))
    n = len(robot.movable)
    made = JointPath(
        tuple(joint.name for joint in robot.movable),
        np.ones(n, bool),
        np.array([0, SECOND]),
        np.zeros((1, n, 6)),
        np.zeros((1, n)),
        0,
        True,
    )
    with pytest.raises(TrajectoryGuardError, match="floating joint 'drive'"):
        certify(work, made)


def test_no_point_of_a_deformed_ball_is_inside_while_free() -> None:
    rng = np.random.default_rng(11)
    directions = rng.normal(size=(300, 3))
    surface = 0.2 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    half = np.array([0.3, 0.3, 0.3])
    work = cell(Sphere(0.2), Box(tuple(2.0 * half)))
    found = 0
    for _ in range(40):
        points = rng.uniform(-1.5, 1.5, (4, 3, 4))
        motion = RationalMotion(points, rng.uniform(0.5, 2.0, 4))
        result = certify(work, path(motion))
        found += len(result.intervals) > 1
        for row in result.intervals:
            if row.status is Status.FREE:
                for s in np.linspace(row.start_ns, row.end_ns, 30) / SECOND:
                    pose = motion.pose(s)
                    images = surface @ pose[:, :3].T + pose[:, 3]
                    assert not (np.abs(images) < half - 1e-9).all(axis=1).any()
    assert found > 5


def test_time_before_the_first_knot_is_nobodys_but_unknown() -> None:
    """A path that begins late is suspect until then, and cannot be told otherwise."""
    motion = straight(np.array([5.0, 0.0, 0.0]), np.array([6.0, 0.0, 0.0]))
    late = FreePath.exact([motion], [5 * SECOND, 6 * SECOND])
    result = certify(cell(Sphere(0.1), Box((0.2, 0.2, 0.2))), late)
    assert [(row.start_ns, row.status) for row in result.intervals] == [
        (0, Status.SUSPECT),
        (5 * SECOND, Status.FREE),
    ]
    with pytest.raises(TrajectoryGuardError, match='unknown_until_ns is 0'):
        FreePath(
            'part',
            np.array([5, 6]),
            (motion,),
            np.zeros(1),
            np.zeros(1),
            'given',
            unknown_until_ns=0,
        )
