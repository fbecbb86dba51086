"""Where resources are looked for."""

from pathlib import Path

import pytest

from trajectory_guard.resource import places

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
