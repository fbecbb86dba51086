"""The exact curve of every joint, recomputed from the values of a trajectory."""

from collections.abc import Sequence
from dataclasses import dataclass

from flint import arb, arb_poly, fmpq, fmpq_poly

from trajectory_guard.cell.robot import Joint
from trajectory_guard.paths.trajectory import JointState, Trajectory
from trajectory_guard.verify.invalid import invalid
from trajectory_guard.verify.knots import approach, Knot, known_positions, points, rational

NANOSECONDS = 10**9

# Hermite bases on s in [0, 1]: what the value, the velocity times h and the acceleration times h^2
# of the start of a segment of h seconds contribute, then the same of its end.
_HALF = fmpq(1, 2)
_LINEAR = [fmpq_poly([1, -1])], [fmpq_poly([0, 1])]
_CUBIC = (
    [fmpq_poly([1, 0, -3, 2]), fmpq_poly([0, 1, -2, 1])],
    [fmpq_poly([0, 0, 3, -2]), fmpq_poly([0, 0, -1, 1])],
)
_QUINTIC = (
    [
        fmpq_poly([1, 0, 0, -10, 15, -6]),
        fmpq_poly([0, 1, 0, -6, 8, -3]),
        fmpq_poly([0, 0, 1, -3, 3, -1]) * _HALF,
    ],
    [
        fmpq_poly([0, 0, 0, 10, -15, 6]),
        fmpq_poly([0, 0, 0, -4, 7, -3]),
        fmpq_poly([0, 0, 0, 1, -2, 1]) * _HALF,
    ],
)
_BASES = _LINEAR, _CUBIC, _QUINTIC


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """
    The motion of all movable joints, one polynomial a segment and joint.

    :param joints: n movable joints of the robot.
    :param columns: column of each commanded joint in the knots.
    :param held: position of each joint that nothing moves [rad or m].
    :param knots: K >= 2 ends of the segments; equal times only where nothing moves.
    :param turns: what whole turns add to a column of the first knot [rad].
    """

    joints: tuple[Joint, ...]
    columns: dict[str, int]
    held: dict[str, fmpq]
    knots: tuple[Knot, ...]
    turns: dict[int, arb]

    def moves(self, joint: Joint) -> bool:
        """Return whether the trajectory commands a joint, or the one it mimics in the end."""
        return self._leader(joint)[0] in self.columns

    def exact(self, segment: int, joint: Joint) -> fmpq_poly:
        """Return position over s in [0, 1] of a segment, without whole turns [rad or m]."""
        name, factor, offset = self._leader(joint)
        if name in self.held:
            return fmpq_poly([factor * self.held[name] + offset])
        column = self.columns[name]
        start, end = self.knots[segment : segment + 2]
        h = fmpq(end.time_ns - start.time_ns, NANOSECONDS)
        total = fmpq_poly([0])
        for knot, basis in zip((start, end), self._basis(segment), strict=True):
            for k, polynomial in enumerate(basis):
                total += polynomial * (knot.carried[k][column] * h**k)
        return factor * total + offset

    def on(self, segment: int, numerator: int, level: int) -> list[arb_poly]:
        """
        Return the positions over tau in [-1, 1] on [numerator, numerator + 1] / 2^level.

        :returns: n polynomials with balls that contain the exact coefficients [rad or m].
        """
        half = fmpq(1, 1 << (level + 1))
        s = fmpq_poly([(2 * numerator + 1) * half, half])
        positions = [arb_poly(self.exact(segment, joint)(s)) for joint in self.joints]
        if segment == 0 and self.turns:
            share = arb_poly(self._basis(0)[0][0](s))
            for j, joint in enumerate(self.joints):
                if (turn := self.turns.get(self.columns.get(joint.name, -1))) is not None:
                    positions[j] += turn * share
        return positions

    def _basis(self, segment: int) -> tuple[list[fmpq_poly], ...]:
        """Return the basis of a segment: a derivative counts if both ends carry it."""
        start, end = self.knots[segment : segment + 2]
        return _BASES[min(len(start.carried), len(end.carried)) - 1]

    def _leader(self, joint: Joint) -> tuple[str, fmpq, fmpq]:
        """Return the joint that a joint follows in the end (itself), its factor and offset."""
        factor, offset = fmpq(1), fmpq(0)
        for _ in self.joints:
            if joint.mimic is None:
                return joint.name, factor, offset
            offset += factor * rational(joint.mimic.offset)
            factor *= rational(joint.mimic.multiplier)
            joint = next((j for j in self.joints if j.name == joint.mimic.joint), joint)
        raise invalid(f'robot: joint {joint.name!r} mimics no movable joint')


def curve(joints: Sequence[Joint], trajectory: Trajectory, start: JointState | None) -> Curve:
    """
    Return the curve that the controller plays.

    :param joints: movable joints of the robot.
    :param trajectory: the message.
    :param start: where the robot is at time 0, None if unknown.
    :raises TrajectoryGuardError: trajectory and start do not say where every joint is.
    """
    named = {joint.name: joint for joint in joints if joint.mimic is None}
    columns = {name: i for i, name in enumerate(trajectory.joint_names)}
    known = known_positions(start)
    for name in columns:
        if name not in named:
            raise invalid(f'trajectory: the robot has no joint {name!r} that can be commanded')
    for name in named:
        if name not in columns and name not in known:
            raise invalid(f'trajectory.start: nothing says where joint {name!r} is')
    knots = points(trajectory)
    followed = {joint.mimic.joint for joint in joints if joint.mimic is not None}
    begin, turns = approach(knots[0], [named[name] for name in columns], known, followed)
    knots = begin + knots
    if len(knots) == 1:
        knots = [Knot(knots[0].time_ns, knots[0].carried[:1])] * 2
    held = {name: known[name][0] for name in named if name not in columns}
    return Curve(tuple(joints), columns, held, tuple(knots), turns)
