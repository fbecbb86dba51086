"""Whether one of two polyhedra with disjoint surfaces lies inside the other, at an instant."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from trajectory_guard.body import U
from trajectory_guard.containment import may_contain
from trajectory_guard.kernels.ball import Curve
from trajectory_guard.polyhedron import Polyhedron


@dataclass(frozen=True, slots=True, eq=False)
class Probe:
    """
    A polyhedron, and a vertex of each connected part of its surface.

    :param polyhedron: a solid if it is watertight, else a surface that has no inside.
    :param part: (P,) indices of vertices.
    """

    polyhedron: Polyhedron
    part: np.ndarray


def probe(polyhedron: Polyhedron) -> Probe:
    """Return a polyhedron with a vertex of each of its parts."""
    count = len(polyhedron.vertices)
    start, end = polyhedron.edges.T
    joined = coo_array((np.ones(len(start)), (start, end)), shape=(count, count))
    _, part = connected_components(joined, directed=False)
    used = np.unique(polyhedron.edges)
    _, first = np.unique(part[used], return_index=True)
    return Probe(polyhedron, used[first])


def surely_apart(moving: Probe, fixed: Probe, curve: Curve, instant: float) -> bool:
    """
    Say whether neither of two polyhedra has a part inside the other.

    Their surfaces are known to keep apart, so each part of a surface is inside a solid as a whole
    or not at all, and one vertex of it tells; nothing is inside a surface that is not watertight.

    :param moving: in its own frame.
    :param fixed: in the frame of the motion's images.
    :param curve: the motion.
    :param instant: in [0, 1].
    :returns: False where one is inside, and in doubt.
    """
    pose = pose_at(curve, instant)
    corners = moving.polyhedron.vertices
    images, still = corners @ pose[:, :3].T + pose[:, 3], fixed.polyhedron.vertices
    # The pose is rounded as `pose_at` says, its product with a corner by 4 u more.
    largest = np.abs(curve.points).max(axis=0).reshape(3, 4)
    reach = float((largest[:, :3].sum(axis=1) * np.abs(corners).max() + largest[:, 3]).max())
    doubt = 8.0 * (len(curve.weights) + 2.0) * U * reach
    return not (
        _may_contain(fixed.polyhedron, still, images[moving.part], doubt)
        or _may_contain(moving.polyhedron, images, still[fixed.part], doubt)
    )


def _may_contain(solid: Polyhedron, corners: np.ndarray, places: np.ndarray, doubt: float) -> bool:
    """Say whether one of some places may be inside a polyhedron with its corners there."""
    if not solid.watertight:
        return False
    low, high = corners.min(axis=0) - doubt, corners.max(axis=0) + doubt
    # Written so that a NaN is near.
    near = places[~((places < low) | (places > high)).any(axis=1)]
    return any(may_contain(corners, solid.triangles, True, place, doubt) for place in near)


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
