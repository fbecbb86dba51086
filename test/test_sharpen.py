"""A closer look at suspect intervals: contacts begin and end when they do, and it is proved."""

import dataclasses
from fractions import Fraction
from itertools import pairwise

from bench_data import cases, ROBOTS, SETTINGS, workcell
from exact_contact import exact, images, pose, surfaces_meet
import numpy as np
import pytest
from random_robot import link_poses
from rational_curves import random_rigid_motion
from scipy.spatial import ConvexHull
from test_certify import assert_partition, slide, slider
from test_free_certify import cell as free_cell
from test_free_certify import path as free_path

from trajectory_guard.certify import certify, judge
from trajectory_guard.errors import Reason
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.result import Status, Verdict
from trajectory_guard.settings import Scope, Settings
from trajectory_guard.shapes.primitive import Box

SECOND = 10**9


def colliding(robot):
    """Return the trajectories of a robot of the bench that touch something."""
    return [trajectory for trajectory, truth, _ in cases(robot) if truth['colliding']]


def without(settings):
    return dataclasses.replace(settings, refine=False)


def slivers(result):
    """Return the suspect intervals of a result."""
    return [row for row in result.intervals if row.status is Status.SUSPECT]


def width(row):
    return row.end_ns - row.start_ns


def spans(result, status):
    """Return the ends of the intervals of a status [ns]."""
    return [(row.start_ns, row.end_ns) for row in result.intervals if row.status is status]


def covers(whole, part):
    """Say whether spans lie within others, or within some that meet."""
    joined = []
    for a, b in whole:
        if joined and joined[-1][1] == a:
            a = joined.pop()[0]
        joined.append((a, b))
    return all(any(a <= c and d <= b for a, b in joined) for c, d in part)


@pytest.mark.parametrize('robot', ROBOTS)
def test_contacts_of_real_robots_are_pinned(robot):
    """All that was free or colliding stays so, and what is left open is short."""
    cell = workcell(robot)
    widths, before, pieces = [], [], np.zeros(2)
    for trajectory in colliding(robot):
        rough = judge(cell, trajectory, None, without(SETTINGS))
        fine = judge(cell, trajectory, None, SETTINGS)
        assert_partition(fine)
        pieces += [rough.pieces, fine.pieces]
        for status in (Status.FREE, Status.COLLISION):
            assert covers(spans(fine, status), spans(rough, status))
        widths += map(width, slivers(fine))
        before += map(width, slivers(rough))
    assert pieces[1] < 2.0 * pieces[0]
    assert np.median(before) > 50_000 and len(widths) > 100
    assert np.median(widths) <= 50
    assert np.quantile(widths, 0.95) <= 1_000
    assert max(widths) <= 10_000


