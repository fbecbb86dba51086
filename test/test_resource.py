"""Where resources are looked for."""

from pathlib import Path

import pytest

from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.errors import Reason, RobotError, SceneError
from trajectory_guard.shapes.resource import MeshLimits, places

FOLDER = Path('/robots/arm_description/urdf')


@pytest.fixture(autouse=True)
def no_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv('AMENT_PREFIX_PATH', raising=False)
    monkeypatch.delenv('ROS_PACKAGE_PATH', raising=False)


def look(uri: str, folder: Path | None = FOLDER) -> list[str]:
    return [str(path) for path in places(uri, folder)]


def test_packages_the_ament_index_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('AMENT_PREFIX_PATH', '/ws/install:/opt/ros/jazzy')
    monkeypatch.setenv('ROS_PACKAGE_PATH', '/src:/src/arm_description')
    assert look('package://arm_description/meshes/a.stl') == [
        '/ws/install/share/arm_description/meshes/a.stl',
        '/opt/ros/jazzy/share/arm_description/meshes/a.stl',
        '/src/arm_description/meshes/a.stl',
        '/src/arm_description/meshes/a.stl',
        '/src/arm_description/arm_description/meshes/a.stl',
        '/robots/arm_description/urdf/arm_description/meshes/a.stl',
        '/robots/arm_description/meshes/a.stl',
        '/robots/arm_description/arm_description/meshes/a.stl',
        '/robots/arm_description/meshes/a.stl',
        '/arm_description/meshes/a.stl',
    ]


@pytest.mark.parametrize(
    ('uri', 'expected'),
    [
        ('meshes/a.stl', ['/robots/arm_description/urdf/meshes/a.stl']),
        ('../a.stl', ['/robots/arm_description/urdf/../a.stl']),
        ('/abs/a.stl', ['/abs/a.stl']),
        ('file:///abs/a.stl', ['/abs/a.stl']),
        ('file://localhost/abs/a.stl', ['/abs/a.stl']),
        ('file:///abs/a%20b.stl', ['/abs/a%20b.stl', '/abs/a b.stl']),
        ('http://example.org/a.stl', []),
        ('model://arm/a.stl', []),
    ],
)
def test_other_uris(uri: str, expected: list[str]) -> None:
    assert look(uri) == expected


def test_without_a_folder_only_absolute_places_remain() -> None:
    assert look('meshes/a.stl', None) == []
    assert look('package://arm/a.stl', None) == []
    assert look('/abs/a.stl', None) == ['/abs/a.stl']


# What may be read

MESH = """
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 2 3
f 1 2 4
"""
LINK = """
<robot name="r"><link name="l"><collision><geometry>
  <mesh filename="{}"/>
</geometry></collision></link></robot>
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ('inside', 'outside'):
        (tmp_path / name).mkdir()
        (tmp_path / name / 'm.obj').write_text(MESH)
    (tmp_path / 'inside' / 'link.obj').symlink_to(tmp_path / 'outside' / 'm.obj')
    return tmp_path


def refusal(folder: Path, uri: str, limits: MeshLimits) -> Reason | None:
    """Return why a robot with this mesh cannot be used."""
    (folder / 'inside' / 'r.urdf').write_text(LINK.format(uri))
    robot = load_robot(folder / 'inside' / 'r.urdf', limits)
    try:
        robot.digest()
    except RobotError as error:
        assert str(error).startswith("link 'l'")
        return error.reason
    return None


def test_meshes_lie_in_the_roots_or_are_not_read(folder: Path) -> None:
    limits = MeshLimits((folder / 'other', folder / 'inside'))
    outside = f'file://{folder}/outside/m.obj'
    assert refusal(folder, 'm.obj', limits) is None
    assert refusal(folder, f'file://{folder}/inside/m.obj', limits) is None
    for uri in (outside, '../outside/m.obj', 'link.obj', str(folder / 'outside' / 'm.obj')):
        assert refusal(folder, uri, limits) is Reason.MESH_FORBIDDEN, uri
        assert refusal(folder, uri, MeshLimits()) is None, uri
    # A name that only begins like a root.
    assert refusal(folder, 'm.obj', MeshLimits((folder / 'ins',))) is Reason.MESH_FORBIDDEN


def test_a_mesh_may_be_this_large(folder: Path) -> None:
    size = (folder / 'inside' / 'm.obj').stat().st_size
    assert refusal(folder, 'm.obj', MeshLimits((), size)) is None
    assert refusal(folder, 'm.obj', MeshLimits((), size - 1)) is Reason.TOO_LARGE


def test_a_scene_file_lies_anywhere_but_its_meshes_do_not(folder: Path) -> None:
    limits = MeshLimits((folder / 'inside',))
    assert load_scene(folder / 'outside' / 'm.obj', limits=limits).obstacles
    (folder / 'outside' / 'r.urdf').write_text(LINK.format('m.obj'))
    with pytest.raises(SceneError) as caught:
        load_scene(folder / 'outside' / 'r.urdf', limits=limits)
    assert caught.value.reason is Reason.MESH_FORBIDDEN
    with pytest.raises(SceneError) as caught:
        load_scene(folder / 'outside' / 'm.obj', limits=MeshLimits((), 5))
    assert caught.value.reason is Reason.TOO_LARGE
