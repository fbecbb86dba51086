"""
The basic collision tests of toleranced features [SW, sec. 4], each a proof of distance or nothing.

*True* says: in exact arithmetic on the doubles given, every point of the orbit is farther than the
thickness from the fixed feature. *False* says nothing. All three are one inequality, see
`quadratic`, for the difference of the fixed feature and the moving one's image:

  - fat vertex, fixed face: y - g(x) over the triangles of the face, convex;
  - fat edge, fixed edge: F(s, t) = |f(s) - g(e(t))|^2 - R^2 rho^2(e(t)) over the unit square,
    which covers parallel edges (F is flat in a direction) and R >= nu (F is concave in t);
  - fat face, fixed vertex: p - g(x) over the triangles of the face. A triangle's inner sides lie
    in the face, so nothing is lost.

They exclude contact of the features, not overlap of solids: a polygon pierced by an edge passes.
"""

import numpy as np

from trajectory_guard.toleranced.affine import Affine
from trajectory_guard.toleranced.displacement_ball import Orbit
from trajectory_guard.toleranced.quadratic import (
    certainly_longer,
    POINT,
    SEGMENT,
    SQUARE,
    TRIANGLE,
)

# Domain of a pair, by the parameters of the fixed and of the moving simplex.
DOMAINS = {
    (0, 0): POINT,
    (0, 1): SEGMENT,
    (1, 0): SEGMENT,
    (1, 1): SQUARE,
    (0, 2): TRIANGLE,
    (2, 0): TRIANGLE,
}


def apart(fixed: np.ndarray, orbit: Orbit, thickness: float = 0.0) -> bool:
    """
    Say whether a simplex is proved to be farther than a thickness from the orbit of another.

    :param fixed: corners, (d + 1, 3); vertex and edge, face or vertex; edge and edge [m].
    :param orbit: of a point, a segment or a triangle.
    :param thickness: clearance and other errors, >= 0 [m].
    """
    static = Affine.of_corners(fixed)
    dimension = static.directions.shape[1]
    domain = DOMAINS[dimension, orbit.image.directions.shape[1]]
    return certainly_longer(
        static - orbit.image, orbit.distortion.behind(dimension), domain, thickness
    )
