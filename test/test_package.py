"""What is installed where, what the messages say, and which layer may import which."""

import ast
from collections.abc import Iterator
from importlib import metadata
import os
from pathlib import Path
import re
import runpy
import subprocess
import sys
from typing import Any
from xml.etree import ElementTree

from ament_index_python import get_package_prefix, get_package_share_directory
import pytest
import setuptools
from trajectory_guard_interfaces.msg import (
    CertificationResult,
    GateDecision,
    GateStatus,
    GuardStatus,
    TimeInterval,
)
from trajectory_guard_interfaces.srv import CertifyTrajectory

from trajectory_guard.result import Status, Verdict

ROOT = Path(__file__).parent.parent
OURS = ['msg_adapters', 'trajectory_guard']
CORE = sorted(
    path
    for package in OURS
    for path in (ROOT / package).rglob('*.py')
    if 'ros' not in path.relative_to(ROOT).parts
)
KERNELS = sorted((ROOT / 'trajectory_guard' / 'kernels').glob('*.py'))
HEADERS = sorted((ROOT / 'trajectory_guard' / 'kernels').glob('*.[hc]pp'))

# The doors take messages and files; what lies behind them takes values.
DOORS = {'__main__.py', 'command_line', 'demo', 'demo.py', 'msg_adapters'}
VALUES = [path for path in CORE if not DOORS & {*path.relative_to(ROOT).parts}]

# Imports every module named, in a Python where nothing of ROS can be imported.
WITHOUT_ROS = """
import importlib, sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        package = name.split('.')[0]
        if package.startswith(('rcl', 'rosidl')) or package.endswith(('_msgs', '_interfaces')):
            raise ImportError(f'{name} is part of ROS')

sys.meta_path.insert(0, NoRos())
for name in sys.argv[1:]:
    importlib.import_module(name)
"""


# Installation


def test_executable_is_where_ros2_run_looks() -> None:
    prefix = get_package_prefix('trajectory_guard')
    executable = Path(prefix, 'lib', 'trajectory_guard', 'guard')
    assert executable.is_file()
    assert os.access(executable, os.X_OK)


def test_executable_starts_the_service_node() -> None:
    (script,) = metadata.distribution('trajectory_guard').entry_points.select(name='guard')
    assert script.group == 'console_scripts'
    assert script.value == 'trajectory_guard.ros.guard:main'
    assert callable(script.load())


def test_share_folder_is_live() -> None:
    share = Path(get_package_share_directory('trajectory_guard'))
    assert (share / 'package.xml').samefile(ROOT / 'package.xml')
    installed = {path.relative_to(share) for path in (share / 'config').rglob('*.*')}
    assert installed == {path.relative_to(ROOT) for path in (ROOT / 'config').rglob('*.*')}
    for path in installed:
        assert (share / path).samefile(ROOT / path)


def test_versions_agree() -> None:
    versions = {
        ElementTree.parse(ROOT / folder / 'package.xml').findtext('version')
        for folder in ['.', 'trajectory_guard_interfaces']
    }
    assert versions == {metadata.version('trajectory_guard')}


# Messages


def test_fields() -> None:
    assert TimeInterval.get_fields_and_field_types() == {
        'status': 'uint8',
        'reason': 'string',
        'start': 'builtin_interfaces/Duration',
        'end': 'builtin_interfaces/Duration',
        'body': 'string',
        'obstacle': 'string',
        'at': 'builtin_interfaces/Duration',
        'location': 'geometry_msgs/Point',
        'gap_lower': 'double',
        'gap_upper': 'double',
    }
    assert CertificationResult.get_fields_and_field_types() == {
        'verdict': 'uint8',
        'reason_code': 'string',
        'message': 'string',
        'intervals': 'sequence<trajectory_guard_interfaces/TimeInterval>',
        'tolerance': 'double',
        'clearance': 'double',
        'interpolation': 'string',
        'robot_hash': 'string',
        'scene_hash': 'string',
        'compute_time': 'double',
        'pieces': 'uint32',
        'pairs_checked': 'uint32',
        'unchecked_pairs': 'sequence<string>',
        'warnings': 'sequence<string>',
        'duration': 'builtin_interfaces/Duration',
    }
    assert CertifyTrajectory.Request.get_fields_and_field_types() == {
        'trajectory': 'trajectory_msgs/JointTrajectory',
        'start_state': 'sensor_msgs/JointState',
        'tolerance': 'double',
        'clearance': 'double',
        'tracking_tolerance': 'sequence<double>',
        'deadline': 'builtin_interfaces/Duration',
        'scope': 'uint8',
        'refine': 'uint8',
        'want_certificate': 'boolean',
    }
    assert CertifyTrajectory.Response.get_fields_and_field_types() == {
        'result': 'trajectory_guard_interfaces/CertificationResult',
        'certificate': 'string',
    }


