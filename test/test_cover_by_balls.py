"""The cover by balls of displacements: the same arms and bodies, and never a wrong free."""

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

from bench_data import cases, ROBOTS, SETTINGS, workcell
import coal
from meshes import box, without
import numpy as np
import pytest
from rational_curves import random_rigid_motion
from typer.testing import CliRunner

from trajectory_guard.cell.free_body import free_body
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import certify, judge
from trajectory_guard.command_line.app import app
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.motions.floating_path import floating_path
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.free_path import FreePath
from trajectory_guard.paths.trajectory import JointState, Point, Trajectory
from trajectory_guard.result import Status, Verdict
from trajectory_guard.settings import Cover, Scope, Settings
from trajectory_guard.shapes.body import ConvexBody
from trajectory_guard.shapes.facets import faceted, joined
from trajectory_guard.shapes.primitive import Box, Cylinder, Sphere
from trajectory_guard.shapes.surface import Surface
from trajectory_guard.toleranced.collision import collide
from trajectory_guard.toleranced.pair import pair_of

SECOND = 10**9
BALLS = Settings(cover=Cover.BALL, tolerance=1e-3)
RNG = np.random.default_rng(3)
BODIES = {
    'box': Box((0.3, 0.2, 0.1)).load().body,
    'sphere': Sphere(0.1).load().body,
    'cylinder': Cylinder(0.05, 0.4).load().body,
    'point': ConvexBody(np.array([[1.0, 2.0, 3.0]])),
    'capsule': ConvexBody(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), ball=0.1),
    'plate': ConvexBody(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])),
    'coin': ConvexBody(np.zeros((1, 3)), disc_radius=0.2),
    'cloud': ConvexBody(RNG.normal(size=(200, 3)), ball=1e-4),
    'grid': ConvexBody(
        np.array([[x, y, z] for x in range(4) for y in range(4) for z in range(4)], float)
    ),
    'far': ConvexBody(1e6 + RNG.uniform(size=(20, 3))),
    'tiny': ConvexBody(1e-6 * RNG.uniform(size=(20, 3))),
}


@pytest.mark.parametrize('name', BODIES)
def test_a_polyhedron_contains_its_body(name: str) -> None:
    """In every direction it reaches at least as far, with its ball, and not much farther."""
    body = BODIES[name]
    polyhedron, ball = faceted(body)
    assert polyhedron.watertight
    directions = np.random.default_rng(1).normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    along = directions @ body.disc_axis
    disc = body.disc_radius * np.sqrt(np.maximum(0.0, 1.0 - along**2))
    wanted = (directions @ body.vertices.T).max(axis=1) + disc + body.ball
    reached = (directions @ polyhedron.vertices.T).max(axis=1) + ball
    size = np.ptp(body.vertices, axis=0).max() + body.disc_radius + body.ball
    rounding = 1e-15 * np.abs(body.vertices).max()
    assert (reached >= wanted - rounding).all()
    assert (reached <= wanted + 0.02 * size + 1e-8).all()


def test_an_open_mesh_stays_open_and_a_hull_is_closed(tmp_path) -> None:
    one, other = (faceted(BODIES[name]).polyhedron for name in ('box', 'sphere'))
    both, owner = joined([one, other])
    assert both.watertight
    assert len(both.faces) == len(one.faces) + len(other.faces)
    assert owner.tolist() == [0] * len(one.faces) + [1] * len(other.faces)


