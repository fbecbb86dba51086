"""The curves in which the patches of an orbit's boundary meet."""

import numpy as np

from trajectory_guard.toleranced.patches import Mesh, Patch

# Patches repeat the vertices of their common side, which rounding sets this far apart at most, as
# a fraction of the size.
SAME = 1e-7


def arcs(mesh: Mesh, first: Patch, second: Patch) -> tuple[np.ndarray, np.ndarray]:
    """
    Return the sides that triangles of one kind of patch share with triangles of another.

    :param mesh: a boundary.
    :param first: a label.
    :param second: another label.
    :returns: the sides (n, 2, 3) [m] and the indices of their triangles, (n, 2).
    """
    size = SAME * np.ptp(mesh.vertices, axis=0).max()
    _, place = np.unique(np.round(mesh.vertices / size), axis=0, return_inverse=True)
    place = place.ravel().tolist()
    sides: dict[tuple[int, int], int] = {}
    found = []
    for wanted in (first, second):
        for triangle in np.flatnonzero(mesh.labels == wanted).tolist():
            corners = mesh.triangles[triangle].tolist()
            if len({place[corner] for corner in corners}) < 3:
                # Where a patch comes to a point a triangle is no more than a side of the next.
                continue
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
                key = (min(place[a], place[b]), max(place[a], place[b]))
                if wanted == first:
                    sides[key] = triangle
                elif key in sides:
                    found.append((mesh.vertices[[a, b]], (sides[key], triangle)))
    return np.array([side for side, _ in found]), np.array([pair for _, pair in found])
