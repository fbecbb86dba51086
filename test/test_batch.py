"""Many trajectories at once: the answers of one at a time, whatever the threads."""

import dataclasses

from bench_data import cases, SETTINGS, workcell
import numpy as np
import pytest

from trajectory_guard import certify as certify_module
from trajectory_guard.batch import judge_all, TOGETHER
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason
from trajectory_guard.paths.trajectory import JointState
from trajectory_guard.result import Verdict


def timeless(result):
    """Return a result without the one thing that differs each time."""
    return dataclasses.replace(result, compute_time=0.0)


@pytest.mark.parametrize('threads', [None, 1, 2, 5])
@pytest.mark.parametrize('certificate', [False, True])
def test_answers_are_those_of_judge_for_any_thread_count(threads, certificate):
    """To the bit, certificates included, in the order asked."""
    cell = workcell('ur5')
    some = [trajectory for trajectory, _, _ in cases('ur5')[:: 3 if certificate else 1]]
    settings = dataclasses.replace(SETTINGS, want_certificate=certificate)
    alone = [judge(cell, trajectory, None, settings) for trajectory in some]
    found = judge_all(cell, some, None, settings, threads)
    assert len(some) > TOGETHER
    assert [timeless(result) for result in found] == [timeless(result) for result in alone]
    assert [r.certificate for r in found] == [r.certificate for r in alone]


def test_one_bad_trajectory_spoils_no_other():
    """A start state that fits no point rejects its own trajectory only."""
    cell = workcell('ur5')
    some = [trajectory for trajectory, _, _ in cases('ur5')[:4]]
    wrong = JointState(some[1].joint_names, some[1].positions[0] + 1.0)
    found = judge_all(cell, some, [None, wrong, None, None], SETTINGS, 2)
    assert found[1].reason_code == Reason.START_STATE_MISMATCH.value
    assert [r.verdict for k, r in enumerate(found) if k != 1] == [Verdict.FREE] * 3


def test_an_unforeseen_error_rejects_what_it_meets(monkeypatch):
    """Neither in the kernels nor after them does an error end free."""
    cell = workcell('ur5')
    some = [trajectory for trajectory, _, _ in cases('ur5')[:3]]
    real = certify_module.intervals

    def broken(knots_ns, *others):
        if knots_ns[-1] == some[1].times_ns[-1]:
            raise ZeroDivisionError('broken on purpose')
        return real(knots_ns, *others)

    monkeypatch.setattr(certify_module, 'intervals', broken)
    found = judge_all(cell, some, None, SETTINGS)
    assert [r.verdict for r in found] == [Verdict.FREE, Verdict.REJECTED, Verdict.FREE]
    assert found[1].reason_code == Reason.INTERNAL_ERROR.value

    def out_of_memory(*_others):
        raise MemoryError

    monkeypatch.setattr(certify_module, 'cover_refined', out_of_memory)
    assert {r.verdict for r in judge_all(cell, some, None, SETTINGS)} == {Verdict.REJECTED}


def test_nothing_asked_is_nothing_answered():
    assert judge_all(workcell('ur5'), [], None, SETTINGS) == []


def test_a_deadline_is_one_for_each():
    """With a deadline of zero every answer is suspect, none is lost."""
    settings = dataclasses.replace(SETTINGS, deadline_ns=0)
    some = [trajectory for trajectory, _, _ in cases('ur5')[:20]]
    found = judge_all(workcell('ur5'), some, None, settings, 2)
    assert [r.reason_code for r in found] == [Reason.DEADLINE.value] * 20
    assert np.isfinite([r.compute_time for r in found]).all()
