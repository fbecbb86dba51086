"""An interval that is not proved free, and one place where it may not be."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from trajectory_guard.kernels import ball


class Kind(IntEnum):
    """Which test left a place open; for the last two nothing is named."""

    VERTEX_FACE = ball.VERTEX_FACE
    EDGE_EDGE = ball.EDGE_EDGE
    FACE_VERTEX = ball.FACE_VERTEX
    EDGE_PIERCES = ball.EDGE_PIERCES
    FACE_PIERCED = ball.FACE_PIERCED
    CONTAINED = 5
    UNKNOWN = 6


class Why(IntEnum):
    """Why an interval is suspect."""

    EPSILON = ball.BY_EPSILON
    DEPTH = ball.BY_RECURSION
    BUDGET = ball.BY_TESTS
    STOPPED = ball.BY_PATIENCE
    CONTAINED = 4


@dataclass(frozen=True, slots=True)
class Suspect:
    """
    An interval that is not proved free, and one place where it may not be.

    :param start: in [0, 1], exact.
    :param end: in [0, 1], exact.
    :param why: what ended the search.
    :param kind: the test that is open: moving features first.
    :param moving_face: index, -1 if none is named.
    :param fixed_face: index, -1 if none is named.
    :param moving: vertices of the moving feature; none for a face.
    :param fixed: vertices of the fixed feature; none for a face.
    :param place: about where, in the fixed polyhedron's frame [m].
    """

    start: float
    end: float
    why: Why
    kind: Kind
    moving_face: int
    fixed_face: int
    moving: tuple[int, ...]
    fixed: tuple[int, ...]
    place: tuple[float, float, float] | None


def suspect_of(leaf: np.void) -> Suspect:
    """Return what a leaf of the kernels says; `kernels.ball.LEAF`."""
    width = 2.0 ** -int(leaf['level'])
    kind = int(leaf['kind'])
    named = kind != ball.NOTHING
    x, y, z = leaf['place'].tolist()
    return Suspect(
        int(leaf['numerator']) * width,
        (int(leaf['numerator']) + 1) * width,
        Why(int(leaf['reason'])),
        Kind(kind) if named else Kind.UNKNOWN,
        int(leaf['moving_face']),
        int(leaf['fixed_face']),
        tuple(v for v in leaf['moving'].tolist() if v >= 0),
        tuple(v for v in leaf['fixed'].tolist() if v >= 0),
        (x, y, z) if named else None,
    )