@pytest.mark.parametrize('robot', ROBOTS)
def test_arms_are_judged_as_the_truth_has_it(robot: str) -> None:
    """No interval that is in contact is free, and free trajectories are."""
    cell = workcell(robot)
    for trajectory, truth, _ in cases(robot)[::8]:
        result = judge(
            cell, trajectory, settings=replace(SETTINGS, cover=Cover.BALL, tolerance=1e-3)
        )
        hull = judge(cell, trajectory, settings=replace(SETTINGS, tolerance=1e-3))
        assert result.intervals[0].start_ns == 0
        assert result.intervals[-1].end_ns == result.duration_ns
        assert (result.verdict is Verdict.FREE) == (hull.verdict is Verdict.FREE)
        assert Status.COLLISION not in {row.status for row in result.intervals}
        for begin, end in truth['contact_core']:
            for row in result.intervals:
                overlap = row.start_ns < end * SECOND and begin * SECOND < row.end_ns
                assert not (row.status is Status.FREE and overlap)


def single(moving, obstacle, at=(0.0, 0.0, 0.0)) -> Workcell:
    T = np.eye(4)
    T[:3, 3] = at
    body = obstacle.load().body.moved(T)
    return Workcell(free_body('part', moving), Scene((Obstacle('thing', (body,)),), ''))


SHAPES = [
    (Box((0.3, 0.2, 0.1)), coal.Box(0.3, 0.2, 0.1)),
    (Sphere(0.1), coal.Sphere(0.1)),
    (Cylinder(0.05, 0.4), coal.Cylinder(0.05, 0.4)),
]


@pytest.mark.parametrize('shape', range(3))
def test_free_bodies_are_judged_as_another_library_samples_them(shape: int) -> None:
    moving, one = SHAPES[shape]
    rng = np.random.default_rng(shape)
    seen = dict.fromkeys(Status, 0)
    for k in range(45):
        obstacle, other = SHAPES[k % 3]
        motion = random_rigid_motion(rng)
        result = certify(single(moving, obstacle), FreePath.exact([motion], [0, SECOND]), BALLS)
        for row in result.intervals:
            seen[row.status] += 1
            for s in np.linspace(row.start_ns, row.end_ns, 15) / SECOND:
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
    assert seen[Status.FREE] > 30
    assert seen[Status.SUSPECT] > 3


def test_what_is_inside_is_not_free() -> None:
    """A small ball deep in a large box never meets its faces."""
    motion = random_rigid_motion(np.random.default_rng(1), size=0.1)
    work = single(Sphere(0.01), Box((2.0, 2.0, 2.0)))
    result = certify(work, FreePath.exact([motion], [0, SECOND]), BALLS)
    (row,) = result.intervals
    assert (row.status, row.reason) == (Status.SUSPECT, 'enclosure')
    assert (row.body, row.obstacle) == ('part', 'thing')


@pytest.mark.parametrize(
    ('settings', 'reason'),
    [
        ({'max_pieces': 0}, 'budget'),
        ({'deadline_ns': 0}, 'deadline'),
    ],
)
def test_what_is_spent_is_suspect(settings: dict, reason: str) -> None:
    motion = random_rigid_motion(np.random.default_rng(1))
    work = single(Box((1.0, 1.0, 1.0)), Box((1.0, 1.0, 1.0)))
    asked = Settings(cover=Cover.BALL, **settings)
    result = certify(work, FreePath.exact([motion], [0, SECOND]), asked)
    assert [row.status for row in result.intervals] == [Status.SUSPECT]
    assert result.intervals[0].reason == reason


def test_tolerances_are_kept_away_as_by_the_hull() -> None:
    points = np.zeros((2, 3, 4))
    points[:, :, :3] = np.eye(3)
    points[0, :, 3], points[1, :, 3] = (-1.0, 0.25, 0.0), (1.0, 0.25, 0.0)
    path = FreePath.exact([RationalMotion(points, np.ones(2))], [0, SECOND])
    work = single(Box((0.2, 0.2, 0.2)), Box((0.2, 0.2, 0.2)))
    corner = float(np.sqrt(3) * 0.1)
    for settings, free in (
        ({'clearance': 0.04}, True),
        ({'clearance': 0.051}, False),
        ({'tracking_tolerance': (0.04, 0.0)}, True),
        ({'tracking_tolerance': (0.051, 0.0)}, False),
        ({'tracking_tolerance': (0.0, 0.04 / corner)}, True),
        ({'tracking_tolerance': (0.0, 0.051 / corner)}, False),
    ):
        result = certify(work, path, Settings(cover=Cover.BALL, tolerance=1e-3, **settings))
        assert (result.verdict is Verdict.FREE) == free


