"""Convex bodies end to end in kernel arrays, each with a box that contains it."""

from collections.abc import Sequence

import numpy as np

from trajectory_guard.body import ConvexBody
from trajectory_guard.kernels.margin import UP
from trajectory_guard.kernels.solids import Solids

# A box frame is looked for among this many of a polytope's faces.
FACES_TRIED = 12


def solids(bodies: Sequence[ConvexBody], nodes: Sequence[int]) -> Solids:
    """
    Pack bodies for the kernels.

    :param bodies: convex bodies, each in the frame of its node (obstacles: the root frame).
    :param nodes: node of each body, -1 for the root.
    """
    ends = np.cumsum([len(body.vertices) for body in bodies])
    face_ends = np.cumsum([len(body.faces) for body in bodies])
    ranges = np.column_stack(
        [
            ends - [len(body.vertices) for body in bodies],
            ends,
            face_ends - [len(body.faces) for body in bodies],
            face_ends,
            nodes,
        ]
    )
    size = [
        (
            body.ball,
            body.disc_radius,
            _farthest(body, body.center),
            (_farthest(body, np.zeros(3)) + body.ball) * UP,
        )
        for body in bodies
    ]
    place = [np.concatenate([body.disc_axis, body.center, *_box(body)]) for body in bodies]
    return Solids(
        ranges=ranges.astype(np.int64),
        size=np.array(size),
        place=np.array(place),
        vertices=np.ascontiguousarray(np.concatenate([body.vertices for body in bodies]).T),
        faces=np.concatenate([body.faces for body in bodies]),
    )


def perpendicular(body: ConvexBody) -> float:
    """Return a bound on the distance of a body's core and centre from its frame's z axis [m]."""
    core = np.hypot(*body.vertices[:, :2].T).max() + body.disc_radius
    return float(max(core, np.hypot(*body.center[:2])) * UP)


def _farthest(body: ConvexBody, point: np.ndarray) -> float:
    """Return a bound on the distance of a body's core from a point [m]."""
    offset = body.vertices - point
    scale = np.abs(body.vertices).max() + np.abs(point).max()
    return float((np.linalg.norm(offset, axis=1).max() + body.disc_radius + 1e-15 * scale) * UP)


def _box(body: ConvexBody) -> tuple[np.ndarray, np.ndarray]:
    """
    Return half sides (3,) and pose (12 numbers) of a box that contains a body's core.

    The smallest of a few candidate frames is taken; whatever the frame, the sides are measured.
    """
    best: tuple[float, np.ndarray, np.ndarray, np.ndarray] | None = None
    for R in _frames(body):
        local = body.vertices @ R
        # |r - (r.a) a| for every box axis r; 1 - (r.a)^2 would cancel where they are parallel.
        across = R - np.outer(body.disc_axis, body.disc_axis @ R)
        reach = body.disc_radius * np.linalg.norm(across, axis=0)
        low, high = local.min(axis=0) - reach, local.max(axis=0) + reach
        scale = 1e-3 * float((high - low).max())
        volume = float(np.prod(high - low + scale))
        if best is None or volume < best[0]:
            best = volume, R, 0.5 * (low + high), 0.5 * (high - low)
    assert best is not None
    _, R, middle, half = best
    rounding = 32.0 * 2.0**-53 * (np.abs(body.vertices).max() * 3.0 + body.disc_radius)
    return half * UP + rounding, np.column_stack([R, R @ middle]).ravel()


def _frames(body: ConvexBody) -> list[np.ndarray]:
    """Return candidate rotations, columns the axes: the frame, pairs of faces, inertia."""
    frames = [np.eye(3)]
    normals = body.faces[:FACES_TRIED, :3]
    for i, n in enumerate(normals):
        for m in normals[i + 1 :]:
            if abs(n @ m) < 1e-9:
                frames.append(_orthonormal(n, m))
                break
    if len(body.vertices) > 3:
        _, _, vt = np.linalg.svd(body.vertices - body.vertices.mean(axis=0), full_matrices=False)
        if np.isfinite(vt).all():
            frames.append(_orthonormal(vt[0], vt[1]))
    return frames


def _orthonormal(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the rotation with first axis x and second axis y made perpendicular to it."""
    x = x / np.linalg.norm(x)
    z = np.cross(x, y)
    z /= np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])
