"""The convex hull of a point cloud, certified to contain every point."""

from dataclasses import dataclass
import math

import numpy as np
from scipy.spatial import cKDTree, ConvexHull, QhullError

from trajectory_guard.shapes.body import U, UNDERFLOW
from trajectory_guard.shapes.unique_rows import unique_rows

# A point farther than this fraction of the size outside the proposed hull becomes a vertex itself;
# nearer ones are covered by the ball. Far below any tolerance, far above the rounding of qhull.
COVERED_BY_BALL = 2.0**-36

# Triangles a walk may cross; it starts at the nearest by direction, so a few are usual. A walk
# that does not end only costs an additional vertex.
LONGEST_WALK = 256


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """
    Points whose convex hull, grown by a ball, contains the whole cloud.

    :param vertices: (n, 3), a subset of the cloud [m].
    :param ball: radius, rounded up [m].
    :param normals: outward unit normals of the hull's facets, one per plane, (m, 3); a proposal.
        No rows for a flat cloud, of which all points are vertices.
    :param heights: how far out along its normal each facet lies, within rounding, (m,) [m].
    :param center: mean of the vertices, (3,) [m].
    :param volume: about the volume [m^3].
    """

    vertices: np.ndarray
    ball: float
    normals: np.ndarray
    heights: np.ndarray
    center: np.ndarray
    volume: float


def convex_hull(points: np.ndarray) -> Hull:
    """
    Return the hull of a cloud.

    Qhull decides with rounding, merges facets and drops what it takes for coplanar or interior, so
    it only proposes. Every point it drops is then written as a convex combination of kept ones,
    and the distance that remains is measured.

    :param points: (n, 3), finite, no two equal [m].
    """
    try:
        # About the middle, so that qhull's own rounding is that of the size, not of the place.
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        hull = ConvexHull(points - middle)
    except (QhullError, ValueError):
        return Hull(points, 0.0, np.empty((0, 3)), np.empty(0), points.mean(axis=0), 0.0)
    center = points[hull.vertices].mean(axis=0)
    dropped = np.ones(len(points), dtype=bool)
    dropped[hull.vertices] = False
    distance = distance_bound(points[dropped], points[hull.simplices], hull.neighbors, center)
    size = np.ptp(points, axis=0).max()
    far = distance > COVERED_BY_BALL * size
    vertices = np.concatenate((points[hull.vertices], points[dropped][far]))
    normals, facet = unique_rows(hull.equations[:, :3])
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    heights = normals @ middle
    heights[facet] -= hull.equations[:, 3]
    ball = float(distance[~far].max(initial=0.0))
    return Hull(vertices, ball, normals, heights, center, float(hull.volume))


def distance_bound(
    points: np.ndarray, triangles: np.ndarray, neighbors: np.ndarray, center: np.ndarray
) -> np.ndarray:
    """
    Bound the distance of points from the convex hull of triangles' corners.

    The ray from the centre through a point x leaves through some triangle: x = sum_k b_k h_k with
    all b_k >= 0, and if sum_k b_k <= 1 the centre takes the rest. Whatever triangle is picked and
    however b is rounded, after clipping b to [0, 1] and scaling it to a sum of at most 1 the
    combination lies in the hull, so |x - sum_k b_k h_k| plus the rounding of this sum is a bound.
    The triangle is found by walking from one nearby across the edge that b blames most.

    :param points: (n, 3) [m].
    :param triangles: corners, (m, 3, 3) [m].
    :param neighbors: for each corner the triangle across the opposite edge, (m, 3).
    :param center: within rounding of the mean of all distinct corners, (3,) [m].
    :returns: (n,), rounded up [m].
    """
    x = points - center
    corners = triangles - center
    # Rows of the inverse of (h0 h1 h2): b_k = (h_i x h_j) . x / det. A sliver has none: NaN.
    inverse = np.cross(corners[:, [1, 2, 0]], corners[:, [2, 0, 1]])
    with np.errstate(all='ignore'):
        inverse /= np.einsum('fk,fk->f', corners[:, 0], inverse[:, 0])[:, None, None]
    inverse[~np.isfinite(inverse)] = math.nan
    bound = np.full(len(x), math.inf)
    _, triangle = cKDTree(directions(corners.sum(axis=1))).query(directions(x))
    walking = np.arange(len(x))
    for _ in range(LONGEST_WALK):
        b = np.einsum('nki,ni->nk', inverse[triangle], x[walking])
        distance = _distance(x[walking], b, corners[triangle])
        bound[walking] = np.fmin(bound[walking], distance)
        # A NaN is the least of all, and the way out of a sliver is as good as any.
        blamed = b.argmin(axis=1)
        lost = ~(b.min(axis=1) >= 0.0)
        walking, triangle = walking[lost], neighbors[triangle[lost], blamed[lost]]
        if not len(walking):
            break
    # Shifting by the centre, the centre's own rounding, the sum and the norm: each a few U of the
    # largest coordinate; the mean of n numbers summed in order is off by n U at most.
    scale = max(np.abs(points).max(initial=0.0), np.abs(triangles).max())
    return bound * (1.0 + 8.0 * U) + (64.0 + len(triangles)) * U * scale


def _distance(x: np.ndarray, b: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distance of each x from the combination of its triangle and the origin."""
    b = b.clip(0.0, 1.0)
    b = b / np.maximum(1.0, b.sum(axis=1))[:, None]
    return np.linalg.norm(x - np.einsum('nk,nki->ni', b, corners), axis=1)


def directions(x: np.ndarray) -> np.ndarray:
    """Return unit vectors, zero for zero."""
    return x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), UNDERFLOW)
