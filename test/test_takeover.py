"""The path that is certified covers what the controller plays, wherever it begins."""

from collections.abc import Mapping, Sequence
import dataclasses
import math

from builtin_interfaces.msg import Duration, Time
import numpy as np
import pytest
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.result import nanoseconds_to_message
from msg_adapters.trajectory import joint_state_from_message, trajectory_from_message
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.entry import Allowance, Entry, Measured
from trajectory_guard.paths.joint_path import joint_path, JointPath
from trajectory_guard.paths.near_path import farthest
from trajectory_guard.paths.takeover import Takeover, takeover
from trajectory_guard.ros.gate_request import request_for

NOW_NS = 1_700_000_000 * 10**9
SECOND = 10**9

ROBOT = robot_from_urdf(
    '<robot name="r"><link name="l0"><collision><geometry><sphere radius="1"/></geometry>'
    '</collision></link>'
    + ''.join(
        f'<link name="l{i + 1}"/><joint name="{name}" type="{kind}"><parent link="l{i}"/>'
        f'<child link="l{i + 1}"/><axis xyz="0 0 1"/>'
        '<limit lower="-9" upper="9" effort="1" velocity="1"/></joint>'
        for i, (name, kind) in enumerate(
            [('turn', 'revolute'), ('spin', 'continuous'), ('slide', 'prismatic')]
        )
    )
    + '</robot>'
)
JOINTS = ('turn', 'spin', 'slide')

ALLOWANCE = Allowance(
    max_drift=0.03,
    max_velocity_drift=0.2,
    max_start_delay_ns=SECOND // 20,
    max_wait_ns=SECOND // 2,
    allowed_start_tolerance=0.05,
    continuous_joints=frozenset({'spin'}),
)


# The controller, as its source has it: Trajectory::sample and interpolate_between_points.


class Played:
    """
    What joint_trajectory_controller (Jazzy) plays.

    :param message: the trajectory.
    :param begin_ns: time of the first sample [ns].
    :param state: position and velocity of each joint then.
    :param reads_velocity: whether the controller reads velocities.
    """

    def __init__(
        self,
        message: JointTrajectory,
        begin_ns: int,
        state: Mapping[str, tuple[float, float]],
        reads_velocity: bool = True,
    ) -> None:
        stamp_ns = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
        start_ns = stamp_ns or begin_ns
        self.begin_ns = begin_ns
        self.knots = [
            (
                start_ns + p.time_from_start.sec * SECOND + p.time_from_start.nanosec,
                (list(p.positions), list(p.velocities), list(p.accelerations)),
            )
            for p in message.points
        ]
        first_ns, (first, _, _) = self.knots[0]
        q = [state[name][0] for name in message.joint_names]
        for j, name in enumerate(message.joint_names):
            if name == 'spin':
                q[j] = first[j] - _shortest(q[j], first[j])
        v = [state[name][1] for name in message.joint_names] if reads_velocity else []
        if begin_ns < first_ns:
            self.knots.insert(0, (begin_ns, (q, v, [])))

    def at(self, time_ns: int) -> np.ndarray:
        """Return the positions at a time, (J,)."""
        for (a_ns, a), (b_ns, b) in zip(self.knots[:-1], self.knots[1:], strict=True):
            if a_ns <= time_ns < b_ns:
                return _between((b_ns - a_ns) / 1e9, a, b, (time_ns - a_ns) / 1e9)
        return np.array(self.knots[-1][1][0])


def _shortest(start: float, end: float) -> float:
    """angles::shortest_angular_distance."""
    return (end - start + math.pi) % (2 * math.pi) - math.pi


