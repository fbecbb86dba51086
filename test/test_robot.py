"""Real robots: the tree agrees with an independent reader, the bodies contain the meshes."""

from hashlib import sha256
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pinocchio
import pytest
import trimesh

from trajectory_guard.cell.robot import JointType, Robot
from trajectory_guard.cell.urdf import load_robot, robot_from_urdf
from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.shapes.mesh import MeshFile

PREFIX = 'cmeel.prefix/share/example-robot-data/robots'
ROBOTS = Path(str(distribution('example-robot-data').locate_file(PREFIX)))
FILES = {
    'panda': 'panda_description/urdf/panda.urdf',
    'ur5': 'ur_description/urdf/ur5_robot.urdf',
    # Mimic joints, cylinders, many fixed joints.
    'baxter': 'baxter_description/urdf/baxter.urdf',
    # Prismatic joints and boxes.
    'tiago': 'tiago_description/robots/tiago_no_hand.urdf',
}
TRIANGLE = 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n'


def motion(type_: JointType, axis: np.ndarray, q: float) -> np.ndarray:
    T = np.eye(4)
    if type_ is JointType.PRISMATIC:
        T[:3, 3] = q * axis
    elif type_ is not JointType.FIXED:
        x, y, z = axis
        K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        T[:3, :3] += np.sin(q) * K + (1 - np.cos(q)) * K @ K
    return T


def link_poses(robot: Robot, q: dict[str, float]) -> dict[str, np.ndarray]:
    """Walk the tree once, in the order in which the joints come."""
    poses = {robot.root: np.eye(4)}
    for joint in robot.joints:
        value = q.get(joint.name, 0.0)
        if joint.mimic is not None:
            value = joint.mimic.multiplier * q[joint.mimic.joint] + joint.mimic.offset
        moved = joint.T_parent_joint @ motion(joint.type, joint.axis, value)
        poses[joint.child] = poses[joint.parent] @ moved
    return poses


