"""Convex solids as arrays: conv(vertices) + disc + ball, many of them end to end."""

from typing import NamedTuple

import numpy as np

# Columns of `ranges`.
FIRST, LAST, FACE_FIRST, FACE_LAST, NODE = range(5)
# Columns of `size` [m]: ball, disc, sphere around vertices and disc, farthest point's distance.
BALL, DISC, CORE, FAR = range(4)
# Columns of `place`: disc normal, sphere centre, box half sides, pose of the box (12).
AXIS, CENTRE, HALF, BOX = 0, 3, 6, 9


class Solids(NamedTuple):
    """
    Convex solids, each in its own frame (links: node frame; obstacles: root frame).

    Few arrays, because every array that a kernel is handed costs a reference count.

    ranges (B, 5) int64: FIRST:LAST vertices, FACE_FIRST:FACE_LAST faces, NODE that carries the
        solid (-1: the root).
    size (B, 4): BALL radius, DISC radius, CORE radius of the sphere around vertices and disc, FAR
        the largest distance of the solid from the frame's origin [m].
    place (B, 21): AXIS unit normal of the disc, CENTRE of the CORE sphere, HALF sides and pose BOX
        of an oriented box that contains vertices and disc [m].
    vertices (3, V): coordinates [m].
    faces (F, 4): rows (n, d), halfspaces n.x <= d of an inscribed polytope.
    """

    ranges: np.ndarray
    size: np.ndarray
    place: np.ndarray
    vertices: np.ndarray
    faces: np.ndarray
