"""The metric of a moving surface as the kernels take it; what is rounded here is bounded here."""

import numpy as np

from trajectory_guard.kernels.ball import Metric, Surface
from trajectory_guard.shapes.body import U
from trajectory_guard.toleranced.face_moments import (
    face_moments,
    Moments,
    surface_moments,
)

# Thinner than this part of its size a distribution is not: K stays well-conditioned, and a
# direction without mass costs nothing in the radius.
THINNEST = 2.0**-10

# The corners of a box, in half sides.
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


def node_metric(surface: Surface, individual: bool, whole: Moments | None = None) -> Metric:
    """
    Return a metric for every node of a surface's tree.

    K is a proposal, as b is; q is what a solver made of it, and only the residual x - b - K q is
    bounded.  In floating point that is three products and five sums of numbers below
    |x| + |b| + |K| |q|: within 16 u of them.  A point of a box or of a face is a mean of corners,
    so its q is the same mean of theirs: |q| is convex and largest at a corner, and the residual
    is no larger than the largest.

    :param surface: of the moving polyhedron.
    :param individual: each face and each cluster its own distribution, or all the same one.
    :param whole: the one for all; that of all faces if not given.
    """
    nodes = len(surface.branch)
    face = surface.branch[:, 2]
    leaves = np.flatnonzero(face >= 0)
    if individual:
        b, K = _box_frames(surface.box)
        own = face_moments(surface)
        b[leaves] = own.barycentre[face[leaves]]
        K[leaves] = _factor(own.inertia)[face[leaves]]
        of = np.arange(nodes)
    else:
        b, inertia = surface_moments(surface) if whole is None else whole
        K = _factor(inertia)
        of = np.zeros(nodes, np.int64)
    node_of_face = np.empty(len(leaves), np.int64)
    node_of_face[face[leaves]] = leaves
    node = np.repeat(node_of_face, np.diff(surface.corner_first))
    turned, residual = _turned(surface.corner, b[of[node]], K[of[node]])
    box = surface.box[:, None, :3] + surface.box[:, None, 3:] * _CORNERS
    at_box, box_residual = _turned(box, b[of][:, None], K[of][:, None])
    far = _length(at_box).max(axis=1)
    far[node_of_face] = np.maximum.reduceat(_length(turned), surface.corner_first[:-1])
    span = np.linalg.norm(b, axis=1) + np.linalg.norm(K, axis=(1, 2))
    return Metric(
        np.ascontiguousarray(np.hstack([b, K.reshape(-1, 9)])),
        span * (1.0 + 16.0 * U),
        np.ascontiguousarray(of),
        far,
        turned,
        float(np.maximum(residual, box_residual)),
    )


def _box_frames(box: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """
    Return b and K of equal masses at the corners of each box.

    Of all distributions on a box these have the least largest distortion rate, 2 at each corner.
    """
    half = box[:, 3:]
    size = np.linalg.norm(half, axis=1, keepdims=True)
    half = np.maximum(half, THINNEST * np.where(size > 0.0, size, 1.0))
    return box[:, :3].copy(), half[:, :, None] * np.eye(3)


def _factor(inertia: np.ndarray) -> np.ndarray:
    """Return K with K K^T about the inertia, (M, 3, 3)."""
    size = np.trace(inertia, axis1=1, axis2=2)
    # What is no number, or no inertia, makes large balls, not unsound ones.
    size = np.where((size > 0.0) & np.isfinite(size), size, 1.0)
    values, vectors = np.linalg.eigh(inertia / size[:, None, None])
    roots = np.sqrt(np.maximum(values, THINNEST**2)) * np.sqrt(size)[:, None]
    return vectors * roots[:, None, :]


def _turned(x: np.ndarray, b: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, float]:
    """Return q with K q about x - b, and a bound on what is missing everywhere [m]."""
    to = (x - b)[..., None]
    # K is orthogonal columns of different lengths: its transpose over their squares inverts it.
    squares = np.einsum('...ij,...ij->...j', K, K)
    q = np.swapaxes(K, -1, -2) @ to / squares[..., None]
    missing = np.linalg.norm((to - K @ q)[..., 0], axis=-1)
    size = np.linalg.norm(x, axis=-1) + np.linalg.norm(b, axis=-1)
    size = size + np.linalg.norm(K, axis=(-2, -1)) * np.linalg.norm(q[..., 0], axis=-1)
    return np.ascontiguousarray(q[..., 0]), float((missing + 16.0 * U * size).max())


def _length(q: np.ndarray) -> np.ndarray:
    """Return |q|, rounded upward."""
    return np.linalg.norm(q, axis=-1) * (1.0 + 8.0 * U)