@pytest.mark.parametrize('name', FILES)
def test_forward_kinematics_agree_with_an_independent_reader(name: str) -> None:
    robot = load_robot(ROBOTS / FILES[name])
    model = pinocchio.buildModelFromUrdf(str(ROBOTS / FILES[name]))
    data = model.createData()
    rng = np.random.default_rng(1)
    q = {joint.name: float(rng.uniform(-2.0, 2.0)) for joint in robot.movable}
    for joint in robot.movable:
        if joint.mimic is not None:
            q[joint.name] = joint.mimic.multiplier * q[joint.mimic.joint] + joint.mimic.offset
    theirs = pinocchio.neutral(model)
    for joint_name, value in q.items():
        joint = model.joints[model.getJointId(joint_name)]
        theirs[joint.idx_q : joint.idx_q + joint.nq] = (
            [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
        )
    pinocchio.framesForwardKinematics(model, data, theirs)
    poses = link_poses(robot, q)
    assert poses.keys() == set(robot.links)
    for link, pose in poses.items():
        frame = model.getFrameId(link, pinocchio.FrameType.BODY)
        assert np.abs(pose - data.oMf[frame].homogeneous).max() < 1e-12


@pytest.mark.parametrize('name', FILES)
def test_the_tree_is_topological_and_the_links_follow_it(name: str) -> None:
    robot = load_robot(ROBOTS / FILES[name])
    seen = {robot.root}
    for joint, link in zip(robot.joints, robot.links[1:], strict=True):
        assert joint.parent in seen
        assert joint.child == link
        seen.add(link)
    assert len(seen) == len(robot.links)
    assert set(robot.collision_links) <= seen
    assert [j for j in robot.joints if j in robot.movable] == list(robot.movable)
    for joint in robot.joints:
        assert not joint.axis.flags.writeable
        assert not joint.T_parent_joint.flags.writeable


def test_the_panda_is_as_its_maker_says() -> None:
    robot = load_robot(ROBOTS / FILES['panda'])
    assert [joint.name for joint in robot.movable] == [
        *(f'panda_joint{k}' for k in range(1, 8)),
        'panda_finger_joint1',
        'panda_finger_joint2',
    ]
    assert robot.movable[-1].mimic == ('panda_finger_joint1', 1.0, 0.0)
    assert [joint.type for joint in robot.movable[-2:]] == [JointType.PRISMATIC] * 2
    assert (robot.movable[3].lower, robot.movable[3].upper) == (-3.0718, -0.0698)
    assert robot.root == 'panda_link0'
    assert len(robot.bodies('panda_link1')) >= 1
    assert robot.bodies('panda_link8') == ()


@pytest.mark.parametrize('name', ['panda', 'ur5'])
def test_every_mesh_vertex_is_in_the_body_of_its_link(name: str) -> None:
    robot = load_robot(ROBOTS / FILES[name])
    n = np.random.default_rng(2).normal(size=(1000, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    meshes = 0
    for link in robot.collision_links:
        for collision, body in zip(robot.collisions[link], robot.bodies(link), strict=True):
            if isinstance(collision.shape, MeshFile):
                mesh = trimesh.load_mesh(
                    ROBOTS.parents[1] / collision.shape.uri[len('package://') :]
                )
                points = trimesh.transform_points(
                    mesh.vertices * collision.shape.scale, collision.T_link_shape
                )
                mine = (body.vertices @ n.T).max(axis=0) + body.ball
                theirs = (points @ n.T).max(axis=0)
                assert (theirs <= mine + 1e-15).all()
                # trimesh merges vertices within 1e-8.
                assert (mine <= theirs + 2e-8).all()
                assert body.ball < 1e-12
                meshes += 1
    assert meshes >= 7


@pytest.mark.parametrize('name', FILES)
def test_all_links_of_a_real_robot_load_once(name: str) -> None:
    robot = load_robot(ROBOTS / FILES[name])
    for link in robot.links:
        bodies = robot.bodies(link)
        assert robot.bodies(link) is bodies
        assert bool(bodies) == (link in robot.collision_links)


def test_a_mesh_is_read_when_its_link_is_asked_for_and_once(tmp_path: Path) -> None:
    text = (
        '<robot name="r"><link name="a"><collision><geometry><mesh filename="a.obj"/></geometry>'
        '</collision><collision><geometry><mesh filename="a.obj"/></geometry></collision></link>'
        '<link name="b"><collision><geometry><sphere radius="1"/></geometry></collision></link>'
        '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint></robot>'
    )
    robot = robot_from_urdf(text, tmp_path)
    assert len(robot.bodies('b')) == 1
    for ask in (lambda: robot.bodies('a'), robot.digest):
        with pytest.raises(RobotError, match=r"link 'a': mesh 'a\.obj' not found") as caught:
            ask()
        assert caught.value.reason is Reason.MESH_MISSING
        assert str(tmp_path / 'a.obj') in str(caught.value)
    (tmp_path / 'a.obj').write_text(TRIANGLE)
    first, second = robot.bodies('a')
    assert first is second
    (tmp_path / 'a.obj').unlink()
    assert robot.bodies('a') == (first, second)
    assert len(robot.digest()) == 64


def test_an_unknown_link_is_named() -> None:
    robot = load_robot(ROBOTS / FILES['panda'])
    with pytest.raises(RobotError, match="no link 'elbow'"):
        robot.bodies('elbow')


def test_visual_geometry_is_never_touched() -> None:
    robot = robot_from_urdf(
        '<robot><link name="a"><visual><geometry><mesh filename="none.stl"/></geometry></visual>'
        '<collision><geometry><sphere radius="1"/></geometry></collision></link></robot>'
    )
    assert robot.bodies('a')[0].ball == 1.0
    robot.digest()


def test_the_digest_sees_contents_and_not_places(tmp_path: Path) -> None:
    shape = '<collision><geometry><mesh filename="{}"/></geometry></collision>'
    text = f'<robot><link name="a">{shape}</link></robot>'
    digests = []
    for folder, name, mesh in [
        ('one', 'a.obj', TRIANGLE),
        ('two', 'a.obj', TRIANGLE),
        ('three', 'a.obj', TRIANGLE + '# touched'),
        ('four', 'b.obj', TRIANGLE),
    ]:
        place = tmp_path / folder
        place.mkdir()
        (place / 'r.urdf').write_text(text.format(name))
        (place / name).write_text(mesh)
        digests.append(load_robot(place / 'r.urdf').digest())
    assert digests[0] == digests[1]
    assert len(set(digests)) == 3


def test_the_digest_can_be_recomputed_from_the_files(tmp_path: Path) -> None:
    shape = '<collision><geometry><mesh filename="a.obj"/></geometry></collision>'
    text = f'<robot><link name="a">{shape}</link></robot>'
    (tmp_path / 'a.obj').write_text(TRIANGLE)
    expected = sha256(
        sha256(text.encode()).digest() + sha256(TRIANGLE.encode()).hexdigest().encode()
    )
    assert robot_from_urdf(text, tmp_path).digest() == expected.hexdigest()
