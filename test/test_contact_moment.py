"""Contacts named by their features: the constraint's zero is where exact arithmetic says."""

from fractions import Fraction
from itertools import pairwise

from bench_data import cases, ROBOTS, SETTINGS, workcell
from exact_contact import exact, images, pose, surfaces_meet
import numpy as np
import pytest
from random_robot import link_poses
from rational_curves import random_rigid_motion
from scipy.spatial import ConvexHull
from test_certify import slide, slider
from test_free_certify import cell as free_cell
from test_free_certify import path as free_path

from trajectory_guard.certify import certify, judge
from trajectory_guard.contact_moment import _first
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.result import NANOSECONDS, Status
from trajectory_guard.settings import Settings
from trajectory_guard.shapes.primitive import Box, Sphere

CONTACTS = Settings(want_contacts=True)


def ends_of_collisions(result):
    """Return the suspect intervals between a free one and a collision."""
    rows = result.intervals
    return [
        row
        for before, row, after in zip(rows, rows[1:], rows[2:], strict=False)
        if {before.status, after.status} == {Status.FREE, Status.COLLISION}
    ]


@pytest.mark.parametrize('robot', ROBOTS)
def test_contacts_of_real_robots(robot):
    """Nearly every end of a collision has a contact, in its interval and far narrower."""
    cell = workcell(robot)
    settings = Settings(
        tolerance=SETTINGS.tolerance, allow_nonzero_end_velocity=True, want_contacts=True
    )
    widths, ends = [], 0
    for trajectory, truth, _ in cases(robot):
        if not truth['colliding']:
            continue
        result = judge(cell, trajectory, None, settings)
        assert result.intervals == judge(cell, trajectory, None, SETTINGS).intervals
        rows = ends_of_collisions(result)
        ends += len(rows)
        left = iter(rows)
        for contact in result.contacts:
            row = next(
                row
                for row in left
                if row.start_ns <= contact.latest_ns and contact.earliest_ns <= row.end_ns
            )
            assert (contact.body, contact.obstacle) == (row.body, row.obstacle)
            assert contact.location == row.location
            widths.append(contact.latest_ns - contact.earliest_ns)
    assert len(widths) >= 0.95 * ends > 100
    assert np.median(widths) < 1.0


def test_contacts_of_free_boxes_are_exact():
    """Before the earliest instant two boxes are apart, after the latest they are not."""
    rng = np.random.default_rng(5)
    named = ends = 0
    for _ in range(40):
        sizes = [tuple(rng.uniform(0.1, 0.4, 3)) for _ in range(2)]
        motion = random_rigid_motion(rng)
        result = certify(free_cell(*map(Box, sizes)), free_path(motion), CONTACTS)
        one, other = (Box(size).load().body.vertices for size in sizes)
        ends += len(ends_of_collisions(result))
        for contact in result.contacts:
            meets = [
                surfaces_meet(
                    images(pose(motion, Fraction(time_ns) / NANOSECONDS), one),
                    ConvexHull(one).simplices,
                    exact(other),
                    ConvexHull(other).simplices,
                )
                for time_ns in (contact.earliest_ns, contact.latest_ns)
            ]
            assert meets == [not contact.begins, contact.begins]
            assert contact.latest_ns - contact.earliest_ns < 10.0
            named += 1
    assert named == ends > 20


