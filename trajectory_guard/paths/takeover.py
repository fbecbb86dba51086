"""What a controller plays when it takes a trajectory over from where the robot is then."""

from collections.abc import Mapping
from dataclasses import dataclass
import math

import numpy as np

from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.entry import Allowance, Entry, entry_of, Measured
from trajectory_guard.paths.near_path import farthest
from trajectory_guard.paths.trajectory import Trajectory

_TURN = 2.0 * math.pi

# The largest value of |h10| and |h11|, at s = 1/3 and s = 2/3.
_STEEPEST = 4.0 / 27.0

# Nearer than this to half a turn it is open which way round a continuous joint goes [rad].
_HALF_TURN_BAND = 0.01

# A joint that is farther off is taken as it is, and refused.
_MOST_TURNS = 2.0**10

# Sums of a few doubles, each rounded, stay below this much more than what they should be.
_UP = 1.0 + 2.0**-40


@dataclass(frozen=True, slots=True, eq=False)
class Takeover:
    """
    A trajectory as the controller plays it, as far as that is known before it begins.

    The path to certify starts at time 0: with an APPROACH a point is put there, the state
    ``positions`` with ``velocities``, and point 0 of the trajectory comes ``approach_ns`` later;
    else point 0 is there. All times between points stay.

    **Why a free path with this much more tracking tolerance covers what is played.** The
    trajectory's own segments are played as they are certified: only the instant at which they
    begin may differ, which no obstacle that stands still takes notice of. The approach may differ.
    With s in [0, 1] it is the Hermite polynomial

        q(s) = h00(s) q0 + h01(s) q1 + T (h10(s) v0 + h11(s) v1),

    h10 = h11 = 0 if it is linear. Certified are q0, v0 and T, played are q0 + dq, v0 + dv and
    T + dT. At the same s the two differ by h00 dq + h10 ((T + dT) dv + dT v0) + h11 dT v1. Since
    h00 lies in [0, 1], linear and cubic, and |h10| = s (1 - s)^2, |h11| = s^2 (1 - s) are at most
    4/27, the difference is at most

        |dq| + 4/27 ((T + |dT|) |dv| + |dT| (|v0| + |v1|)).

    |dq| is at most ``max_drift``: `check` counts the way that is still to come. |dv| is at most
    twice ``max_velocity_drift``: `check` lets pass one by which the last velocity that was
    measured is off v0, and until the controller begins it may change by one more.
    dT is 0 without a stamp. With one, the approach ends at a given instant, so it is as much
    shorter as it begins later. A cubic approach needs velocities of both the state and point 0, a
    quintic one accelerations of both; a controller that reads accelerations is refused where they
    would count, for no joint state has them. [JTC Jazzy, trajectory.cpp: Trajectory::sample.]

    Without an approach the robot starts off the path by what is measured, and that much the
    tracking error may be larger: ``cover`` is how far it may be off.

    Joints that the trajectory does not name stay where they are; that they do is checked
    against ``max_drift``, but no tracking tolerance covers it.

    :param trajectory: the message.
    :param stamp_ns: its stamp [ns]; 0: begin when it arrives.
    :param now_ns: when this was planned, on the clock of the stamp [ns].
    :param entry: where the controller enters.
    :param approach_ns: T, how long the approach takes if it began now [ns]; 0: there is none.
    :param positions: (J,) where the trajectory's joints are, whole turns of continuous joints
        taken off [rad or m].
    :param velocities: (J,) how fast they move, if that shapes the approach [rad/s or m/s].
    :param cover: (J,) what the tracking tolerance must be larger by [rad or m].
    :param measured: the state of all joints that was certified.
    :param allowance: what may differ.
    """

    trajectory: Trajectory
    stamp_ns: int
    now_ns: int
    entry: Entry
    approach_ns: int
    positions: tuple[float, ...]
    velocities: tuple[float, ...] | None
    cover: tuple[float, ...]
    measured: Mapping[str, Measured]
    allowance: Allowance

    def check(self, now_ns: int, measured: Mapping[str, Measured]) -> None:
        """
        Check that the proof still holds if the trajectory is passed on now.

        :param now_ns: the time on the clock of the stamp [ns].
        :param measured: the joints of which the state is fresh.
        :raises TrajectoryError: it does not: a joint is not where it was, or its state is not
            fresh, or the instant of the stamp is not where it was.
        """
        allowance = self.allowance
        if self.stamp_ns and abs(now_ns - self.now_ns) > allowance.max_wait_ns:
            raise TrajectoryError(
                Reason.STAMP_UNCERTAIN,
                f'the clock went from {self.now_ns} to {now_ns} ns meanwhile',
            )
        entry, _ = entry_of(self.trajectory, self.stamp_ns, now_ns, allowance)
        if entry is not self.entry:
            raise TrajectoryError(
                Reason.STAMP_UNCERTAIN,
                f'the controller was to enter the path by {self.entry.value}, '
                f'now it would by {entry.value}',
            )
        for name in self.measured:
            _require(name, measured)
        self._check_commanded(now_ns, measured)
        for name in self.measured.keys() - set(self.trajectory.joint_names):
            before = self.measured[name].position
            self._check_near(
                name, before, abs(measured[name].position - before), measured, allowance.max_drift
            )

    def _check_commanded(self, now_ns: int, measured: Mapping[str, Measured]) -> None:
        names, allowance = self.trajectory.joint_names, self.allowance
        off = self._distances(now_ns, measured)
        if self.entry is Entry.APPROACH:
            limits = (allowance.max_drift,) * len(names)
        else:
            limits = self.cover
        for name, place, distance, limit in zip(names, self.positions, off, limits, strict=True):
            self._check_near(name, place, distance, measured, limit)
        for name, velocity in zip(names, self.velocities or (), strict=False):
            change = abs(measured[name].velocity - velocity)
            if not change <= allowance.max_velocity_drift:
                raise TrajectoryError(
                    Reason.STATE_CHANGED,
                    f'joint {name!r} moved at {velocity:.9g} and now at '
                    f'{measured[name].velocity:.9g}; max_velocity_drift is '
                    f'{allowance.max_velocity_drift:g}',
                )

    def _distances(self, now_ns: int, measured: Mapping[str, Measured]) -> tuple[float, ...]:
        """Return how far each joint is off where the controller would begin, (J,)."""
        names = self.trajectory.joint_names
        turned = _turned(self.trajectory, self.positions, measured, self.allowance)
        if self.entry is Entry.MIDDLE:
            return _off_path(self.trajectory, self.stamp_ns, now_ns, turned, self.allowance)
        places = (
            self.positions
            if self.entry is Entry.APPROACH
            else self.trajectory.positions[0].tolist()
        )
        return tuple(abs(turned[i] - places[i]) for i in range(len(names)))

    def _check_near(
        self,
        name: str,
        place: float,
        distance: float,
        measured: Mapping[str, Measured],
        limit: float,
    ) -> None:
        """
        Refuse a joint that is, or may be when the controller begins, farther off than the limit.

        Since it was measured, and until the controller begins, it moves at most as fast as it was
        measured, or as slow as what cannot be measured, and max_velocity_drift more.
        """
        joint, allowance = measured[name], self.allowance
        speed = 0.0 if math.isnan(joint.velocity) else abs(joint.velocity)
        ahead_s = (joint.age_ns + allowance.max_start_delay_ns) / 1e9
        reach = (distance + (speed + allowance.max_velocity_drift) * ahead_s) * _UP
        if not reach <= limit:
            raise TrajectoryError(
                Reason.STATE_CHANGED,
                f'joint {name!r} is at {joint.position:.9g}, certified from {place:.9g}, and '
                f'moves at {joint.velocity:.9g}: off by up to {reach:.3g} in {ahead_s:.3g} s, '
                f'{limit:.3g} is allowed',
            )


