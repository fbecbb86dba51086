"""The polygons of the experiments."""

import numpy as np

from trajectory_guard.shapes.polyhedron import Polyhedron


def octagon(radius: float) -> Polyhedron:
    """Return a regular octagon in the plane z = 0."""
    angle = (np.arange(8) + 0.5) * np.pi / 4
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    return Polyhedron(points, (np.arange(8),))


def squares(n: int) -> Polyhedron:
    """Return the unit square round the origin as n x n squares, row by row."""
    x = np.linspace(-0.5, 0.5, n + 1)
    points = np.stack([*np.meshgrid(x, x, indexing='ij'), np.zeros((n + 1, n + 1))], axis=-1)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    return Polyhedron(points.reshape(-1, 3), tuple(corner[:, None] + [0, n + 1, n + 2, 1]))