def test_the_first_suspect_segment_may_be_the_last_to_be_looked_at() -> None:
    rng = np.random.default_rng(5)
    work = single(Box((0.4, 0.4, 0.4)), Box((1.0, 1.0, 1.0)))
    motions = [random_rigid_motion(rng, size=0.3) for _ in range(3)]
    path = FreePath.exact(motions, [0, SECOND, 2 * SECOND, 3 * SECOND])
    result = certify(work, path, Settings(cover=Cover.BALL, scope=Scope.FIRST))
    assert result.intervals[-1].reason == 'not_examined'
    assert result.verdict is Verdict.SUSPECT


def test_no_certificate_is_promised_of_balls() -> None:
    with pytest.raises(RequestError, match='cover hull') as caught:
        Settings(cover=Cover.BALL, want_certificate=True)
    assert caught.value.reason is Reason.INVALID_PARAMETER


def test_the_command_line_takes_a_cover(tmp_path) -> None:
    mesh = Path(__file__).parent / 'data' / 'bench' / 'scene.urdf'
    robot = tmp_path / 'cart.urdf'
    robot.write_text(
        '<robot name="r"><link name="map"/><link name="cart"><collision><geometry>'
        '<sphere radius="0.01"/></geometry></collision></link><joint name="j" type="prismatic">'
        '<parent link="map"/><child link="cart"/><axis xyz="0 0 1"/><origin xyz="9 9 9"/>'
        '<limit lower="0" upper="2"/></joint></robot>'
    )
    file = tmp_path / 'trajectory.yaml'
    file.write_text(
        'joint_names: [j]\npoints:\n- {positions: [0], time_from_start: {sec: 0, nanosec: 0}}\n'
        '- {positions: [1], time_from_start: {sec: 1, nanosec: 0}}\n'
    )
    given = ['--urdf', str(robot), '--scene', str(mesh), str(file), '--cover']
    run = CliRunner().invoke(app, ['check', *given, 'ball'])
    assert run.exit_code == 0, run.output
    run = CliRunner().invoke(app, ['check', *given, 'cube'])
    assert run.exit_code == 2
    assert "cover 'cube'" in run.stderr


def test_a_floating_joint_may_hang_anywhere_at_the_root() -> None:
    """Its fixed pose counts, and a joint that stands before it does not."""
    robot = robot_from_urdf(
        '<robot name="r"><link name="map"/><link name="arm"><collision><geometry>'
        '<sphere radius="0.01"/></geometry></collision></link><link name="cart"><collision>'
        '<geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>'
        '<joint name="a" type="prismatic"><parent link="map"/><child link="arm"/>'
        '<axis xyz="0 0 1"/><origin xyz="50 0 0"/><limit lower="0" upper="2"/></joint>'
        '<joint name="drive" type="floating"><parent link="map"/><child link="cart"/>'
        '<origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/></joint></robot>'
    )
    T = np.eye(4)
    T[:3, 3] = (0.0, 1.0, 1.0)
    post = Box((0.2, 0.2, 0.2)).load().body.moved(T)
    work = Workcell(robot, Scene((Obstacle('post', (post,)),), ''))
    points = np.zeros((2, 3, 4))
    points[:, :, :3] = np.eye(3)
    points[1, 0, 3] = 2.0  # along x of the joint, y of the root
    free = FreePath.exact([RationalMotion(points, np.ones(2))], [0, SECOND], 'drive')
    held = floating_path(robot, free, JointState(('a',), np.array([0.0])))
    for cover in Cover:
        first = certify(work, held, Settings(cover=cover, tolerance=1e-3)).intervals[0]
        assert first.status is Status.FREE
        assert first.end_ns == pytest.approx(0.4 * SECOND, abs=2e-3 * SECOND)


