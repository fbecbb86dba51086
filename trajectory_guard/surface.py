"""The triangles of a mesh whose convex hull is more than the mesh."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from trajectory_guard.body import TRANSFORM_ROUNDING, U


class Placed(NamedTuple):
    """
    A surface where its motions have brought it.

    :param points: (n, 3) corners [m].
    :param ball: how far a real corner may be from its point [m].
    :param turn: (3, 3) the motions' rotation, within rounding.
    """

    points: np.ndarray
    ball: float
    turn: np.ndarray


# Without slots, so that what was computed can be kept.
@dataclass(frozen=True, eq=False)
class Surface:
    """
    A triangle surface and the rigid motions that it has made since it was read.

    Nothing is computed before it is asked for, and then once.

    :param points: (n, 3) corners in the mesh's own frame, no two equal [m].
    :param triangles: (m, 3) indices, m >= 2.
    :param ball: how far a real corner may be from its point [m].
    :param poses: rigid transforms, (4, 4) each, one applied after the other [m].
    """

    points: np.ndarray
    triangles: np.ndarray
    ball: float = 0.0
    poses: tuple[np.ndarray, ...] = ()

    def moved(self, T: np.ndarray) -> 'Surface':
        """Return the surface after one more rigid motion, whose rigidity has been checked."""
        return replace(self, poses=(*self.poses, T))

    @cached_property
    def placed(self) -> Placed:
        """Where the surface is now; each motion rounds as it does for a body."""
        points, ball, turn = self.points, self.ball, np.eye(3)
        for T in self.poses:
            R, t = T[:3, :3], T[:3, 3]
            reach = np.abs(points).sum(axis=1).max() + np.abs(t).sum()
            points = points @ R.T + t
            ball = float((ball + TRANSFORM_ROUNDING * U * reach) * (1.0 + 4.0 * U))
            turn = R @ turn
        return Placed(points, ball, turn)

    @cached_property
    def _proper(self) -> np.ndarray:
        a, b, c = self.triangles.T
        return self.triangles[(a != b) & (b != c) & (c != a)]

    @cached_property
    def is_watertight(self) -> bool:
        """
        Whether every edge has an even number of triangles.

        Then rays from a point meet the surface an odd number of times, or an even one, whatever
        their direction: it has an inside, however its triangles are wound.
        """
        ends = np.sort(self._proper[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges = ends[:, 0] * np.int64(len(self.points)) + ends[:, 1]
        return bool((np.unique(edges, return_counts=True)[1] % 2 == 0).all())

    @cached_property
    def is_wound(self) -> bool:
        """Whether each edge is run through equally often in both directions."""
        # Brings scipy, as below; few requests need it.
        from trajectory_guard.inscribed import is_closed

        return is_closed(self._proper, len(self.points))

    @cached_property
    def pieces(self) -> np.ndarray:
        """One corner of each connected piece, as indices of points."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        a, b, c = self.triangles.T
        rows, columns = np.concatenate((a, b)), np.concatenate((b, c))
        count = len(self.points)
        graph = coo_array((np.ones(len(rows), bool), (rows, columns)), shape=(count, count))
        _, first = np.unique(connected_components(graph, directed=False)[1], return_index=True)
        return first
