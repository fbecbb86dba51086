"""Bodies as polyhedra that contain them, for what works on faces."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from trajectory_guard.body import ConvexBody, U
from trajectory_guard.hull import distance_bound
from trajectory_guard.polyhedron import Polyhedron
from trajectory_guard.surface import Surface

# Sides of the prism around a cylinder; its edges are at 1.0086 of the radius.
SIDES = 24

# How far a body without extent in some direction is given one: as a part of its size and ball.
THICKNESS = 2.0**-12


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
    points = body.vertices
    if body.disc_radius:
        points = (points[:, None] + _around(body.disc_axis, body.disc_radius)).reshape(-1, 3)
    # Whether the hull has an inside must not depend on rounding.
    centre = points.mean(axis=0)
    sizes = np.linalg.svd(points - centre, compute_uv=False)
    size = float(np.ptp(points, axis=0).max())
    thin = THICKNESS * (size + body.ball) or U * (1.0 + float(np.abs(points).max()))
    if len(points) < 4 or len(sizes) < 3 or sizes[2] < thin:
        corners = thin * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
        points = (points[:, None] + corners).reshape(-1, 3)
    return _hull(points, body.ball)


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
    if not polyhedron.watertight:
        return _box(points, ball)
    dropped = np.ones(len(points), bool)
    dropped[hull.vertices] = False
    centre = points[hull.vertices].mean(axis=0)
    distance = distance_bound(points[dropped], points[hull.simplices], hull.neighbors, centre)
    # Shifting a corner by the middle rounds where qhull sees it, not where it is.
    grown = (ball + float(distance.max(initial=0.0))) * (1.0 + 4.0 * U)
    return Faceted(polyhedron, grown)


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
