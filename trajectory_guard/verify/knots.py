"""What the controller interpolates: the points of a trajectory, and the way to the first."""

from collections.abc import Sequence
from typing import NamedTuple

from flint import arb, fmpq

from trajectory_guard.cell.robot import Joint, JointType
from trajectory_guard.paths.trajectory import JointState, Trajectory
from trajectory_guard.verify.invalid import invalid

# The controller adds whole turns in doubles: its float errs by at most 4 u of their size.
_TURN_ROUNDING = fmpq(1, 2**51)
# Nearer to half a turn than this the direction is open [rad].
_HALF_TURN_BAND = fmpq(1, 100)


class Knot(NamedTuple):
    """
    One end of a segment.

    :param time_ns: [ns].
    :param carried: rows of positions and, as far as the point carries them, velocities and
        accelerations; one exact number a commanded joint.
    """

    time_ns: int
    carried: tuple[list[fmpq], ...]


def rational(value: float) -> fmpq:
    """Return a double as an exact fraction."""
    return fmpq(*value.as_integer_ratio())


def known_positions(start: JointState | None) -> dict[str, tuple[fmpq, fmpq]]:
    """Return position and velocity by joint, at rest where no velocity is known."""
    if start is None:
        return {}
    positions = start.positions.tolist()
    velocities = [0.0] * len(positions) if start.velocities is None else start.velocities.tolist()
    return {
        name: (rational(q), rational(v))
        for name, q, v in zip(start.joint_names, positions, velocities, strict=True)
    }


def points(trajectory: Trajectory) -> list[Knot]:
    """Return the points of a trajectory; the columns are its joints."""
    knots = []
    for i, time_ns in enumerate(trajectory.times_ns.tolist()):
        carried = 1 + int(trajectory.has_velocities[i]) + int(trajectory.has_accelerations[i])
        tables = (trajectory.positions, trajectory.velocities, trajectory.accelerations)[:carried]
        rows = tuple([rational(x) for x in table[i].tolist()] for table in tables)
        knots.append(Knot(time_ns, rows))
    return knots


def approach(
    first: Knot, joints: Sequence[Joint], known: dict[str, tuple[fmpq, fmpq]], followed: set[str]
) -> tuple[list[Knot], dict[int, arb]]:
    """
    Return the knot of the start, if the controller makes a way from it to the first point.

    It carries what the first point carries, the acceleration being zero. Continuous joints go the
    short way: whole turns are added.

    :param joints: the commanded ones, in the order of the columns.
    :param known: position and velocity of the start by joint.
    :param followed: joints that others mimic; turned, they would leave those elsewhere.
    :returns: the knot or nothing, and what the turns add to its positions, by column [rad].
    """
    if first.time_ns == 0 or not any(joint.name in known for joint in joints):
        return [], {}
    turns = {}
    for column, joint in enumerate(joints):
        if joint.name not in known:
            raise invalid(f'trajectory.start: lacks the commanded joint {joint.name!r}')
        if joint.type is JointType.CONTINUOUS:
            turn = _turn(joint.name, known[joint.name][0], first.carried[0][column])
            if turn is not None and joint.name in followed:
                raise invalid(f'trajectory.start: {joint.name!r}, which others mimic, turns')
            if turn is not None:
                turns[column] = turn
    rows = [list(row) for row in zip(*(known[joint.name] for joint in joints), strict=True)]
    rest = [fmpq(0)] * len(joints)
    return [Knot(0, (*rows, rest)[: len(first.carried)])], turns


def _turn(name: str, measured: fmpq, target: fmpq) -> arb | None:
    """Return the whole turns that bring a start next to its target, None for no turn [rad]."""
    whole = 2 * arb.pi()
    turns = ((arb(target) - measured) / whole + fmpq(1, 2)).floor().unique_fmpz()
    if turns is None or not abs(measured + turns * whole - target) < arb.pi() - _HALF_TURN_BAND:
        raise invalid(f'trajectory.start: joint {name!r} may turn either way to point 0')
    if turns == 0:
        return None
    size = abs(measured) + abs(target) + 7 * (abs(turns) + 1)
    return arb(turns * whole, arb(size * _TURN_ROUNDING))
