"""The guarantee: free means free, at every instant, for every deviation, at every scale."""

import dataclasses
from itertools import pairwise
import math

from bench_data import cases, ROBOTS, SETTINGS, workcell
from coal_judge import Judge
import numpy as np
import pytest
from random_robot import box_body, far_scene, Given, hull_body, pose, random_body, random_path
from random_robot import random_robot as make_robot

from trajectory_guard import certify as certify_module
from trajectory_guard.cell.robot import Collision, Joint, JointType, Robot
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import certify, judge
from trajectory_guard.errors import Reason, RequestError, RobotError, SceneError
from trajectory_guard.paths.joint_path import INTERPOLATION, joint_path
from trajectory_guard.paths.trajectory import JointState, Point, Trajectory
from trajectory_guard.request import tracking_slack
from trajectory_guard.result import Status, Verdict
from trajectory_guard.settings import Settings
from trajectory_guard.shapes.body import ConvexBody

SECOND = 10**9


def assert_partition(result):
    """Check that the intervals meet and cover [0, duration]."""
    assert result.intervals[0].start_ns == 0
    assert result.intervals[-1].end_ns == result.duration_ns
    for a, b in pairwise(result.intervals):
        assert a.end_ns == b.start_ns


def meets(interval, span):
    """Say whether an interval and a span of seconds share more than an end."""
    return interval.start_ns < span[1] * 1e9 and span[0] * 1e9 < interval.end_ns


@pytest.mark.parametrize('robot', ROBOTS)
def test_bench_truth(robot):
    """Nothing certified free meets a contact; whatever keeps 1 mm is free; collisions are real."""
    cell = workcell(robot)
    assert len(cases(robot)) == 62
    for trajectory, truth, category in cases(robot):
        result = judge(cell, trajectory, None, SETTINGS)
        assert_partition(result)
        assert result.pairs_checked == {'panda': 150, 'ur5': 105}[robot]
        for row in result.intervals:
            if row.status == Status.FREE:
                assert not any(meets(row, core) for core in truth['contact_core'])
            elif row.status == Status.COLLISION:
                assert any(
                    a * 1e9 - 1 <= row.start_ns and row.end_ns <= b * 1e9 + 1
                    for a, b in truth['contact'] + truth['undetermined']
                )
            if row.status != Status.FREE:
                assert row.body and row.obstacle
                assert row.start_ns <= row.at_ns <= row.end_ns
        if category in ('free', 'near'):
            assert truth['min_clearance_m'] >= 1e-3
            assert result.verdict == Verdict.FREE
            assert [row.status for row in result.intervals] == [Status.FREE]
        if truth['colliding']:
            assert result.verdict in (Verdict.SUSPECT, Verdict.COLLISION)
        if category in ('collide', 'tunnel'):
            assert result.verdict == Verdict.COLLISION


@pytest.mark.parametrize('robot', ROBOTS)
def test_permuted_joints_give_the_same_answer(robot):
    """Joints are matched by name: any order, the same intervals to the bit."""
    cell = workcell(robot)
    rng = np.random.default_rng(0)
    for trajectory, _, _ in cases(robot)[::15]:
        order = rng.permutation(len(trajectory.joint_names))
        permuted = Trajectory.from_points(
            [trajectory.joint_names[k] for k in order],
            [
                Point(int(t), p[order], v[order])
                for t, p, v in zip(
                    trajectory.times_ns, trajectory.positions, trajectory.velocities, strict=True
                )
            ],
        )
        a, b = (judge(cell, x, None, SETTINGS) for x in (trajectory, permuted))
        assert a.intervals == b.intervals


def sampled_free(cell, path, result, slack, rng, count, oracle):
    """Check random in-tube configurations at random instants of free intervals against coal."""
    free = [
        row for row in result.intervals if row.status == Status.FREE and row.end_ns > row.start_ns
    ]
    links = {cell.link_names[b] for b in cell.pairs(path.in_path).moving}
    checked = 0
    for _ in range(count if free else 0):
        row = free[rng.integers(len(free))]
        q = path.position(int(rng.integers(row.start_ns, row.end_ns + 1)))
        off = slack * rng.uniform(-1.0, 1.0, len(q))
        assert oracle.clearance(q + off, links) > result.clearance - 1e-9
        checked += 1
    return checked


