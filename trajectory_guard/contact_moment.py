"""Which features touch where a collision begins or ends, and when."""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import islice, product
import math
from typing import NamedTuple

import numpy as np

from trajectory_guard.canny.along import along
from trajectory_guard.canny.constraint import Kind
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.errors import RequestError
from trajectory_guard.motions.link_motion import Builder, rational_motion
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.joint_path import JointPath
from trajectory_guard.result import ContactMoment, Interval, Status
from trajectory_guard.shapes.body import ConvexBody
from trajectory_guard.shapes.facets import faceted

# Planes whose unit normals differ by less are one face.
FLAT = 1e-6
# Features this near to the place of contact may be those that touch; a part of the body's size.
NEAR = 2.0**-20
# A body whose ball is more than this part of its size is round: it touches with no corner or edge.
ROUND = 2.0**-30
# Pairs of features that are tried; where more are near, the contact is of whole faces or edges.
MOST_TRIED = 64

# Bodies whose faces are kept.
MOST_KEPT = 256

# The window looked at is this many times the open interval, and at least so long [ns].
WIDER = 8
LEAST_WINDOW_NS = 256
# Halvings of a cell when its roots are enclosed.
DEPTH = 18


FEATURES = {
    Kind.A: 'face of the link, vertex of the obstacle',
    Kind.B: 'vertex of the link, face of the obstacle',
    Kind.C: 'edge of the link, edge of the obstacle',
}


class _Features(NamedTuple):
    """Features near a place: corners of triangles, ends of edges, vertices [m]."""

    faces: np.ndarray
    edges: np.ndarray
    vertices: np.ndarray


def contact_moments(
    workcell: Workcell, path: JointPath, rows: Sequence[Interval]
) -> Iterator[ContactMoment]:
    """
    Yield the contact at each end of a collision, by the constraints of [Canny 1984].

    Which features touch is found by looking where the smallest gap was seen; when, follows from
    the signs of their constraint along the link's rational motion. Contacts of round bodies have
    none, and those of whole faces or edges may be left out.

    :param workcell: what was judged.
    :param path: the motion that was judged, without tracking tolerance and clearance: with them
        it is not the bodies that touch.
    :param rows: the intervals found, with ``refine``: at most one contact for each suspect one
        between a free one and a collision.
    """
    for before, row, after in zip(rows, rows[1:], rows[2:], strict=False):
        ends = {before.status, after.status}
        if row.status is Status.SUSPECT and ends == {Status.FREE, Status.COLLISION}:
            moment = _moment(workcell, path, row, after.status is Status.COLLISION)
            if moment is not None:
                yield moment


def _moment(
    workcell: Workcell, path: JointPath, row: Interval, begins: bool
) -> ContactMoment | None:
    """Return the contact in a suspect interval, if one constraint tells."""
    if row.location is None or row.at_ns is None:
        return None
    cells = _cells(path, row)
    place = np.array(row.location)
    builder = Builder.RATIONAL if path.floating is None else Builder.ECONOMISED
    for body, obstacle in _pairs(workcell, row):
        try:
            motions = [rational_motion(workcell, path, body, *c, builder=builder) for c in cells]
        except RequestError:  # it turns too far for one motion, however short
            return None
        at = _pose(motions, cells, path, row.at_ns)
        moving, standing = workcell.bodies[0][body], workcell.bodies[1][obstacle]
        a = _near(_shape(moving), (place - at[:, 3]) @ at[:, :3])
        b = _near(_shape(standing), place)
        for kind, of_a, of_b in islice(_touching(a, b, at), MOST_TRIED):
            span = _zeros(motions, kind, of_a, of_b)
            if span is None:
                continue
            earliest, latest = (_instant(path, cells[i], s) for i, s in span)
            # Near a corner other constraints vanish, too, but not when contact begins or ends.
            if earliest <= row.end_ns and latest >= row.start_ns:
                return ContactMoment(
                    row.body,
                    row.obstacle,
                    FEATURES[kind],
                    begins,
                    math.nextafter(float(earliest), -math.inf),
                    math.nextafter(float(latest), math.inf),
                    row.location,
                )
    return None


# The neighbourhood in time: one or two dyadic cells of a segment