def test_the_probe_of_a_real_robot_touches_then():
    """Another chain of transforms, in doubles: apart and overlapping a nanosecond off."""
    cell = workcell('ur5')
    settings = Settings(allow_nonzero_end_velocity=True, want_contacts=True)
    (probe,) = cell.robot.collisions['probe']
    corners = probe.shape.load().body.vertices @ probe.T_link_shape[:3, :3].T
    corners = corners + probe.T_link_shape[:3, 3]
    obstacles = {obstacle.name: obstacle.bodies[0].vertices for obstacle in cell.scene.obstacles}
    seen = 0
    for trajectory, truth, _ in cases('ur5'):
        if not truth['colliding']:
            continue
        path = joint_path(cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
        for contact in certify(cell, path, settings).contacts:
            if contact.body != 'probe' or contact.latest_ns - contact.earliest_ns > 1.0:
                continue
            other = obstacles[contact.obstacle]
            meets = []
            for time_ns in (int(contact.earliest_ns) - 2, int(contact.latest_ns) + 3):
                T = link_poses(cell.robot, path.position(time_ns))['probe']
                meets.append(
                    surfaces_meet(
                        exact(corners @ T[:3, :3].T + T[:3, 3]),
                        ConvexHull(corners).simplices,
                        exact(other),
                        ConvexHull(other).simplices,
                    )
                )
            assert meets == [not contact.begins, contact.begins]
            seen += 1
    assert seen > 50


def test_whole_faces_touch_at_a_corner_of_one():
    """A cube meets a wall face to face: some corner's constraint says when."""
    result = judge(slider(), slide(0.0, 5.0), None, CONTACTS)
    begin, end = result.contacts
    assert begin.begins and not end.begins
    for contact, when in ((begin, 0.5), (end, 0.9)):
        assert contact.earliest_ns <= when * NANOSECONDS <= contact.latest_ns
        assert contact.latest_ns - contact.earliest_ns < 1.0


def test_round_bodies_have_no_constraint():
    rng = np.random.default_rng(5)
    boxes = balls = 0
    for _ in range(60):
        motion = random_rigid_motion(rng)
        size = tuple(rng.uniform(0.1, 0.4, 3))
        boxes += len(
            ends_of_collisions(certify(free_cell(Sphere(0.2), Box(size)), free_path(motion)))
        )
        balls += len(
            certify(free_cell(Sphere(0.2), Box(size)), free_path(motion), CONTACTS).contacts
        )
    assert boxes > 10
    assert balls == 0


def test_asked_for_only_where_bodies_touch():
    assert judge(slider(), slide(0.0, 5.0), None, Settings()).contacts == ()
    for other in ({'clearance': 0.01}, {'tracking_tolerance': (0.0, 0.1)}):
        with pytest.raises(RequestError, match='contacts are named') as caught:
            Settings(want_contacts=True, **other)
        assert caught.value.reason is Reason.INVALID_PARAMETER


def test_json_has_contacts_only_where_there_are_some():
    asked = judge(slider(), slide(0.0, 5.0), None, CONTACTS)
    rows = asked.to_dict()['contacts']
    assert [row['begins'] for row in rows] == [True, False]
    assert rows[0]['earliest'] <= 0.5 <= rows[0]['latest']
    assert 'contacts' not in judge(slider(), slide(0.0, 5.0)).to_dict()


@pytest.mark.parametrize('seed', range(3))
def test_zeros_lie_after_the_first_open_part(seed):
    """The span that is left contains every exact zero, from both sides."""
    rng = np.random.default_rng(seed)
    for _ in range(200):
        roots = [Fraction(int(k), 97) for k in rng.integers(-20, 120, int(rng.integers(1, 5)))]
        power = np.poly([float(r) for r in roots])[::-1]
        n = len(power) - 1
        c = np.array(
            [
                sum(power[k] * float(Fraction(_choose(i, k), _choose(n, k))) for k in range(i + 1))
                for i in range(n + 1)
            ]
        )
        slack = 1e-13 * float(np.abs(c).max())
        inside = [root for root in roots if 0 <= root <= 1]
        first, last = _first(c, slack, 18), _first(c[::-1], slack, 18)
        if inside:
            assert first <= min(inside) and max(inside) <= 1.0 - last
        else:
            assert first is None or first >= 0.0


def _choose(n, k):
    return 0 if k > n else Fraction(np.prod([Fraction(n - i, i + 1) for i in range(k)] or [1]))


def test_pairs_in_order_of_time():
    result = judge(slider(), slide(0.0, 5.0, 0.0), None, CONTACTS)
    assert [contact.begins for contact in result.contacts] == [True, False, True, False]
    assert all(a.latest_ns < b.earliest_ns for a, b in pairwise(result.contacts))