def standing(x: float, scale: float = 1.0) -> FreePath:
    points = np.column_stack([scale * np.eye(3), (x, 0.0, 0.0)])[None]
    return FreePath.exact([RationalMotion(points, np.ones(1))], [0, 0])


def test_an_affine_motion_stretches_what_is_round() -> None:
    """A sphere of 0.1 m becomes one of 0.3 m, and touches a box whose side is 0.25 m away."""
    work = single(Sphere(0.1), Box((0.2, 0.2, 0.2)))
    for cover in Cover:
        asked = Settings(cover=cover, tolerance=1e-3)
        assert certify(work, standing(0.35, 3.0), asked).verdict is not Verdict.FREE
        assert certify(work, standing(0.45, 3.0), asked).verdict is Verdict.FREE


def solid(half: float, inward: bool = False) -> ConvexBody:
    mesh = box((-half,) * 3, (half,) * 3, inward)
    return ConvexBody(mesh.points, surface=Surface(mesh.points, mesh.triangles))


@pytest.mark.parametrize('inward', [False, True])
def test_obstacles_are_solids_each_by_itself(inward: bool) -> None:
    """Inside of two, whichever way they are wound, is inside of both."""
    scene = Scene((Obstacle('one', (solid(1.0),)), Obstacle('other', (solid(0.5, inward),))), '')
    work = Workcell(free_body('part', Box((0.1, 0.1, 0.1))), scene)
    for x, free in ((0.0, False), (0.75, False), (1.2, True)):
        result = certify(work, standing(x), BALLS)
        assert (result.verdict is Verdict.FREE) == free
        assert free or result.intervals[0].reason == 'enclosure'


def test_solids_of_a_polyhedron_have_no_vertex_in_common() -> None:
    one = faceted(BODIES['box']).polyhedron
    with pytest.raises(RequestError, match='in common'):
        pair_of(one, one, solids=np.arange(len(one.faces)))
    with pytest.raises(RequestError, match='solids must be integers of shape'):
        pair_of(one, one, solids=np.zeros(1, np.int64))


def prism() -> np.ndarray:
    """Caps of many corners that rounding leaves off their planes."""
    rng = np.random.default_rng(0)
    turn = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    ring = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    points = np.concatenate([ring, ring + (0.0, 0.0, 1.0)])
    return points @ np.linalg.qr(rng.normal(size=(3, 3)))[0].T


def test_a_hull_contains_what_lies_between_its_corners() -> None:
    """In exact arithmetic: triangles of a cap that rounding made concave leave some of it out."""
    points = prism()
    polyhedron, ball = faceted(ConvexBody(points))
    exact = [[Fraction(x) for x in vertex] for vertex in polyhedron.vertices.tolist()]
    centre = [Fraction(x) for x in polyhedron.vertices.mean(axis=0).tolist()]
    triangles = [
        [[a - b for a, b in zip(exact[v], centre, strict=True)] for v in face]
        for face in polyhedron.triangles
    ]
    rng = np.random.default_rng(1)
    outside = 0
    for _ in range(40):
        pair = 64 * rng.integers(2) + rng.choice(64, 2, replace=False)
        ends = [[Fraction(x) for x in points[i].tolist()] for i in pair]
        y = [(a + b) / 2 - c for a, b, c in zip(*ends, centre, strict=True)]
        leaves = max(filter(None, (passes(y, corners) for corners in triangles)))
        outside += leaves < 1
        assert (1 - leaves) * Fraction(float(np.linalg.norm([float(a) for a in y]))) <= ball
    assert outside > 0


