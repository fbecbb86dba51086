"""Convex polyhedra with exactly known faces."""

from collections.abc import Sequence
from dataclasses import dataclass, field
import itertools
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike

from trajectory_guard.canny.exact_hull import exact_hull
from trajectory_guard.canny.integers import cross, dot, exponent, minus, scaled
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.shapes.body import LARGEST_COORDINATE, read_only


@dataclass(frozen=True, slots=True, eq=False)
class ConvexPolyhedron:
    """
    A closed convex solid with an interior, given by its boundary.

    The coordinates are taken as exact numbers, and everything is checked with exact numbers: faces
    are plane, no vertex lies outside of one, and every edge has one face on either side. Faces may
    lie in one plane.

    :param vertices: (V, 3), no two equal [m].
    :param faces: F rows of indices of vertices, counter-clockwise seen from outside.
    :param edges: (E, 2) int64, tail and head.
    :param edge_faces: (E, 2) int64: the face that the edge bounds counter-clockwise, the other.
    :param face_edges: for each face its edges and 1 if they run counter-clockwise, else -1.
    :raises RequestError: it is not such a solid.
    """

    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    edges: np.ndarray = field(init=False)
    edge_faces: np.ndarray = field(init=False)
    face_edges: tuple[tuple[tuple[int, int], ...], ...] = field(init=False)

    def __post_init__(self) -> None:
        """Check all values and find the edges."""
        object.__setattr__(self, 'vertices', _checked_points(self.vertices))
        faces = tuple(tuple(int(i) for i in face) for face in self.faces)
        object.__setattr__(self, 'faces', faces)
        bounds = self._bounds()
        edges = [edge for edge in bounds if edge[0] < edge[1]]
        number = {edge: i for i, edge in enumerate(edges)}
        object.__setattr__(self, 'edges', _indices(edges))
        object.__setattr__(
            self, 'edge_faces', _indices([(bounds[e], bounds[e[::-1]]) for e in edges])
        )
        object.__setattr__(
            self,
            'face_edges',
            tuple(
                tuple((number[min(a, b), max(a, b)], 1 if a < b else -1) for a, b in _around(face))
                for face in faces
            ),
        )
        self._check_shape()

    @classmethod
    def hull(cls, points: ArrayLike) -> 'ConvexPolyhedron':
        """
        Return the exact convex hull of points.

        :param points: (n, 3), equal ones count once [m].
        :raises RequestError: they lie in one plane, or a coordinate is not finite or too large.
        """
        cloud = np.unique(_checked_points(np.atleast_2d(points)), axis=0)
        faces = exact_hull(scaled(cloud, exponent(cloud)))
        if not faces:
            _refuse('points', f'{len(cloud)} different points lie in one plane')
        kept = sorted({i for face in faces for i in face})
        number = {i: k for k, i in enumerate(kept)}
        return cls(cloud[kept], tuple(tuple(number[i] for i in face) for face in faces))

    @classmethod
    def box(cls, lower: Sequence[float], upper: Sequence[float]) -> 'ConvexPolyhedron':
        """
        Return an axis-aligned box.

        :param lower: least corner, (3,) [m].
        :param upper: greatest corner, (3,) [m].
        :raises RequestError: it has no interior.
        """
        corners = np.array([lower, upper], dtype=np.float64)
        return cls.hull(
            [[corners[i, 0], corners[j, 1], corners[k, 2]] for i, j, k in np.ndindex(2, 2, 2)]
        )

    def _bounds(self) -> dict[tuple[int, int], int]:
        """Return the face that each directed edge bounds counter-clockwise."""
        bounds: dict[tuple[int, int], int] = {}
        for f, face in enumerate(self.faces):
            if len(face) < 3 or not all(0 <= i < len(self.vertices) for i in face):
                _refuse(f'faces[{f}]', f'{face} is not three or more indices of vertices')
            for edge in _around(face):
                if edge in bounds or edge[0] == edge[1]:
                    _refuse(f'faces[{f}]', f'edge {edge} is already bounded by a face')
                bounds[edge] = f
        for edge, f in bounds.items():
            if edge[::-1] not in bounds:
                _refuse(f'faces[{f}]', f'edge {edge} has no face on its other side')
        return bounds

    def _check_shape(self) -> None:
        """Refuse what is not the boundary of a convex solid."""
        points = scaled(self.vertices, exponent(self.vertices))
        if len({tuple(p) for p in points}) < len(points):
            _refuse('vertices', 'two are equal')
        for f, face in enumerate(self.faces):
            corners = [points[i] for i in face]
            normal = face_normal(corners)
            heights = [dot(normal, minus(p, corners[0])) for p in points]
            if not any(normal) or any(heights[i] for i in face):
                _refuse(f'faces[{f}]', f'{face} is not a plane polygon')
            if max(heights) > 0:
                _refuse(f'faces[{f}]', f'vertex {heights.index(max(heights))} lies outside of it')
            for a, b in _around(face):
                inward = cross(normal, minus(points[b], points[a]))
                if any(dot(inward, minus(p, points[a])) < 0 for p in corners):
                    _refuse(f'faces[{f}]', f'{face} is not convex at edge {(a, b)}')
        # Planes that all vertices lie below are faces of the hull; a sphere of them is all of it.
        if len(self.vertices) - len(self.edges) + len(self.faces) != 2:
            _refuse('faces', 'they do not close one surface that has all the vertices')


def face_normal(corners: list[list[int]]) -> list[int]:
    """
    Return the outward normal of a plane convex polygon, of twice its area as length.

    :param corners: (n, 3) counter-clockwise.
    """
    total = [0, 0, 0]
    for b, c in itertools.pairwise(corners[1:]):
        part = cross(minus(b, corners[0]), minus(c, corners[0]))
        total = [x + y for x, y in zip(total, part, strict=True)]
    return total


def _around(face: tuple[int, ...]) -> list[tuple[int, int]]:
    return list(zip(face, face[1:] + face[:1], strict=True))


def _indices(rows: list[tuple[int, int]]) -> np.ndarray:
    array = np.array(rows, dtype=np.int64).reshape(-1, 2)
    array.flags.writeable = False
    return array


def _checked_points(points: ArrayLike) -> np.ndarray:
    array = read_only(points)
    if array.ndim != 2 or array.shape[1] != 3 or len(array) < 4:
        _refuse('vertices', f'shape {array.shape} is not (n, 3) with n > 3')
    if not np.abs(array).max() <= LARGEST_COORDINATE:
        _refuse('vertices', f'one exceeds {LARGEST_COORDINATE:g} m or is not finite')
    return array


def _refuse(name: str, what: str) -> NoReturn:
    raise RequestError(Reason.INVALID_PARAMETER, f'polyhedron.{name}: {what}')
