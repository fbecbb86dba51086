"""What a request asks for, checked once."""

from dataclasses import dataclass
from enum import IntEnum
import math

from trajectory_guard.errors import Reason, RequestError

# A proof at a tolerance below a nanometre would be a statement about rounding, not about robots.
SMALLEST_TOLERANCE = 1e-9
LARGEST_LENGTH = 1e6


class Scope(IntEnum):
    """
    How much of the motion is asked about; what is not looked at is *suspect*, never free.

    ALL: every interval. FIRST: up to the first interval that is not free, in time order. VERDICT:
    until something is known not to be free, wherever that is found first.
    """

    ALL = 0
    FIRST = 1
    VERDICT = 2


class Cover(IntEnum):
    """
    How a motion is enclosed.

    HULL: by the convex hull of its control points and separating planes. BALL: by balls in the
    space of affine displacements [Schroecker & Weber 2014]; it proves no collisions, and writes
    no certificates.
    """

    HULL = 0
    BALL = 1

    @classmethod
    def named(cls, name: str) -> 'Cover':
        """
        Return the cover of a name in lower case.

        :raises RequestError: there is none.
        """
        for cover in cls:
            if name == cover.name.lower():
                return cover
        names = ', '.join(cover.name.lower() for cover in cls)
        raise RequestError(Reason.INVALID_PARAMETER, f'cover {name!r} is not one of {names}')


@dataclass(frozen=True, slots=True)
class Settings:
    """
    The knobs of one certification.

    :param tolerance: gaps larger than this are proved, smaller ones may be *suspect* [m].
    :param clearance: distance that *free* must exceed [m].
    :param tracking_tolerance: how far the robot may follow off the path; one value for every
        joint of the trajectory, or one per joint in the trajectory's order [rad or m].
    :param deadline_ns: wall-clock time for the answer; the rest is *suspect* [ns]; None: no limit.
    :param max_pieces: motion pieces that may be examined; the rest is *suspect*.
    :param scope: how much of the motion is asked about.
    :param cover: how the motion is enclosed.
    :param refine: look closer at suspect intervals, down to what rounding allows: contacts then
        begin and end within nanoseconds or so; not where a certificate is wanted.
    :param want_contacts: name the features that touch where collisions begin and end.
    :param want_certificate: write down what proves each answer.
    :param allowed_start_tolerance: start state against a point 0 at time 0 [rad or m].
    :param joint_limit_tolerance: how far the curve may leave the joint limits [rad or m].
    :param check_joint_limits: False leaves limits unchecked, and the result says so.
    :param allow_nonzero_end_velocity: accept a last point that does not come to rest.
    :raises RequestError: a value is not finite, negative or out of range; the message names it.
    """

    tolerance: float = 1e-4
    clearance: float = 0.0
    tracking_tolerance: tuple[float, ...] = (0.0,)
    deadline_ns: int | None = None
    max_pieces: int = 200_000
    scope: Scope = Scope.ALL
    cover: Cover = Cover.HULL
    refine: bool = True
    want_contacts: bool = False
    want_certificate: bool = False
    allowed_start_tolerance: float = 0.01
    joint_limit_tolerance: float = 1e-6
    check_joint_limits: bool = True
    allow_nonzero_end_velocity: bool = False

    def __post_init__(self) -> None:
        """Refuse what no proof could use."""
        if not SMALLEST_TOLERANCE <= self.tolerance <= LARGEST_LENGTH:
            raise RequestError(
                Reason.INVALID_TOLERANCE,
                f'tolerance must lie in [{SMALLEST_TOLERANCE:g}, {LARGEST_LENGTH:g}] m, '
                f'got {self.tolerance!r}',
            )
        if not 0.0 <= self.clearance <= LARGEST_LENGTH:
            raise RequestError(
                Reason.INVALID_CLEARANCE,
                f'clearance must lie in [0, {LARGEST_LENGTH:g}] m, got {self.clearance!r}',
            )
        if not self.tracking_tolerance:
            raise RequestError(
                Reason.INVALID_TRACKING_TOLERANCE, 'tracking_tolerance must not be empty'
            )
        for value in self.tracking_tolerance:
            if not (math.isfinite(value) and value >= 0.0):
                raise RequestError(
                    Reason.INVALID_TRACKING_TOLERANCE,
                    f'tracking_tolerance must be finite and >= 0, got {value!r}',
                )
        if self.want_contacts and (self.clearance or any(self.tracking_tolerance)):
            raise RequestError(
                Reason.INVALID_PARAMETER,
                'contacts are named without clearance and tracking_tolerance only: with them it '
                'is not the bodies that touch',
            )
        if self.want_certificate and self.cover is not Cover.HULL:
            raise RequestError(
                Reason.INVALID_PARAMETER,
                f'certificates are written of the cover hull, not {self.cover.name.lower()}',
            )
        if self.deadline_ns is not None and self.deadline_ns < 0:
            raise RequestError(
                Reason.INVALID_DEADLINE, f'deadline must be >= 0 s, got {self.deadline_ns} ns'
            )
        if self.max_pieces < 0:
            raise RequestError(
                Reason.INVALID_PARAMETER, f'max_pieces must be >= 0, got {self.max_pieces}'
            )
        for name in ('allowed_start_tolerance', 'joint_limit_tolerance'):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise RequestError(
                    Reason.INVALID_PARAMETER, f'{name} must be finite and >= 0, got {value!r}'
                )
