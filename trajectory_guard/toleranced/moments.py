"""Mass, barycentre and central inertia of points, surfaces and solids."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.shapes.body import LARGEST_COORDINATE
from trajectory_guard.shapes.inscribed import is_closed


class Moments(NamedTuple):
    """
    What a metric needs to know of a mass distribution.

    :param mass: total mass.
    :param barycenter: b, (3,) [m].
    :param inertia: J, the integral of (x - b)(x - b)^T, (3, 3).
    """

    mass: float
    barycenter: np.ndarray
    inertia: np.ndarray


def point_moments(points: np.ndarray, weights: np.ndarray) -> Moments:
    """
    Return the moments of point masses.

    J = sum w_i (m_i - b)(m_i - b)^T: linear in the weights, since the scalar product is, and
    central [SW, sec. 2, corrected].

    :param points: (n, 3) [m].
    :param weights: (n,) positive.
    """
    # About the first point, so that a common offset costs no digits.
    shifted = points - points[0]
    mass = float(weights.sum())
    b = points[0] + weights @ shifted / mass
    y = points - b
    return Moments(mass, b, (weights[:, None] * y).T @ y)


def surface_samples(vertices: ArrayLike, triangles: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """
    Return point masses with the moments of a surface: the midpoints of all sides, a third each.

    The rule integrates every polynomial of degree two over a triangle exactly.

    :param vertices: (n, 3) [m].
    :param triangles: (m, 3) indices.
    :returns: points (3 m', 3) and weights (3 m',), m' <= m triangles with an area.
    :raises RequestError: INVALID_PARAMETER, an index is out of range or the area is zero.
    """
    corners = mesh_corners(vertices, triangles)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = 0.5 * np.linalg.norm(cross, axis=1)
    some = areas > 0.0
    if not some.any():
        raise RequestError(Reason.INVALID_PARAMETER, 'triangles: the surface has no area')
    midpoints = 0.5 * (corners + corners[:, [1, 2, 0]])[some]
    return midpoints.reshape(-1, 3), np.repeat(areas[some] / 3.0, 3)


def solid_moments(vertices: ArrayLike, triangles: ArrayLike) -> Moments:
    """
    Return the moments of the solid that a closed mesh bounds, density 1 [1 / m^3].

    The solid is a signed sum of tetrahedra (o, v1, v2, v3) with volumes V = det(v1, v2, v3) / 6
    about a point o. Over one of them the mean of x is c = (v1 + v2 + v3) / 4 and that of x x^T is
    (sum_k v_k v_k^T + 16 c c^T) / 20.

    :param vertices: (n, 3) [m].
    :param triangles: (m, 3) indices, counter-clockwise seen from outside.
    :raises RequestError: INVALID_PARAMETER, an index is out of range, the surface is open, or the
        volume is not positive.
    """
    corners = mesh_corners(vertices, triangles)
    indices = np.asarray(triangles)
    if not is_closed(indices, int(indices.max()) + 1):
        raise RequestError(Reason.INVALID_PARAMETER, 'triangles: the surface is not closed')
    middle = 0.5 * (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1)))
    v = corners - middle
    volumes = np.einsum('ni,ni->n', v[:, 0], np.cross(v[:, 1], v[:, 2])) / 6.0
    mass = float(volumes.sum())
    if not mass > 0.0:
        raise RequestError(
            Reason.INVALID_PARAMETER, f'triangles: the volume must be positive, got {mass} m^3'
        )
    c = v.sum(axis=1) / 4.0
    offset = volumes @ c / mass
    second = np.einsum('n,nki,nkj->ij', volumes, v, v)
    second = (second + 16.0 * np.einsum('n,ni,nj->ij', volumes, c, c)) / 20.0
    return Moments(mass, middle + offset, second - mass * np.outer(offset, offset))


def mesh_corners(vertices: ArrayLike, triangles: ArrayLike) -> np.ndarray:
    """
    Return the corners of the triangles of a mesh, checked, (m, 3, 3) [m].

    :param vertices: (n, 3) [m].
    :param triangles: (m, 3) indices.
    :raises RequestError: INVALID_PARAMETER, naming what is wrong.
    """
    points, indices = np.asarray(vertices, dtype=np.float64), np.asarray(triangles)
    if points.ndim != 2 or points.shape[1] != 3:
        raise RequestError(
            Reason.INVALID_PARAMETER, f'vertices must have shape (n, 3), got {points.shape}'
        )
    if not np.abs(points).max(initial=0.0) <= LARGEST_COORDINATE:
        raise RequestError(Reason.INVALID_PARAMETER, 'vertices: one is not finite or too far')
    if indices.ndim != 2 or indices.shape[1] != 3 or indices.dtype.kind not in 'iu':
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'triangles must be indices of shape (m, 3), got {indices.dtype} {indices.shape}',
        )
    if not len(indices) or indices.min() < 0 or indices.max() >= len(points):
        raise RequestError(
            Reason.INVALID_PARAMETER, f'triangles must name some of {len(points)} vertices'
        )
    corners: np.ndarray = points[indices]
    return corners
