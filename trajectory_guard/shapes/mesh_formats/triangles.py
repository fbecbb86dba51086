"""What every mesh reader returns, and how polygons become triangles."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from trajectory_guard.shapes.body import read_only


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """
    A triangle surface.

    :param points: (n, 3), in the file's own frame and unit [m after URDF scaling].
    :param triangles: rows of indices into points, (m, 3) int64, m >= 1.
    :param rounding: how far a point may be from what the file says, by arithmetic of the reader.
    :raises ValueError: no triangle, an index out of range, or a coordinate that is not finite.
    """

    points: np.ndarray
    triangles: np.ndarray
    rounding: float = 0.0

    def __post_init__(self) -> None:
        """Check the values and keep only the points that the surface uses."""
        triangles = np.asarray(self.triangles, dtype=np.int64).reshape(-1, 3)
        if not len(triangles):
            raise ValueError('the file has no triangles')
        if triangles.min() < 0 or triangles.max() >= len(self.points):
            raise ValueError(f'a face names a vertex outside 1..{len(self.points)}')
        used = np.zeros(len(self.points), dtype=bool)
        used[triangles] = True
        triangles = (np.cumsum(used) - 1)[triangles]
        points = read_only(np.asarray(self.points)[used])
        broken = ~np.isfinite(points).all(axis=1)
        if broken.any():
            raise ValueError(f'a vertex is not finite: {points[broken][0].tolist()}')
        triangles.flags.writeable = False
        object.__setattr__(self, 'points', points)
        object.__setattr__(self, 'triangles', triangles)


def fans(polygons: Iterable[Sequence[int]]) -> np.ndarray:
    """
    Split polygons into fans of triangles round their first vertex.

    The boundary of the fan is that of the polygon, so closed surfaces stay closed.

    :param polygons: vertex indices in order.
    :returns: (m, 3) int64.
    :raises ValueError: a polygon has fewer than three corners.
    """
    polygons = list(polygons)
    if set(map(len, polygons)) == {3}:
        return np.array(polygons, dtype=np.int64)
    rows: list[tuple[int, int, int]] = []
    for polygon in polygons:
        if len(polygon) < 3:
            raise ValueError(f'a face has {len(polygon)} corners')
        first = polygon[0]
        rows.extend((first, polygon[k], polygon[k + 1]) for k in range(1, len(polygon) - 1))
    return np.array(rows, dtype=np.int64).reshape(-1, 3)
