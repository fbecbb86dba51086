"""Scenes: named obstacles in the robot's root frame, or an error; never an empty scene."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from trajectory_guard.cell.scene import load_scene, Scene
from trajectory_guard.errors import Reason, SceneError

BOX = '<collision><origin xyz="0 0 1"/><geometry><box size="2 2 2"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="{}"/></geometry></collision>'


def urdf(folder: Path, name: str = 'cell.urdf', table: str = BOX, joint: str = 'fixed') -> Path:
    path = folder / name
    path.write_text(
        '<robot name="cell"><link name="world"/>'
        f'<link name="table">{table}</link><link name="lamp">{BOX}{BOX}</link>'
        f'<joint name="j" type="{joint}"><parent link="world"/><child link="table"/>'
        '<origin xyz="10 0 0" rpy="0 0 1.5707963267948966"/><limit lower="0" upper="1"/></joint>'
        '<joint name="k" type="fixed"><parent link="table"/><child link="lamp"/>'
        '<origin xyz="0 1 0"/></joint></robot>'
    )
    return path


def mesh(folder: Path, name: str = 'vase.stl', radius: float = 1.0) -> Path:
    trimesh.creation.icosphere(subdivisions=1, radius=radius).export(folder / name)
    return folder / name


def centers(scene: Scene) -> dict[str, list[list[float]]]:
    return {o.name: [np.round(b.center, 9).tolist() for b in o.bodies] for o in scene.obstacles}


def rigid(angle: float, t: tuple[float, float, float]) -> np.ndarray:
    T = np.eye(4)
    c, s = np.cos(angle), np.sin(angle)
    T[:2, :2] = [[c, -s], [s, c]]
    T[:3, 3] = t
    return T


def test_each_link_and_each_mesh_file_is_an_obstacle(tmp_path: Path) -> None:
    scene = load_scene([urdf(tmp_path), mesh(tmp_path), str(mesh(tmp_path, 'cup.ply'))])
    assert centers(scene) == {
        'table': [[10.0, 0.0, 1.0]],
        'lamp': [[9.0, 0.0, 1.0]] * 2,
        'vase': [[0.0, 0.0, 0.0]],
        'cup': [[0.0, 0.0, 0.0]],
    }
    table = scene.obstacles[0].bodies[0]
    assert np.allclose(table.vertices.min(axis=0), [9.0, -1.0, 0.0], rtol=0, atol=1e-14)
    assert len(table.faces) == 6
    # The turn of the joint is a quarter within rounding, and the rounding is counted.
    assert np.abs(np.abs(table.vertices[:, 1]) - 1.0).max() < table.ball < 1e-12


def test_one_path_needs_no_list(tmp_path: Path) -> None:
    path = mesh(tmp_path)
    assert load_scene(path).digest == load_scene(str(path)).digest == load_scene([path]).digest


def test_the_pose_moves_everything(tmp_path: Path) -> None:
    scene = load_scene([urdf(tmp_path), mesh(tmp_path)], rigid(np.pi, (0.0, 0.0, 5.0)))
    assert centers(scene) == {
        'table': [[-10.0, 0.0, 6.0]],
        'lamp': [[-9.0, 0.0, 6.0]] * 2,
        'vase': [[0.0, 0.0, 5.0]],
    }


def test_a_pose_of_ten_digits_is_made_rigid(tmp_path: Path) -> None:
    exact = rigid(1.0, (1.0, 2.0, 3.0))
    bodies = [
        load_scene(mesh(tmp_path), T).obstacles[0].bodies[0] for T in (exact, exact.round(10))
    ]
    assert np.abs(bodies[0].vertices - bodies[1].vertices).max() < 1e-9
    assert max(body.ball for body in bodies) < 1e-13


def test_long_chains_of_fixed_joints_stay_exact_enough(tmp_path: Path) -> None:
    count = 200
    links = ''.join(f'<link name="l{k}"/>' for k in range(count))
    joints = ''.join(
        f'<joint name="j{k}" type="fixed"><parent link="l{k}"/><child link="l{k + 1}"/>'
        f'<origin xyz="0.1 0 0" rpy="0 0 {2 * np.pi / 100!r}"/></joint>'
        for k in range(count)
    )
    path = tmp_path / 'chain.urdf'
    path.write_text(f'<robot>{links}<link name="l{count}">{BOX}</link>{joints}</robot>')
    (body,) = load_scene(path).obstacles[0].bodies
    # Two closed polygons of a hundred corners lead back to the root.
    assert np.abs(body.center - [0.0, 0.0, 1.0]).max() < body.ball < 1e-10


def test_the_digest_sees_contents_order_and_pose_and_not_places(tmp_path: Path) -> None:
    other = tmp_path / 'elsewhere'
    other.mkdir()
    cell, vase = urdf(tmp_path), mesh(tmp_path)
    same = load_scene([urdf(other), mesh(other)]).digest
    turned = np.eye(4)
    turned[0, 1] = -0.0
    digests = [
        load_scene([cell, vase]).digest,
        load_scene([vase, cell]).digest,
        load_scene(vase).digest,
        load_scene([cell, vase], rigid(0.0, (0.0, 0.0, 1e-9))).digest,
        load_scene([cell, mesh(other, radius=1.5)]).digest,
    ]
    assert digests[0] == same == load_scene([cell, vase], turned).digest
    assert len(set(digests)) == len(digests)


@pytest.mark.parametrize(
    ('make', 'reason', 'named'),
    [
        (lambda d: [], Reason.SCENE_EMPTY, 'no obstacles'),
        (lambda d: d / 'none.urdf', Reason.SCENE_MISSING, 'none.urdf'),
        (lambda d: d / 'none.stl', Reason.SCENE_MISSING, 'none.stl'),
        (lambda d: d, Reason.SCENE_MISSING, 'does not exist'),
        (lambda d: [mesh(d), mesh(d, 'vase.ply')], Reason.DUPLICATE_NAME, "'vase'"),
        (lambda d: [urdf(d), urdf(d, 'b.urdf')], Reason.DUPLICATE_NAME, "'table'"),
        (lambda d: urdf(d, joint='revolute'), Reason.SCENE_INVALID, "'j' can move"),
        (lambda d: urdf(d, joint='floating'), Reason.SCENE_INVALID, "'j' can move"),
        (lambda d: urdf(d, joint='planar'), Reason.JOINT_UNSUPPORTED, "'j'"),
        (lambda d: urdf(d, table=MESH.format('gone.stl')), Reason.MESH_MISSING, 'gone.stl'),
        (lambda d: urdf(d, table=MESH.format('cell.urdf')), Reason.MESH_INVALID, 'cell.urdf'),
        (lambda d: urdf(d, table='<collision/>'), Reason.SCENE_INVALID, "link 'table'"),
        (
            lambda d: urdf(d, table=BOX.replace('box size', 'capsule size')),
            Reason.GEOMETRY_UNSUPPORTED,
            '<capsule>',
        ),
    ],
)
def test_what_is_no_scene_is_refused_by_name(
    tmp_path: Path, make: Callable, reason: Reason, named: str
) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene(make(tmp_path))
    assert caught.value.reason is reason
    assert named in str(caught.value)


@pytest.mark.parametrize(
    ('name', 'content', 'reason'),
    [
        ('a.urdf', '<robot><link name="a"/></robot>', Reason.SCENE_EMPTY),
        ('a.urdf', '<robot/>', Reason.SCENE_EMPTY),
        ('a.urdf', '<robot', Reason.SCENE_INVALID),
        ('a.stl', 'solid\nendsolid\n', Reason.MESH_INVALID),
        ('a.step', 'x', Reason.SCENE_INVALID),
    ],
)
def test_an_empty_or_broken_file_is_refused(
    tmp_path: Path, name: str, content: str, reason: Reason
) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(SceneError, match=name) as caught:
        load_scene([mesh(tmp_path), tmp_path / name])
    assert caught.value.reason is reason


@pytest.mark.parametrize(
    'pose',
    [
        np.eye(3),
        np.full((4, 4), np.nan),
        np.diag([1.0, 1.0, -1.0, 1.0]),
        np.diag([1.0, 1.0, 1.0 + 1e-8, 1.0]),
        np.diag([2.0, 2.0, 2.0, 1.0]),
        rigid(0.5, (0.0, np.inf, 0.0)),
        np.eye(2),
    ],
)
def test_a_pose_that_is_not_rigid_is_refused(tmp_path: Path, pose: np.ndarray) -> None:
    with pytest.raises(SceneError, match='pose') as caught:
        load_scene(mesh(tmp_path), pose)
    assert caught.value.reason is Reason.SCENE_INVALID
