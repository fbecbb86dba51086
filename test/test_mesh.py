"""A mesh file becomes a body that contains it, or an error that names it."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
import trimesh

from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.shapes.body import ConvexBody
from trajectory_guard.shapes.mesh import mesh_body, MeshFile
from trajectory_guard.shapes.mesh_formats import Triangles

ONE = (1.0, 1.0, 1.0)
KNOT = trimesh.creation.torus(major_radius=0.4, minor_radius=0.1).apply_translation((0.1, 0, 3))


def assert_contains(body: ConvexBody, points: np.ndarray) -> None:
    """Check the support of a body against points in many directions."""
    n = np.random.default_rng(1).normal(size=(2000, 3))
    n = np.concatenate((n, np.eye(3), -np.eye(3)))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    mine, theirs = ((p @ n.T).max(axis=0) for p in (body.vertices, points))
    noise = 4e-16 * np.abs(points).max()
    assert (theirs <= mine + body.ball + noise).all()
    assert (mine <= theirs + noise + body.ball).all()


@pytest.mark.parametrize('suffix', ['.stl', '.obj', '.ply', '.STL'])
def test_the_body_contains_every_vertex_of_the_file(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f'knot{suffix}'
    KNOT.export(path, file_type=suffix[1:].lower())
    body, content = MeshFile(path.name, tmp_path).load()
    assert content == hashlib.sha256(path.read_bytes()).hexdigest()
    assert_contains(body, trimesh.load_mesh(path, process=False).vertices)
    assert len(body.faces) == 0


@pytest.mark.parametrize('scale', [ONE, (0.001, 0.001, 0.001), (1.0, -1.0, 1.0), (-2.0, 0.1, 3.3)])
def test_the_scale_is_applied_and_its_rounding_counted(scale: tuple) -> None:
    box = trimesh.creation.box((0.3, 0.7, 1.1))
    body = mesh_body(Triangles(box.vertices, box.faces), scale)
    assert_contains(body, box.vertices * scale)
    assert (body.ball > 0.0) == (scale != ONE)
    assert body.ball < 1e-14
    assert len(body.faces) == 6
    assert np.allclose(np.sort(body.faces[:, 3]), np.sort(np.repeat(body.vertices.max(axis=0), 2)))


@pytest.mark.parametrize(
    ('points', 'count'),
    [
        (np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), 3),
        (np.array([[0.0, 0, 0], [1, 1, 1], [2, 2, 2]]), 3),
        (np.array([[1.0, 2, 3], [1, 2, 3], [1, 2, 3]]), 1),
        (np.array([[1.0, 2, 3], [1, 2, 4], [1, 2, 3]]), 2),
        (np.array([[0.0, 0, -0.0], [1, 0, 0.0], [0, 0.0, 0.0]]), 2),
        (np.array([[0.0, 0, 0], [1e-300, 0, 0], [0, 1e-300, 0]]), 3),
        (np.array([[1e9, 0, 0], [1e9, 1e-6, 0], [1e9, 0, 1e-6]]), 3),
    ],
    ids=['triangle', 'collinear', 'point', 'edge', 'two zeros', 'tiny', 'far'],
)
def test_flat_and_tiny_meshes_keep_all_their_points(points: np.ndarray, count: int) -> None:
    body = mesh_body(Triangles(points, np.array([[0, 1, 2]])))
    assert {tuple(v) for v in body.vertices} == {tuple(p + 0.0) for p in points}
    assert len(body.vertices) == count
    assert body.faces.shape == (0, 4)


def test_the_rounding_of_the_reader_grows_with_the_scale() -> None:
    box = trimesh.creation.box()
    body = mesh_body(Triangles(box.vertices, box.faces, rounding=1e-6), (1.0, -5.0, 1.0))
    assert 5e-6 <= body.ball < 2e-5
    assert (body.faces[:, 3] < np.abs(body.faces[:, :3]) @ [0.5, 2.5, 0.5] - 5e-6).all()


def test_a_coordinate_may_not_be_astronomic() -> None:
    triangle = Triangles(np.eye(3), np.array([[0, 1, 2]]))
    with pytest.raises(ValueError, match='1e\\+09 m'):
        mesh_body(triangle, (1.0, 2e9, 1.0))


def load_error(uri: str, folder: Path | None) -> RobotError:
    with pytest.raises(RobotError) as caught:
        MeshFile(uri, folder).load()
    assert repr(uri) in str(caught.value)
    return caught.value


def test_a_missing_mesh_names_the_places(tmp_path: Path) -> None:
    error = load_error('package://arm/meshes/hand.stl', tmp_path)
    assert error.reason is Reason.MESH_MISSING
    assert str(tmp_path / 'arm/meshes/hand.stl') in str(error)
    assert 'nowhere' in str(load_error('https://example.org/hand.stl', tmp_path))
    assert load_error('hand.stl', None).reason is Reason.MESH_MISSING


@pytest.mark.parametrize(
    ('name', 'content', 'named'),
    [
        ('hand.step', b'x', '.stl, .obj, .dae, .ply'),
        ('hand', b'x', '.stl, .obj, .dae, .ply'),
        ('hand.stl', b'', 'STL of 0 bytes'),
        ('hand.stl', b'solid a\nendsolid a\n', 'no triangles'),
        ('hand.obj', b'v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n', 'nan'),
        ('hand.ply', b'ply\n', 'header'),
        ('hand.dae', b'<COLLADA>', 'broken XML'),
        ('hand.obj', b'v 0 0 0\nv 9e9 0 0\nv 0 1 0\nf 1 2 3\n', '1e+09'),
    ],
)
def test_an_unusable_mesh_is_named(tmp_path: Path, name: str, content: bytes, named: str) -> None:
    (tmp_path / name).write_bytes(content)
    error = load_error(name, tmp_path)
    assert error.reason is Reason.MESH_INVALID
    assert named in str(error)


def test_a_folder_is_no_mesh(tmp_path: Path) -> None:
    (tmp_path / 'hand.stl').mkdir()
    assert load_error('hand.stl', tmp_path).reason is Reason.MESH_MISSING


def test_a_file_that_changes_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / 'mesh.obj'
    loaded = []
    for size in (1, 2, 1):
        path.write_text(f'v 0 0 0\nv {size} 0 0\nv 0 1 0\nf 1 2 3\n')
        loaded.append(MeshFile(str(path)).load())
    small, large, again = loaded
    assert small.content != large.content
    assert small.body.vertices.max() == 1.0 and large.body.vertices.max() == 2.0
    assert again.body is small.body and again.content == small.content
    # The same file at another scale is another body.
    assert MeshFile(str(path), scale=(3.0, 1.0, 1.0)).load().body.vertices.max() == 3.0
