"""The verifier's exact curve: Hermite conditions in fractions, and the certifier's own curve."""

from fractions import Fraction
import math

from flint import arb, fmpq
import numpy as np
import pytest

from trajectory_guard.cell.robot import Joint, JointType, Mimic
from trajectory_guard.errors import Reason, TrajectoryGuardError
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.paths.trajectory import JointState, Point, Trajectory
from trajectory_guard.verify.curve import curve
from trajectory_guard.verify.series import precision

SECOND = 10**9


def joint(name, kind=JointType.REVOLUTE, mimic=None):
    """Return a joint whose place does not matter."""
    axis = np.array([0.0, 0.0, 1.0])
    return Joint(name, kind, 'a', name, np.eye(4), axis, -math.inf, math.inf, mimic)


JOINTS = [
    joint('a'),
    joint('b', JointType.CONTINUOUS),
    joint('c', JointType.PRISMATIC),
    joint('held'),
    joint('mimic', mimic=Mimic('a', -0.7, 0.2)),
    joint('second', mimic=Mimic('mimic', 3.0, -0.1)),
    joint('still', mimic=Mimic('held', 2.0, 1.0)),
]
START = JointState(('held', 'other'), np.array([0.3, 7.0]))


def random_trajectory(rng, points, names=('c', 'a', 'b'), first=0):
    """Return points that carry none, one or two derivatives each."""
    times = np.cumsum(rng.integers(1, 3 * SECOND, points))
    times += first - times[0]
    carried = rng.integers(0, 3, points)
    n = len(names)
    return Trajectory.from_points(
        names,
        [
            Point(
                int(t),
                rng.normal(size=n),
                rng.normal(size=n) if k > 0 else (),
                rng.normal(size=n) if k > 1 else (),
            )
            for t, k in zip(times, carried, strict=True)
        ],
    )


def fraction(value):
    """Return an exact number of flint or numpy as a Fraction."""
    if isinstance(value, fmpq):
        return Fraction(int(value.p), int(value.q))
    return Fraction(float(value))


def evaluated(polynomial, s, derivative):
    """Return a derivative of a polynomial at s, exactly."""
    for _ in range(derivative):
        polynomial = polynomial.derivative()
    return fraction(polynomial(fmpq(s)))


@pytest.mark.parametrize('seed', range(10))
def test_hermite_conditions_hold_exactly(seed):
    """Ends, and what both ends carry, are met; the degree leaves no other choice."""
    rng = np.random.default_rng(seed)
    trajectory = random_trajectory(rng, 5)
    found = curve(JOINTS, trajectory, START)
    tables = (trajectory.positions, trajectory.velocities, trajectory.accelerations)
    carried = 1 + trajectory.has_velocities.astype(int) + trajectory.has_accelerations
    for segment in range(4):
        h = Fraction(int(np.diff(trajectory.times_ns)[segment]), SECOND)
        order = min(carried[segment : segment + 2])
        for j in range(3):
            column = trajectory.joint_names.index(JOINTS[j].name)
            polynomial = found.exact(segment, JOINTS[j])
            assert polynomial.degree() <= 2 * order - 1
            for end in (0, 1):
                for k in range(order):
                    expected = fraction(tables[k][segment + end, column]) * h**k
                    assert evaluated(polynomial, end, k) == expected


@pytest.mark.parametrize('seed', range(10))
@pytest.mark.parametrize('approached', [False, True])
def test_the_certifiers_curve_is_this_one(seed, approached):
    """The certifier's coefficients are off by no more than it says, and its knots are the same."""
    rng = np.random.default_rng(seed)
    trajectory = random_trajectory(rng, 4, first=SECOND if approached else 0)
    start = START
    if approached:
        names = ('held', 'a', 'b', 'c')
        velocities = rng.normal(size=4) if seed % 2 else None
        position = np.concatenate([[0.3], rng.normal(size=3)])
        position[2] += 2.0 * math.pi * rng.integers(-3, 4)
        start = JointState(names, position, velocities)
    path = joint_path(
        JOINTS, trajectory, start, check_joint_limits=False, allow_nonzero_end_velocity=True
    )
    with precision():
        found = curve(JOINTS, trajectory, start)
        assert [knot.time_ns for knot in found.knots] == path.knots_ns.tolist()
        for segment in range(len(path.knots_ns) - 1):
            # tau = 2 s - 1
            for j, polynomial in enumerate(found.on(segment, 0, 0)):
                theirs = path.coefficients[segment, j]
                error = path.coefficient_error[segment, j] + 1e-30
                for s in (0.0, 0.25, 0.8, 1.0):
                    value = sum(arb(c) * arb(s) ** k for k, c in enumerate(theirs))
                    assert abs(polynomial(2 * arb(s) - 1) - value) < error * 1.001
    assert [found.moves(joint) for joint in JOINTS] == path.in_path.tolist()