def test_contacts_of_a_real_robot_are_those_of_another_chain():
    """At ends of free intervals the probe is apart, at those of collisions it is not."""
    cell = workcell('ur5')
    (probe,) = cell.robot.collisions['probe']
    corners = probe.shape.load().body.vertices @ probe.T_link_shape[:3, :3].T
    corners = corners + probe.T_link_shape[:3, 3]
    obstacles = {obstacle.name: obstacle.bodies[0].vertices for obstacle in cell.scene.obstacles}
    seen = dict.fromkeys(Status, 0)
    for trajectory in colliding('ur5'):
        path = joint_path(cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
        for a, b in pairwise(certify(cell, path, SETTINGS).intervals):
            sliver, side = (a, b) if a.status is Status.SUSPECT else (b, a)
            if sliver.body != 'probe' or side.body not in ('probe', ''):
                continue
            T = link_poses(cell.robot, path.position(a.end_ns))['probe']
            moved = corners @ T[:3, :3].T + T[:3, 3]
            other = obstacles[sliver.obstacle]
            meet = surfaces_meet(
                exact(moved),
                ConvexHull(corners).simplices,
                exact(other),
                ConvexHull(other).simplices,
            )
            assert meet is (side.status is Status.COLLISION)
            seen[side.status] += 1
    assert seen[Status.FREE] > 20 and seen[Status.COLLISION] > 20


def test_a_stationary_touch_ends_suspect():
    """Where the bodies come to touch and stay, nothing is proved, however close the look."""
    result = judge(slider(), slide(0.0, 2.5, 2.5), None, Settings())
    last = result.intervals[-1]
    assert last.status is Status.SUSPECT and last.end_ns == 2 * SECOND
    assert SECOND - 100 <= last.start_ns <= SECOND
    assert last.gap_lower <= 0.0


@pytest.mark.parametrize('scale', [1e-3, 1.0, 1e3])
def test_entry_and_exit_are_pinned_at_every_scale(scale):
    """A cube flies through a wall: contact from x = 2.5 to x = 4.5 of 5."""
    result = judge(slider(scale), slide(0.0, 5.0 * scale), None, Settings(tolerance=1e-4 * scale))
    status = [row.status for row in result.intervals]
    assert status == [
        Status.FREE,
        Status.SUSPECT,
        Status.COLLISION,
        Status.SUSPECT,
        Status.FREE,
    ]
    entry, leave = slivers(result)
    assert entry.start_ns <= 0.5 * SECOND <= entry.end_ns
    assert leave.start_ns <= 0.9 * SECOND <= leave.end_ns
    assert max(width(entry), width(leave)) <= 100


@pytest.mark.parametrize(('clearance', 'tracking'), [(0.01, 0.0), (0.0, 0.02), (0.3, 0.1)])
def test_both_ends_of_a_tube_are_pinned(clearance, tracking):
    """Free ends where clearance and tracking are used up, collision begins at contact."""
    settings = Settings(clearance=clearance, tracking_tolerance=(tracking,))
    result = judge(slider(), slide(0.0, 5.0), None, settings)
    reserve = (clearance + tracking) / 5.0 * SECOND
    free, before, hit, after, last = result.intervals
    assert hit.status is Status.COLLISION and before.status is after.status is Status.SUSPECT
    assert 0 <= 0.5 * SECOND - reserve - free.end_ns <= 100
    assert 0 <= hit.start_ns - 0.5 * SECOND <= 100
    assert 0 <= 0.9 * SECOND - hit.end_ns <= 100
    assert 0 <= last.start_ns - 0.9 * SECOND - reserve <= 100


@pytest.mark.parametrize('gap', [1e-6, 1e-7, 0.0, -1e-7, -1e-6])
def test_a_turning_point_is_what_is_proved(gap):
    """The cube comes near, turns and leaves again: a double root if it just touches."""
    stop = 2.5 - gap
    result = judge(slider(), slide(stop - 1e-3, stop, stop - 1e-3), None, Settings())
    statuses = {row.status for row in result.intervals}
    assert (
        statuses
        == {
            1: {Status.FREE},
            0: {Status.FREE, Status.SUSPECT},
            -1: {Status.FREE, Status.SUSPECT, Status.COLLISION},
        }[np.sign(gap)]
    )
    if gap <= 0.0:
        open_rows = [row for row in result.intervals if row.status is not Status.FREE]
        first, last = open_rows[0].start_ns, open_rows[-1].end_ns
        contact = -gap / 1e-3 * SECOND
        assert first <= SECOND - contact and SECOND + contact <= last
        # The cube is told apart from the wall from 0.2 um on.
        assert last - first <= 2 * (contact + 2e-7 / 1e-3 * SECOND)


def boxes_meet(sizes, motion, time_ns):
    """Say in rational arithmetic whether a moved box meets another one."""
    one, other = (Box(size).load().body.vertices for size in sizes)
    displacement = pose(motion, Fraction(time_ns, SECOND))
    return surfaces_meet(
        images(displacement, one),
        ConvexHull(one).simplices,
        exact(other),
        ConvexHull(other).simplices,
    )


def test_free_bodies_touch_when_exact_arithmetic_says():
    """Ends of free intervals are apart and ends of collisions overlap, in rational arithmetic."""
    rng = np.random.default_rng(5)
    widths = []
    for _ in range(25):
        sizes = [tuple(rng.uniform(0.1, 0.4, 3)) for _ in range(2)]
        motion = random_rigid_motion(rng)
        result = certify(free_cell(*map(Box, sizes)), free_path(motion))
        for row, following in pairwise(result.intervals):
            for side in (row, following):
                if side.status is not Status.SUSPECT:
                    meet = boxes_meet(sizes, motion, row.end_ns)
                    assert meet is (side.status is Status.COLLISION)
        widths += map(width, slivers(result))
    assert len(widths) >= 10
    assert np.median(widths) <= 100
    assert np.quantile(widths, 0.9) <= 1_000


@pytest.mark.parametrize('robot', ROBOTS)
def test_a_budget_for_less_keeps_the_answer_of_before(robot):
    """With nothing to spare the answer is that without a closer look; with some, in between."""
    cell = workcell(robot)
    for trajectory in colliding(robot)[::4]:
        rough = judge(cell, trajectory, None, without(SETTINGS))
        fine = judge(cell, trajectory, None, SETTINGS)
        enough = dataclasses.replace(SETTINGS, max_pieces=rough.pieces + 1)
        none = judge(cell, trajectory, None, enough)
        assert none.intervals == rough.intervals
        assert none.pieces <= enough.max_pieces
        for more in (20, 45):
            some = dataclasses.replace(SETTINGS, max_pieces=rough.pieces + more)
            result = judge(cell, trajectory, None, some)
            assert_partition(result)
            assert result.pieces <= some.max_pieces
            assert result.verdict is rough.verdict
            for status in (Status.FREE, Status.COLLISION):
                assert covers(spans(result, status), spans(rough, status))
                assert covers(spans(fine, status), spans(result, status))


@pytest.mark.parametrize('scope', Scope)
def test_every_budget_proves_part_of_the_answer(scope):
    """Wherever a closer look is cut off, nothing is claimed that the whole one does not prove."""
    cell, trajectory = slider(), slide(0.0, 5.0)
    fine = judge(cell, trajectory, None, Settings())
    rough = judge(cell, trajectory, None, Settings(refine=False))
    seen = set()
    for pieces in range(1, fine.pieces + 2):
        result = judge(cell, trajectory, None, Settings(max_pieces=pieces, scope=scope))
        assert_partition(result)
        assert result.pieces <= pieces
        assert result.verdict is not Verdict.FREE
        for status in (Status.FREE, Status.COLLISION):
            assert covers(spans(fine, status), spans(result, status))
        seen.add(result.intervals)
    assert len(seen) > 1
    if scope is Scope.ALL:
        assert {rough.intervals, fine.intervals} <= seen


@pytest.mark.parametrize('robot', ROBOTS)
def test_a_deadline_at_any_time_proves_part_of_the_answer(robot):
    """A clock may stop the tree, the closer look, or neither."""
    cell = workcell(robot)
    for trajectory in colliding(robot)[::8]:
        fine = judge(cell, trajectory, None, SETTINGS)
        for deadline in np.geomspace(1e3, 1e7, 25).astype(int).tolist():
            settings = dataclasses.replace(SETTINGS, deadline_ns=deadline)
            result = judge(cell, trajectory, None, settings)
            assert_partition(result)
            assert result.verdict is not Verdict.FREE
            for status in (Status.FREE, Status.COLLISION):
                assert covers(spans(fine, status), spans(result, status))
        longest = dataclasses.replace(SETTINGS, deadline_ns=60 * SECOND)
        assert judge(cell, trajectory, None, longest).intervals == fine.intervals


def test_a_passed_deadline_is_one_still():
    result = judge(slider(), slide(0.0, 5.0), None, Settings(deadline_ns=0))
    assert [row.reason for row in result.intervals] == [Reason.DEADLINE.value]


def test_certificates_say_what_the_tree_proved():
    """Where a certificate is wanted, intervals are those without a closer look."""
    trajectory = slide(0.0, 5.0)
    wanted = judge(slider(), trajectory, None, Settings(want_certificate=True))
    assert wanted.certificate is not None
    assert wanted.intervals == judge(slider(), trajectory, None, Settings(refine=False)).intervals


@pytest.mark.parametrize('robot', ROBOTS)
def test_what_turns_out_to_be_free_does_not_stop_a_narrow_question(robot):
    """A gap within the tolerance is looked at before it is called the first that is not free."""
    cell = workcell(robot)
    turned = 0
    for trajectory, truth, category in cases(robot):
        if category not in ('free', 'near'):
            continue
        settings = dataclasses.replace(SETTINGS, clearance=truth['min_clearance_m'] - 5e-6)
        turned += judge(cell, trajectory, None, without(settings)).verdict is Verdict.SUSPECT
        for scope in Scope:
            asked = dataclasses.replace(settings, scope=scope)
            assert judge(cell, trajectory, None, asked).verdict is Verdict.FREE
    assert turned > 5
