"""The tree over faces: every node is the range of its children, every leaf one face."""

import time

import numpy as np
import pytest

from trajectory_guard.shapes.face_tree import face_tree
from trajectory_guard.shapes.polyhedron import Polyhedron


def grid(n):
    """Return the unit square as n x n squares."""
    x = np.linspace(0.0, 1.0, n + 1)
    points = np.array([[a, b, 0.0] for a in x for b in x])
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    return Polyhedron(points, tuple(corner[:, None] + [0, n + 1, n + 2, 1]))


@pytest.mark.parametrize('n', [1, 2, 3, 7])
def test_nodes_are_ranges(n):
    surface = grid(n)
    tree = face_tree(surface)
    assert sorted(tree.order) == list(range(n * n))
    assert (tree.first[0], tree.last[0]) == (0, n * n)
    assert len(tree.left) == 2 * n * n - 1
    children = np.concatenate([tree.left, tree.right])
    assert sorted(children[children >= 0]) == list(range(1, len(tree.left)))
    for i, (left, right) in enumerate(zip(tree.left, tree.right, strict=True)):
        if left < 0:
            assert right < 0
            assert tree.last[i] - tree.first[i] == 1
        else:
            assert i < left < right
            assert tree.first[left] == tree.first[i]
            assert tree.last[left] == tree.first[right]
            assert tree.last[right] == tree.last[i]
            assert abs(2 * tree.last[left] - tree.first[i] - tree.last[i]) <= 1


def test_split_along_the_longest_axis():
    """The halves of a long strip are its ends."""
    surface = grid(8)
    stretched = Polyhedron(surface.vertices * [1.0, 5.0, 1.0], surface.faces)
    tree = face_tree(stretched)
    half = tree.order[tree.first[1] : tree.last[1]]
    assert max(stretched.vertices[stretched.faces[i]][:, 1].max() for i in half) <= 2.5


def test_equal_centroids_are_split():
    """Faces on top of each other make a tree all the same, and always the same one."""
    face = np.array([0, 1, 2])
    surface = Polyhedron(np.eye(3), (face,) * 100)
    tree = face_tree(surface)
    assert tree.order.tolist() == list(range(100))
    assert len(tree.left) == 199


def test_many_faces_are_quick():
    surface = grid(100)
    begin = time.perf_counter()
    tree = face_tree(surface)
    assert time.perf_counter() - begin < 0.3
    assert len(tree.left) == 19999
