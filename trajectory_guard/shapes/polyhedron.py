"""
Polyhedral surfaces: vertices, and polygons between them.

A face *is* the union of its triangles: for three corners, itself; for more, the triangles of
``triangulate`` on the same corners. So the surface is defined exactly by the vertices, and corners
of a larger face need not lie in one plane to the last bit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from trajectory_guard.shapes.body import LARGEST_COORDINATE, read_only
from trajectory_guard.shapes.triangulate import triangulate
from trajectory_guard.shapes.unique_rows import unique_rows


@dataclass(frozen=True, slots=True, eq=False)
class Polyhedron:
    """
    A surface of planar simple polygons; closed or not, convex or not.

    :param vertices: (V, 3) [m].
    :param faces: indices of each face's corners, three or more different ones, counter-clockwise
        seen from outside where there is an outside.  A triangle may be flat (its corners on a
        line), so that closed surfaces with such triangles stay closed.
    :raises ValueError: a coordinate is not finite or larger than `LARGEST_COORDINATE`; there is no
        face; a face has fewer than three corners, one twice, or one that is no vertex, or is not a
        simple planar polygon.

    ``watertight``: every directed side of a face occurs once, and so does its opposite; the
    surface then bounds a solid (a point is inside if the surface winds round it).
    ``edges``: (E, 2) sides of the faces, each once, smaller index first.  ``triangles``: (T, 3),
    those of the faces in order.  ``triangle_face``: (T,) the face that each is part of.
    """

    vertices: np.ndarray
    faces: tuple[np.ndarray, ...]
    watertight: bool = field(init=False)
    edges: np.ndarray = field(init=False)
    triangles: np.ndarray = field(init=False)
    triangle_face: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Check the values, make the arrays read-only, find edges and triangles."""
        vertices = read_only(self.vertices)
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise ValueError(f'vertices must have shape (V, 3), got {vertices.shape}')
        # Written so that a NaN fails.
        if not (np.abs(vertices) <= LARGEST_COORDINATE).all():
            raise ValueError(f'a vertex exceeds {LARGEST_COORDINATE:g} m or is not finite')
        sizes, corners = _corners(self.faces, len(vertices))
        starts = np.cumsum(sizes) - sizes
        after = np.arange(1, len(corners) + 1)
        after[starts + sizes - 1] = starts
        edges, watertight = _edges(corners, corners[after], len(vertices))
        triangles, triangle_face = _triangles(vertices, corners, starts, sizes)
        for array in (corners, edges, triangles, triangle_face):
            array.flags.writeable = False
        ends = (starts + sizes).tolist()
        faces = tuple(corners[i:j] for i, j in zip(starts.tolist(), ends, strict=True))
        for name, value in (
            ('vertices', vertices),
            ('faces', faces),
            ('watertight', watertight),
            ('edges', edges),
            ('triangles', triangles),
            ('triangle_face', triangle_face),
        ):
            object.__setattr__(self, name, value)

    @classmethod
    def from_triangles(cls, points: ArrayLike, triangles: ArrayLike) -> 'Polyhedron':
        """
        Return the surface of a triangle soup, identical points merged.

        A triangle that merging leaves with two corners is a segment: it is left out where that
        segment is a side of another triangle, which covers it (and its two directed sides were
        each other's opposites); elsewhere it is refused.  Flat triangles of three different
        corners are kept.

        :param points: (n, 3) [m].
        :param triangles: (m, 3) indices of points.
        :raises ValueError: see the class; or a triangle is no more than a segment or a point, and
            is not covered by the sides of others.
        """
        placed = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        if not np.isfinite(placed).all():
            raise ValueError('a point is not finite')
        rows = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
        if rows.size and (rows.min() < 0 or rows.max() >= len(placed)):
            raise ValueError(f'a triangle names a point outside 0..{len(placed) - 1}')
        vertices, inverse = unique_rows(placed + 0.0)
        rows = inverse[rows].astype(np.int64)
        ends = rows[:, [1, 2, 0]]
        whole = (rows != ends).all(axis=1)
        count = len(vertices)
        if not whole.all():
            kept = rows[whole]
            sides = _undirected(kept.ravel(), kept[:, [1, 2, 0]].ravel(), count)
            points_kept = kept.ravel() * (count + 1)  # a corner as a side to itself
            covered = np.isin(_undirected(rows, ends, count), np.union1d(sides, points_kept))
            bare = ~(whole | covered.all(axis=1))
            if bare.any():
                raise ValueError(
                    f'triangle {bare.argmax()} is no more than a segment, and no side of another'
                )
        used, names = np.unique(rows[whole], return_inverse=True)
        return cls(vertices[used], tuple(names.reshape(-1, 3).astype(np.int64)))


def _corners(faces: Sequence[ArrayLike], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return how many corners each face has, and all of them in a row; checked."""
    rings = [np.asarray(face) for face in faces]
    if not rings:
        raise ValueError('a polyhedron has at least one face')
    for i, ring in enumerate(rings):
        if ring.ndim != 1 or len(ring) < 3 or not np.issubdtype(ring.dtype, np.integer):
            raise ValueError(f'face {i} must have three or more indices, got {ring.tolist()}')
    sizes = np.array([len(ring) for ring in rings])
    corners = np.concatenate(rings).astype(np.int64)
    face = np.repeat(np.arange(len(rings)), sizes)
    wrong = (corners < 0) | (corners >= count)
    if wrong.any():
        at = wrong.argmax()
        raise ValueError(f'face {face[at]} names vertex {corners[at]} of {count}')
    order = np.lexsort((corners, face))
    again = (np.diff(corners[order]) == 0) & (np.diff(face[order]) == 0)
    if again.any():
        at = order[again.argmax()]
        raise ValueError(f'face {face[at]} has corner {corners[at]} twice')
    return sizes, corners


def _undirected(start: np.ndarray, end: np.ndarray, count: int) -> np.ndarray:
    """Return a number for each pair of vertices, the same both ways."""
    return np.minimum(start, end) * count + np.maximum(start, end)


def _edges(start: np.ndarray, end: np.ndarray, count: int) -> tuple[np.ndarray, bool]:
    """Return every side once, and whether each is met by exactly one opposite."""
    sides, times = np.unique(_undirected(start, end, count), return_counts=True)
    directed = np.unique(start * count + end)
    watertight = len(directed) == len(start) and bool((times == 2).all())
    return np.stack(np.divmod(sides, count), axis=1), watertight


def _triangles(
    vertices: np.ndarray, corners: np.ndarray, starts: np.ndarray, sizes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles of all faces in the order of the faces, and the face of each."""
    first = np.cumsum(sizes - 2) - (sizes - 2)
    triangles = np.empty((int((sizes - 2).sum()), 3), dtype=np.int64)
    for size in np.unique(sizes):
        chosen = np.flatnonzero(sizes == size)
        rings = corners[starts[chosen][:, None] + np.arange(size)]
        where = first[chosen][:, None] + np.arange(size - 2)
        triangles[where] = triangulate(vertices, rings)
    return triangles, np.repeat(np.arange(len(sizes)), sizes - 2)
