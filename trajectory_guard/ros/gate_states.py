"""The robot's joints as their states come in, each with its own age."""

from collections.abc import Mapping
import math
from typing import Any, NamedTuple

from trajectory_guard.paths.entry import Measured

# More names than any robot has, so that a broken publisher cannot fill the memory.
MOST_JOINTS = 1000

# A joint that nobody has told of for so long does not belong to the robot any more [ns].
FORGOTTEN_NS = 30 * 1_000_000_000


class _Row(NamedTuple):
    """The last state of one joint: position, velocity, its stamp and when it arrived [ns]."""

    position: float
    velocity: float
    stamp_ns: int
    arrived_ns: int


class JointStates:
    """The last state of every joint, from any number of publishers that each know some."""

    def __init__(self) -> None:
        self._rows: dict[str, _Row] = {}

    def take(self, message: Any, arrived_ns: int) -> None:
        """
        Take a message; joints of which it says nonsense are not known any more.

        :param message: sensor_msgs/JointState.
        :param arrived_ns: when it arrived, on the steady clock [ns].
        """
        names, positions, velocities = message.name, message.position, message.velocity
        count = len(names)
        if len(self._rows) + count > MOST_JOINTS and len({*self._rows, *names}) > MOST_JOINTS:
            return
        stamp_ns = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        if not velocities:
            velocities = (math.nan,) * count
        if len(positions) != count or len(velocities) != count or len(set(names)) != count:
            for name in names:
                self._rows.pop(name, None)
            return
        for name, position, velocity in zip(names, positions, velocities, strict=True):
            if math.isfinite(position) and not math.isinf(velocity):
                self._rows[name] = _Row(position, velocity, stamp_ns, arrived_ns)
            else:
                self._rows.pop(name, None)

    def fresh(self, steady_ns: int, now_ns: int, max_age_ns: int) -> Mapping[str, Measured]:
        """
        Return the joints of which the state is fresh.

        It is if it arrived within the age, and if its stamp is neither older than that, nor by
        more than that in the future. The age that counts is the larger of the two.

        :param steady_ns: the time on the steady clock [ns].
        :param now_ns: the time on the clock of the stamps [ns].
        :param max_age_ns: the age [ns].
        """
        found = {}
        for name, row in self._rows.items():
            age_ns = max(steady_ns - row.arrived_ns, now_ns - row.stamp_ns)
            if age_ns <= max_age_ns and row.stamp_ns - now_ns <= max_age_ns:
                found[name] = Measured(row.position, row.velocity, age_ns)
        return found

    def complaint(self, steady_ns: int, now_ns: int, max_age_ns: int) -> str:
        """
        Say which joint was heard of lately, but is not fresh, or that there is none.

        :param steady_ns: as for `fresh`.
        :param now_ns: as for `fresh`.
        :param max_age_ns: as for `fresh`.
        :returns: the sentence; '': all are fresh.
        """
        for name in [*self._rows]:
            if steady_ns - self._rows[name].arrived_ns > FORGOTTEN_NS:
                del self._rows[name]
        if not self._rows:
            return 'no joint state has arrived'
        fresh = self.fresh(steady_ns, now_ns, max_age_ns)
        for name, row in self._rows.items():
            if name not in fresh:
                arrived, stamp = (steady_ns - row.arrived_ns) / 1e9, (now_ns - row.stamp_ns) / 1e9
                return (
                    f'the state of joint {name!r} arrived {arrived:.3f} s ago, its stamp is '
                    f'{stamp:.3f} s old; max_state_age is {max_age_ns / 1e9:g} s'
                )
        return ''
