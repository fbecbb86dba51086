"""The demo: its motions against an independent check, and the whole of it as a user runs it."""

import contextlib
from dataclasses import replace
from itertools import pairwise
import os
from pathlib import Path
import shlex
import subprocess
import sys
import time

import numpy as np
import pytest
from scipy.interpolate import BPoly
from typer.testing import CliRunner

from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.command_line.app import app
from trajectory_guard.demo.case import CASES, FINGERS, SCENE
from trajectory_guard.demo.error import DemoError
from trajectory_guard.demo.files import CHECKOUT, config_file, panda_urdf
from trajectory_guard.demo.next_steps import next_steps
from trajectory_guard.demo.poses import PoseChecker, positions, sample_times, waypoint_times
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.trajectory import JointState
from trajectory_guard.result import NANOSECONDS, Result, Status, Verdict
from trajectory_guard.settings import Settings

STEP = 0.05
DENSE = 400

# Includes the compilation of the kernels where nothing has done so before [s].
TIMEOUT = 700.0

each_case = pytest.mark.parametrize('case', CASES, ids=lambda case: case.file)


@pytest.fixture(scope='module')
def checker():
    return PoseChecker(panda_urdf(), config_file(SCENE))


@pytest.fixture(scope='module')
def workcell():
    return Workcell(load_robot(panda_urdf()), load_scene(config_file(SCENE)))


@pytest.fixture(scope='module')
def dense(checker):
    """Return for each case what a check of many poses says."""
    found = {}
    for case in CASES:
        trajectory = case.trajectory()
        times = np.linspace(0.0, waypoint_times(trajectory)[-1], DENSE)
        found[case.file] = checker.check(trajectory, FINGERS, times)
    return found


def answer(workcell, case, clearance=None):
    start = case.start()
    settings = Settings(clearance=case.clearance if clearance is None else clearance)
    state = JointState(tuple(start), list(start.values()))
    return judge(workcell, case.trajectory(), state, settings)


# Motions


@each_case
def test_motion_is_what_the_controller_plays(case):
    trajectory = case.trajectory()
    assert trajectory.has_velocities.all()
    assert not trajectory.has_accelerations.any()
    knots = waypoint_times(trajectory)
    derivatives = np.stack([trajectory.positions, trajectory.velocities], axis=1)
    times = np.linspace(0.0, knots[-1], 301)
    spline = BPoly.from_derivatives(knots, derivatives)
    np.testing.assert_allclose(positions(trajectory, times), spline(times), atol=1e-12)


@each_case
def test_motion_comes_as_near_as_promised(case, dense):
    low, high = case.closest
    assert low <= dense[case.file].distances.min() <= high
    assert dense[case.file].hits.any() == (case.verdict is Verdict.COLLISION)


@each_case
def test_waypoints_and_samples_look_free(case, checker):
    trajectory = case.trajectory()
    for times in (waypoint_times(trajectory), sample_times(trajectory, STEP)):
        sampled = checker.check(trajectory, FINGERS, times)
        assert not sampled.hits.any()
        assert sampled.distances.min() > max(case.clearance, 0.001)


def test_collision_lies_between_two_samples(checker, dense):
    (case,) = (case for case in CASES if case.verdict is Verdict.COLLISION)
    check = dense[case.file]
    hits = check.times[check.hits]
    # In one go, and long enough not to be a matter of rounding.
    assert check.hits[(check.times >= hits[0]) & (check.times <= hits[-1])].all()
    assert hits[-1] - hits[0] > 0.04
    samples = sample_times(case.trajectory(), STEP)
    assert np.searchsorted(samples, hits[0]) == np.searchsorted(samples, hits[-1])
    # Half the step finds it.
    finer = checker.check(case.trajectory(), FINGERS, sample_times(case.trajectory(), STEP / 2))
    assert finer.hits.any()


@each_case
def test_guard_agrees_with_the_dense_check(case, workcell, dense):
    result = answer(workcell, case)
    assert result.verdict is case.verdict
    check = dense[case.file]
    for row in result.intervals:
        inside = (check.times * NANOSECONDS > row.start_ns) & (
            check.times * NANOSECONDS < row.end_ns
        )
        if row.status is Status.FREE:
            assert (check.distances[inside] > case.clearance).all()
        if row.status is Status.COLLISION:
            assert check.hits[inside].all()


def test_too_much_clearance_finds_the_place(workcell, dense):
    (case,) = (case for case in CASES if case.too_much is not None)
    result = answer(workcell, case, case.too_much)
    assert result.verdict is Verdict.SUSPECT
    rows = [row for row in result.intervals if row.status is Status.SUSPECT]
    assert {row.obstacle for row in rows} == {case.obstacle}
    nearest = dense[case.file].distances.min()
    assert min(row.gap_lower for row in rows) <= nearest
    # The dense check may have missed the very nearest instant.
    assert nearest <= min(row.gap_upper for row in rows) + 1e-4


# Sampling


@each_case
@pytest.mark.parametrize('step', [0.05, 0.013])
def test_samples_keep_their_step(case, step):
    trajectory = case.trajectory()
    times = sample_times(trajectory, step)
    assert (np.diff(times) > 0.0).all()
    assert np.isin(waypoint_times(trajectory), times).all()
    for start, end in pairwise(times):
        q = positions(trajectory, np.linspace(start, end, 50))
        assert np.abs(q - q[0]).max() <= step * (1.0 + 1e-9)
    # No more samples than it needs: each step but the last to a waypoint is used up.
    moved = np.abs(np.diff(positions(trajectory, times), axis=0)).max(axis=1)
    assert (moved < 0.97 * step).sum() <= len(trajectory.times_ns) - 1


