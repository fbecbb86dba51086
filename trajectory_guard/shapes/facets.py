"""Bodies as polyhedra that contain them, for what works on faces."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from trajectory_guard.shapes.body import ConvexBody, U
from trajectory_guard.shapes.polyhedron import Polyhedron
from trajectory_guard.shapes.surface import Surface

# Sides of the prism around a cylinder; its edges are at 1.0086 of the radius.
SIDES = 24

# How far a body without extent in some direction is given one: as a part of its size and ball.
THICKNESS = 2.0**-12

# Heights of points over faces that are computed together.
AT_ONCE = 2**22


class Faceted(NamedTuple):
    """
    A polyhedron that contains a body but for a ball.

    :param polyhedron: a solid, or a surface if the body's mesh is open.
    :param ball: each point of the body is within it of the polyhedron [m].
    """

    polyhedron: Polyhedron
    ball: float


def faceted(body: ConvexBody) -> Faceted:
    """
    Return the mesh of a body where it knows one, else the hull of its vertices and disc.

    A mesh that has an inside, but sides that are not each other's opposites, is taken as its hull:
    what lies inside it would not be seen.

    :param body: a body.
    """
    if body.surface is not None:
        mesh = _mesh(body.surface)
        if mesh is not None:
            return mesh
    points, ball = body.vertices, body.ball
    if body.disc_radius:
        points, ball = _plus(points, ball, _around(body.disc_axis, body.disc_radius))
    # Whether the hull has an inside must not depend on rounding.
    centre = points.mean(axis=0)
    sizes = np.linalg.svd(points - centre, compute_uv=False)
    size = float(np.ptp(points, axis=0).max())
    thin = THICKNESS * (size + body.ball) or U * (1.0 + float(np.abs(points).max()))
    if len(points) < 4 or len(sizes) < 3 or sizes[2] < thin:
        corners = thin * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
        points, ball = _plus(points, ball, corners)
    return _hull(points, ball)


def _plus(points: np.ndarray, ball: float, others: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the sums of points and others, and the ball with what rounding moves them by."""
    sums = (points[:, None] + others).reshape(-1, 3)
    return sums, float((ball + 2.0 * U * np.abs(sums).max()) * (1.0 + 4.0 * U))


def _mesh(surface: Surface) -> Faceted | None:
    points, ball, _ = surface.placed
    try:
        polyhedron = Polyhedron.from_triangles(points, surface.triangles)
    except ValueError:
        return None
    if surface.is_watertight and not polyhedron.watertight:
        return None
    return Faceted(polyhedron, ball)


def _around(axis: np.ndarray, radius: float) -> np.ndarray:
    """Return the corners of a polygon around a disc, a little farther out for their rounding."""
    x = np.zeros(3)
    x[np.abs(axis).argmin()] = 1.0
    x -= (x @ axis) * axis
    x /= np.linalg.norm(x)
    angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
    out = radius / np.cos(np.pi / SIDES) * (1.0 + 64.0 * U)
    corners: np.ndarray = out * (
        np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * np.cross(axis, x)
    )
    return corners


def _hull(points: np.ndarray, ball: float) -> Faceted:
    """Return the hull's triangles, their sides in order; a box if qhull does not close them."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    try:
        hull = ConvexHull(points - middle)
    except (QhullError, ValueError):
        return _box(points, ball)
    triangles = hull.simplices.copy()
    corners = points[triangles]
    turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    back = (turned * hull.equations[:, :3]).sum(axis=1) < 0.0
    triangles[back] = triangles[back][:, ::-1]
    try:
        polyhedron = Polyhedron.from_triangles(points, triangles)
    except ValueError:
        return _box(points, ball)
    if not polyhedron.watertight or len(polyhedron.faces) < len(triangles):
        return _box(points, ball)
    grown = (ball + _beyond(points, polyhedron, hull.equations[:, :3])) * (1.0 + 4.0 * U)
    return Faceted(polyhedron, grown) if np.isfinite(grown) else _box(points, ball)


def _beyond(points: np.ndarray, polyhedron: Polyhedron, normals: np.ndarray) -> float:
    """
    Bound the distance of the points' convex hull from a polyhedron that is nearly it [m].

    Qhull merges facets, drops points and decides with rounding, so that its triangles need not be
    convex. Let c be inside, and y in the hull but outside the polyhedron. The segment from c to y
    leaves through a triangle, at z, and y - c = t (z - c) with t > 1. For any n

        (t - 1) n.(z - c) = n.(y - z),    |y - z| = (t - 1) |z - c|;

    n.(z - c) is at least the least height h of the triangle's corners over c, and n.(y - z) at
    most the largest height of all points less h. So the distance is at most the largest of
    (top - h) / h times |z - c|, if every h > 0: then every triangle that has an area to speak of
    turns its inside to c, and the polyhedron winds round it. A height is off by less than 8 u of
    the coordinates' size: the difference from c, three products and two sums.

    :param points: (n, 3) [m].
    :param polyhedron: closed triangles between some of them.
    :param normals: (F, 3) about the triangles' normals, outward, of length 1.
    :returns: infinity if nothing is known.
    """
    c = polyhedron.vertices.mean(axis=0)
    x, corners = points - c, polyhedron.vertices[polyhedron.triangles] - c
    rounding = 16.0 * U * float(np.abs(points).max() + np.abs(c).max())
    low = np.einsum('fkr,fr->fk', corners, normals).min(axis=1) - rounding
    if not (low > 0.0).all():
        return np.inf
    rows = max(1, AT_ONCE // len(x))
    top = np.concatenate(
        [(normals[i : i + rows] @ x.T).max(axis=1) for i in range(0, len(normals), rows)]
    )
    beyond = ((top + rounding - low) / low).max()
    return float(beyond * np.linalg.norm(corners, axis=2).max() * (1.0 + 16.0 * U))


def _box(points: np.ndarray, ball: float) -> Faceted:
    """Return the box around points."""
    low, high = points.min(axis=0), points.max(axis=0)
    grown = U * 4.0 * (1.0 + np.abs(points).max())
    ends = np.array([low - grown, high + grown])
    corners = np.array(
        [[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    )
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return Faceted(Polyhedron(corners, tuple(np.array(side) for side in sides)), ball)


def joined(parts: list[Polyhedron]) -> tuple[Polyhedron, np.ndarray]:
    """
    Return several polyhedra as one, corners not merged, and of which one each face is.

    :param parts: at least one; all watertight, or none.
    """
    if len(parts) == 1:
        return parts[0], np.zeros(len(parts[0].faces), np.int64)
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = tuple(face + at for part, at in zip(parts, first, strict=False) for face in part.faces)
    owner = np.repeat(np.arange(len(parts)), [len(part.faces) for part in parts])
    return Polyhedron(np.concatenate([part.vertices for part in parts]), faces), owner