def _between(T: float, a: Sequence[list], b: Sequence[list], t: float) -> np.ndarray:
    (q0, v0, a0), (q1, v1, a1) = (tuple(map(np.array, side)) for side in (a, b))
    if not (len(v0) and len(v1)):
        return q0 + t * (q1 - q0) / T
    if not (len(a0) and len(a1)):
        c2 = (-3 * q0 + 3 * q1 - 2 * v0 * T - v1 * T) / T**2
        c3 = (2 * q0 - 2 * q1 + v0 * T + v1 * T) / T**3
        return q0 + t * v0 + t**2 * c2 + t**3 * c3
    c3 = (-20 * q0 + 20 * q1 - 3 * a0 * T**2 + a1 * T**2 - 12 * v0 * T - 8 * v1 * T) / (2 * T**3)
    c4 = (30 * q0 - 30 * q1 + 3 * a0 * T**2 - 2 * a1 * T**2 + 16 * v0 * T + 14 * v1 * T) / (
        2 * T**4
    )
    c5 = (-12 * q0 + 12 * q1 - a0 * T**2 + a1 * T**2 - 6 * v0 * T - 6 * v1 * T) / (2 * T**5)
    return q0 + t * v0 + t**2 * a0 / 2 + t**3 * c3 + t**4 * c4 + t**5 * c5


# Trajectories and states


