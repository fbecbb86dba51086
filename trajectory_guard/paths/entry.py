"""Where a controller enters a path, and what may differ from what was known of that before."""

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.trajectory import Trajectory


class Entry(Enum):
    """Where the controller enters the path: before the first point, at it, or behind it."""

    APPROACH = 'approach'
    AT_ONCE = 'at once'
    MIDDLE = 'middle'


class Measured(NamedTuple):
    """
    One joint as it was last measured.

    :param position: [rad or m].
    :param velocity: [rad/s or m/s]; NaN: not measured.
    :param age_ns: how long ago [ns].
    """

    position: float
    velocity: float
    age_ns: int


@dataclass(frozen=True, slots=True)
class Allowance:
    """
    What may differ between the proof and the moment at which the controller begins.

    :param max_drift: how far a joint may be off the state that was certified [rad or m].
    :param max_velocity_drift: how far its velocity may be off when the trajectory is passed on,
        and how much it may change from when it was measured last until the controller begins
        [rad/s or m/s].
    :param max_start_delay_ns: from passing on to the controller's first sample, and how far the
        instant of that on the controller's clock may be off that of passing on, on the gate's,
        either way: the delay and the difference of the clocks together [ns].
    :param max_wait_ns: from the measurement to passing on [ns].
    :param allowed_start_tolerance: how far a joint may be off the path where the controller does
        not approach it [rad or m].
    :param continuous_joints: joints of which whole turns do not count.
    :param reads_velocity: the controller reads velocities of the robot.
    :param reads_acceleration: the controller reads accelerations of the robot.
    """

    max_drift: float
    max_velocity_drift: float
    max_start_delay_ns: int
    max_wait_ns: int
    allowed_start_tolerance: float
    continuous_joints: frozenset[str] = frozenset()
    reads_velocity: bool = True
    reads_acceleration: bool = False


def entry_of(
    trajectory: Trajectory, stamp_ns: int, now_ns: int, allowance: Allowance
) -> tuple[Entry, int]:
    """
    Return where the controller enters if it is told now, and how long it approaches then [ns].

    With a stamp S it approaches point 0 until S + t_0, if it begins before, else it begins in the
    middle; the controller may see another time by up to the start delay, either way.

    :param trajectory: the message.
    :param stamp_ns: its stamp [ns]; 0: begin when it arrives.
    :param now_ns: the time on the clock of the stamp [ns].
    :param allowance: the start delay.
    :raises TrajectoryError: the controller refuses it, or it is open where it would enter.
    """
    first_ns, last_ns = int(trajectory.times_ns[0]), int(trajectory.times_ns[-1])
    if stamp_ns < 0:
        # The controller's own type of time raises.
        raise TrajectoryError(Reason.STAMP_INVALID, f'header.stamp is negative: {stamp_ns} ns')
    if stamp_ns == 0:
        return (Entry.APPROACH, first_ns) if first_ns > 0 else (Entry.AT_ONCE, 0)
    if stamp_ns + last_ns < now_ns:
        raise TrajectoryError(
            Reason.ENDS_IN_PAST,
            f'the last point is at {stamp_ns + last_ns} ns, it is {now_ns} ns now',
        )
    ahead_ns = stamp_ns + first_ns - now_ns
    if ahead_ns > allowance.max_start_delay_ns:
        return Entry.APPROACH, ahead_ns
    if ahead_ns < -allowance.max_start_delay_ns:
        return Entry.MIDDLE, 0
    raise TrajectoryError(
        Reason.STAMP_UNCERTAIN,
        f'point 0 is due in {ahead_ns} ns, within max_start_delay '
        f'({allowance.max_start_delay_ns} ns): it is open whether the controller approaches it',
    )
