"""The bringup script: what it promises about a set-up that fails, stops half-way or goes stale."""

import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time

import pytest

ROOT = Path(__file__).parent.parent
INPUTS = [
    'bringup',
    'package.xml',
    'requirements',
    'resource',
    'setup.cfg',
    'setup.py',
    'trajectory_guard_interfaces',
]
REAL = 'source ./bringup\n'
BASE_PYTHON = Path(sys.base_prefix, 'bin', 'python3')
SOURCED = {'AMENT_PREFIX_PATH', 'CMAKE_PREFIX_PATH', 'LD_LIBRARY_PATH', 'PYTHONPATH'}

# The script with every step of the set-up replaced by something quick that leaves a trace.
QUICK_STEPS = f"""
source ./bringup
choose_python() {{ python={BASE_PYTHON}; }}
make_venv() {{ echo venv; mkdir -p "$venv/bin"; ln -s "$python" "$venv/bin/python"; }}
install_packages() {{ echo packages; echo "$ros" >>"$venv/installed"; }}
mend_cmake_files() {{ echo mended; }}
build() {{ echo built; echo "$ros" >>"$venv/built"; }}
"""


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """Return a checkout that holds what the set-up reads, and no environment."""
    folder = tmp_path / 'checkout'
    folder.mkdir()
    for name in INPUTS:
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copy2)(ROOT / name, folder / name)
    (folder / 'config').mkdir()
    (folder / 'config' / 'guard.yaml').write_text('tolerance: 1\n')
    return folder


def environment(**changes: str) -> dict[str, str]:
    """Return an environment in which no ROS is sourced, but for the changes."""
    clean = {k: v for k, v in os.environ.items() if 'ROS' not in k and k not in SOURCED}
    return {**clean, **changes}


def shell(
    checkout: Path, script: str, start: str = QUICK_STEPS, **changes: str
) -> subprocess.CompletedProcess[str]:
    """Run lines of bash in the checkout, after those that start the script."""
    return subprocess.run(
        ['bash', '-c', start + script],
        cwd=checkout,
        env=environment(**changes),
        capture_output=True,
        text=True,
    )


def is_ready(checkout: Path) -> bool:
    """Return whether the checkout's set-up would be trusted."""
    return shell(checkout, 'ready').returncode == 0


def prepared(checkout: Path, before: str = '') -> str:
    """Prepare the checkout, after the lines of bash given; return what was said."""
    done = shell(checkout, before + '\nprepare')
    assert done.returncode == 0, done.stderr
    assert done.stdout == ''
    return done.stderr


# The script as a command, in this very checkout.


