"""Which features touch at an instant, and where."""

import math
from typing import NamedTuple

import numpy as np

from trajectory_guard.canny.conditions import Constraints, edge_meets_face
from trajectory_guard.canny.constraint import Kind
from trajectory_guard.canny.motion import Motion
from trajectory_guard.canny.transitions import holds

# Squared sine of an angle that is nothing but rounding.
PARALLEL = 2.0**-100


class Contact(NamedTuple):
    """
    Two features that touch.

    :param kind: which features: A a face of A and a vertex of B, B a vertex of A and a face of B,
        C an edge of A and an edge of B.
    :param part_a: index of the convex part of A.
    :param part_b: index of the convex part of B.
    :param feature_a: index of the face, vertex or edge of A.
    :param feature_b: index of the vertex, face or edge of B.
    :param point: where, to rounding, in the frame of the motions [m].
    """

    kind: Kind
    part_a: int
    part_b: int
    feature_a: int
    feature_b: int
    point: tuple[float, float, float]


def touching(signs: Constraints, cell: int) -> list[tuple[Kind, int, int]]:
    """
    Return the pairs of features that have a point in common on a cell, exactly.

    A vertex touches a face if its value is 0 and it is not above any other. Two edges that are not
    parallel touch if their value is 0 and one meets a face next to the other; parallel ones have
    an end in the other, which is a vertex in a face.
    """
    swapped = signs.swapped()
    return [
        *((Kind.A, i, j) for j, i in _vertices_on_faces(swapped, cell)),
        *((Kind.B, i, j) for i, j in _vertices_on_faces(signs, cell)),
        *((Kind.C, i, j) for i, j in _edges_on_edges(signs, cell)),
    ]


def _vertices_on_faces(signs: Constraints, cell: int) -> list[tuple[int, int]]:
    found = []
    for i, row in enumerate(signs.b):
        values = [one.at(cell) for one in row]
        if max(values) == 0:
            found += [(i, j) for j, value in enumerate(values) if value == 0]
    return found


def _edges_on_edges(signs: Constraints, cell: int) -> list[tuple[int, int]]:
    return [
        (i, k)
        for i, row in enumerate(signs.c)
        for k, one in enumerate(row)
        if one.at(cell) == 0
        and any(
            holds(edge_meets_face(signs, i, j), cell) for j in signs.body_b.edge_faces[k].tolist()
        )
    ]


def contact_point(
    signs: Constraints, kind: Kind, i: int, j: int, motions: tuple[Motion, Motion], s: float
) -> tuple[float, float, float]:
    """
    Return where two features touch, to rounding [m].

    :param signs: tells the bodies.
    :param i: feature of A.
    :param j: feature of B.
    :param motions: of A and of B.
    :param s: the instant.
    """
    a, b = (
        body.vertices @ pose[:, :3].T + pose[:, 3]
        for body, pose in zip(
            (signs.body_a, signs.body_b), (motion.pose(s) for motion in motions), strict=True
        )
    )
    if kind == Kind.A:
        point = b[j]
    elif kind == Kind.B:
        point = a[i]
    else:
        point = _crossing(a[signs.body_a.edges[i]], b[signs.body_b.edges[j]])
    x, y, z = point.tolist()
    return x, y, z


def _crossing(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """
    Return the point of a segment that is nearest to the line of another, (2, 3) each.

    Where they are parallel but for rounding it is the middle of what they have in common.
    """
    along, other = _direction(a), _direction(b)
    length, *ends = ((x - a[0]) @ along for x in (a[1], *b))
    normal = np.cross(other, np.cross(along, other))
    slope = normal @ along
    if slope > PARALLEL:
        ends = [normal @ (b[0] - a[0]) / slope]
    return np.asarray(a[0] + np.clip(ends, 0.0, length).mean() * along)


def _direction(segment: np.ndarray) -> np.ndarray:
    """Return the unit vector from tail to head, 0 if rounding has made them one."""
    along = segment[1] - segment[0]
    # No square of a small body's edge underflows in `hypot`.
    return np.asarray(along / (math.hypot(*along.tolist()) or 1.0))