def test_untouched_messages_certify_nothing() -> None:
    assert TimeInterval().status == TimeInterval.UNKNOWN == 0 != TimeInterval.FREE
    answer = CertifyTrajectory.Response().result
    assert answer.verdict == CertificationResult.REJECTED == 0 != CertificationResult.FREE
    assert answer.intervals == []
    assert GateDecision().decision == GateDecision.HELD == 0 != GateDecision.PASSED
    assert not GateStatus().ready
    assert not GuardStatus().ready


@pytest.mark.parametrize('member', Status)
def test_status_values(member: Status) -> None:
    assert getattr(TimeInterval, member.name) == member


@pytest.mark.parametrize('member', Verdict)
def test_verdict_values(member: Verdict) -> None:
    assert getattr(CertificationResult, member.name) == member


# Layers: kernels < core < shell


def imports(path: Path) -> Iterator[str]:
    """Yield the full names of the modules that a file imports, wherever it does so."""
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path}: relative import'
            yield node.module or ''


@pytest.mark.parametrize('path', CORE, ids=lambda path: str(path.relative_to(ROOT)))
def test_only_the_shell_imports_ros(path: Path) -> None:
    for name in imports(path):
        package = name.split('.')[0]
        assert package != 'rclpy', f'{path} imports {name}'
        # The adapters build messages on request; nothing else of the core knows the classes.
        assert path.parts[-2] == 'msg_adapters' or not package.endswith(('_msgs', '_interfaces'))


@pytest.mark.parametrize('path', KERNELS, ids=lambda path: path.stem)
def test_kernels_import_only_kernels(path: Path) -> None:
    for name in imports(path):
        assert name.split('.')[0] not in OURS or name.startswith('trajectory_guard.kernels')


@pytest.mark.parametrize('path', HEADERS, ids=lambda path: path.name)
def test_kernels_include_only_kernels(path: Path) -> None:
    """In quotes: a header of the folder; in angles: the standard library, without a suffix."""
    text = path.read_text(encoding='utf-8')
    included = re.findall(r'^\s*#\s*include\s*(\S+)', text, re.MULTILINE)
    for name in included:
        if name.startswith('"'):
            assert name.strip('"') in {
                header.name for header in HEADERS if header.suffix == '.hpp'
            }
        else:
            assert re.fullmatch(r'<[a-z_]+>', name), f'{path} includes {name}'
    if path.suffix == '.hpp':
        assert '#pragma once' in text


def test_the_sources_of_the_kernels_are_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are compiled where they run, so a package without them cannot answer."""
    told: dict[str, Any] = {}
    monkeypatch.setattr(setuptools, 'setup', lambda **arguments: told.update(arguments))
    monkeypatch.chdir(ROOT)
    runpy.run_path('setup.py')
    assert 'trajectory_guard.kernels' in told['packages']
    patterns = told['package_data']['trajectory_guard.kernels']
    folder = ROOT / 'trajectory_guard' / 'kernels'
    installed = {path for pattern in patterns for path in folder.glob(pattern)}
    assert installed == set(HEADERS)
    assert {'kernels.cpp', 'separation.hpp'} <= {path.name for path in HEADERS}


@pytest.mark.parametrize('path', VALUES, ids=lambda path: str(path.relative_to(ROOT)))
def test_values_and_functions_import_no_messages(path: Path) -> None:
    for name in imports(path):
        assert not name.startswith('msg_adapters'), f'{path} imports {name}'


def test_core_imports_without_ros() -> None:
    names = [
        '.'.join(path.relative_to(ROOT).with_suffix('').parts).removesuffix('.__init__')
        for path in CORE
        if path.stem != '__main__'
    ]
    assert {'trajectory_guard.certify', 'msg_adapters.result'} <= {*names}
    done = subprocess.run(
        [sys.executable, '-c', WITHOUT_ROS, *names], capture_output=True, text=True, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
