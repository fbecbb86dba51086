"""A convex polytope that certainly lies inside the solid a mesh bounds."""

import numpy as np
from scipy.spatial import cKDTree

from trajectory_guard.shapes.body import U
from trajectory_guard.shapes.hull import directions, Hull

# A mesh that fills less of its hull than this is no convex solid, and nothing is tried.
WORTH_TRYING = 0.9

# A facet that costs a triangle less than this fraction of the size is good enough.
CHEAP = 2.0**-40

# Triangles times facets of the hull beyond which nothing is tried: if none finds a cheap facet at
# once that is about half a second, and a polytope of that many faces is slow to ask.
LARGEST_TABLE = 1 << 25

# Entries of that table held at once: 8 MB.
CHUNK = 1 << 20

# A ray fails only if it passes an edge within rounding, so a few are enough.
RAYS = 8

# In units of the largest coordinate: turned coordinates are up to sqrt(3) and within 7 U, so a
# weight, the difference of two products, is up to 6 and within 2 * (2 * sqrt(3) * 7 + 2 * 3) U
# < 64 U, and a sum of three weights times coordinates within
# 3 * (64 * sqrt(3) + 6 * 7 + 4 * 6 * sqrt(3)) U < 600 U.
WEIGHT_ROUNDING = 128.0 * U
HEIGHT_ROUNDING = 1024.0 * U


def inscribed_polytope(
    points: np.ndarray, triangles: np.ndarray, hull: Hull, rounding: float
) -> np.ndarray:
    """
    Return faces of a polytope inside the solid, for a closed and nearly convex mesh.

    Let Q = {x: n_g . x < d_g for all g}. If every triangle has a g with n_g . v >= d_g at its
    three corners v, no triangle meets Q. The surface being closed, every point off it has a
    winding number, which is constant on the connected set Q; one ray from one point of Q finds
    it. If it is not 0, Q is inside. The normals may be any: those of the hull's facets are good.
    Each triangle takes the g that costs least, or the one whose normal is nearest to its own if
    that costs next to nothing, and d_g is as large as its triangles allow; for a convex solid that
    costs rounding only.

    :param points: (n, 3), no two equal [m].
    :param triangles: (m, 3) indices, wound alike.
    :param hull: hull of the points.
    :param rounding: how far the real corners may be from the points [m].
    :returns: rows (n, d), (j, 4); none if the mesh is open, clearly not convex or too large.
    """
    nothing = np.empty((0, 4))
    normals = hull.normals
    # An edge run back and forth bounds nothing, and has no side that a ray could meet.
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    if not len(normals) or len(triangles) * len(normals) > LARGEST_TABLE:
        return nothing
    corners = points[triangles] - hull.center
    volume = np.einsum('ni,ni->', corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    if not abs(volume) >= WORTH_TRYING * hull.volume or not is_closed(triangles, len(points)):
        return nothing
    best = _best_facets(points, triangles, corners, hull)
    offsets = np.full(len(normals), np.inf)
    np.minimum.at(offsets, best, _lowest(points, triangles, normals[best]))
    # A height is a sum of three products, within 4 U of the sum of the absolute values. The centre
    # must be off the real surface, not only off the rounded one: hence the margin twice.
    margin = 8.0 * U * np.abs(points).sum(axis=1).max() + 2.0 * rounding
    offsets -= margin
    needed = np.isfinite(offsets)
    if (normals @ hull.center + margin >= offsets)[needed].any() or not winding_number(corners):
        return nothing
    return np.column_stack((normals[needed], offsets[needed]))


def _best_facets(
    points: np.ndarray, triangles: np.ndarray, corners: np.ndarray, hull: Hull
) -> np.ndarray:
    """
    Choose for each triangle the facet that has to be moved least to clear it.

    :param points: (n, 3) [m].
    :param triangles: (m, 3) indices.
    :param corners: those points from the hull's centre, (m, 3, 3) [m].
    :param hull: hull of the points.
    :returns: (m,) indices of the hull's normals.
    """
    normals = hull.normals
    own = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # Either side may be the outer one, but of all triangles the same: that of a positive volume.
    own *= np.sign(np.einsum('ni,ni->', own, corners[:, 0]))
    _, best = cKDTree(normals).query(directions(own))
    cost = hull.heights[best] - _lowest(points, triangles, normals[best])
    dear = np.flatnonzero(~(cost <= CHEAP * np.abs(points).max()))
    step = max(1, CHUNK // len(normals))
    for start in range(0, len(dear), step):
        rows = dear[start : start + step]
        lowest = (points[triangles[rows]] @ normals.T).min(axis=1)
        best[rows] = (lowest - hull.heights).argmax(axis=1)
    return best


def _lowest(points: np.ndarray, triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the least height of each triangle's corners along its normal, (m,) [m]."""
    lowest: np.ndarray = np.einsum('nki,ni->nk', points[triangles], normals).min(axis=1)
    return lowest


def is_closed(triangles: np.ndarray, count: int) -> bool:
    """
    Tell whether each edge is run through equally often in both directions.

    Then the surface has no boundary, however its pieces touch.

    :param triangles: (m, 3) indices below `count`.
    """
    start = triangles.ravel()
    end = triangles[:, [1, 2, 0]].ravel()
    forward = np.sort(start * np.int64(count) + end)
    return bool((forward == np.sort(end * np.int64(count) + start)).all())


def winding_number(corners: np.ndarray) -> int:
    """
    Return how often a closed surface winds round the origin, 0 if that cannot be told.

    Counts the triangles that a ray meets, with the sign of the side it meets. Seen along the ray
    the origin is inside a triangle if the cross products of consecutive corners have one sign; all
    signs that matter are required to be clear of rounding, otherwise another ray is tried.

    :param corners: (m, 3, 3), relative to the origin.
    """
    size = np.abs(corners).max()
    rng = np.random.default_rng(0)
    for _ in range(RAYS):
        basis = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        basis[:, 0] *= np.sign(np.linalg.det(basis))
        x, y, z = np.moveaxis(corners @ basis, -1, 0)
        # Twice the area of (origin, next corner, the one after): the weight of a corner.
        a, b = [1, 2, 0], [2, 0, 1]
        weight = x[:, a] * y[:, b] - y[:, a] * x[:, b]
        if (np.abs(weight) <= WEIGHT_ROUNDING * size**2).any():
            continue
        met = np.abs(np.sign(weight).sum(axis=1)) == 3.0
        side = np.sign(weight[met].sum(axis=1))
        height = (weight * z)[met].sum(axis=1)
        if (np.abs(height) <= HEIGHT_ROUNDING * size**3).any():
            continue
        return int(side[height * side > 0.0].sum())
    return 0