@pytest.mark.parametrize('arguments', [[], ['nonsense'], ['run'], ['Test'], ['--version']])
def test_usage_error(arguments: list[str]) -> None:
    done = subprocess.run([ROOT / 'bringup', *arguments], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stdout == ''
    assert done.stderr.startswith('usage: ./bringup')


def test_help_is_no_error() -> None:
    done = subprocess.run([ROOT / 'bringup', '--help'], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, '')
    assert 'run CMD' in done.stdout


def test_second_time_is_quick_and_silent(tmp_path: Path) -> None:
    command = [ROOT / 'bringup', 'run', 'pwd']
    subprocess.run(command, check=True, capture_output=True)
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert time.perf_counter() - start < 3.0
    assert done.returncode == 0
    assert done.stdout.strip() == str(tmp_path.resolve())
    assert done.stderr == ''


def test_run_keeps_arguments_and_exit_code(tmp_path: Path) -> None:
    script = 'import sys, rclpy, trajectory_guard; print(sys.argv[1:]); sys.exit(7)'
    command = [ROOT / 'bringup', 'run', 'python', '-c', script, 'a b', '*', '']
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (7, "['a b', '*', '']\n")


def test_works_through_a_link(tmp_path: Path) -> None:
    (tmp_path / 'link').symlink_to(ROOT / 'bringup')
    done = subprocess.run([tmp_path / 'link', 'run', 'true'], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, '')


# The set-up, with quick steps in a checkout of its own.


def test_set_up_runs_once(checkout: Path) -> None:
    assert not is_ready(checkout)
    said = prepared(checkout)
    assert 'installing packages' in said
    assert said.splitlines()[-1] == 'bringup: ready'
    assert is_ready(checkout)
    assert prepared(checkout) == ''
    assert (checkout / '.venv' / 'installed').read_text() == 'wheels\n'
    assert (checkout / '.venv' / 'built').read_text() == 'wheels\n'


@pytest.mark.parametrize('step', ['make_venv', 'install_packages', 'mend_cmake_files', 'build'])
def test_killed_set_up_is_not_trusted(checkout: Path, step: str) -> None:
    half = checkout / '.venv' / 'half-made'
    killed = shell(checkout, f'{step}() {{ touch {half}; kill -KILL $$; }}\nprepare')
    assert killed.returncode == -signal.SIGKILL
    assert half.exists()
    assert not is_ready(checkout)
    prepared(checkout)
    assert is_ready(checkout)
    # Packages that were installed completely are kept; a half-made environment is not.
    assert half.exists() == (step == 'build')


@pytest.mark.parametrize('step', ['make_venv', 'install_packages', 'mend_cmake_files', 'build'])
def test_failing_step_is_reported(checkout: Path, step: str) -> None:
    failed = shell(checkout, f'{step}() {{ echo the reason; return 1; }}\nprepare\necho went on')
    log = checkout / '.venv' / 'bringup.log'
    assert failed.returncode == 3
    assert failed.stdout == ''
    assert 'the reason' in failed.stderr
    assert str(log) in failed.stderr.splitlines()[-1]
    assert 'the reason' in log.read_text()
    assert not is_ready(checkout)


@pytest.mark.parametrize(
    'change',
    [
        'echo >>requirements/runtime.txt',
        'echo >>requirements/ros-jazzy.txt',
        'echo >>setup.py',
        'echo >>bringup',
        'echo >>trajectory_guard_interfaces/msg/TimeInterval.msg',
        'mv trajectory_guard_interfaces/msg/TimeInterval.msg trajectory_guard_interfaces/srv/',
        'touch config/another.yaml',
        'rm .venv/bin/python',
        'ln -sf /nowhere/python3 .venv/bin/python',
        ': >.venv/environment',
        'truncate -s 20 .venv/environment',
    ],
)
def test_stale_or_damaged_set_up_is_not_trusted(checkout: Path, change: str) -> None:
    prepared(checkout)
    subprocess.run(['bash', '-c', change], cwd=checkout, check=True)
    assert not is_ready(checkout)
    prepared(checkout)
    assert is_ready(checkout)


def test_live_edits_need_no_set_up(checkout: Path) -> None:
    prepared(checkout)
    (checkout / 'config' / 'guard.yaml').write_text('tolerance: 2\n')
    assert is_ready(checkout)


def test_moved_checkout_is_set_up_anew(checkout: Path) -> None:
    prepared(checkout)
    moved = checkout.rename(checkout.parent / 'moved')
    assert not is_ready(moved)
    assert 'installing packages' in prepared(moved)


def test_two_at_once_set_up_once(checkout: Path) -> None:
    wait = 'install_packages() { touch started; while [[ ! -e go ]]; do sleep 0.01; done; echo; }'
    script = ['bash', '-c', f'{QUICK_STEPS}\n{wait}\nprepare']
    started = {'cwd': checkout, 'env': environment(), 'stderr': subprocess.PIPE, 'text': True}
    with subprocess.Popen(script, **started) as first:
        while not (checkout / 'started').exists():
            assert first.poll() is None
            time.sleep(0.01)
        with subprocess.Popen(script, **started) as second:
            assert 'waiting for another set-up' in second.stderr.readline()
            (checkout / 'go').touch()
            assert second.stderr.read() == ''
        assert (first.wait(), second.wait()) == (0, 0)
    assert (checkout / '.venv' / 'built').read_text() == 'wheels\n'


def test_path_with_space_is_refused(checkout: Path) -> None:
    moved = checkout.rename(checkout.parent / 'with space')
    refused = shell(moved, 'prepare')
    assert refused.returncode == 3
    assert f'without spaces and colons: {moved}' in refused.stderr


# Which Python, which ROS.


def executable(path: Path, text: str) -> None:
    """Write a shell script that can be run."""
    path.parent.mkdir(exist_ok=True)
    path.write_text(f'#!/bin/sh\n{text}\n')
    path.chmod(0o755)


def test_python_that_does_not_run_is_passed_over(checkout: Path) -> None:
    executable(checkout / 'shims' / 'python3.12', 'echo command not found >&2; exit 127')
    path = f'{checkout}/shims:{os.environ["PATH"]}'
    done = shell(checkout, 'choose_python; echo "$python"', REAL, PATH=path)
    assert (done.stdout, done.stderr) == ('python3\n', '')


def test_no_python_says_what_to_install(checkout: Path) -> None:
    names = ['python3', 'python3.10', 'python3.11', 'python3.12', 'python3.13']
    for name in names:
        executable(checkout / 'shims' / name, 'exit 1')
    path = f'{checkout}/shims:{os.environ["PATH"]}'
    done = shell(checkout, 'prepare', REAL, PATH=path)
    assert done.returncode == 3
    assert 'python3-venv python3-dev' in done.stderr
    assert not (checkout / '.venv').exists()


def test_sourced_jazzy_is_used(checkout: Path) -> None:
    (checkout / 'ros').mkdir()
    (checkout / 'ros' / 'rclpy.py').touch()
    sourced = {'ROS_DISTRO': 'jazzy', 'PYTHONPATH': f'{checkout}/ros', 'AMENT_PREFIX_PATH': '/ros'}
    script = (
        'find_python python3; prepare; enter; echo "$ros $venv $AMENT_PREFIX_PATH $PYTHONPATH"'
    )
    done = shell(checkout, script, **sourced)
    venv = checkout / '.venv-jazzy'
    packages = f'{venv}/lib/python3.*/site-packages'
    assert done.stdout == f'sourced {venv} {venv}:/ros {checkout}:{packages}:{checkout}/ros\n'
    assert (venv / 'built').read_text() == 'sourced\n'
    assert not (checkout / '.venv').exists()


def test_sourced_jazzy_without_its_python_falls_back(checkout: Path) -> None:
    executable(
        checkout / 'shims' / 'python3',
        f'case $* in *"import rclpy"*) exit 1;; esac; exec {BASE_PYTHON} "$@"',
    )
    path = f'{checkout}/shims:{os.environ["PATH"]}'
    script = 'choose_python; echo "$ros $venv"'
    done = shell(checkout, script, REAL, ROS_DISTRO='jazzy', PATH=path)
    assert done.stdout == f'wheels {checkout}/.venv\n'
    assert 'using the wheels instead' in done.stderr


def test_other_ros_does_not_mix_with_the_wheels(checkout: Path) -> None:
    other = {'ROS_DISTRO': 'humble', 'PYTHONPATH': '/other', 'AMENT_PREFIX_PATH': '/other'}
    script = 'enter; echo "${ROS_DISTRO-} ${PYTHONPATH-} $AMENT_PREFIX_PATH"'
    assert shell(checkout, script, **other).stdout == f'  {checkout}/.venv\n'


def test_entering_twice_changes_nothing(checkout: Path) -> None:
    done = shell(checkout, 'enter; env >one; enter; env >two; diff <(sort one) <(sort two)')
    assert (done.returncode, done.stdout) == (0, '')


def test_include_paths_of_the_wheels_are_mended(checkout: Path) -> None:
    prepared(checkout)
    cmake = checkout / '.venv' / 'share' / 'a_msgs' / 'cmake' / 'a_msgsExport.cmake'
    cmake.parent.mkdir(parents=True)
    built = '/opt/python/cp311-cp311'
    cmake.write_text(
        f'DIRS "{built}/include/python3.11;${{_PREFIX}}/include;'
        f'{built}/lib/python3.11/site-packages/numpy/_core/include")\n'
    )
    (checkout / 'numpy.py').write_text("def get_include(): return '/numpy/include'\n")
    (checkout / '.venv' / 'pyvenv.cfg').write_text(f'home = {BASE_PYTHON.parent}')
    assert shell(checkout, 'mend_cmake_files', REAL).returncode == 0
    mended = cmake.read_text()
    assert '/opt/python' not in mended
    assert ';${_PREFIX}/include;/numpy/include")' in mended
