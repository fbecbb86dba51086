"""The same question has the same answer to the bit: again, in threads, on a lesser processor."""

from concurrent.futures import ThreadPoolExecutor
import ctypes
import dataclasses
import shutil
import subprocess

from bench_data import cases, ROBOTS, SETTINGS, workcell
import numpy as np
import pytest

from trajectory_guard.certify import judge
from trajectory_guard.kernels import compiled
from trajectory_guard.kernels import cover as cover_module
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.request import motion_path
from trajectory_guard.settings import Scope

TRACKING = 0.002
# Without unique symbols the two libraries share nothing, not even a table.
ALWAYS = ('-std=c++17', '-ffp-contract=off', '-fno-gnu-unique', '-fPIC', '-shared')


def covered(robot, scope=Scope.ALL, stride=1):
    """Return the bytes of leaves, entries and pieces for trajectories of the bench."""
    cell = workcell(robot)
    answers = []
    for trajectory, _, _ in cases(robot)[::stride]:
        path = joint_path(cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
        pairs = cell.pairs(path.in_path)
        found = cover_module.cover(
            cell.packed,
            motion_path(cell, path, np.full(len(path.joint_names), TRACKING)),
            pairs.moving,
            SETTINGS.tolerance,
            SETTINGS.clearance,
            SETTINGS.max_pieces,
            scope,
            True,
            np.zeros(1, np.int64),
        )
        answers.append(
            (found.leaves.tobytes(), found.entries.tobytes(), found.proved_on.tobytes())
        )
    return answers


@pytest.mark.parametrize('scope', Scope)
@pytest.mark.parametrize('robot', ROBOTS)
def test_again_is_the_same(robot, scope):
    """What a thread keeps from one request to the next is never seen in an answer."""
    first = covered(robot, scope, stride=3)
    covered('ur5' if robot == 'panda' else 'panda', scope, stride=20)
    assert covered(robot, scope, stride=3) == first


def test_threads_do_not_see_each_other():
    """Many threads on both robots and all scopes at once, each as if it were alone."""
    questions = [(robot, scope) for robot in ROBOTS for scope in Scope]
    alone = {question: covered(*question, stride=8) for question in questions}
    with ThreadPoolExecutor(8) as threads:
        jobs = [(q, threads.submit(covered, *q, stride=8)) for q in questions * 4]
        for question, job in jobs:
            assert job.result() == alone[question]


@pytest.mark.parametrize('scope', Scope)
@pytest.mark.parametrize('robot', ROBOTS)
def test_many_at_once_are_as_each_alone(robot, scope):
    """A call with many questions answers each as if it had been asked alone."""
    cell = workcell(robot)
    questions = []
    for trajectory, _, _ in cases(robot)[::2]:
        path = joint_path(cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
        slack = np.full(len(path.joint_names), TRACKING)
        pairs = cell.pairs(path.in_path)
        questions.append(cover_module.Question(motion_path(cell, path, slack), pairs.moving))
    limits = (SETTINGS.tolerance, SETTINGS.clearance, 300, scope, True, np.zeros(1, np.int64))
    together = cover_module.cover_all(cell.packed, questions, *limits)
    for question, ours in zip(questions, together, strict=True):
        alone = cover_module.cover(cell.packed, *question, *limits)
        for field in ('leaves', 'entries', 'proved_on'):
            np.testing.assert_array_equal(getattr(ours, field), getattr(alone, field))
        assert ours.pieces == alone.pieces


@pytest.mark.parametrize('scope', Scope)
@pytest.mark.parametrize('robot', ROBOTS)
def test_what_is_not_written_down_changes_nothing(robot, scope):
    """Without a certificate only the leaves that tell of a run are kept: the same intervals."""
    cell = workcell(robot)
    for budget in (5, SETTINGS.max_pieces):
        for trajectory, _, _ in cases(robot):
            settings = dataclasses.replace(
                SETTINGS,
                scope=scope,
                tracking_tolerance=(TRACKING,),
                max_pieces=budget,
                refine=False,
            )
            short = judge(cell, trajectory, None, settings)
            whole = judge(
                cell, trajectory, None, dataclasses.replace(settings, want_certificate=True)
            )
            assert whole.certificate is not None
            assert short.intervals == whole.intervals
            assert (short.verdict, short.reason_code) == (whole.verdict, whole.reason_code)


@pytest.mark.parametrize('optimised', ['-O1', '-O3'])
def test_a_plain_processor_gives_the_same_bits(tmp_path, monkeypatch, optimised):
    """Without the native instructions, and at another level, every leaf and entry is equal."""
    compiler = next(filter(None, map(shutil.which, compiled.COMPILERS)))
    library = tmp_path / 'plain.so'
    command = [compiler, *ALWAYS, optimised, f'-I{compiled.SOURCES}', '-o', str(library)]
    subprocess.run([*command, str(compiled.UNIT)], check=True, capture_output=True)
    native = {robot: covered(robot) for robot in ROBOTS}
    plain = ctypes.CDLL(str(library))
    monkeypatch.setattr(cover_module, 'library', lambda: plain)
    for robot in ROBOTS:
        for ours, theirs in zip(native[robot], covered(robot), strict=True):
            assert ours == theirs


def test_the_flags_keep_arithmetic_strict():
    """No contraction and nothing of fast math, whatever else is tuned."""
    assert '-ffp-contract=off' in compiled.FLAGS
    allowed = {'-fno-math-errno', '-fno-trapping-math', '-fPIC', '-ffp-contract=off'}
    assert {flag for flag in compiled.FLAGS if flag.startswith('-f')} <= allowed
    assert not {'-Ofast', '-ffast-math'} & set(compiled.FLAGS)
