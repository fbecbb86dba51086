"""A polyhedron and the tree over its faces as the kernels take them."""

from typing import NamedTuple

import numpy as np

from trajectory_guard.kernels.ball import Surface
from trajectory_guard.shapes.body import U
from trajectory_guard.shapes.face_tree import face_tree, FaceTree
from trajectory_guard.shapes.polyhedron import Polyhedron


class _Parts(NamedTuple):
    """Edges and triangles of all faces by corners within the face, and where each face's begin."""

    edge_first: np.ndarray
    edge: np.ndarray
    triangle_first: np.ndarray
    triangle: np.ndarray


def surface(polyhedron: Polyhedron) -> Surface:
    """
    Pack a polyhedron.

    :param polyhedron: the surface.
    """
    tree = face_tree(polyhedron)
    sizes = np.array([len(face) for face in polyhedron.faces])
    vertex = np.concatenate(polyhedron.faces)
    corner = polyhedron.vertices[vertex]
    corner_first = _starts(sizes)
    box = _boxes(corner, corner_first, tree)
    leaf = tree.left < 0
    face = np.where(leaf, tree.order[tree.first], -1)
    parts = _parts(polyhedron, sizes, corner_first, vertex)
    return Surface(
        corner_first,
        corner,
        vertex,
        parts.edge_first,
        parts.edge,
        parts.triangle_first,
        parts.triangle,
        np.ascontiguousarray(np.stack([tree.left, tree.right, face], axis=1)),
        box,
        float(np.linalg.norm(np.abs(box[0, :3]) + box[0, 3:])) * (1.0 + 8.0 * U),
    )


def _starts(sizes: np.ndarray) -> np.ndarray:
    """Return where runs of these sizes begin, and the end of the last."""
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)


def _boxes(corner: np.ndarray, corner_first: np.ndarray, tree: FaceTree) -> np.ndarray:
    """Return centre and half sides of a box around each node's faces, rounded outward, (N, 6)."""
    low = np.minimum.reduceat(corner, corner_first[:-1])[tree.order]
    high = np.maximum.reduceat(corner, corner_first[:-1])[tree.order]
    # Every other run is a node's; one more row, because an end may not be past the last.
    runs = np.stack([tree.first, tree.last], axis=1).ravel()
    low = np.minimum.reduceat(np.vstack([low, low[-1:]]), runs)[::2]
    high = np.maximum.reduceat(np.vstack([high, high[-1:]]), runs)[::2]
    centre = 0.5 * low + 0.5 * high
    half = np.maximum(high - centre, centre - low) * (1.0 + 4.0 * U)
    return np.ascontiguousarray(np.hstack([centre, half]))


def _parts(
    polyhedron: Polyhedron, sizes: np.ndarray, corner_first: np.ndarray, vertex: np.ndarray
) -> _Parts:
    """
    Return edges and triangles of all faces.

    Of k corners k sides and k - 3 diagonals are edges; a diagonal is a side of two triangles that
    run along it in opposite directions.
    """
    edge_first, triangle_first = _starts(2 * sizes - 3), _starts(sizes - 2)
    edge = np.empty((edge_first[-1], 2), np.int64)
    triangle = np.empty((triangle_first[-1], 3), np.int64)
    for k in np.unique(sizes):
        faces = np.flatnonzero(sizes == k)
        rings = vertex[corner_first[faces][:, None] + np.arange(k)]
        rows = triangle_first[faces][:, None] + np.arange(k - 2)
        named = polyhedron.triangles[rows]
        local = (rings[:, None, None, :] == named[..., None]).argmax(axis=-1)
        triangle[rows] = local
        sides = np.stack([np.arange(k), (np.arange(k) + 1) % k], axis=1)
        directed = np.stack([local, np.roll(local, -1, axis=2)], axis=-1).reshape(
            len(faces), -1, 2
        )
        steps = directed[..., 1] - directed[..., 0]
        diagonal = (steps > 1) & (steps < k - 1)
        chosen = directed[diagonal].reshape(len(faces), k - 3, 2)
        where = edge_first[faces][:, None]
        edge[where + np.arange(k)] = sides
        edge[where + k + np.arange(k - 3)] = chosen
    return _Parts(edge_first, edge, triangle_first, triangle)
