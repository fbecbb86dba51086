"""Whether one of two solids with disjoint surfaces lies inside the other, at an instant."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from trajectory_guard.kernels.ball import Curve
from trajectory_guard.polyhedron import Polyhedron
from trajectory_guard.winding import surely_outside


def surely_apart(moving: Polyhedron, fixed: Polyhedron, curve: Curve, instant: float) -> bool:
    """
    Say whether neither of two watertight polyhedra has a part inside the other.

    Their surfaces are known to keep apart by more than the rounding of a pose, so each part of a
    surface is inside as a whole or not at all, and one vertex of it tells.

    :param moving: in its own frame.
    :param fixed: in the frame of the motion's images.
    :param curve: the motion.
    :param instant: in [0, 1].
    :returns: False where one is inside, and in doubt.
    """
    pose = pose_at(curve, instant)
    images = moving.vertices @ pose[:, :3].T + pose[:, 3]
    return surely_outside(
        images[_one_of_each_part(moving)], fixed.vertices, fixed.triangles
    ) and surely_outside(fixed.vertices[_one_of_each_part(fixed)], images, moving.triangles)


def pose_at(curve: Curve, instant: float) -> np.ndarray:
    """
    Return the displacement at an instant, (3, 4), by de Casteljau's algorithm.

    Two roundings of convex combinations a step: within 4 n u of the largest entries, what the
    kernel's thickness holds for it.
    """
    rows = np.column_stack([curve.points * curve.weights[:, None], curve.weights])
    while len(rows) > 1:
        rows = (1.0 - instant) * rows[:-1] + instant * rows[1:]
    return (rows[0, :12] / rows[0, 12]).reshape(3, 4)


def _one_of_each_part(polyhedron: Polyhedron) -> np.ndarray:
    """Return a vertex of each connected part of the surface."""
    count = len(polyhedron.vertices)
    start, end = polyhedron.edges.T
    joined = coo_array((np.ones(len(start)), (start, end)), shape=(count, count))
    _, part = connected_components(joined, directed=False)
    used = np.unique(polyhedron.edges)
    _, first = np.unique(part[used], return_index=True)
    return used[first]
