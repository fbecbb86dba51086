"""Narrower questions: the same truth, and what was not looked at is suspect."""

import dataclasses
from itertools import pairwise

from bench_data import cases, ROBOTS, SETTINGS, workcell
import pytest
from test_certify import slide, slider

from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason
from trajectory_guard.result import Status, Verdict
from trajectory_guard.settings import Scope, Settings

UNSEEN = (Status.SUSPECT, Reason.NOT_EXAMINED.value)


def asked(cell, trajectory, scope, **changes):
    """Return the answer to a question of a scope."""
    settings = dataclasses.replace(SETTINGS, scope=scope, **changes)
    result = judge(cell, trajectory, None, settings)
    assert result.verdict != Verdict.REJECTED, result.message
    assert result.intervals[0].start_ns == 0
    assert result.intervals[-1].end_ns == result.duration_ns
    for a, b in pairwise(result.intervals):
        assert a.end_ns == b.start_ns
    return result


def first_not_free(result):
    """Return the first interval that is not free, or None."""
    return next((row for row in result.intervals if row.status != Status.FREE), None)


def bad(verdict):
    """Say whether a verdict forbids the motion."""
    return verdict in (Verdict.SUSPECT, Verdict.COLLISION)


def inside(row, rows):
    """Say whether an interval lies within one of others."""
    return any(a.start_ns <= row.start_ns and row.end_ns <= a.end_ns for a in rows)


@pytest.mark.parametrize('tracking', [0.0, 0.005])
@pytest.mark.parametrize('robot', ROBOTS)
def test_first_is_the_beginning_of_all(robot, tracking):
    """Up to the first interval that is not free the answers agree; the rest was not examined."""
    cell = workcell(robot)
    stopped = 0
    for trajectory, _, _ in cases(robot):
        whole = asked(cell, trajectory, Scope.ALL, tracking_tolerance=(tracking,))
        first = asked(cell, trajectory, Scope.FIRST, tracking_tolerance=(tracking,))
        assert first.pieces <= whole.pieces
        assert bad(first.verdict) is bad(whole.verdict)
        row, same = first_not_free(first), first_not_free(whole)
        if row is None:
            assert first.intervals == whole.intervals
            continue
        assert row.start_ns == same.start_ns
        assert (row.status, row.reason) == (same.status, same.reason)
        assert row.end_ns <= same.end_ns
        # Nothing is free behind what stopped the search; its own collision may be cut out of it.
        after = first.intervals[first.intervals.index(row) + 1 :]
        assert not any(r.status == Status.FREE for r in after)
        if first.pieces < whole.pieces:
            assert (after[-1].status, after[-1].reason) == UNSEEN
            assert sum((r.status, r.reason) == UNSEEN for r in after) == 1
            stopped += 1
    assert stopped > 10


@pytest.mark.parametrize('tracking', [0.0, 0.005])
@pytest.mark.parametrize('robot', ROBOTS)
def test_verdict_agrees_with_all(robot, tracking):
    """Free is free in both; what is free or collides in the narrow answer is so in the whole."""
    cell = workcell(robot)
    found = 0
    for trajectory, _, _ in cases(robot):
        whole = asked(cell, trajectory, Scope.ALL, tracking_tolerance=(tracking,))
        quick = asked(cell, trajectory, Scope.VERDICT, tracking_tolerance=(tracking,))
        assert (quick.verdict == Verdict.FREE) is (whole.verdict == Verdict.FREE)
        if quick.verdict == Verdict.FREE:
            assert quick.intervals == whole.intervals
            continue
        found += 1
        free = [row for row in whole.intervals if row.status == Status.FREE]
        named = 0
        for row in quick.intervals:
            if row.status == Status.FREE:
                # A pair proved on a piece may be suspect on its halves: proofs differ, not truth.
                assert not any(
                    other.status == Status.COLLISION
                    and row.start_ns < other.end_ns
                    and other.start_ns < row.end_ns
                    for other in whole.intervals
                )
            elif (row.status, row.reason) != UNSEEN:
                assert not inside(row, free)
                assert row.body and row.obstacle
                named += 1
        assert named >= 1
        # With a tube the whole answer may settle a graze before it meets its collision.
        if quick.verdict == Verdict.COLLISION and tracking == 0.0:
            assert whole.verdict == Verdict.COLLISION
    assert found > 10


@pytest.mark.parametrize('scope', Scope)
@pytest.mark.parametrize('budget', [0, 1, 2, 3, 5, 9, 20])
@pytest.mark.parametrize('robot', ROBOTS)
def test_a_spent_budget_keeps_what_was_proved(robot, scope, budget):
    """Few pieces: never more than was allowed, never free what the whole answer does not allow."""
    cell = workcell(robot)
    for trajectory, _, _ in cases(robot)[::6]:
        whole = asked(cell, trajectory, scope)
        part = asked(cell, trajectory, scope, max_pieces=budget)
        assert part.pieces <= budget
        if whole.pieces <= budget:
            assert part.intervals == whole.intervals
            continue
        assert part.verdict != Verdict.FREE
        for row in part.intervals:
            if row.status == Status.FREE:
                assert inside(row, [r for r in whole.intervals if r.status == Status.FREE])
        reasons = {row.reason for row in part.intervals if row.status == Status.SUSPECT}
        # A closer look that is cut short leaves what was suspect for another reason.
        rough = asked(cell, trajectory, scope, refine=False)
        complete = rough.pieces <= budget
        assert Reason.BUDGET.value in reasons or scope != Scope.ALL or complete


@pytest.mark.parametrize('scope', Scope)
def test_three_pieces_prove_the_beginning(scope):
    """In time order the free beginning stays; breadth first whatever was reached stays."""
    trajectory = slide(0.0, 1.0, 0.0, 1.0, 5.0, 0.0)
    part = judge(slider(), trajectory, None, Settings(tolerance=1e-6, max_pieces=3, scope=scope))
    assert part.pieces == 3
    assert [(r.status, r.reason) for r in part.intervals] == [
        (Status.FREE, ''),
        (Status.SUSPECT, Reason.BUDGET.value),
    ]
    assert part.intervals[0].end_ns == 3 * 10**9


@pytest.mark.parametrize('scope', Scope)
def test_a_passed_deadline_proves_nothing(scope):
    """Whatever is asked, no time means no answer."""
    result = judge(slider(), slide(0.0, 1.0), None, Settings(deadline_ns=0, scope=scope))
    assert result.verdict == Verdict.SUSPECT
    assert [(r.status, r.reason) for r in result.intervals] == [
        (Status.SUSPECT, Reason.DEADLINE.value)
    ]