# Promises


def test_broken_promises_are_named(workcell, checker):
    near, collision = CASES[1], CASES[2]
    free, hit = answer(workcell, near), answer(workcell, collision)
    wider = answer(workcell, near, near.too_much)
    assert near.problems([free, free], wider, {}) == []
    assert collision.problems([hit], None, {}) == []
    rejected = Result.rejected(TrajectoryError(Reason.NO_POINTS, 'it has no points'))
    for broken in (
        near.problems([free, replace(free, intervals=())], wider, {}),
        near.problems([free], free, {}),
        near.problems([rejected], wider, {}),
        near.problems([replace(free, intervals=free.intervals[:-1])], wider, {}),
        near.problems([free], hit, {}),
        collision.problems([free], None, {}),
        collision._replace(obstacle='crate').problems([hit], None, {}),
    ):
        assert broken
    assert 'it has no points' in near.problems([rejected], wider, {})[0]
    touching = checker.check(collision.trajectory(), FINGERS, np.array([1.2]))
    assert near.problems([free], wider, {'waypoints': touching})


# The whole


def run_demo(**environment):
    """Return exit code, output and errors of the demo; whatever it did, its guard is gone."""
    with subprocess.Popen(
        [sys.executable, '-m', 'trajectory_guard.demo'],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=CHECKOUT,
        env={**os.environ, **environment},
    ) as process:
        try:
            output, errors = process.communicate(timeout=TIMEOUT)
        finally:
            process.kill()
    assert not guards_of(process.pid)
    return process.returncode, output, errors


def guards_of(demo):
    """Return the running guards of a demo, by its process id."""
    namespace = f'__ns:=/demo_{demo}'.encode()
    found = []
    for command in Path('/proc').glob('[0-9]*/cmdline'):
        # Processes come and go.
        with contextlib.suppress(OSError):
            if namespace in command.read_bytes().split(b'\0'):
                found.append(command)
    return found


def test_demo():
    code, output, errors = run_demo()
    assert code == 0, output + errors
    answers, _, commands = output.partition('To try next:')
    assert max(map(len, answers.splitlines())) <= 100
    for case in CASES:
        assert case.title in answers
        assert f'{case.file}: {case.verdict.name}\n' in answers
    for checked_by in ('the guard  ', 'through ROS', 'waypoints  ', 'every 0.05 rad'):
        rows = [row for row in answers.splitlines() if row.strip().startswith(f'{checked_by} ')]
        assert len(rows) == len(CASES)
    assert 'not as promised' not in output
    assert commands.strip()


def test_interrupted_demo_leaves_no_guard():
    with subprocess.Popen(
        [sys.executable, '-m', 'trajectory_guard.demo'],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        cwd=CHECKOUT,
    ) as process:
        try:
            wait_until(lambda: guards_of(process.pid))
        finally:
            process.kill()
    wait_until(lambda: not guards_of(process.pid))


def wait_until(condition):
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_without_the_package_it_says_how_to_get_it(tmp_path):
    code, _, errors = run_demo(AMENT_PREFIX_PATH=str(tmp_path))
    assert code == 3
    assert 'trajectory_guard is not installed here; ./bringup demo does that' in errors
    assert 'Traceback' not in errors


def test_a_guard_that_stops_is_quoted(tmp_path):
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages'
    index.mkdir(parents=True)
    (index / 'trajectory_guard').touch()
    guard = tmp_path / 'lib' / 'trajectory_guard' / 'guard'
    guard.parent.mkdir(parents=True)
    guard.write_text('#!/bin/sh\necho no robot today\nexit 7\n', encoding='utf-8')
    guard.chmod(0o755)
    code, _, errors = run_demo(
        AMENT_PREFIX_PATH=os.pathsep.join([str(tmp_path), os.environ['AMENT_PREFIX_PATH']])
    )
    assert code == 3
    assert 'the guard stopped with exit code 7\n  no robot today' in errors
    assert 'Traceback' not in errors


def test_next_steps_work_here(monkeypatch):
    monkeypatch.chdir(CHECKOUT)
    robot, more, errors, *_ = next_steps(panda_urdf())
    for step, code, words in ((more, 1, 'SUSPECT'), (errors, 0, '"verdict": "free"')):
        # A shell takes the words apart; the command runs here, where the kernels are loaded.
        script = '\n'.join((*robot.command, *step.command))
        script = script.replace('./bringup run python -m trajectory_guard', "printf '%s\\n'")
        arguments = subprocess.check_output(['bash', '-c', script], text=True).splitlines()
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == code, result.output
        assert words in result.output


@pytest.mark.parametrize('folder', [Path('/'), CHECKOUT / 'test'])
def test_next_steps_name_files_that_exist(folder, monkeypatch):
    monkeypatch.chdir(folder)
    words = shlex.split(
        '\n'.join(line for step in next_steps(panda_urdf()) for line in step.command)
    )
    paths = [
        word.partition('=')[2] or word for word in words if 'demo_' in word or '.urdf' in word
    ]
    assert len(paths) >= 6
    for path in paths:
        assert Path(path.strip('[]').removeprefix('=[')).is_file(), path


def test_missing_file_is_an_error():
    with pytest.raises(DemoError, match=r'no_such_file\.yaml'):
        config_file('no_such_file.yaml')
