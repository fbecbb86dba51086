"""How often closed surfaces wind round points: whether a point is inside a solid, proved."""

import numpy as np

from trajectory_guard.body import U

# Rounding of a solid angle's two components, in units of U |a| |b| |c|: a triple product and a sum
# of four terms, each of at most 12 operations on differences that are rounded themselves.
COMPONENTS = 128.0


def surely_outside(points: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> bool:
    """
    Say whether a closed surface is proved to wind round none of the points.

    The solid angle of a triangle with corners a, b, c seen from the origin is 2 atan2(a . (b x c),
    |a||b||c| + (a . b)|c| + (b . c)|a| + (c . a)|b|) [Van Oosterom & Strackee 1983]; over a closed
    surface they add up to 4 pi times the winding number, an integer.  Errors of the components
    of at most e turn the pair (y, x) by at most asin(e / |(y, x)|) < 2 e / |(y, x)|, as long as
    that is below 1; the sum of all these bounds must leave no other integer than 0.  Outside the
    box around the surface it is 0.

    :param points: (n, 3) [m].
    :param vertices: (V, 3) of the surface [m].
    :param triangles: (T, 3).
    :returns: False for a point inside, and where rounding leaves a doubt (on the surface).
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    # Written so that a NaN is near.
    near = points[~((points < low) | (points > high)).any(axis=1)]
    return all(_winds_not(vertices[triangles] - point) for point in near)


def _winds_not(corners: np.ndarray) -> bool:
    """Say whether a surface is proved not to wind round the origin; (T, 3, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    y = np.einsum('ij,ij->i', a, np.cross(b, c))
    x = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
    with np.errstate(invalid='ignore', divide='ignore'):
        turn = 2.0 * COMPONENTS * U * la * lb * lc / np.hypot(y, x)
    angle = np.arctan2(y, x)
    # Half the solid angles, so 2 pi is one turn; each is rounded by a few u, and so is the sum.
    doubt = turn.sum() + 16.0 * U * len(corners) * np.abs(angle).sum() + 16.0 * U * len(corners)
    # Written so that NaN is a doubt.
    return bool((turn < 0.5).all() and abs(angle.sum()) + doubt < 3.0)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum('ij,ij->i', a, b)
