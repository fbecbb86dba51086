"""The answer: intervals that partition [0, T], and one verdict."""

from dataclasses import dataclass, field
from enum import IntEnum

from trajectory_guard.errors import TrajectoryGuardError
from trajectory_guard.settings import Settings

NANOSECONDS = 1_000_000_000


class Status(IntEnum):
    """What is known about an interval; zero is never a permission."""

    UNKNOWN = 0
    FREE = 1
    SUSPECT = 2
    COLLISION = 3


class Verdict(IntEnum):
    """What is known about a whole trajectory; zero is never a permission."""

    REJECTED = 0
    FREE = 1
    SUSPECT = 2
    COLLISION = 3


@dataclass(frozen=True, slots=True)
class Interval:
    """
    A closed span of time and what was proved about it.

    :param start_ns: start from the trajectory's own start [ns].
    :param end_ns: end [ns]; the next interval starts here.
    :param status: FREE and COLLISION are proved for every instant; SUSPECT is neither.
    :param reason: why a suspect interval stayed open (a value of :class:`Reason`).
    :param body: link of the pair with the smallest gap.
    :param obstacle: obstacle of that pair.
    :param at_ns: an instant of the smallest gap found; of the witness in a collision [ns].
    :param location: the place in the robot's root frame: the nearest obstacle point, or the
        witness inside both solids [m].
    :param gap_lower: proved lower bound of the pair's distance over the interval and the tracking
        tolerance, negative when an overlap cannot be excluded [m]; None: unknown. It does not
        speak of the part of a nanosecond by which an end is rounded into a collision.
    :param gap_upper: upper bound of the pair's smallest distance in the interval, negative for a
        proved overlap, 0 where surfaces are proved to cross [m]; None: unknown.
    """

    start_ns: int
    end_ns: int
    status: Status
    reason: str = ''
    body: str = ''
    obstacle: str = ''
    at_ns: int | None = None
    location: tuple[float, float, float] | None = None
    gap_lower: float | None = None
    gap_upper: float | None = None

    def to_dict(self) -> dict:
        """Return the JSON object of the interval, times in seconds."""
        row: dict = {
            'start': self.start_ns / NANOSECONDS,
            'end': self.end_ns / NANOSECONDS,
            'status': self.status.name.lower(),
        }
        if self.reason:
            row['reason'] = self.reason
        if self.body:
            row['body'] = self.body
            row['obstacle'] = self.obstacle
        if self.at_ns is not None:
            row['at'] = self.at_ns / NANOSECONDS
        if self.location is not None:
            row['location'] = list(self.location)
        if self.gap_lower is not None or self.gap_upper is not None:
            row['gap'] = [self.gap_lower, self.gap_upper]
        return row


@dataclass(frozen=True, slots=True)
class ContactMoment:
    """
    A contact that begins or ends, as its features tell.

    The constraint between the two features [Canny 1984] has one sign before `earliest_ns`, the
    other one after `latest_ns`, in the neighbourhood of the interval where the contact begins or
    ends, and is zero in between: proved along the link's rational motion, whose error is counted.
    That these features and no others touch is found, not proved; the interval is.

    :param body: link of the robot.
    :param obstacle: obstacle.
    :param features: which ones of the two touch, in words.
    :param begins: False: the contact ends.
    :param earliest_ns: from the trajectory's own start [ns].
    :param latest_ns: likewise [ns].
    :param location: where, in the robot's root frame [m].
    """

    body: str
    obstacle: str
    features: str
    begins: bool
    earliest_ns: float
    latest_ns: float
    location: tuple[float, float, float]

    def to_dict(self) -> dict:
        """Return the JSON object of the contact, times in seconds."""
        return {
            'body': self.body,
            'obstacle': self.obstacle,
            'features': self.features,
            'begins': self.begins,
            'earliest': self.earliest_ns / NANOSECONDS,
            'latest': self.latest_ns / NANOSECONDS,
            'location': list(self.location),
        }


@dataclass(frozen=True, slots=True)
class Result:
    """
    What the certifier says about one trajectory.

    :param verdict: FREE only if every interval is free.
    :param reason_code: stable code of a rejection, or of the first suspect interval.
    :param message: the same for people.
    :param intervals: partition of [0, duration], in time order; empty when rejected.
    :param tolerance: as requested [m].
    :param clearance: as requested [m].
    :param interpolation: the rule by which the controller turns points into a curve.
    :param robot_hash: SHA-256 of the robot and its meshes.
    :param scene_hash: SHA-256 of the scene.
    :param compute_time: wall-clock time of the certification [s].
    :param pieces: motion pieces examined.
    :param pairs_checked: pairs of a moving link and an obstacle that the verdict covers.
    :param unchecked_pairs: what the verdict does not cover, in words.
    :param warnings: what a user should know and no interval can say.
    :param duration_ns: time of the last point [ns].
    :param contacts: where collisions begin and end, as far as features tell; empty: not asked for.
    :param name: the trajectory's label.
    :param certificate: what proves the intervals, as a JSON object; None: not asked for.
    """

    verdict: Verdict
    reason_code: str = ''
    message: str = ''
    intervals: tuple[Interval, ...] = ()
    tolerance: float = 0.0
    clearance: float = 0.0
    interpolation: str = ''
    robot_hash: str = ''
    scene_hash: str = ''
    compute_time: float = 0.0
    pieces: int = 0
    pairs_checked: int = 0
    unchecked_pairs: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    duration_ns: int = 0
    contacts: tuple[ContactMoment, ...] = ()
    name: str = ''
    certificate: dict | None = field(default=None, repr=False, compare=False)

    @classmethod
    def rejected(
        cls, error: TrajectoryGuardError, settings: Settings | None = None, name: str = ''
    ) -> 'Result':
        """
        Return the answer to a request that cannot be certified.

        :param error: why.
        :param settings: what was asked, if it got that far.
        :param name: the trajectory's label.
        """
        return cls(
            verdict=Verdict.REJECTED,
            reason_code=error.reason.value,
            message=str(error),
            tolerance=settings.tolerance if settings else 0.0,
            clearance=settings.clearance if settings else 0.0,
            name=name,
        )

    def to_dict(self) -> dict:
        """Return the JSON object of the result, the same words as the messages."""
        return {
            'trajectory': self.name,
            'verdict': self.verdict.name.lower(),
            'reason_code': self.reason_code,
            'message': self.message,
            'duration': self.duration_ns / NANOSECONDS,
            'intervals': [interval.to_dict() for interval in self.intervals],
            'tolerance': self.tolerance,
            'clearance': self.clearance,
            'interpolation': self.interpolation,
            'robot_hash': self.robot_hash,
            'scene_hash': self.scene_hash,
            'compute_time': self.compute_time,
            'pieces': self.pieces,
            'pairs_checked': self.pairs_checked,
            'unchecked_pairs': list(self.unchecked_pairs),
            'warnings': list(self.warnings),
            **({'contacts': [one.to_dict() for one in self.contacts]} if self.contacts else {}),
        }
