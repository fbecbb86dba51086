"""Obstacles from markers contain what a viewer draws, and come and go as in a viewer."""

from fractions import Fraction
from itertools import product

from bench_data import BENCH, cases, SETTINGS, workcell
import kernel_calls
from marker_messages import array, BASE, delete, delete_all, drawn, marker, outside, TURNED, UNIT
from meshes import extruded, write
from meshes import U as U_SHAPE
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_quaternion import exact_rotation
from visualization_msgs.msg import Marker

from msg_adapters.marker import changes_from_message
from trajectory_guard.cell.pack import solids
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.urdf import load_robot, robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason, SceneError
from trajectory_guard.markers.marker import MarkerKind
from trajectory_guard.markers.marker_scene import (
    fixed_frames,
    MarkerLimits,
    MarkerScene,
    with_markers,
)
from trajectory_guard.result import Status
from trajectory_guard.shapes.primitive import Box

FRAMES = {BASE: ()}
PLACES = [(0.0, 0.0, 0.0), (1.0, 2.0, -3.0), (-0.1, 0.2, 0.5)]
TRIANGLES = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1.5)]
FILES = Scene((Obstacle('table', (Box((1.0, 1.0, 1.0)).load().body,)),), 'f' * 64)

# What the comparison with an independent rotation rounds [m].
ROUNDING = 1e-14

KIND_NAMES = {int(kind): kind.name for kind in MarkerKind}
KINDS = [
    marker(Marker.CUBE),
    marker(Marker.SPHERE, scale=(0.3, 0.3, 0.3)),
    marker(Marker.SPHERE, scale=(0.3, 0.1, 0.7)),
    marker(Marker.CYLINDER, scale=(0.3, 0.3, 0.7)),
    marker(Marker.CYLINDER, scale=(0.3, 0.1, 0.7)),
    marker(Marker.CUBE_LIST, points=PLACES),
    marker(Marker.SPHERE_LIST, scale=(0.2, 0.2, 0.2), points=PLACES),
    marker(Marker.SPHERE_LIST, scale=(0.2, 0.1, 0.3), points=PLACES),
    marker(Marker.TRIANGLE_LIST, scale=(2.0, 0.5, 3.0), points=TRIANGLES),
    # Nearly of length 1 is taken for what it means.
    marker(Marker.CUBE, quaternion=np.multiply(UNIT, 1.0009)),
]


def scene(*messages, into=None, **options):
    """Return the scene after an array of each tuple of messages, or of each message."""
    found = into or MarkerScene()
    for message in messages:
        markers = message if isinstance(message, tuple) else (message,)
        found = found.updated(changes_from_message(array(*markers)), **options)
    return found


def names(found):
    """Return the names of its obstacles."""
    return [obstacle.name for obstacle in found.obstacles(FRAMES)]


# Geometry


@pytest.mark.parametrize('message', KINDS, ids=lambda m: f'{m.type}-{m.scale.x}-{m.scale.y}')
def test_all_that_is_drawn_is_in_the_obstacle(message):
    (obstacle,) = scene(message).obstacles(FRAMES)
    points = drawn(message, np.random.default_rng(0), 500)
    nearest = np.min([outside(body, points) for body in obstacle.bodies], axis=0)
    assert nearest.max() <= ROUNDING
    # And no more than an ellipsoid's polyhedron needs, or a list's unequal spheres.
    if message.type != Marker.SPHERE_LIST:
        assert nearest.max() > -0.02