def stamp(time_ns: int) -> Time:
    return Time(sec=time_ns // SECOND, nanosec=time_ns % SECOND)


def some_trajectory(
    rng: np.random.Generator, first_ns: int, degree: int, stamp_ns: int = 0
) -> JointTrajectory:
    """Return three points for the joints in some order."""
    names = list(rng.permutation(JOINTS))
    message = JointTrajectory(joint_names=names)
    message.header.stamp = stamp(stamp_ns)
    for i in range(3):
        point = JointTrajectoryPoint(positions=rng.uniform(-1, 1, 3).tolist())
        point.time_from_start = nanoseconds_to_message(first_ns + i * SECOND, Duration)
        if degree >= 3:
            point.velocities = rng.uniform(-1, 1, 3).tolist() if i < 2 else [0.0] * 3
        if degree == 5:
            point.accelerations = rng.uniform(-1, 1, 3).tolist()
        message.points.append(point)
    return message


def plan_of(
    message: JointTrajectory,
    measured: Mapping[str, Measured],
    allowance: Allowance = ALLOWANCE,
    now_ns: int = NOW_NS,
) -> Takeover:
    stamp_ns = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
    return takeover(trajectory_from_message(message), stamp_ns, now_ns, measured, allowance)


def certified(message: JointTrajectory, plan: Takeover) -> tuple[JointPath, np.ndarray]:
    """Return the path that the guard makes of the request, and its tolerance by joint."""
    asked = request_for(message, plan, [0.0] * len(message.joint_names))
    start = joint_state_from_message(asked.start_state) if asked.start_state.name else None
    path = joint_path(
        ROBOT.movable,
        trajectory_from_message(asked.trajectory),
        start,
        check_joint_limits=False,
        allow_nonzero_end_velocity=True,
        allowed_start_tolerance=0.05,
    )
    tolerance = dict(zip(message.joint_names, asked.tracking_tolerance, strict=True))
    return path, np.array([tolerance[name] for name in path.joint_names])


def distance(played: np.ndarray, message: JointTrajectory, path: JointPath, t: int) -> np.ndarray:
    column = [message.joint_names.index(name) for name in path.joint_names]
    return np.abs(played[column] - path.position(t))


def moved(
    rng: np.random.Generator, measured: Mapping[str, Measured], most: float, fastest: float
) -> dict[str, tuple[float, float]]:
    """Return a state that is off by up to so much, often by just that."""
    return {
        name: (
            joint.position + most * rng.choice([-1, 1, rng.uniform(-1, 1)]),
            joint.velocity + fastest * rng.choice([-1, 1, rng.uniform(-1, 1)]),
        )
        for name, joint in measured.items()
    }


ROUNDING = 1e-9


@pytest.mark.parametrize('degree', [1, 3, 5])
@pytest.mark.parametrize('reads_velocity', [True, False])
@pytest.mark.parametrize('stamped', [False, True])
def test_an_approach_is_covered(degree: int, reads_velocity: bool, stamped: bool) -> None:
    rng = np.random.default_rng([degree, reads_velocity, stamped])
    allowance = dataclasses.replace(ALLOWANCE, reads_velocity=reads_velocity)
    closest = 0.0
    for _ in range(60):
        first_ns = int(rng.integers(1, 3 * SECOND))
        ahead_ns = int(rng.integers(SECOND, 3 * SECOND)) if stamped else 0
        message = some_trajectory(rng, first_ns, degree, NOW_NS + ahead_ns if stamped else 0)
        measured = {
            name: Measured(
                rng.uniform(-1, 1) + (2 * math.pi * rng.integers(-3, 4) if name == 'spin' else 0),
                rng.uniform(-1, 1),
                0,
            )
            for name in JOINTS
        }
        plan = plan_of(message, measured, allowance)
        assert plan.entry is Entry.APPROACH
        path, tolerance = certified(message, plan)
        later_ns = int(rng.integers(0, allowance.max_wait_ns + allowance.max_start_delay_ns + 1))
        # As far off as the check lets pass, and as much again until the controller begins.
        faster = 2 * allowance.max_velocity_drift
        state = moved(rng, measured, allowance.max_drift, faster)
        played = Played(message, NOW_NS + later_ns, state, reads_velocity)
        (begin_ns, _), (first_at_ns, _), *_ = played.knots
        T = int(path.knots_ns[1])
        for s in np.linspace(0.0, 1.0, 41)[:-1]:
            q = played.at(begin_ns + round(s * (first_at_ns - begin_ns)))
            off = distance(q, message, path, round(s * T)) / (tolerance + ROUNDING)
            assert (off <= 1.0).all()
            closest = max(closest, off.max())
        for after_ns in range(0, 2 * SECOND, SECOND // 20):
            q = played.at(first_at_ns + after_ns)
            assert (distance(q, message, path, T + after_ns) <= ROUNDING).all()
    # The bound is not far above what happens.
    assert closest > 0.7


@pytest.mark.parametrize('v0', [0.0, 1.0])
def test_each_term_of_the_bound_is_reached(v0: float) -> None:
    exact = dataclasses.replace(ALLOWANCE, max_drift=0.0, max_velocity_drift=0.0)
    later_ns = exact.max_wait_ns + exact.max_start_delay_ns
    message = straight(SECOND, NOW_NS + SECOND)
    message.points[0].velocities = [1.0 - v0] * 3
    measured = {name: Measured(0.0, v0, 0) for name in JOINTS}
    path, tolerance = certified(message, plan_of(message, measured, exact))
    played = Played(message, NOW_NS + later_ns, dict.fromkeys(JOINTS, (0.0, v0)))
    (begin_ns, _), (end_ns, _), *_ = played.knots
    off = [
        distance(
            played.at(begin_ns + (end_ns - begin_ns) * k // 300),
            message,
            path,
            int(path.knots_ns[1]) * k // 300,
        )
        for k in range(300)
    ]
    largest = np.max(off, axis=0)
    assert (largest <= tolerance + ROUNDING).all()
    assert (largest >= 0.99 * tolerance).all()


def test_a_velocity_that_changes_before_and_after_the_check_is_covered() -> None:
    message = straight(5 * SECOND)
    plan = plan_of(message, STILL)
    drift = ALLOWANCE.max_velocity_drift
    plan.check(NOW_NS, {name: Measured(0.0, 0.999 * drift, 0) for name in JOINTS})
    path, tolerance = certified(message, plan)
    played = Played(message, NOW_NS, dict.fromkeys(JOINTS, (0.0, 1.999 * drift)))
    for t in range(0, 5 * SECOND, SECOND // 10):
        assert (distance(played.at(NOW_NS + t), message, path, t) <= tolerance).all()


@pytest.mark.parametrize('degree', [1, 3, 5])
def test_what_begins_in_the_middle_is_covered(degree: int) -> None:
    rng = np.random.default_rng(degree)
    begun = 0
    for _ in range(200):
        first_ns = int(rng.integers(0, SECOND))
        past_ns = int(rng.integers(first_ns + SECOND // 10, first_ns + 2 * SECOND))
        message = some_trajectory(rng, first_ns, degree, NOW_NS - past_ns)
        on_path = Played(message, NOW_NS, dict.fromkeys(JOINTS, (0.0, 0.0)))
        q = dict(zip(message.joint_names, on_path.at(NOW_NS), strict=True))
        measured = {name: Measured(q[name] + rng.uniform(-0.02, 0.02), 0.0, 0) for name in JOINTS}
        allowance = dataclasses.replace(ALLOWANCE, max_start_delay_ns=SECOND // 100)
        try:
            plan = plan_of(message, measured, allowance)
            plan.check(NOW_NS, measured)
        except TrajectoryError as error:
            assert error.reason in (Reason.START_STATE_MISMATCH, Reason.STATE_CHANGED)
            continue
        begun += 1
        assert plan.entry is Entry.MIDDLE
        path, tolerance = certified(message, plan)
        for later_ns in (-allowance.max_start_delay_ns, 0, allowance.max_start_delay_ns):
            begin_ns = NOW_NS + later_ns
            t = begin_ns - (NOW_NS - past_ns) - first_ns
            played = Played(message, begin_ns, {n: (m.position, 0.0) for n, m in measured.items()})
            if t <= 2 * SECOND:
                assert (distance(played.at(begin_ns), message, path, t) <= ROUNDING).all()
                # The robot itself.
                robot = np.array([measured[name].position for name in path.joint_names])
                assert (np.abs(robot - path.position(t)) <= tolerance + ROUNDING).all()
    assert begun > 50


def test_a_joint_that_is_not_continuous_after_all_is_not_turned() -> None:
    message = straight(0, NOW_NS - SECOND // 2)
    allowance = dataclasses.replace(
        ALLOWANCE, continuous_joints=frozenset({'turn', 'spin'}), max_start_delay_ns=SECOND // 1000
    )
    measured = {name: Measured(0.5, 0.0, 0) for name in JOINTS}
    certified(message, plan_of(message, measured, allowance))
    certified(
        message, plan_of(message, measured | {'spin': Measured(0.5 - math.tau, 0.0, 0)}, allowance)
    )
    # The robot has 'turn' as a joint with limits, which would go back by a whole turn.
    turned = measured | {'turn': Measured(0.5 - math.tau, 0.0, 0)}
    with pytest.raises(TrajectoryError) as caught:
        certified(message, plan_of(message, turned, allowance))
    assert caught.value.reason is Reason.START_STATE_MISMATCH


def test_what_begins_at_once_is_covered() -> None:
    rng = np.random.default_rng(0)
    for _ in range(100):
        message = some_trajectory(rng, 0, 3)
        target = dict(zip(message.joint_names, message.points[0].positions, strict=True))
        measured = {
            name: Measured(target[name] + rng.uniform(-0.05, 0.05), 0.0, 0) for name in JOINTS
        }
        plan = plan_of(message, measured)
        assert plan.entry is Entry.AT_ONCE
        path, tolerance = certified(message, plan)
        state = {name: Measured(m.position + 0.01, 0.0, 0) for name, m in measured.items()}
        try:
            plan.check(NOW_NS, state)
        except TrajectoryError as error:
            assert error.reason is Reason.STATE_CHANGED
            continue
        robot = np.array([state[name].position for name in path.joint_names])
        assert (np.abs(robot - path.position(0)) <= tolerance + ROUNDING).all()
        played = Played(message, NOW_NS + 77, {n: (m.position, 0.0) for n, m in state.items()})
        for t in range(0, 2 * SECOND, SECOND // 20):
            q = played.at(NOW_NS + 77 + t)
            assert (distance(q, message, path, t) <= ROUNDING).all()


# What is refused


STILL = {name: Measured(0.0, 0.0, 0) for name in JOINTS}


def straight(first_ns: int, stamp_ns: int = 0, velocities: bool = True) -> JointTrajectory:
    """Return a trajectory from the origin, all joints alike."""
    message = JointTrajectory(joint_names=list(JOINTS))
    message.header.stamp = stamp(stamp_ns)
    for i, q in enumerate((0.0, 1.0)):
        point = JointTrajectoryPoint(positions=[q] * 3)
        point.velocities = [0.0] * 3 if velocities else []
        point.time_from_start = nanoseconds_to_message(first_ns + i * SECOND, Duration)
        message.points.append(point)
    return message


def reason_of(function, *arguments) -> Reason | None:
    try:
        function(*arguments)
    except TrajectoryError as error:
        assert str(error)
        return error.reason
    return None


@pytest.mark.parametrize(
    ('message', 'measured', 'reason'),
    [
        (straight(0), STILL, None),
        (straight(SECOND), STILL, None),
        (straight(0), {}, Reason.STATE_STALE),
        (straight(0), {'turn': STILL['turn'], 'slide': STILL['slide']}, Reason.STATE_STALE),
        (straight(0), STILL | {'turn': Measured(0.051, 0.0, 0)}, Reason.START_STATE_MISMATCH),
        (straight(0), STILL | {'spin': Measured(2 * math.pi, 0.0, 0)}, None),
        (
            straight(0),
            STILL | {'turn': Measured(2 * math.pi, 0.0, 0)},
            Reason.START_STATE_MISMATCH,
        ),
        (straight(SECOND), STILL | {'turn': Measured(3.11, 0.0, 0)}, Reason.START_STATE_MISMATCH),
        (straight(SECOND), STILL | {'spin': Measured(3.15, 0.0, 0)}, Reason.START_STATE_MISMATCH),
        (straight(SECOND), STILL | {'turn': Measured(3.0, 0.0, 0)}, None),
        (straight(SECOND), STILL | {'turn': Measured(0.0, math.nan, 0)}, Reason.STATE_INCOMPLETE),
        (
            straight(SECOND, velocities=False),
            STILL | {'turn': Measured(0.0, math.nan, 0)},
            None,
        ),
        (straight(0, -SECOND), STILL, Reason.STAMP_INVALID),
        (straight(0, NOW_NS - 2 * SECOND), STILL, Reason.ENDS_IN_PAST),
        (straight(0, NOW_NS), STILL, Reason.STAMP_UNCERTAIN),
        (straight(0, NOW_NS + SECOND // 20), STILL, Reason.STAMP_UNCERTAIN),
        (straight(0, NOW_NS + SECOND // 20 + 1), STILL, None),
        (straight(SECOND, NOW_NS - SECOND), STILL, Reason.STAMP_UNCERTAIN),
        (straight(0, NOW_NS - SECOND // 2), STILL, Reason.START_STATE_MISMATCH),
    ],
)
def test_plan(
    message: JointTrajectory, measured: Mapping[str, Measured], reason: Reason | None
) -> None:
    assert reason_of(plan_of, message, measured) is reason


def test_accelerations_that_the_controller_reads_are_unknown() -> None:
    message = straight(SECOND)
    message.points[0].accelerations = [0.0] * 3
    message.points[1].accelerations = [0.0] * 3
    reads = dataclasses.replace(ALLOWANCE, reads_acceleration=True)
    assert reason_of(plan_of, message, STILL, reads) is Reason.STATE_INCOMPLETE
    assert reason_of(plan_of, message, STILL) is None
    message.points[0].accelerations = []
    assert reason_of(plan_of, message, STILL, reads) is None


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        ({}, None),
        ({'turn': Measured(0.019, 0.0, 0)}, None),
        ({'turn': Measured(0.021, 0.0, 0)}, Reason.STATE_CHANGED),
        # 0.2 rad/s more than nothing for 50 ms are 0.01 rad, and as much for 50 ms of age.
        ({'turn': Measured(0.011, 0.0, SECOND // 20)}, Reason.STATE_CHANGED),
        ({'turn': Measured(0.009, 0.0, SECOND // 20)}, None),
        ({'turn': Measured(0.0, 0.19, 0)}, None),
        ({'turn': Measured(0.0, 0.21, 0)}, Reason.STATE_CHANGED),
        ({'turn': Measured(0.0, math.nan, 0)}, Reason.STATE_CHANGED),
        ({'turn': Measured(math.nan, 0.0, 0)}, Reason.STATE_CHANGED),
        ({'spin': Measured(2 * math.pi + 0.019, 0.0, 0)}, None),
        ({'gripper': Measured(0.031, 0.0, 0)}, Reason.STATE_CHANGED),
        ({'gripper': Measured(0.019, 0.0, 0)}, None),
    ],
)
def test_check_of_an_approach(change: dict[str, Measured], reason: Reason | None) -> None:
    before = STILL | {'gripper': Measured(0.0, 0.0, 0)}
    plan = plan_of(straight(SECOND), before)
    assert reason_of(plan.check, NOW_NS, before | change) is reason


def test_what_is_not_fresh_any_more_is_refused() -> None:
    before = STILL | {'gripper': Measured(0.0, 0.0, 0)}
    plan = plan_of(straight(0), before)
    for name in before:
        fresh = {other: state for other, state in before.items() if other != name}
        assert reason_of(plan.check, NOW_NS, fresh) is Reason.STATE_STALE


@pytest.mark.parametrize(
    ('jump_ns', 'reason'),
    [
        (SECOND // 4, None),
        (-SECOND // 4, None),
        (SECOND, Reason.STAMP_UNCERTAIN),
        (-SECOND, Reason.STAMP_UNCERTAIN),
    ],
)
def test_a_clock_that_jumps_moves_a_stamp(jump_ns: int, reason: Reason | None) -> None:
    plan = plan_of(straight(SECOND, NOW_NS + 5 * SECOND), STILL)
    assert reason_of(plan.check, NOW_NS + jump_ns, STILL) is reason
    # Without a stamp it does not matter.
    assert reason_of(plan_of(straight(SECOND), STILL).check, NOW_NS + jump_ns, STILL) is None


def test_an_entry_that_changes_is_refused() -> None:
    plan = plan_of(straight(0, NOW_NS + SECOND // 10), STILL)
    assert plan.entry is Entry.APPROACH
    assert reason_of(plan.check, NOW_NS + SECOND // 4, STILL) is Reason.STAMP_UNCERTAIN


# How far off the path


def test_farthest_bounds_every_sample() -> None:
    rng = np.random.default_rng(1)
    for k in range(100):
        message = some_trajectory(rng, int(rng.integers(0, SECOND)), (1, 3, 5)[k % 3])
        trajectory = trajectory_from_message(message)
        played = Played(message, 0, dict.fromkeys(JOINTS, (0.0, 0.0)))
        q = rng.uniform(-1, 1, 3)
        low = int(rng.integers(trajectory.times_ns[0], trajectory.times_ns[-1]))
        high = low + int(10 ** rng.uniform(0, 9.3))
        bound = farthest(trajectory, q, (low, high))
        samples = [
            np.abs(q - played.at(int(t)))
            for t in np.linspace(low, min(high, int(trajectory.times_ns[-1])), 50)
        ]
        assert (bound >= np.max(samples, axis=0) - 1e-12).all()
        if high - low < SECOND // 1000:
            np.testing.assert_allclose(bound, samples[0], atol=0.01)


def test_farthest_outside_the_path_is_from_its_end() -> None:
    trajectory = trajectory_from_message(straight(SECOND))
    q = np.array([2.0, 0.0, -1.0])
    np.testing.assert_allclose(farthest(trajectory, q, (-5, 0)), [2.0, 0.0, 1.0], atol=1e-9)
    after = farthest(trajectory, q, (3 * SECOND, 4 * SECOND))
    np.testing.assert_allclose(after, [1.0, 1.0, 2.0], atol=1e-9)
    single = trajectory_from_message(
        JointTrajectory(joint_names=['turn'], points=[JointTrajectoryPoint(positions=[1.0])])
    )
    assert farthest(single, np.array([3.0]), (0, 5)).tolist() == [2.0]
