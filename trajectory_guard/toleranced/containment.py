"""Whether one of two solids with disjoint surfaces lies inside the other, at an instant."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from trajectory_guard.kernels.ball import Curve
from trajectory_guard.polyhedron import Polyhedron
from trajectory_guard.winding import surely_outside


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """
    A watertight polyhedron, and a vertex of each connected part of its surface.

    :param polyhedron: the solid.
    :param part: (P,) indices of vertices.
    """

    polyhedron: Polyhedron
    part: np.ndarray


def solid(polyhedron: Polyhedron) -> Solid:
    """Return a watertight polyhedron with its parts."""
    count = len(polyhedron.vertices)
    start, end = polyhedron.edges.T
    joined = coo_array((np.ones(len(start)), (start, end)), shape=(count, count))
    _, part = connected_components(joined, directed=False)
    used = np.unique(polyhedron.edges)
    _, first = np.unique(part[used], return_index=True)
    return Solid(polyhedron, used[first])


def surely_apart(moving: Solid, fixed: Solid, curve: Curve, instant: float) -> bool:
    """
    Say whether neither of two solids has a part inside the other.

    Their surfaces are known to keep apart by more than the rounding of a pose, so each part of a
    surface is inside as a whole or not at all, and one vertex of it tells.

    :param moving: in its own frame.
    :param fixed: in the frame of the motion's images.
    :param curve: the motion.
    :param instant: in [0, 1].
    :returns: False where one is inside, and in doubt.
    """
    pose = pose_at(curve, instant)
    images = moving.polyhedron.vertices @ pose[:, :3].T + pose[:, 3]
    still = fixed.polyhedron.vertices
    return surely_outside(
        images[moving.part], still, fixed.polyhedron.triangles
    ) and surely_outside(still[fixed.part], images, moving.polyhedron.triangles)


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