def _cells(path: JointPath, row: Interval) -> list[tuple[int, int, int]]:
    """Return segment, numerator and level of neighbouring cells that contain a window."""
    knots = path.knots_ns.tolist()
    middle = (row.start_ns + row.end_ns) // 2
    segment = min(int(np.searchsorted(path.knots_ns, middle, 'right')), len(knots) - 1) - 1
    start, length = knots[segment], knots[segment + 1] - knots[segment]
    window = max(WIDER * (row.end_ns - row.start_ns), LEAST_WINDOW_NS)
    level = 0
    while (length >> (level + 1)) >= window:
        level += 1
    first, last = (
        min(max((t - start << level) // length, 0), (1 << level) - 1)
        for t in (middle - window // 2, middle + window // 2)
    )
    return [(segment, numerator, level) for numerator in range(first, last + 1)]


def _instant(path: JointPath, cell: tuple[int, int, int], s: float) -> Fraction:
    """Return when a cell's motion is at s [ns]."""
    segment, numerator, level = cell
    start, end = path.knots_ns[segment : segment + 2].tolist()
    return start + (end - start) * (numerator + Fraction(s)) / (1 << level)


def _pose(
    motions: list[RationalMotion], cells: list[tuple[int, int, int]], path: JointPath, at_ns: int
) -> np.ndarray:
    """Return the pose at an instant, or at the nearest that the cells contain, (3, 4) [m]."""
    for motion, cell in zip(motions, cells, strict=True):
        start, end = (_instant(path, cell, s) for s in (0.0, 1.0))
        if at_ns <= end or cell == cells[-1]:
            return motion.pose(min(max(float((at_ns - start) / (end - start)), 0.0), 1.0))
    raise AssertionError('no cells')


# The features that may touch


def _pairs(workcell: Workcell, row: Interval) -> Iterator[tuple[int, int]]:
    """Yield the packed bodies of a pair of names that have corners and edges."""
    sides = []
    for names, name, bodies in zip(
        (workcell.link_names, workcell.obstacle_names),
        (row.body, row.obstacle),
        workcell.bodies,
        strict=True,
    ):
        sides.append(
            [
                i
                for i, body in enumerate(bodies)
                if names[i] == name and not body.disc_radius and body.ball <= ROUND * body.radius
            ]
        )
    yield from product(*sides)


class _Shape(NamedTuple):
    """Corners of the triangles and unit normals, ends of the edges that bend, and vertices."""

    corners: np.ndarray
    normals: np.ndarray
    edges: np.ndarray
    vertices: np.ndarray


@lru_cache(maxsize=MOST_KEPT)
def _shape(body: ConvexBody) -> _Shape:
    """Return the polyhedron of a body, without what is flat."""
    polyhedron = faceted(body).polyhedron
    points, triangles = polyhedron.vertices, polyhedron.triangles
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normals, axis=1)
    solid = size > 0.0
    triangles, corners = triangles[solid], corners[solid]
    normals = normals[solid] / size[solid, None]
    sides = np.sort(np.stack((triangles, np.roll(triangles, -1, axis=1)), axis=2), axis=2)
    sides = sides.reshape(-1, 2)
    order = np.lexsort(sides.T)
    sides, owners = sides[order], order // 3
    paired = (sides[:-1] == sides[1:]).all(axis=1)
    bend = np.linalg.norm(normals[owners[:-1]] - normals[owners[1:]], axis=1)
    flat = np.zeros(len(sides), bool)
    flat[:-1] |= paired & (bend < FLAT)
    flat[1:] |= paired & (bend < FLAT)
    edges = np.unique(sides[~flat], axis=0)
    return _Shape(corners, normals, points[edges], points)


def _near(shape: _Shape, place: np.ndarray) -> _Features:
    """Return the features of a polyhedron that are at a place."""
    points, ends, corners = shape.vertices, shape.edges, shape.corners
    reach = NEAR * float(np.ptp(points, axis=0).max())
    off = ends[:, 1] - ends[:, 0]
    part = ((place - ends[:, 0]) * off).sum(axis=1) / (off**2).sum(axis=1)
    nearest = ends[:, 0] + np.clip(part, 0.0, 1.0)[:, None] * off
    height, inside = _over(corners, shape.normals, place)
    return _Features(
        corners[(np.abs(height) <= reach) & (inside >= -reach)],
        ends[np.linalg.norm(nearest - place, axis=1) <= reach],
        points[np.linalg.norm(points - place, axis=1) <= reach],
    )


def _over(
    corners: np.ndarray, normals: np.ndarray, place: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the height of a place over triangles, and how far inside of their sides it is."""
    height = ((place - corners[:, 0]) * normals).sum(axis=1)
    sides = np.roll(corners, -1, axis=1) - corners
    inward = np.cross(normals[:, None], sides) / np.linalg.norm(sides, axis=2)[..., None]
    return height, ((place - corners) * inward).sum(axis=2).min(axis=1)


def _whole(near: _Features) -> _Features:
    """Return also what bounds the features: where an edge lies in a face, their ends touch."""
    sides = np.stack((near.faces, np.roll(near.faces, -1, axis=1)), axis=2).reshape(-1, 2, 3)
    edges = np.concatenate((near.edges, sides))
    corners = np.concatenate((near.vertices, edges.reshape(-1, 3)))
    return _Features(near.faces, edges, np.unique(corners, axis=0))


def _candidates(a: _Features, b: _Features) -> list[tuple[Kind, np.ndarray, np.ndarray]]:
    """Return the pairs of features of two bodies that may touch."""
    return [
        *((Kind.B, p, face) for p, face in product(a.vertices, b.faces)),
        *((Kind.A, face, p) for face, p in product(a.faces, b.vertices)),
        *((Kind.C, x, y) for x, y in product(a.edges, b.edges)),
    ]


def _touching(
    a: _Features, b: _Features, at: np.ndarray
) -> Iterator[tuple[Kind, np.ndarray, np.ndarray]]:
    """Yield the pairs that may touch: first those at the place, then those of their bounds."""
    yield from _candidates(a, b)
    for kind, of_a, of_b in _candidates(_whole(a), _whole(b)):
        if _meet(kind, of_a @ at[:, :3].T + at[:, 3], of_b):
            yield kind, of_a, of_b


def _meet(kind: Kind, of_a: np.ndarray, of_b: np.ndarray) -> bool:
    """Return whether two features in one frame have a point in common, about."""
    if kind is Kind.C:
        (p, p_end), (q, q_end) = of_a, of_b
        d, e = p_end - p, q_end - q
        normal = np.cross(d, e)
        square = float(normal @ normal)
        if not square > (NEAR * np.linalg.norm(d) * np.linalg.norm(e)) ** 2:
            return False
        parts = np.array([np.cross(q - p, e) @ normal, np.cross(q - p, d) @ normal]) / square
        reach = NEAR * max(np.linalg.norm(d), np.linalg.norm(e))
        off = abs(normal @ (q - p)) / math.sqrt(square)
        return bool(off <= reach and (np.abs(parts - 0.5) <= 0.5 + NEAR).all())
    vertex, face = (of_a, of_b) if kind is Kind.B else (of_b, of_a)
    normal = np.cross(face[1] - face[0], face[2] - face[0])
    height, inside = _over(face[None], normal[None] / np.linalg.norm(normal), vertex)
    reach = NEAR * float(np.ptp(face, axis=0).max())
    return bool(abs(height[0]) <= reach and inside[0] >= -reach)


# The zeros of a constraint


def _zeros(
    motions: list[RationalMotion], kind: Kind, of_a: np.ndarray, of_b: np.ndarray
) -> tuple[tuple[int, float], tuple[int, float]] | None:
    """
    Return where the zeros of a constraint begin and end, as cell and s.

    :returns: None unless the constraint is proved to have one sign before, the other after.
    """
    pieces = [along(motion, kind, of_a, of_b) for motion in motions]
    if not pieces[0].coefficients[0] * pieces[-1].coefficients[-1] < 0.0:
        return None
    opened = []
    for i, (c, error) in enumerate(pieces):
        # A halving sums as many products as there are coefficients, with weights that sum to 1.
        slack = error + 2.0 * DEPTH * len(c) * 2.0**-53 * float(np.abs(c).max())
        first, last = _first(c, slack, DEPTH), _first(c[::-1], slack, DEPTH)
        if first is not None and last is not None:
            opened.append(((i, first), (i, 1.0 - last)))
    if not opened:
        return None  # the sign changes between two cells, within the errors of both
    (start, _), (_, end) = opened[0], opened[-1]
    certain = start != (0, 0.0) and end != (len(motions) - 1, 1.0)
    return (start, end) if certain else None


def _first(c: np.ndarray, slack: float, depth: int) -> float | None:
    """Return the start of the first of 2^depth parts that may have a zero; None: none has."""
    if (c > slack).all() or (c < -slack).all():
        return None
    if depth == 0:
        return 0.0
    left, right = _halves(c)
    found = _first(left, slack, depth - 1)
    if found is not None:
        return 0.5 * found
    found = _first(right, slack, depth - 1)
    return None if found is None else 0.5 + 0.5 * found


def _halves(c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the Bernstein coefficients on both halves [de Casteljau]."""
    left = _halving(len(c))
    return left @ c, left[::-1, ::-1] @ c


@lru_cache(maxsize=MOST_KEPT)
def _halving(count: int) -> np.ndarray:
    """Return the matrix of the left half: row i has C(i, j) / 2^i."""
    return np.array([[math.comb(i, j) / 2.0**i for j in range(count)] for i in range(count)])