def takeover(
    trajectory: Trajectory,
    stamp_ns: int,
    now_ns: int,
    measured: Mapping[str, Measured],
    allowance: Allowance,
) -> Takeover:
    """
    Plan how the controller takes a trajectory over.

    :param trajectory: the message.
    :param stamp_ns: its stamp [ns]; 0: begin when it arrives.
    :param now_ns: the time on the clock of the stamp [ns].
    :param measured: the joints of which the state is fresh.
    :param allowance: what may differ until the controller begins.
    :raises TrajectoryError: it cannot be known well enough what the controller will play.
    """
    names = trajectory.joint_names
    for name in names:
        _require(name, measured)
    entry, approach_ns = entry_of(trajectory, stamp_ns, now_ns, allowance)
    targets = trajectory.positions[0].tolist()
    positions = _turned(trajectory, targets, measured, allowance)
    velocities = None
    if entry is Entry.APPROACH:
        _check_half_turns(names, positions, targets, allowance)
        velocities = _velocities(trajectory, measured, allowance)
        cover = _approach_cover(trajectory, stamp_ns, approach_ns, velocities, allowance)
    elif entry is Entry.AT_ONCE:
        off = [abs(q - q0) for q, q0 in zip(positions, targets, strict=True)]
        _check_start(names, off, allowance)
        cover = tuple(
            min((distance + allowance.max_drift) * _UP, allowance.allowed_start_tolerance)
            for distance in off
        )
    else:
        _check_start(
            names, _off_path(trajectory, stamp_ns, now_ns, positions, allowance), allowance
        )
        cover = (allowance.allowed_start_tolerance,) * len(names)
    return Takeover(
        trajectory=trajectory,
        stamp_ns=stamp_ns,
        now_ns=now_ns,
        entry=entry,
        approach_ns=approach_ns,
        positions=positions,
        velocities=velocities,
        cover=cover,
        measured=dict(measured),
        allowance=allowance,
    )


