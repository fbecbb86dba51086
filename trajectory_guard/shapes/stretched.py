"""Ellipsoids and elliptic cylinders: polyhedra round them, and polytopes inside them."""

import math

import numpy as np

from trajectory_guard.shapes.body import ConvexBody, FACE_ROUNDING, U
from trajectory_guard.shapes.primitive import INWARD, PRISM_SIDES, sphere_directions


def ellipsoid(diameters: tuple[float, float, float]) -> ConvexBody:
    """
    Return a polyhedron that contains an ellipsoid, 1.8 % larger at most, and a polytope inside it.

    The convex hull of the directions p_i contains the ball of radius r, so that of the p_i / r
    contains the unit ball; scaled by the half axes D it contains the ellipsoid D B. Rounding moves
    a vertex by a few 2^-53 of each of its coordinates, and r has been rounded down by `INWARD`,
    which is far more. The polytope {y: p_i . y <= r} lies in the unit ball, so {x: p_i . D^-1 x <=
    r} lies in the ellipsoid.

    :param diameters: along x, y, z [m].
    """
    directions, inradius = sphere_directions()
    half = 0.5 * np.array(diameters)
    faces = _faces_stretched(directions, np.full(len(directions), inradius), half)
    return ConvexBody(directions * (half / inradius), faces=faces)


def elliptic_cylinder(diameters: tuple[float, float], length: float) -> ConvexBody:
    """
    Return a prism round an elliptic cylinder about z, 0.9 % wider at most, and one inside it.

    A regular polygon of n corners at the distance 1 / cos(pi / n) contains the unit circle, and
    one whose sides have the distance cos(pi / n) lies in it; both are scaled by the half axes.

    :param diameters: along x, y [m].
    :param length: along z [m].
    """
    angle = 2.0 * math.pi / PRISM_SIDES * np.arange(PRISM_SIDES)
    corners = np.column_stack((np.cos(angle), np.sin(angle), np.zeros(PRISM_SIDES)))
    flat = math.cos(math.pi / PRISM_SIDES)
    half = 0.5 * np.array([*diameters, length])
    ring = corners * (half * (1.0 + INWARD) / flat)
    vertices = np.concatenate((ring + [0.0, 0.0, half[2]], ring - [0.0, 0.0, half[2]]))
    normals = np.concatenate((corners, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]))
    offsets = np.append(np.full(PRISM_SIDES, flat * (1.0 - INWARD)), (1.0, 1.0))
    return ConvexBody(vertices, faces=_faces_stretched(normals, offsets, half))


def _faces_stretched(normals: np.ndarray, offsets: np.ndarray, half: np.ndarray) -> np.ndarray:
    """
    Return the faces of a polytope in the unit ball or cylinder after scaling; none if too thin.

    n . D^-1 x <= d is (D^-1 n) . x <= d, divided by the length of D^-1 n. A unit normal that is
    off by a few 2^-53 acts on the reach of the scaled polytope, at most sqrt(2) |half|.
    """
    stretched = normals / half
    lengths = np.linalg.norm(stretched, axis=1)
    inward = FACE_ROUNDING * U * 2.0 * np.linalg.norm(half)
    distances = offsets / lengths * (1.0 - INWARD) - inward
    if not (distances > 0.0).all():
        return np.empty((0, 4))
    return np.column_stack((stretched / lengths[:, None], distances))