def passes(y: list[Fraction], corners: list[list[Fraction]]) -> Fraction | None:
    """Return t where t y lies in a triangle, None if no positive t does."""

    def volume(a: list[Fraction], b: list[Fraction], c: list[Fraction]) -> Fraction:
        return sum(a[i] * (b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2]) for i in range(3))

    a, b, c = corners
    shares = volume(y, b, c), volume(a, y, c), volume(a, b, y)
    if not sum(shares) or min(shares) < 0:
        return None
    return volume(a, b, c) / sum(shares)


def test_corners_that_qhull_drops_cost_what_they_stand_out() -> None:
    rng = np.random.default_rng(0)
    grid = np.stack(np.meshgrid(*[np.arange(6.0)] * 3), axis=-1).reshape(-1, 3)
    grid = grid @ np.linalg.qr(rng.normal(size=(3, 3)))[0].T
    assert faceted(ConvexBody(grid + 1e-12 * rng.normal(size=grid.shape))).ball < 1e-10


LEVER = (
    '<robot name="r"><link name="map"/><link name="arm"><collision><origin xyz="1000 0 0"/>'
    '<geometry><box size="0.1 0.1 0.1"/></geometry></collision></link><joint name="j" '
    'type="continuous"><parent link="map"/><child link="arm"/><axis xyz="0 0 1"/></joint></robot>'
)


@pytest.mark.parametrize(
    ('settings', 'reason'), [({'deadline_ns': 10**7}, 'deadline'), ({'max_pieces': 9}, 'budget')]
)
def test_building_motions_ends_in_time(settings: dict, reason: str) -> None:
    """At this tolerance the rounding of a kilometre alone is too much, on every short piece."""
    post = Box((0.2, 0.2, 0.2)).load().body
    work = Workcell(robot_from_urdf(LEVER), Scene((Obstacle('post', (post,)),), ''))
    points = [Point(i * SECOND, (0.1 * i,)) for i in range(20)]
    asked = Settings(cover=Cover.BALL, tolerance=1e-9, **settings)
    result = judge(work, Trajectory.from_points(('j',), points), settings=asked)
    assert result.intervals[0].reason == reason
    assert result.compute_time < 1.0


def test_any_number_of_pieces_may_be_allowed() -> None:
    asked = Settings(cover=Cover.BALL, max_pieces=2**63 - 1)
    work = single(Box((0.1, 0.1, 0.1)), Box((0.2, 0.2, 0.2)))
    assert certify(work, standing(1.0), asked).verdict is Verdict.FREE


def test_open_meshes_are_told_of_as_by_the_hull() -> None:
    mesh = without(box((-1.0,) * 3, (1.0,) * 3), 0)
    body = ConvexBody(mesh.points, surface=Surface(mesh.points, mesh.triangles))
    work = Workcell(free_body('part', Sphere(0.1)), Scene((Obstacle('bin', (body,)),), ''))
    for cover in Cover:
        result = certify(work, standing(0.0), Settings(cover=cover))
        assert result.verdict is Verdict.FREE
        assert result.warnings == ('open meshes, so nothing counts as inside: bin',)


@pytest.mark.parametrize(
    ('given', 'told'),
    [
        ({'stop': np.zeros(0, np.int64)}, 'stop must be int64'),
        ({'stop': np.zeros(1)}, 'stop must be int64'),
        ({'max_tests': 1e6}, 'max_tests must be a whole number'),
        ({'max_depth': -1}, 'max_depth must be a whole number'),
        ({'individual': False, 'moments': np.diag([1e308, 1.0, 1.0, 1e-300])}, 'not finite'),
    ],
)
def test_what_the_kernels_could_not_take_is_refused(given: dict, told: str) -> None:
    """A flag without an entry would be read out of bounds, infinite moments end no search."""
    one = faceted(BODIES['box']).polyhedron
    still = RationalMotion(np.eye(3, 4)[None], np.ones(1))
    with pytest.raises(RequestError, match=told) as caught:
        collide(one, one, still, epsilon=1e-3, **given)
    assert caught.value.reason is Reason.INVALID_PARAMETER
