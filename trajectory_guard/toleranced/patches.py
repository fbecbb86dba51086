"""Meshes of the surfaces that bound orbits, for drawing."""

from collections.abc import Sequence
from enum import IntEnum
import math
from typing import NamedTuple

import numpy as np

from trajectory_guard.toleranced.line_metric import LineMetric


class Patch(IntEnum):
    """Which feature's orbit a part of a boundary belongs to."""

    VERTEX = 0
    EDGE = 1
    FACE = 2


class Mesh(NamedTuple):
    """
    A labelled triangle mesh; patches that meet repeat the vertices of their common side.

    :param vertices: (n, 3) in the world frame [m].
    :param triangles: (m, 3) indices, counter-clockwise seen from outside.
    :param labels: (m,) values of `Patch`.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    labels: np.ndarray


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Return several meshes as one."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([m.triangles + s for m, s in zip(meshes, starts, strict=True)]),
        np.concatenate([mesh.labels for mesh in meshes]),
    )


def grid(points: np.ndarray, label: Patch) -> Mesh:
    """
    Return the mesh of a surface from its points over a grid.

    :param points: (m, n, 3); rows cross columns counter-clockwise, seen from outside [m].
    :param label: what the surface is.
    """
    m, n = points.shape[:2]
    index = np.arange(m * n).reshape(m, n)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.concatenate(
        [np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]
    )
    return Mesh(points.reshape(-1, 3), triangles, np.full(len(triangles), label))


def triangle_grid(corners: np.ndarray, steps: int, label: Patch) -> Mesh:
    """
    Return a triangle cut into steps^2 equal ones.

    :param corners: (3, 3) [m].
    :param steps: parts of a side.
    :param label: what the surface is.
    """
    place: dict[tuple[int, int], int] = {}
    for i in range(steps + 1):
        for j in range(steps + 1 - i):
            place[i, j] = len(place)
    weights = np.array([(steps - i - j, i, j) for i, j in place]) / steps
    triangles = [
        (place[i, j], place[i + 1, j], place[i, j + 1]) for i, j in place if i + j < steps
    ] + [
        (place[i + 1, j], place[i + 1, j + 1], place[i, j + 1])
        for i, j in place
        if i + j < steps - 1
    ]
    return Mesh(weights @ corners, np.array(triangles), np.full(len(triangles), label))


def sphere(center: np.ndarray, radius: float, steps: int) -> Mesh:
    """
    Return a sphere, an octahedron whose faces are cut and blown up.

    :param center: (3,) [m].
    :param radius: radius [m].
    :param steps: parts of a quarter of a circle.
    """
    faces = []
    for sx in (1.0, -1.0):
        for sy in (1.0, -1.0):
            for sz in (1.0, -1.0):
                corners = np.diag([sx, sy, sz])
                outward = corners if sx * sy * sz > 0.0 else corners[::-1]
                faces.append(triangle_grid(outward, steps, Patch.VERTEX))
    mesh = joined(faces)
    unit = mesh.vertices / np.linalg.norm(mesh.vertices, axis=1, keepdims=True)
    return mesh._replace(vertices=center + radius * unit)


def circle(
    line: LineMetric, R: float, t: np.ndarray, frame: np.ndarray, angles: np.ndarray
) -> np.ndarray:
    """
    Return the arcs in which the envelope touches the balls over points of a line.

    The ball over t, of radius r(t), touches where the directions n from its centre have
    n . b = -r'(t): n = -r' b + sqrt(1 - r'^2) (cos phi e_1 + sin phi e_2).

    :param line: the line, R < nu.
    :param R: radius of the ball of displacements.
    :param t: parameters of the line, (m,) [m].
    :param frame: e_1, e_2 across the line as columns, (3, 2).
    :param angles: phi, (m, n) [rad].
    :returns: (m, n, 3) [m].
    """
    radius = line.radius(R, t)
    slope = R**2 * t / line.nu**2 / radius
    around = np.stack((np.cos(angles), np.sin(angles)), axis=-1) @ frame.T
    n = np.sqrt(1.0 - slope**2)[:, None, None] * around
    n = n - (slope[:, None] * line.direction)[:, None]
    arcs: np.ndarray = (line.foot + t[:, None] * line.direction)[:, None] + radius[
        :, None, None
    ] * n
    return arcs


def lune(first: np.ndarray, second: np.ndarray, center: np.ndarray, steps: int) -> Mesh:
    """
    Return the part of a sphere between two arcs with common ends.

    :param first: (n, 3) points of the arc [m].
    :param second: (n, 3) [m].
    :param center: the sphere's, (3,) [m].
    :param steps: parts of the way from one to the other.
    """
    u, v = first - center, second - center
    radius = np.linalg.norm(u[0])
    cosines = np.clip((u * v).sum(axis=1) / radius**2, -1.0, 1.0)
    angle = np.arccos(cosines)[None, :, None]
    share = np.linspace(0.0, 1.0, steps + 1)[:, None, None]
    # Great arcs; where the two nearly meet, chords are as good.
    with np.errstate(invalid='ignore', divide='ignore'):
        way = (np.sin((1.0 - share) * angle) * u + np.sin(share * angle) * v) / np.sin(angle)
    way = np.where(angle < 1e-6, (1.0 - share) * u + share * v, way)
    return grid(center + way, Patch.VERTEX)


def cap(line: LineMetric, R: float, t: float, outward: float, steps: int) -> Mesh:
    """
    Return the part of an end ball's sphere beyond the circle in which the envelope touches it.

    :param line: the line, R < nu.
    :param R: radius of the ball of displacements.
    :param t: parameter of the end [m].
    :param outward: 1 if the edge lies before the end, -1 if after.
    :param steps: parts of the way to the pole, and of a quarter circle.
    """
    radius = float(line.radius(R, np.array(t)))
    slope = outward * R**2 * t / line.nu**2 / radius
    polar = np.linspace(0.0, math.acos(-slope), steps + 1)[:, None, None]
    frame = across(line.direction) * [1.0, outward]
    angles = np.linspace(0.0, 2.0 * math.pi, 4 * steps + 1)
    around = (np.stack((np.cos(angles), np.sin(angles)), axis=-1) @ frame.T)[None]
    n = np.cos(polar) * outward * line.direction + np.sin(polar) * around
    return grid(line.foot + t * line.direction + radius * n, Patch.VERTEX)


def across(direction: np.ndarray) -> np.ndarray:
    """Return e_1, e_2 as columns, right-handed with a unit vector before them, (3, 2)."""
    e_1 = np.zeros(3)
    e_1[np.abs(direction).argmin()] = 1.0
    e_1 -= direction * (direction @ e_1)
    e_1 /= np.linalg.norm(e_1)
    return np.column_stack((e_1, np.cross(direction, e_1)))
