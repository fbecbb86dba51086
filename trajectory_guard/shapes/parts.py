"""Clusters of a mesh's faces as packed solids, down to single triangles, a subtree at a time."""

from typing import NamedTuple

import numpy as np

from trajectory_guard.kernels.layout import BUILT, LANES, Solids, TRIANGLE, UNBUILT, UP
from trajectory_guard.shapes.body import U
from trajectory_guard.shapes.primitive import BOX_CORNERS
from trajectory_guard.shapes.surface import Surface

# Clusters are halved so many times at once, into a thousand at most.
LEVELS = 10

# A cluster of more points is packed as the corners of a box.
MOST_POINTS = 32

# Steps towards the centre of a small ball.
STEPS = 8


class Subtrees(NamedTuple):
    """
    What lies below some clusters of one surface.

    :param solids: two halves of each cluster, then two of each half, ...; CHILD counts from the
        first of them, WHOLE and NODE are left zero.
    :param spans: (k, 2) the faces of each cluster, first and end in the order of the faces.
    """

    solids: Solids
    spans: np.ndarray


class Clusters:
    """
    A binary tree over the faces of a surface, of which only what is asked for gets built.

    A cluster is a span of the ordered faces. It is halved at the median of the faces' centroids
    along their longest side, so the tree does not depend on what is asked for.

    :param surface: the mesh, in the frame of the whole that it refines.
    """

    def __init__(self, surface: Surface) -> None:
        self._points, self._ball, self._turn = surface.placed
        self._triangles = surface.triangles
        self._centroids = (self._points @ self._turn)[surface.triangles].mean(axis=1)
        self._order = np.arange(len(surface.triangles))

    def below(self, spans: np.ndarray) -> Subtrees:
        """
        Return the clusters below some.

        :param spans: (w, 2) their faces, two at least each.
        """
        level = spans
        levels: list[np.ndarray] = []
        kinds: list[np.ndarray] = []
        children: list[np.ndarray] = []
        count = 0
        for depth in range(LEVELS):
            level = self._halves(level)
            count += len(level)
            single = level[:, 1] - level[:, 0] == 1
            whole = depth + 1 < LEVELS
            kinds.append(np.where(single, TRIANGLE, BUILT if whole else UNBUILT))
            # The halves of this level follow it, in its order.
            place = count + 2 * (np.cumsum(~single) - 1)
            children.append(np.where(~single & whole, place, 0))
            levels.append(level)
            level = level[~single]
            if not len(level):
                break
        spans = np.concatenate(levels)
        return Subtrees(
            self._packed(spans, np.concatenate(kinds), np.concatenate(children)), spans
        )

    def _halves(self, spans: np.ndarray) -> np.ndarray:
        """Order the faces of each span, two at least, and return both its halves."""
        at, of, starts = _members(spans)
        x = self._centroids[self._order[at]]
        extent = np.maximum.reduceat(x, starts) - np.minimum.reduceat(x, starts)
        key = x[np.arange(len(at)), extent.argmax(axis=1)[of]]
        self._order[at] = self._order[at][np.lexsort((key, of))]
        middle = (spans[:, 0] + spans[:, 1]) // 2
        return np.column_stack((spans[:, 0], middle, middle, spans[:, 1])).reshape(-1, 2)

    def _packed(self, spans: np.ndarray, kinds: np.ndarray, children: np.ndarray) -> Solids:
        """
        Return solids that contain the faces of the spans.

        A sphere contains the points themselves. The box has the axes T of the mesh; as whatever is
        computed with them rounds, and they are square to each other only within rounding, its
        sides are widened. With no entry of T T^T - I above d and no coordinate of x above s, T T^T
        x is off x by 3 sqrt(3) d s at most, so x leaves the box of T^T x by less than 6 d s.
        """
        at, of, _ = _members(spans)
        corners = self._triangles[self._order[at]]
        count = len(self._points)
        keys = np.unique((of[:, None] * np.int64(count) + corners).ravel())
        owner, x = keys // count, self._points[keys % count]
        counts = np.bincount(owner, minlength=len(spans))
        starts = np.cumsum(counts) - counts
        center, radius = _spheres(x, owner, starts, counts)
        scale = np.abs(self._points).max()
        defect = np.abs(self._turn @ self._turn.T - np.eye(3)).max()
        local = x @ self._turn
        low, high = np.minimum.reduceat(local, starts), np.maximum.reduceat(local, starts)
        half = 0.5 * (high - low) * UP + (6.0 * defect + 64.0 * U) * scale
        middle = 0.5 * (low + high) @ self._turn.T
        boxed = middle[:, None] + (BOX_CORNERS * half[:, None]) @ self._turn.T
        big = counts > MOST_POINTS
        used = np.where(big, LANES, -(-counts // LANES) * LANES)
        ends = np.cumsum(used)
        slot = np.arange(ends[-1]) - np.repeat(ends - used, used)
        node = np.repeat(np.arange(len(spans)), used)
        # Rows are filled up with copies of the last point.
        vertices = x[starts[node] + np.minimum(slot, counts[node] - 1)]
        vertices[big[node]] = boxed[big].reshape(-1, 3)
        distance = np.maximum.reduceat(np.linalg.norm(vertices, axis=1), ends - used)
        zero, one = np.zeros(len(spans)), np.ones(len(spans))
        ranges = np.column_stack((ends - used, ends, zero, zero, zero, zero, kinds, children))
        far = (distance + self._ball) * UP
        pose = np.concatenate(
            (np.broadcast_to(self._turn, (len(spans), 3, 3)), middle[..., None]), 2
        )
        return Solids(
            ranges=ranges.astype(np.int64),
            size=np.column_stack((self._ball * one, zero, radius, far, -np.inf * one)),
            place=np.column_stack((zero, zero, one, center, half, pose.reshape(-1, 12))),
            vertices=np.ascontiguousarray(vertices.T),
            faces=np.empty((4, 0)),
        )


def _members(spans: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the members of all spans, the span of each, and where each span's members start."""
    lengths = spans[:, 1] - spans[:, 0]
    of = np.repeat(np.arange(len(spans)), lengths)
    starts = np.cumsum(lengths) - lengths
    return np.arange(len(of)) - starts[of] + spans[of, 0], of, starts


def _spheres(
    x: np.ndarray, owner: np.ndarray, starts: np.ndarray, counts: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """
    Return small spheres around groups of points, their centres within the groups' hulls.

    From the mean a step of 1/2, 1/3, ... towards the farthest point [Badoiu, Clarkson 2003].

    :param x: (n, 3) points, group by group [m].
    :param owner: (n,) group of each.
    :param starts: (k,) first point of each group.
    :param counts: (k,) points of each group.
    """
    center = np.add.reduceat(x, starts) / counts[:, None]
    best = center
    smallest = np.full(len(starts), np.inf)
    for step in range(STEPS):
        offset = x - center[owner]
        square = np.einsum('ni,ni->n', offset, offset)
        farthest = np.maximum.reduceat(square, starts)
        better = farthest < smallest
        best = np.where(better[:, None], center, best)
        smallest = np.where(better, farthest, smallest)
        at = np.flatnonzero(square == farthest[owner])
        at = at[np.unique(owner[at], return_index=True)[1]]
        center = center + (x[at] - center) / (step + 2)
    scale = np.abs(x).max()
    return best, (np.sqrt(smallest) + 1e-15 * scale) * UP
