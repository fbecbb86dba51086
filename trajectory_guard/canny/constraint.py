"""
Constraints between features, as linear functions of the relative motion (``relative.py``).

*Type A*: a face of A and a vertex of B; *type B*: a vertex of A and a face of B. The value is the
height of the vertex above the plane times the length of the normal: positive outside.

*Type C*: an edge of A and an edge of B; (e_A x e_B) . (p_A - p_B), e from tail to head. Let B's
edge bound a face counter-clockwise seen from outside and A's edge leave through the plane of the
face. In coordinates with B's edge along x, the face at y >= 0 and its outward normal z,
e_A = (a, b, c) with c > 0 meets the plane in p_A = (u, v, 0), and with p_B = 0

    (e_A x e_B) . p_A = (0, c, -b) . (u, v, 0) = c v:

positive if and only if the line of A's edge passes on the inner side of B's edge. So an edge that
leaves through a face has *only positive* values (the paper prints the opposite), one that enters
only negative ones; an edge that runs clockwise around the face counts with the opposite sign. The
value does not change if A and B change places, so the same holds for edges of B and faces of A.
"""

from enum import Enum
from typing import NamedTuple

from trajectory_guard.canny.integers import cross, dot, minus, scaled
from trajectory_guard.canny.polyhedron import ConvexPolyhedron, face_normal
from trajectory_guard.canny.relative import N, P, S, T, T_BACK, TERMS


class Kind(str, Enum):
    """Which features of A and B a constraint is between."""

    A = 'face of A, vertex of B'
    B = 'vertex of A, face of B'
    C = 'edge of A, edge of B'


class Features(NamedTuple):
    """
    What the constraints need of a polyhedron, exactly, lengths times 2^k.

    :param points: V vertices p.
    :param planes: F normals n and offsets d: n . x = d on the face, n outward.
    :param lines: E directions e and moments p x e.
    """

    points: list[list[int]]
    planes: list[tuple[list[int], int]]
    lines: list[tuple[list[int], list[int]]]


def features(body: ConvexPolyhedron, k: int) -> Features:
    """
    Return the features of a polyhedron.

    :param body: the polyhedron.
    :param k: a power of two that makes its coordinates integers.
    """
    points = scaled(body.vertices, k)
    planes = []
    for face in body.faces:
        normal = face_normal([points[i] for i in face])
        planes.append((normal, dot(normal, points[face[0]])))
    lines = []
    for tail, head in body.edges.tolist():
        along = minus(points[head], points[tail])
        lines.append((along, cross(points[tail], along)))
    return Features(points, planes, lines)


def constraint_a(plane_a: tuple[list[int], int], point_b: list[int]) -> list[int]:
    """Return n_A . (P^T p_B - t') - N d_A as the coefficients of a basis, (TERMS,)."""
    n, d = plane_a
    row = [0] * TERMS
    for r in range(3):
        for c in range(3):
            row[P + 3 * r + c] = point_b[r] * n[c]
        row[T_BACK + r] = -n[r]
    row[N] = -d
    return row


def constraint_b(point_a: list[int], plane_b: tuple[list[int], int]) -> list[int]:
    """Return n_B . (P p_A + t) - N d_B as the coefficients of a basis, (TERMS,)."""
    n, d = plane_b
    row = [0] * TERMS
    for r in range(3):
        for c in range(3):
            row[P + 3 * r + c] = n[r] * point_a[c]
        row[T + r] = n[r]
    row[N] = -d
    return row


def constraint_c(
    line_a: tuple[list[int], list[int]], line_b: tuple[list[int], list[int]]
) -> list[int]:
    """Return e_B.P(p_A x e_A) + (p_B x e_B).P e_A + e_A.S e_B as coefficients, (TERMS,)."""
    (e_a, m_a), (e_b, m_b) = line_a, line_b
    row = [0] * TERMS
    for r in range(3):
        for c in range(3):
            row[P + 3 * r + c] = e_b[r] * m_a[c] + m_b[r] * e_a[c]
            row[S + 3 * r + c] = e_a[r] * e_b[c]
    return row