def test_joints_that_follow_or_hold_are_exact():
    """Mimics of mimics and of held joints are exact multiples."""
    trajectory = random_trajectory(np.random.default_rng(3), 3)
    found = curve(JOINTS, trajectory, START)
    led = found.exact(1, JOINTS[0])
    factor, offset = fmpq(*(-0.7).as_integer_ratio()), fmpq(*(0.2).as_integer_ratio())
    followed = factor * led + offset
    assert found.exact(1, JOINTS[4]) == followed
    assert found.exact(1, JOINTS[5]) == 3 * followed + fmpq(*(-0.1).as_integer_ratio())
    held = fmpq(*(0.3).as_integer_ratio())
    assert found.exact(0, JOINTS[3]).coeffs() == [held]
    assert found.exact(0, JOINTS[6]).coeffs() == [2 * held + 1]


def test_pieces_are_the_curve_on_their_span():
    """The polynomial of a piece is the segment's, on the piece's dyadic span."""
    trajectory = random_trajectory(np.random.default_rng(4), 3)
    with precision():
        found = curve(JOINTS, trajectory, START)
        for numerator, level in ((0, 0), (5, 3), (12345, 20), (2**60 - 1, 60)):
            whole = found.exact(1, JOINTS[1])
            part = found.on(1, numerator, level)[1]
            for tau in (fmpq(-1), fmpq(1, 3), fmpq(1)):
                s = (numerator + (tau + 1) / 2) / fmpq(2) ** level
                value = part(arb(tau))
                assert value.contains(arb(whole(s)).mid())
                assert value.rad() < 1e-30


def test_whole_turns_are_made_the_short_way():
    """A continuous joint starts next to its target; the turn is a ball, not a guess."""
    trajectory = Trajectory.from_points(['b'], [Point(SECOND, [0.5]), Point(2 * SECOND, [1.0])])
    only = [JOINTS[1]]
    with precision():
        found = curve(only, trajectory, JointState(('b',), np.array([0.25 + 6.0 * math.pi])))
        start = found.on(0, 0, 0)[0](arb(-1))
        assert abs(start - 0.25) < 1e-13
        assert start.rad() > 1e-15
        assert found.on(1, 0, 0)[0](arb(-1)).rad() < 1e-30
        near = curve(only, trajectory, JointState(('b',), np.array([0.25])))
        assert not near.turns


def test_a_single_point_stays():
    """One point is one constant segment without length, or the end of an approach."""
    trajectory = Trajectory.from_points(
        ['a', 'b', 'c'], [Point(SECOND, [1.0, 2.0, 3.0], [1.0] * 3)]
    )
    found = curve(JOINTS, trajectory, START)
    assert [knot.time_ns for knot in found.knots] == [SECOND, SECOND]
    assert found.exact(0, JOINTS[2]).coeffs() == [3]
    start = JointState(('a', 'b', 'c', 'held'), np.zeros(4))
    found = curve(JOINTS, trajectory, start)
    assert [knot.time_ns for knot in found.knots] == [0, SECOND]
    assert found.exact(0, JOINTS[2]).degree() == 3


@pytest.mark.parametrize(
    ('names', 'start', 'said'),
    [
        (['a', 'x'], START, "'x'"),
        (['mimic'], START, "'mimic'"),
        (['a', 'b', 'c'], None, "'held'"),
        (['a', 'b', 'c'], JointState(('held', 'a'), np.zeros(2)), "'b'"),
        (['a', 'b', 'c'], JointState(('held', 'a', 'b', 'c'), [0, 0, 3.14, 0]), 'either way'),
    ],
)
def test_what_says_too_little_is_refused(names, start, said):
    """A joint whose place or way is unknown is named."""
    trajectory = Trajectory.from_points(names, [Point(SECOND, [0.0] * len(names))])
    with precision(), pytest.raises(TrajectoryGuardError, match=said) as raised:
        curve(JOINTS, trajectory, start)
    assert raised.value.reason is Reason.CERTIFICATE_INVALID