def random_scene(rng, count=6, size=0.15):
    """Return obstacles of every kind around the origin."""
    return Scene(
        tuple(
            Obstacle(f'o{k}', (random_body(rng, size).moved(pose(rng.normal(size=3) * 0.6)),))
            for k in range(count)
        ),
        'random',
    )


@pytest.mark.parametrize('seed', range(7))
def test_free_is_free_for_random_robots(seed):
    """Any tree of joints, slack and clearance: coal finds nothing in free intervals."""
    rng = np.random.default_rng(seed)
    cell = Workcell(make_robot(rng, joints=5), random_scene(rng))
    oracle = Judge(cell)
    checked = 0
    for spread in (0.1, 0.5, 2.0):
        path = random_path(rng, cell.robot, spread=spread)
        tolerance = rng.choice([0.0, 0.01, 0.05])
        settings = Settings(
            tolerance=1e-3,
            clearance=float(rng.choice([0.0, 0.02])),
            tracking_tolerance=(tolerance,),
            max_pieces=3000,
        )
        result = certify(cell, path, settings)
        assert_partition(result)
        slack = tracking_slack(cell.robot.movable, path, (), settings)
        checked += sampled_free(cell, path, result, slack, rng, 60, oracle)
        for row in result.intervals:
            if row.status == Status.COLLISION:
                q = path.position((row.start_ns + row.end_ns) // 2)
                assert oracle.clearance(q) < 1e-9
    assert checked > 0


@pytest.mark.parametrize('robot', ROBOTS)
def test_free_is_free_on_real_robots(robot):
    """With tracking tolerance, in-tube samples of free intervals never touch."""
    rng = np.random.default_rng(4)
    cell = workcell(robot)
    oracle = Judge(cell)
    settings = dataclasses.replace(SETTINGS, tracking_tolerance=(0.005,))
    checked = 0
    for trajectory, _, _ in cases(robot)[::4]:
        path = joint_path(cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
        result = certify(cell, path, settings)
        slack = np.full(len(path.joint_names), 0.005)
        checked += sampled_free(cell, path, result, slack, rng, 12, oracle)
    assert checked > 100


@pytest.mark.slow
@pytest.mark.parametrize('robot', ROBOTS)
def test_free_is_free_on_real_robots_many(robot):
    """The same with ten times the samples on every trajectory."""
    rng = np.random.default_rng(5)
    cell = workcell(robot)
    oracle = Judge(cell)
    for tolerance in (0.0, 0.01):
        settings = dataclasses.replace(SETTINGS, tracking_tolerance=(tolerance,))
        for trajectory, _, _ in cases(robot):
            path = joint_path(
                cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True
            )
            result = certify(cell, path, settings)
            slack = np.full(len(path.joint_names), tolerance)
            sampled_free(cell, path, result, slack, rng, 100, oracle)


# A cube of side 1 on a slide along x towards a wall: everything is known in closed form.


def slider(scale=1.0, wall=3.0, depth=1.0, body=None):
    """Return a workcell: a cube centred on the slide, a wall whose near face is at x = wall."""
    robot = Robot(
        'slider',
        'base',
        (
            Joint(
                'slide',
                JointType.PRISMATIC,
                'base',
                'cube',
                np.eye(4),
                np.array([1.0, 0, 0]),
                -math.inf,
                math.inf,
            ),
        ),
        {'cube': (Collision(np.eye(4), Given(body or box_body(np.full(3, scale)))),)},
        b'slider',
    )
    size = np.array([depth, 4.0, 4.0]) * scale
    center = ((wall + 0.5 * depth) * scale, 0.0, 0.0)
    return Workcell(robot, Scene((Obstacle('wall', (box_body(size, center),)),), 'wall'))


def slide(*stops, seconds=1.0):
    """Return a trajectory of the slide through positions, linear in between."""
    step = round(seconds * SECOND)
    return Trajectory.from_points(
        ['slide'], [Point(i * step, [float(x)]) for i, x in enumerate(stops)]
    )


@pytest.mark.parametrize('scale', [1e-6, 1e-3, 1.0, 1e3, 1e6])
def test_contact_time_is_exact_at_every_scale(scale):
    """From micrometres to kilometres the free interval ends just before the known contact."""
    tolerance = max(1e-4 * scale, 1e-9)
    result = judge(slider(scale), slide(0.0, 5.0 * scale), None, Settings(tolerance=tolerance))
    contact = 0.5 * SECOND  # at x = 2.5 the front face reaches the wall
    last = 0.9 * SECOND  # at x = 4.5 the back face leaves it
    free, rest = result.intervals[0], result.intervals[1:]
    slack = 4.0 * tolerance / (5.0 * scale) * SECOND
    assert free.status == Status.FREE
    assert contact - slack - 2 <= free.end_ns <= contact
    assert result.intervals[-1].status == Status.FREE
    assert last <= result.intervals[-1].start_ns <= last + slack + 2
    assert result.verdict == Verdict.COLLISION
    collision = [row for row in rest if row.status == Status.COLLISION]
    assert min(row.start_ns for row in collision) >= contact
    assert max(row.end_ns for row in collision) <= last
    assert (
        sum(row.end_ns - row.start_ns for row in collision) > 0.99 * (last - contact) - 2 * slack
    )
    at = collision[0]
    assert at.gap_upper < 0.0
    assert at.start_ns <= at.at_ns <= at.end_ns


@pytest.mark.parametrize('gap', [1.01e-4, 1e-3, 0.1])
def test_a_gap_above_the_tolerance_is_always_free(gap):
    """G4: what keeps more than the tolerance is free."""
    result = judge(slider(), slide(0.0, 2.5 - gap), None, Settings(tolerance=1e-4))
    assert result.verdict == Verdict.FREE


@pytest.mark.parametrize('gap', [0.0, -1e-12, -1e-3])
def test_touching_is_never_free(gap):
    """Closed solids that touch are not free, and neither is anything deeper."""
    result = judge(slider(), slide(0.0, 2.5 - gap), None, Settings(tolerance=1e-4))
    assert result.verdict != Verdict.FREE
    assert result.intervals[-1].status != Status.FREE


@pytest.mark.parametrize('clearance', [0.01, 0.3])
@pytest.mark.parametrize('tracking', [0.0, 0.02])
def test_clearance_and_tracking_are_inside_the_bound(clearance, tracking):
    """The free end moves back by exactly clearance plus tracking tolerance."""
    settings = Settings(tolerance=1e-4, clearance=clearance, tracking_tolerance=(tracking,))
    result = judge(slider(), slide(0.0, 5.0), None, settings)
    end = (2.5 - clearance - tracking) / 5.0 * SECOND
    assert end - 4e-4 / 5.0 * SECOND - 2 <= result.intervals[0].end_ns <= end


@pytest.mark.parametrize('tracking', [0.0, 0.02])
def test_the_lower_bound_of_a_gap_is_one_for_the_whole_tube(tracking):
    """Found in review: the bound that is reported left the tracking tolerance out."""
    settings = Settings(clearance=0.015, tracking_tolerance=(tracking,))
    (_, row) = judge(slider(), slide(0.0, 2.49), None, settings).intervals
    assert row.status == Status.SUSPECT
    assert row.gap_lower <= 0.01 - tracking
    assert row.gap_lower > 0.01 - tracking - 2e-3
    assert row.gap_upper >= 0.01


def test_start_inside_an_obstacle_is_not_free():
    """Disjoint, not only contact-free: a body wholly inside never touches a surface."""
    small = box_body(np.full(3, 0.1))
    cell = slider(depth=4.0, body=small)  # the wall is now from 3 to 7
    result = judge(cell, slide(4.5, 5.5), None, Settings())
    assert [row.status for row in result.intervals] == [Status.COLLISION]
    reverse = slider(body=box_body(np.full(3, 9.0)))  # and an obstacle wholly inside the link
    assert judge(reverse, slide(3.4, 3.6), None, Settings()).verdict == Verdict.COLLISION


@pytest.mark.parametrize(
    'body',
    [
        ConvexBody(np.zeros((1, 3)), ball=0.5),
        ConvexBody(np.array([[0, -1.0, 0], [0, 1.0, 0]]), disc_radius=0.5, disc_axis=[0, 1.0, 0]),
        ConvexBody(np.array([[0.5, 0, 0], [-0.5, 0, 0], [0, 0.5, 0]])),
    ],
    ids=['sphere', 'cylinder', 'triangle'],
)
def test_round_and_flat_bodies_are_exact(body):
    """A sphere, a lying cylinder and a triangle reach the wall when their front does."""
    result = judge(slider(body=body), slide(0.0, 2.6), None, Settings(tolerance=1e-5))
    contact = 2.5 / 2.6 * SECOND
    assert contact - 4e-5 / 2.6 * SECOND <= result.intervals[0].end_ns <= contact
    assert result.verdict != Verdict.FREE


def test_no_faces_means_suspect_not_collision():
    """A body of which nothing is known to be solid can be suspect only."""
    body = ConvexBody(box_body(np.ones(3)).vertices)
    result = judge(slider(body=body), slide(0.0, 3.0), None, Settings(tolerance=1e-3))
    assert result.verdict == Verdict.SUSPECT
    assert result.reason_code == Reason.TOLERANCE.value


def test_spent_budget_is_suspect_and_keeps_what_was_proved():
    """With a few pieces the beginning is free and the rest is suspect for that reason."""
    trajectory = slide(0.0, 1.0, 0.0, 1.0, 5.0, 0.0)
    full = judge(slider(), trajectory, None, Settings(tolerance=1e-6))
    part = judge(slider(), trajectory, None, Settings(tolerance=1e-6, max_pieces=3))
    assert part.pieces == 3
    assert_partition(part)
    assert [(r.status, r.reason) for r in part.intervals] == [
        (Status.FREE, ''),
        (Status.SUSPECT, Reason.BUDGET.value),
    ]
    assert part.intervals[0].end_ns == 3 * SECOND
    assert full.intervals[0].end_ns >= 3 * SECOND
    nothing = judge(slider(), trajectory, None, Settings(max_pieces=0))
    assert nothing.verdict == Verdict.SUSPECT
    assert nothing.intervals[0].reason == Reason.BUDGET.value


def test_deadline_of_zero_proves_nothing():
    """A deadline that has passed is never free."""
    result = judge(slider(), slide(0.0, 1.0), None, Settings(deadline_ns=0))
    assert result.verdict == Verdict.SUSPECT
    assert result.intervals[0].reason == Reason.DEADLINE.value


def test_deadline_stops_a_long_search():
    """A search that would take long is given up, and what it proved first stays."""
    cell = slider(body=ConvexBody(box_body(np.ones(3)).vertices))
    # In contact without known faces: cut down to the tolerance everywhere, a million pieces.
    long = slide(0.0, *np.tile([2.0, 3.2], 200), seconds=0.1)
    result = judge(
        cell, long, None, Settings(tolerance=1e-9, deadline_ns=50_000_000, max_pieces=10**9)
    )
    assert result.intervals[0].status == Status.FREE
    assert result.intervals[-1].reason == Reason.DEADLINE.value
    assert_partition(result)


def test_unknown_start_is_suspect_and_a_start_state_settles_it():
    """The approach is certified when the start is known, and suspect when it is not."""
    late = Trajectory.from_points(['slide'], [Point(SECOND, [0.0]), Point(2 * SECOND, [1.0])])
    unknown = judge(slider(), late)
    assert unknown.verdict == Verdict.SUSPECT
    assert unknown.intervals[0].reason == Reason.START_STATE_UNKNOWN.value
    assert unknown.intervals[1].status == Status.FREE
    known = judge(slider(), late, JointState(('slide',), np.array([0.5])))
    assert known.verdict == Verdict.FREE
    hits = judge(slider(), late, JointState(('slide',), np.array([3.0])))
    assert hits.verdict == Verdict.COLLISION


def test_one_point_is_a_pose():
    """A trajectory of one point at time zero is judged where it stands."""
    start = JointState(('slide',), np.array([2.6]))
    hit = judge(slider(), Trajectory.from_points(['slide'], [Point(0, [2.6])]), start)
    assert hit.verdict == Verdict.COLLISION
    free = judge(slider(), Trajectory.from_points(['slide'], [Point(0, [1.0])]), None)
    assert free.verdict == Verdict.FREE
    assert free.duration_ns == 0


def test_a_thousand_turns_far_away_cost_nothing():
    """A spinning joint out of reach is one piece, however far it turns."""
    robot = Robot(
        'spinner',
        'base',
        (
            Joint(
                'spin',
                JointType.CONTINUOUS,
                'base',
                'blade',
                np.eye(4),
                np.array([0, 0, 1.0]),
                -math.inf,
                math.inf,
            ),
        ),
        {'blade': (Collision(np.eye(4), Given(box_body(np.array([1.0, 0.1, 0.1])))),)},
        b'',
    )
    cell = Workcell(robot, far_scene(3.0))
    trajectory = Trajectory.from_points(['spin'], [Point(0, [0.0]), Point(SECOND, [6283.0])])
    result = judge(cell, trajectory)
    assert result.verdict == Verdict.FREE
    assert result.pieces == 1
    near = judge(Workcell(robot, far_scene(0.9)), trajectory, None, Settings(max_pieces=2000))
    assert near.verdict == Verdict.COLLISION


@pytest.mark.parametrize('duration_ns', [1, 3, 10**6, 10**18])
def test_any_duration(duration_ns):
    """One nanosecond to thirty years: the same motion, the same proof."""
    free = Trajectory.from_points(['slide'], [Point(0, [0.0]), Point(duration_ns, [2.0])])
    assert judge(slider(), free).verdict == Verdict.FREE
    hits = Trajectory.from_points(['slide'], [Point(0, [0.0]), Point(duration_ns, [5.0])])
    result = judge(slider(), hits)
    assert_partition(result)
    assert result.verdict != Verdict.FREE
    assert result.intervals[0].status != Status.FREE or (
        result.intervals[0].end_ns <= duration_ns // 2
    )


def test_velocities_decide_between_two_equal_sets_of_points():
    """The waypoints are free; only the spline between them hits."""
    points = [Point(0, [2.0], [8.0]), Point(SECOND, [2.0], [0.0])]
    overshoot = Trajectory.from_points(['slide'], points)
    assert judge(slider(), overshoot).verdict == Verdict.COLLISION
    straight = Trajectory.from_points(['slide'], [p._replace(velocities=()) for p in points])
    assert judge(slider(), straight).verdict == Verdict.FREE


def test_tracking_tolerance_per_joint_and_wrong_counts():
    """One value or one per commanded joint, in the message's order; anything else is refused."""
    settings = Settings(tracking_tolerance=(0.01, 0.02))
    refused = judge(slider(), slide(0.0, 1.0), None, settings)
    assert refused.verdict == Verdict.REJECTED
    assert refused.reason_code == Reason.INVALID_TRACKING_TOLERANCE.value
    cell = workcell('ur5')
    trajectory = cases('ur5')[0][0]
    path = joint_path(cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
    values = tuple(0.001 * k for k in range(6))
    reverse = tuple(reversed(trajectory.joint_names))
    slack = tracking_slack(cell.robot.movable, path, reverse, Settings(tracking_tolerance=values))
    by_name = dict(zip(path.joint_names, slack, strict=True))
    assert [by_name[name] for name in reverse] == list(values)


def test_mimic_joint_follows_with_its_multiplier():
    """A follower's tolerance is its leader's times the multiplier, never less."""
    rng = np.random.default_rng(0)
    robot = make_robot(rng)
    path = random_path(rng, robot)
    slack = tracking_slack(robot.movable, path, (), Settings(tracking_tolerance=(0.1,)))
    index = {joint.name: j for j, joint in enumerate(robot.movable)}
    follower = next(joint for joint in robot.movable if joint.mimic)
    assert 0.07 <= slack[index[follower.name]] <= 0.07 * (1.0 + 1e-12)


def test_what_the_verdict_does_not_cover_is_said():
    """Static pairs and self-collision are listed; a static overlap is a warning."""
    base = {'base': (Collision(np.eye(4), Given(box_body(np.ones(3), (3.0, 0, 0)))),)}
    cell = slider()
    robot = dataclasses.replace(cell.robot, collisions={**base, **cell.robot.collisions})
    result = judge(Workcell(robot, cell.scene), slide(0.0, 1.0))
    assert result.verdict == Verdict.FREE
    assert any('base' in line for line in result.unchecked_pairs)
    assert any('against each other' in line for line in result.unchecked_pairs)
    assert any('base and wall' in line for line in result.warnings)
    assert result.interpolation == INTERPOLATION


def test_limits_unchecked_are_said():
    """Switching the limits off leaves a trace in the result."""
    result = judge(slider(), slide(0.0, 1.0), None, Settings(check_joint_limits=False))
    assert 'joint limits were not checked' in result.warnings


@pytest.mark.parametrize('slack', [[0.1, 0.1], [], [-0.1], [math.nan], [math.inf]], ids=str)
def test_slack_that_does_not_fit_is_refused(slack):
    """Found in review: a wrong shape was read out of bounds, a negative one deflated the proof."""
    cell = slider()
    path = joint_path(cell.robot.movable, slide(0.0, 1.0))
    with pytest.raises(RequestError):
        certify(cell, path, Settings(), np.array(slack))


@pytest.mark.parametrize(
    'change',
    [
        {'coefficients': np.zeros((1, 1, 4))},
        {'coefficients': np.zeros((2, 1, 6))},
        {'coefficients': np.full((1, 1, 6), np.nan)},
        {'coefficient_error': np.full((1, 1), -1.0)},
        {'coefficient_error': np.full((1, 1), np.nan)},
        {'in_path': np.ones(2, bool)},
        {'knots_ns': np.array([0])},
        {'knots_ns': np.array([1, 0])},
    ],
    ids=str,
)
def test_a_path_of_the_wrong_shape_is_refused(change):
    """Kernels take shapes on trust, so a path never has another."""
    path = joint_path(slider().robot.movable, slide(0.0, 1.0))
    with pytest.raises(RequestError):
        certify(slider(), dataclasses.replace(path, **change))


def test_a_jump_in_no_time_is_refused():
    """Found in review: what happens in a segment without length had no interval."""
    path = joint_path(slider().robot.movable, slide(0.0, 1.0, 4.9, 5.0))
    knots = path.knots_ns.copy()
    knots[2] = knots[1]
    with pytest.raises(RequestError):
        dataclasses.replace(path, knots_ns=knots)


def test_a_standing_body_within_rounding_is_one_piece():
    """Found in review: what does not move was halved to the end of the budget."""
    gap = 1e-9
    cell = slider(1e6, wall=0.5 + gap / 1e6)
    result = judge(cell, slide(0.0, 0.0), None, Settings(tolerance=1e-9))
    assert result.verdict == Verdict.SUSPECT
    assert result.pieces == 1


def test_tracking_near_the_limit_needs_few_pieces():
    """A gap just above clearance and tracking closes without cutting to the bottom."""
    for gap in (1.5e-4, 1e-3, 1e-2):
        settings = Settings(tolerance=1e-4, tracking_tolerance=(0.005,), clearance=0.01)
        result = judge(slider(), slide(0.0, 2.485 - gap), None, settings)
        assert result.verdict == Verdict.FREE
        assert result.pieces < 100


def test_a_path_of_another_robot_is_refused():
    """Coefficients are never applied to joints they were not made for."""
    rng = np.random.default_rng(1)
    path = random_path(rng, make_robot(rng))
    with pytest.raises(RequestError):
        certify(slider(), path)


def test_huge_motion_is_refused_not_certified():
    """What would overflow the kernels is an error that names the joint."""
    result = judge(slider(), slide(0.0, 1e12))
    assert result.verdict == Verdict.REJECTED
    assert result.reason_code == Reason.TOO_LARGE.value
    assert 'slide' in result.message


def test_nothing_to_check_is_an_error():
    """Neither an empty scene nor a robot without moving geometry is ever free."""
    with pytest.raises((RobotError, SceneError)):
        Workcell(slider().robot, Scene((), ''))
    robot = dataclasses.replace(slider().robot, collisions={})
    with pytest.raises(RobotError):
        Workcell(robot, slider().scene)
    static = dataclasses.replace(
        slider().robot,
        collisions={'base': (Collision(np.eye(4), Given(hull_body(np.random.rand(9, 3)))),)},
    )
    result = judge(Workcell(static, slider().scene), slide(0.0, 1.0))
    assert result.reason_code == Reason.ROBOT_EMPTY.value


def test_an_unforeseen_error_is_a_rejection(monkeypatch):
    """Whatever breaks inside, the answer is REJECTED and says so."""

    def broken(*_args):
        raise ZeroDivisionError('broken on purpose')

    monkeypatch.setattr(certify_module, 'cover_refined', broken)
    result = judge(slider(), slide(0.0, 1.0))
    assert result.verdict == Verdict.REJECTED
    assert result.reason_code == Reason.INTERNAL_ERROR.value
    assert 'broken on purpose' in result.message
