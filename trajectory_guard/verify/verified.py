"""The finding about a certificate that holds."""

from dataclasses import dataclass, field

from trajectory_guard.verify.cover import Interval

TRUSTED = (
    'the URDF and scene files describe what is there, and their meshes and shapes were read right',
    'the convex bodies (hulls of meshes) contain the geometry',
    'the inscribed polytopes, which prove collisions, lie inside the geometry',
    'the controller plays the spline of the interpolation rule, from the start state named',
    'Python and python-flint compute what they promise',
)


@dataclass(frozen=True, slots=True)
class Verified:
    """
    What a certificate proves, after all of it was proved again.

    :param name: label of the trajectory.
    :param verdict: free, suspect or collision.
    :param intervals: start [ns], end [ns] and status; they partition the duration.
    :param clearance: what free exceeds [m].
    :param tracking_tolerance: per movable joint [rad or m].
    :param start: positions at time 0 that the certificate assumes [rad or m]; None: it has none.
    :param pairs: pairs of a moving body and an obstacle that free covers.
    :param unmoved: links that no joint of the trajectory moves, so nothing is said about them.
    :param entries: how many were proved, by kind.
    :param halvings: how often one was proved on halves of its piece.
    :param seconds: it took [s].
    :param trusted: what was not proved but taken for granted, in words.
    """

    name: str
    verdict: str
    intervals: tuple[Interval, ...]
    clearance: float
    tracking_tolerance: dict[str, float]
    start: dict[str, float] | None
    pairs: int
    unmoved: tuple[str, ...]
    entries: dict[str, int]
    halvings: int
    seconds: float
    trusted: tuple[str, ...] = field(default=TRUSTED, repr=False)
