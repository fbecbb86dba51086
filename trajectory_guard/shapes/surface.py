"""The triangles of a mesh whose convex hull is more than the mesh."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from trajectory_guard.shapes.body import TRANSFORM_ROUNDING, U


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


class Shell(NamedTuple):
    """
    Triangles of which every edge has an even number.

    Then rays from a point meet them an odd number of times, or an even one, whatever their
    direction: there is an inside, however they are wound.

    :param triangles: (m, 3) indices.
    :param wound: whether each edge is run through equally often in both directions.
    """

    triangles: np.ndarray
    wound: bool


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
    def is_watertight(self) -> bool:
        """Whether it has an inside."""
        return bool(self.shells)

    @cached_property
    def shells(self) -> tuple[Shell, ...]:
        """
        What of the surface has an inside, none if it is open; what is inside one is inside.

        That is the surface as it is, and with each triangle once: drawn twice, to be seen from
        both sides, it would cancel, and drawn three times it would open its neighbours' edges.
        """
        a, b, c = self.triangles.T
        proper = self.triangles[(a != b) & (b != c) & (c != a)]
        _, first, of = np.unique(
            np.sort(proper, axis=1), axis=0, return_index=True, return_inverse=True
        )
        of = of.ravel()
        once = proper[np.sort(first)]
        candidates = [once]
        if len(once) < len(proper):
            odd = (np.bincount(of) % 2).any()
            # What is drawn an even number of times bounds nothing, unless it winds round it.
            if odd or (np.bincount(of, _side(proper)).any() and self._is_wound(proper)):
                candidates.append(proper)
        shells = [rows for rows in candidates if len(rows) and self._is_closed(rows)]
        return tuple(Shell(rows, self._is_wound(rows)) for rows in shells)

    def _is_closed(self, triangles: np.ndarray) -> bool:
        ends = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges = ends[:, 0] * np.int64(len(self.points)) + ends[:, 1]
        return bool((np.unique(edges, return_counts=True)[1] % 2 == 0).all())

    def _is_wound(self, triangles: np.ndarray) -> bool:
        # Brings scipy, as below; few requests need it.
        from trajectory_guard.shapes.inscribed import is_closed

        return is_closed(triangles, len(self.points))

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


def _side(triangles: np.ndarray) -> np.ndarray:
    """Return 1 or -1 for each triangle: equal for two with the same corners if wound alike."""
    a, b, c = triangles.T
    return np.where((a < b) ^ (b < c) ^ (c < a), 1.0, -1.0)
