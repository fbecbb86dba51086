"""Whether one of two polyhedra with disjoint surfaces lies inside the other, at an instant."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from trajectory_guard.kernels.ball import Curve
from trajectory_guard.shapes.body import U
from trajectory_guard.shapes.containment import may_contain
from trajectory_guard.shapes.polyhedron import Polyhedron


@dataclass(frozen=True, slots=True, eq=False)
class Probe:
    """
    A polyhedron, and a vertex of each connected part of its surface.

    :param polyhedron: one solid or several if it is watertight, else a surface without an inside.
    :param part: (P,) indices of vertices.
    :param triangles: (T, 3) those of the polyhedron, solid by solid.
    :param first: (S,) where the triangles of each solid begin.
    """

    polyhedron: Polyhedron
    part: np.ndarray
    triangles: np.ndarray
    first: np.ndarray


def probe(polyhedron: Polyhedron, solids: np.ndarray | None = None) -> Probe:
    """
    Return a polyhedron with a vertex of each of its parts.

    :param polyhedron: the surface.
    :param solids: (F,) the solid that each face bounds; one if None. What is inside is asked of
        each by itself: what one winds round could cancel another that is wound the other way.
    """
    count = len(polyhedron.vertices)
    start, end = polyhedron.edges.T
    joined = coo_array((np.ones(len(start)), (start, end)), shape=(count, count))
    _, part = connected_components(joined, directed=False)
    used = np.unique(polyhedron.edges)
    _, first = np.unique(part[used], return_index=True)
    owner = np.zeros(len(polyhedron.faces), np.int64) if solids is None else solids
    owner = owner[polyhedron.triangle_face]
    order = np.argsort(owner, kind='stable')
    _, begin = np.unique(owner[order], return_index=True)
    return Probe(polyhedron, used[first], polyhedron.triangles[order], begin)


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
        _may_contain(fixed, still, images[moving.part], doubt)
        or _may_contain(moving, images, still[fixed.part], doubt)
    )


def _may_contain(outer: Probe, corners: np.ndarray, places: np.ndarray, doubt: float) -> bool:
    """Say whether one of some places may be inside a solid of a polyhedron with its corners so."""
    if not outer.polyhedron.watertight:
        return False
    own = corners[outer.triangles]
    low = np.minimum.reduceat(own.min(axis=1), outer.first) - doubt
    high = np.maximum.reduceat(own.max(axis=1), outer.first) + doubt
    solids = np.split(outer.triangles, outer.first[1:])
    # Written so that a NaN is near.
    return any(
        may_contain(corners, solids[i], True, place, doubt)
        for place in places
        for i in np.flatnonzero(~((place < low) | (place > high)).any(axis=1))
    )


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
