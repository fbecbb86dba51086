"""
Mass distributions of faces and of a whole surface.

A distribution of mass 1 is its barycentre b and its central inertia J = sum w_i (m_i - b)
(m_i - b)^T; the metric of [Schroecker & Weber 2014, sec. 2] needs no more, and every positive
choice is sound: these are what makes balls small.
"""

from typing import NamedTuple

import numpy as np

from trajectory_guard.kernels.ball import Surface

# The feature point off a face's plane, in root mean square distances of its corners from their
# mean: small beside the face, so that the inertia ellipsoid has its shape.
OFF_PLANE = 1.0 / 16.0


class Moments(NamedTuple):
    """
    Distributions of mass 1.

    :param barycentre: (M, 3) [m].
    :param inertia: (M, 3, 3) central second moments [m^2].
    """

    barycentre: np.ndarray
    inertia: np.ndarray


def face_moments(surface: Surface) -> Moments:
    """
    Return one distribution for each face: equal masses at its corners and over its barycentre.

    The last point is off the plane, as in [Schroecker & Weber 2014, sec. 7.1]: corners alone make
    the inertia singular.

    :param surface: F faces.
    """
    first = surface.corner_first[:-1]
    count = np.diff(surface.corner_first)
    face = np.repeat(np.arange(len(first)), count)
    mean = np.add.reduceat(surface.corner, first) / count[:, None]
    to = surface.corner - mean[face]
    after = np.arange(1, len(to) + 1)
    after[surface.corner_first[1:] - 1] = first
    normal = np.add.reduceat(np.cross(to, to[after]), first)
    length = np.linalg.norm(normal, axis=1)
    scatter = np.add.reduceat(to[:, :, None] * to[:, None, :], first)
    height = OFF_PLANE * np.sqrt(np.trace(scatter, axis1=1, axis2=2) / count)
    # A flat triangle has no normal, and its last point is its barycentre.
    off = normal * (height / np.where(length > 0.0, length, 1.0))[:, None]
    mass = count + 1.0
    # About the common barycentre mean + off / mass the extra point keeps the share count / mass of
    # its square: the reduced mass of two.
    inertia = scatter + off[:, :, None] * off[:, None, :] * (count / mass)[:, None, None]
    return Moments(mean + off / mass[:, None], inertia / mass[:, None, None])


def surface_moments(surface: Surface) -> Moments:
    """
    Return the sum of the distributions of all faces, each with the mass of its points.

    :param surface: the surface.
    """
    b, inertia = face_moments(surface)
    mass = np.diff(surface.corner_first) + 1.0
    share = mass / mass.sum()
    barycentre = share @ b
    to = b - barycentre
    total = np.einsum('f,fij->ij', share, inertia + to[:, :, None] * to[:, None, :])
    return Moments(barycentre[None], total[None])


def given_moments(G: np.ndarray) -> Moments:
    """
    Return the distribution of a matrix of moments.

    :param G: (4, 4) sum of w_i [m_i; 1] [m_i; 1]^T.
    """
    b = G[:3, 3] / G[3, 3]
    return Moments(b[None], (G[:3, :3] / G[3, 3] - np.outer(b, b))[None])