def _require(name: str, measured: Mapping[str, Measured]) -> None:
    if name not in measured:
        raise TrajectoryError(Reason.STATE_STALE, f'there is no fresh state of joint {name!r}')


def _turned(
    trajectory: Trajectory,
    targets: tuple[float, ...] | list[float],
    measured: Mapping[str, Measured],
    allowance: Allowance,
) -> tuple[float, ...]:
    """Return the measured positions, those of continuous joints by whole turns near targets."""
    turned = []
    for name, target in zip(trajectory.joint_names, targets, strict=True):
        position = measured[name].position
        turns = (target - position) / _TURN
        if name in allowance.continuous_joints and abs(turns) < _MOST_TURNS:
            position += round(turns) * _TURN
        turned.append(position)
    return tuple(turned)


def _check_half_turns(
    names: tuple[str, ...],
    positions: tuple[float, ...],
    targets: list[float],
    allowance: Allowance,
) -> None:
    """
    Refuse an approach by half a turn or more.

    A continuous joint goes the short way, any other goes straight; where both are the same, it
    need not be known which of them it is. (Nobody here knows what joints the robot has.)
    """
    most = math.pi - _HALF_TURN_BAND - allowance.max_drift
    for name, position, target in zip(names, positions, targets, strict=True):
        if not abs(target - position) < most:
            raise TrajectoryError(
                Reason.START_STATE_MISMATCH,
                f'joint {name!r} is at {position:.9g} and point 0 at {target:.9g}: half a turn or '
                'more, so that a continuous joint would go the other way; add a point in between',
            )


def _velocities(
    trajectory: Trajectory, measured: Mapping[str, Measured], allowance: Allowance
) -> tuple[float, ...] | None:
    """Return the velocities that shape the approach; None: it is linear."""
    if not (allowance.reads_velocity and trajectory.has_velocities[0]):
        return None
    if allowance.reads_acceleration and trajectory.has_accelerations[0]:
        raise TrajectoryError(
            Reason.STATE_INCOMPLETE,
            'the approach depends on accelerations of the robot, which no joint state has; '
            'leave them out of point 0, or put it at time 0',
        )
    for name in trajectory.joint_names:
        if math.isnan(measured[name].velocity):
            raise TrajectoryError(
                Reason.STATE_INCOMPLETE,
                f'the approach depends on the velocity of joint {name!r}, which is not measured',
            )
    return tuple(measured[name].velocity for name in trajectory.joint_names)


def _approach_cover(
    trajectory: Trajectory,
    stamp_ns: int,
    approach_ns: int,
    velocities: tuple[float, ...] | None,
    allowance: Allowance,
) -> tuple[float, ...]:
    """Return the bound of `Takeover` on what the approach may differ, (J,)."""
    # What the controller computes for a state less whole turns is another float: off by less than
    # 2^-37 for so few turns, by the bound that `start_state.with_start` derives.
    drift = allowance.max_drift + 2.0**-36 * bool(allowance.continuous_joints)
    if velocities is None:
        return (drift * _UP,) * len(trajectory.joint_names)
    later_s = 0.0
    if stamp_ns:
        later_s = (allowance.max_wait_ns + allowance.max_start_delay_ns) / 1e9
    longest_s = approach_ns / 1e9 + later_s
    return tuple(
        (
            drift
            + _STEEPEST
            * (longest_s * 2.0 * allowance.max_velocity_drift + later_s * (abs(v0) + abs(v1)))
        )
        * _UP
        for v0, v1 in zip(velocities, trajectory.velocities[0].tolist(), strict=True)
    )


def _check_start(
    names: tuple[str, ...], off: tuple[float, ...] | list[float], allowance: Allowance
) -> None:
    for name, distance in zip(names, off, strict=True):
        if not distance <= allowance.allowed_start_tolerance:
            raise TrajectoryError(
                Reason.START_STATE_MISMATCH,
                f'joint {name!r} is off the path by {distance:.6g} where the controller begins; '
                f'allowed_start_tolerance is {allowance.allowed_start_tolerance:g}',
            )


def _off_path(
    trajectory: Trajectory,
    stamp_ns: int,
    now_ns: int,
    positions: tuple[float, ...],
    allowance: Allowance,
) -> tuple[float, ...]:
    """Return how far the joints are off the path at any instant the controller may begin, (J,)."""
    at_ns = now_ns - stamp_ns
    window = (at_ns - allowance.max_start_delay_ns, at_ns + allowance.max_start_delay_ns)
    return tuple(farthest(trajectory, np.array(positions), window).tolist())
