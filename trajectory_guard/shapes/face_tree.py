"""A binary tree over the faces of a polyhedron, for searches that leave whole regions out."""

from dataclasses import dataclass

import numpy as np

from trajectory_guard.shapes.polyhedron import Polyhedron


@dataclass(frozen=True, slots=True, eq=False)
class FaceTree:
    """
    Nodes over ranges of reordered faces; the root is node 0, a leaf holds one face.

    :param left: (N,) int64 first child, -1 for a leaf; children come after their parent.
    :param right: (N,) int64 second child, -1 for a leaf.
    :param first: (N,) int64; node i holds the faces ``order[first[i]:last[i]]``.
    :param last: (N,) int64.
    :param order: (F,) int64 the faces in the tree's order.
    """

    left: np.ndarray
    right: np.ndarray
    first: np.ndarray
    last: np.ndarray
    order: np.ndarray


def face_tree(polyhedron: Polyhedron) -> FaceTree:
    """
    Split the faces at the median of their centroids along the longest axis, down to single ones.

    All nodes of a level are split together: a sort within ranges is a sort by (range, key).

    :param polyhedron: the surface.
    """
    order = np.arange(len(polyhedron.faces))
    centroids = _centroids(polyhedron)
    first, last = np.zeros(1, np.int64), np.full(1, len(order), np.int64)
    levels = [(first, last)]
    while True:
        wide = last - first > 1
        if not wide.any():
            break
        first, last = first[wide], last[wide]
        order = _sorted_within(order, centroids, first, last)
        middle = (first + last + 1) // 2
        first = np.stack([first, middle], axis=1).ravel()
        last = np.stack([middle, last], axis=1).ravel()
        levels.append((first, last))
    first, last = (np.concatenate(part) for part in zip(*levels, strict=True))
    split = last - first > 1
    # Children of the nodes of a level are the next level, two by two in the same order.
    left = np.where(split, 2 * np.cumsum(split) - 1, -1)
    right = np.where(split, left + 1, -1)
    for array in (left, right, first, last, order):
        array.flags.writeable = False
    return FaceTree(left, right, first, last, order)


def _centroids(polyhedron: Polyhedron) -> np.ndarray:
    """Return the mean of each face's corners, (F, 3)."""
    sizes = np.array([len(face) for face in polyhedron.faces])
    corners = polyhedron.vertices[np.concatenate(polyhedron.faces)]
    sums = np.add.reduceat(corners, np.cumsum(sizes) - sizes, axis=0)
    return sums / sizes[:, None]


def _sorted_within(
    order: np.ndarray, centroids: np.ndarray, first: np.ndarray, last: np.ndarray
) -> np.ndarray:
    """Return the order with each range sorted along the longest axis of its centroids."""
    sizes = last - first
    where = np.repeat(first - (np.cumsum(sizes) - sizes), sizes) + np.arange(sizes.sum())
    mine = np.repeat(np.arange(len(first)), sizes)
    faces = order[where]
    points = centroids[faces]
    starts = np.cumsum(sizes) - sizes
    extent = np.maximum.reduceat(points, starts) - np.minimum.reduceat(points, starts)
    key = points[np.arange(len(points)), extent.argmax(axis=1)[mine]]
    changed = order.copy()
    # Faces of equal keys stay in the order of their numbers, whatever the sort.
    changed[where] = faces[np.lexsort((faces, key, mine))]
    return changed