@pytest.mark.parametrize('far', [0.0, 1.0, 1e6])
@pytest.mark.parametrize('kind', [Marker.CUBE, Marker.CUBE_LIST, Marker.TRIANGLE_LIST])
def test_the_exact_corners_are_in_the_balls_of_the_vertices(kind, far):
    """In rationals: the rotation of the quaternion as the message has it, made of length 1."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = rng.normal(size=4)
        q *= (1 + rng.uniform(-1e-3, 1e-3)) / np.linalg.norm(q)
        scale, shift = rng.uniform(0.1, 3.0, 3), far * rng.normal(size=3)
        points = rng.normal(size=(1 if kind == Marker.CUBE_LIST else 3, 3))
        message = marker(kind, scale=scale, position=shift, quaternion=q, points=points)
        ((body,),) = (o.bodies for o in scene(message).obstacles(FRAMES))
        S, R = [Fraction(x) for x in scale], exact_rotation(q)
        if kind == Marker.TRIANGLE_LIST:
            local = [[s * Fraction(x) for s, x in zip(S, p, strict=True)] for p in points]
        else:
            middle = points[0] if kind == Marker.CUBE_LIST else np.zeros(3)
            local = [
                [Fraction(m) + sign * s / 2 for m, sign, s in zip(middle, corner, S, strict=True)]
                for corner in product((-1, 1), repeat=3)
            ]
        balls = [[Fraction(x) for x in vertex] for vertex in body.vertices]
        for p in local:
            exact = [
                sum(r * x for r, x in zip(row, p, strict=True)) + Fraction(t)
                for row, t in zip(R, shift, strict=True)
            ]
            nearest = min(
                sum((a - b) ** 2 for a, b in zip(exact, ball, strict=True)) for ball in balls
            )
            assert nearest <= Fraction(body.ball) ** 2


@pytest.mark.parametrize(
    'message', [m for m in KINDS if 'SPHERE' in KIND_NAMES[m.type] or m.type == Marker.CYLINDER]
)
def test_no_surface_point_is_inside(message):
    """Neither in the polytope inside of the body nor in the round solid it is taken for."""
    (obstacle,) = scene(message).obstacles(FRAMES)
    points = drawn(message, np.random.default_rng(1), 4000)
    for body in obstacle.bodies:
        assert len(body.faces)
        depth = (body.faces[:, 3] - points @ body.faces[:, :3].T).min(axis=1)
        assert depth.max() <= ROUNDING
        packed = solids([body], [-1])
        assert max(kernel_calls.depth(packed, point) for point in points[:500]) <= ROUNDING


def test_a_frame_rigidly_attached_to_the_root_counts():
    robot = robot_from_urdf(
        '<robot name="r"><link name="base"/><link name="stand"/><link name="shelf"/>'
        '<link name="arm"><collision><geometry><box size="1 1 1"/></geometry></collision></link>'
        '<joint name="a" type="fixed"><parent link="base"/><child link="stand"/>'
        '<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/></joint>'
        '<joint name="b" type="fixed"><parent link="stand"/><child link="shelf"/>'
        '<origin xyz="0 0 1" rpy="1 0 0"/></joint>'
        '<joint name="c" type="continuous"><parent link="shelf"/><child link="arm"/>'
        '</joint></robot>'
    )
    frames = fixed_frames(robot)
    assert set(frames) == {'base', 'stand', 'shelf'}
    message = marker(frame='shelf')
    (obstacle,) = scene(message, frames=frames).obstacles(frames)
    points = drawn(message, np.random.default_rng(0))
    for turn, shift in (((1, 0, 0), (0, 0, 1)), ((0.1, 0.2, 0.3), (1, 2, 3))):
        points = points @ Rotation.from_euler('xyz', turn).as_matrix().T + shift
    assert outside(obstacle.bodies[0], points).max() <= ROUNDING
    with pytest.raises(SceneError, match=r"'ns/0'.*'arm'.*base, stand") as error:
        scene(marker(frame='arm'), frames=frames)
    assert error.value.reason is Reason.FRAME_UNKNOWN
    # Also if the robot comes later than the marker.
    with pytest.raises(SceneError, match='arm'):
        scene(marker(frame='arm')).obstacles(frames)


def test_a_list_of_triangles_is_no_more_than_its_surface():
    mesh = extruded(U_SHAPE, scale=1)
    corners = mesh.points[mesh.triangles].reshape(-1, 3)
    found = scene(marker(Marker.TRIANGLE_LIST, scale=(1, 1, 1), points=corners))
    (body,) = found.obstacles(FRAMES)[0].bodies
    assert body.surface is not None and body.surface.is_watertight


def test_a_mesh_is_scaled_and_read_once(tmp_path):
    path = tmp_path / 'u.stl'
    mesh = extruded(U_SHAPE, scale=1)
    write(mesh, path)
    resource = marker(Marker.MESH_RESOURCE, scale=(1, 2, 3), mesh_resource=f'file://{path}')
    first = scene(resource)
    (body,) = first.obstacles(FRAMES)[0].bodies
    R = Rotation.from_quat(UNIT).as_matrix()
    points = (mesh.points * (1, 2, 3)) @ R.T + (0.5, -1.0, 2.0)
    # STL has single precision.
    assert outside(body, points).max() < 1e-6
    assert body.surface is not None
    path.unlink()
    assert scene(resource, into=first).obstacles(FRAMES)[0].bodies[0] is body
    with pytest.raises(SceneError, match=r"'ns/1'.*not found") as error:
        scene(marker(Marker.MESH_RESOURCE, 1, mesh_resource=f'file://{path}'), into=first)
    assert error.value.reason is Reason.MESH_MISSING
    write(mesh, path)
    for limits, reason in (
        (MarkerLimits(mesh_bytes=100), Reason.TOO_LARGE),
        (MarkerLimits(mesh_roots=(tmp_path / 'other',)), Reason.MESH_FORBIDDEN),
    ):
        with pytest.raises(SceneError, match=r"'ns/0'.*u.stl") as error:
            scene(resource, limits=limits)
        assert error.value.reason is reason
    assert names(scene(resource, limits=MarkerLimits(mesh_roots=(tmp_path,)))) == ['ns/0']


# What comes and goes


def test_markers_replace_and_remove_each_other():
    a, b, c = marker(number=1, ns='a'), marker(number=2, ns='a'), marker(number=1, ns='b')
    found = scene((b, c, a))
    assert names(found) == ['a/1', 'a/2', 'b/1']
    assert names(scene(delete(1, 'a'), into=found)) == ['a/2', 'b/1']
    assert names(scene(delete(7, 'a'), into=found)) == ['a/1', 'a/2', 'b/1']
    assert names(scene(delete_all('a'), into=found)) == ['b/1']
    assert names(scene(delete_all(), into=found)) == []
    # In the order of the array.
    assert names(scene((delete_all(), marker(number=9)), into=found)) == ['ns/9']
    assert names(scene((marker(number=9), delete_all()), into=found)) == []
    moved = scene(marker(Marker.SPHERE, 1, 'a', scale=(1, 1, 1)), into=found)
    assert [len(o.bodies[0].vertices) for o in moved.obstacles(FRAMES)] == [1, 8, 8]
    assert names(scene(marker(Marker.TEXT_VIEW_FACING, 1, 'a', text='hi'), into=found)) == [
        'a/2',
        'b/1',
    ]
    # An empty list shows nothing.
    assert names(scene(marker(Marker.CUBE_LIST, 1, 'a'), into=found)) == ['a/2', 'b/1']


def test_nothing_ends_a_marker_but_its_removal():
    kept = marker(frame_locked=True)
    kept.lifetime.nanosec = 1_000_000
    kept.color.a = 0.0
    assert names(scene(kept, marker(number=1))) == ['ns/0', 'ns/1']


@pytest.mark.parametrize(
    ('bad', 'reason', 'words'),
    [
        (marker(number=5, scale=(1, 0, 1)), Reason.SCENE_INVALID, r"'ns/5': scale.y 0.0"),
        (marker(number=5, scale=(1, -1, 1)), Reason.SCENE_INVALID, r"'ns/5': scale.y -1.0"),
        (marker(number=5, scale=(1, np.nan, 1)), Reason.NOT_FINITE, r"'ns/5': scale .*nan"),
        (marker(number=5, quaternion=(0, 0, 0, 0)), Reason.SCENE_INVALID, 'orientation.*length 0'),
        (marker(number=5, quaternion=TURNED), Reason.SCENE_INVALID, 'orientation.*length 0.97'),
        (marker(number=5, position=(0, np.inf, 0)), Reason.NOT_FINITE, 'position.*inf'),
        (
            marker(number=5, position=(0, 1e10, 0)),
            Reason.SCENE_INVALID,
            'position.y 10000000000.0',
        ),
        (marker(number=5, frame=''), Reason.FRAME_UNKNOWN, "frame_id ''"),
        (marker(number=5, frame='map'), Reason.FRAME_UNKNOWN, "frame_id 'map'.*base"),
        (marker(Marker.ARROW, 5), Reason.GEOMETRY_UNSUPPORTED, "type 'ARROW'"),
        (marker(Marker.ARROW_STRIP, 5), Reason.GEOMETRY_UNSUPPORTED, 'ARROW_STRIP'),
        (marker(77, 5), Reason.GEOMETRY_UNSUPPORTED, 'type 77'),
        (marker(number=5, action=4), Reason.SCENE_INVALID, 'action 4'),
        (marker(Marker.TRIANGLE_LIST, 5), Reason.SCENE_INVALID, '0 points'),
        (
            marker(Marker.TRIANGLE_LIST, 5, points=TRIANGLES[:4]),
            Reason.SCENE_INVALID,
            '4 points',
        ),
        (
            marker(Marker.CUBE_LIST, 5, points=[(0, 0, 0), (0, np.nan, 0)]),
            Reason.NOT_FINITE,
            r'points\[1\]',
        ),
        (
            marker(Marker.CUBE_LIST, 5, points=[(0, 0, 0), (0, 2e9, 0)]),
            Reason.SCENE_INVALID,
            r'points\[1\].y',
        ),
        (marker(Marker.MESH_RESOURCE, 5), Reason.MESH_MISSING, 'mesh_resource'),
        (
            marker(Marker.MESH_RESOURCE, 5, mesh_resource='http://host/a.stl'),
            Reason.MESH_MISSING,
            'http',
        ),
    ],
)
def test_an_array_with_a_bad_marker_changes_nothing(bad, reason, words):
    before = scene(marker(number=1))
    digest = before.digest
    with pytest.raises(SceneError, match=words) as error:
        scene((delete_all(), marker(number=2), bad), into=before, frames=FRAMES)
    assert error.value.reason is reason
    assert names(before) == ['ns/1'] and before.digest == digest


def test_a_removal_that_viewers_ignore_is_refused():
    bad = delete_all()
    bad.pose.position.x = np.nan
    with pytest.raises(SceneError, match='position'):
        scene(bad)


def test_limits():
    limits = MarkerLimits(markers=3, points=4)
    full = scene((marker(number=1), marker(number=2)), limits=limits)
    with pytest.raises(SceneError, match='4 markers, more than 3') as error:
        scene((marker(number=3), marker(number=4)), into=full, limits=limits)
    assert error.value.reason is Reason.TOO_LARGE
    with pytest.raises(SceneError, match='4 markers, more than 3'):
        changes_from_message(array(*[delete()] * 4), limits)
    two = [
        marker(Marker.CUBE_LIST, 1, points=PLACES),
        marker(Marker.CUBE_LIST, 2, points=PLACES),
    ]
    with pytest.raises(SceneError, match='6 points, more than 4'):
        changes_from_message(array(*two), limits)
    with pytest.raises(SceneError, match='6 points, more than 4'):
        scene(*two, limits=limits)
    # One takes the place of the other.
    assert names(scene(two[0], two[0], limits=limits)) == ['ns/1']


# Digest


def test_the_digest_is_that_of_what_is_there():
    messages = [marker(number=k) for k in range(3)]
    one = scene(*messages)
    assert scene(tuple(messages[::-1])).digest == one.digest
    assert scene(marker(number=7), *messages, delete(7)).digest == one.digest
    others = [
        scene(*messages[:2]),
        scene(*messages[:2], marker(number=3)),
        scene(*messages[:2], marker(number=2, ns='n')),
        scene(*messages[:2], marker(number=2, scale=(0.2, 0.3, np.nextafter(0.4, 1)))),
        scene(*messages[:2], marker(number=2, position=(0.5, -1.0, np.nextafter(2, 3)))),
        scene(*messages[:2], marker(number=2, quaternion=np.negative(UNIT))),
        scene(*messages[:2], marker(number=2, frame='other')),
        scene(*messages[:2], marker(Marker.SPHERE, number=2)),
        scene(*messages[:2], marker(Marker.CUBE_LIST, number=2, points=PLACES)),
        scene(*messages[:2], marker(Marker.CUBE_LIST, number=2, points=PLACES[:2])),
        MarkerScene(),
    ]
    digests = {other.digest for other in others} | {one.digest}
    assert len(digests) == len(others) + 1
    minus = scene(*messages[:2], marker(number=2, position=(0.5, -1.0, 0.0)))
    zero = scene(*messages[:2], marker(number=2, position=(0.5, -1.0, -0.0)))
    assert minus.digest == zero.digest


def test_the_digest_knows_the_content_of_meshes(tmp_path):
    path = tmp_path / 'm.stl'
    resource = marker(Marker.MESH_RESOURCE, mesh_resource=f'file://{path}')
    digests = set()
    for scale in (1, 2):
        write(extruded(U_SHAPE, scale=scale), path)
        digests.add(scene(resource).digest)
    assert len(digests) == 2


# With files


def test_files_and_markers_are_one_scene():
    found = scene(marker(number=1))
    both = with_markers(FILES, found, FRAMES)
    assert [o.name for o in both.obstacles] == ['table', 'ns/1']
    alone = with_markers(None, found, FRAMES)
    assert [o.name for o in alone.obstacles] == ['ns/1']
    assert len({both.digest, alone.digest, FILES.digest, found.digest}) == 4
    assert with_markers(FILES, MarkerScene(), FRAMES) is FILES
    with pytest.raises(SceneError) as error:
        with_markers(None, scene(delete_all()), FRAMES)
    assert error.value.reason is Reason.SCENE_EMPTY
    clash = Scene((Obstacle('ns/1', FILES.obstacles[0].bodies),), 'f' * 64)
    with pytest.raises(SceneError, match=r"'ns/1'") as error:
        with_markers(clash, found, FRAMES)
    assert error.value.reason is Reason.DUPLICATE_NAME


def bench_markers(root):
    """Return the scene of the benchmark as markers in the root link."""
    robot = load_robot(BENCH / 'scene.urdf')
    for k, joint in enumerate(robot.joints):
        (collision,) = robot.collisions[joint.child]
        T = joint.T_parent_joint @ collision.T_link_shape
        shape = collision.shape
        yield (
            joint.child,
            marker(
                Marker.CUBE if isinstance(shape, Box) else Marker.MESH_RESOURCE,
                k,
                scale=shape.size if isinstance(shape, Box) else shape.scale,
                position=T[:3, 3],
                quaternion=Rotation.from_matrix(T[:3, :3]).as_quat(),
                frame=root,
                mesh_resource='' if isinstance(shape, Box) else f'file://{BENCH / shape.uri}',
            ),
        )


def test_the_same_scene_from_markers_and_from_a_file_has_the_same_answers():
    cell = workcell('panda')
    named, messages = zip(*bench_markers(cell.robot.root), strict=True)
    frames = fixed_frames(cell.robot)
    live = Workcell(cell.robot, with_markers(None, scene(messages, frames=frames), frames))
    name = {'': ''} | {f'ns/{k}': link for k, link in enumerate(named)}
    seen = set()
    for trajectory, _, _ in cases('panda')[::4]:
        one, other = (judge(c, trajectory, None, SETTINGS) for c in (cell, live))
        assert one.verdict == other.verdict, trajectory.name
        assert len(one.intervals) == len(other.intervals)
        for a, b in zip(one.intervals, other.intervals, strict=True):
            assert (a.status, a.body) == (b.status, b.body)
            if a.status != Status.FREE:
                assert a.obstacle == name[b.obstacle]
            # The poses differ by their rounding.
            assert abs(a.start_ns - b.start_ns) <= 100
        seen.add(one.verdict)
    assert len(seen) >= 2
