"""Convex bodies end to end in kernel arrays, each with a box that contains it."""

from collections.abc import Sequence

import numpy as np

from trajectory_guard.kernels.layout import (
    BALL,
    BOX,
    Boxes,
    FAR,
    HALF,
    LANES,
    NO_PARTS,
    Solids,
    UNBUILT,
    UP,
)
from trajectory_guard.shapes.body import ConvexBody, U

# Of a point's depth in a sphere or cylinder, in units of the farthest coordinate: differences,
# three products twice, a square root, and an axis that is off by as much.
DEPTH_ROUNDING = 64.0

# A box frame is looked for among this many of a polytope's faces.
FACES_TRIED = 12


def solids(bodies: Sequence[ConvexBody], nodes: Sequence[int]) -> Solids:
    """
    Pack bodies for the kernels.

    :param bodies: convex bodies, each in the frame of its node (obstacles: the root frame).
    :param nodes: node of each body, -1 for the root.
    """
    vertices = [_whole(body.vertices) for body in bodies]
    faces = [_whole(body.faces) for body in bodies]
    ends = np.cumsum([len(rows) for rows in vertices])
    face_ends = np.cumsum([len(rows) for rows in faces])
    ranges = np.column_stack(
        [
            ends - [len(rows) for rows in vertices],
            ends,
            face_ends - [len(rows) for rows in faces],
            face_ends,
            nodes,
            np.arange(len(bodies)),
            [NO_PARTS if body.surface is None else UNBUILT for body in bodies],
            np.zeros(len(bodies)),
        ]
    )
    size = [
        (
            body.ball,
            body.disc_radius,
            _farthest(body, body.center),
            far := (_farthest(body, np.zeros(3)) + body.ball) * UP,
            # Measuring a depth rounds by a few units of the coordinates.
            body.inside - DEPTH_ROUNDING * U * far,
        )
        for body in bodies
    ]
    place = [np.concatenate([body.disc_axis, body.center, *_box(body)]) for body in bodies]
    return Solids(
        ranges=ranges.astype(np.int64),
        size=np.array(size),
        place=np.array(place),
        vertices=np.ascontiguousarray(np.concatenate(vertices).T),
        faces=np.ascontiguousarray(np.concatenate(faces).T),
    )


def _whole(rows: np.ndarray) -> np.ndarray:
    """Return rows filled up to whole vectors with copies of the last one, which change nothing."""
    missing = -len(rows) % LANES
    return np.concatenate([rows, np.repeat(rows[-1:], missing, axis=0)]) if missing else rows


def boxes(obstacles: Solids) -> Boxes:
    """
    Arrange the boxes of obstacles in blocks of neighbours, and a tree over the blocks.

    The tree halves the obstacles about the longest side of their centres' bounds.

    :param obstacles: packed obstacles.
    """
    half = obstacles.place[:, HALF : HALF + 3]
    pose = obstacles.place[:, BOX:].reshape(-1, 3, 4)
    middle = pose[:, :, 3]
    # Each of the sums below errs by a few U of its size; the doubled 16 U cover them all.
    reach = np.einsum('nrc,nc->nr', np.abs(pose[:, :, :3]), half) + obstacles.size[:, BALL, None]
    reach += 32.0 * U * (np.abs(middle) + reach)
    low, high = middle - reach, middle + reach
    blocks: list[np.ndarray] = []
    bounds: list[np.ndarray] = []
    branch: list[tuple[int, int]] = []

    def grow(some: np.ndarray) -> int:
        number = len(bounds)
        bounds.append(np.concatenate([low[some].min(axis=0), high[some].max(axis=0)]))
        branch.append((-1, len(blocks)))
        if len(some) <= LANES:
            blocks.append(some)
            return number
        axis = int(np.ptp(middle[some], axis=0).argmax())
        some = some[np.argsort(middle[some, axis], kind='stable')]
        # Whole blocks on one side, so that few lanes stay empty.
        cut = LANES * ((len(some) // LANES + 1) // 2) if len(some) > 2 * LANES else LANES
        branch[number] = (grow(some[:cut]), grow(some[cut:]))
        return number

    grow(np.arange(len(middle)))
    lanes = np.full((len(blocks), LANES), -1, np.int64)
    for k, some in enumerate(blocks):
        lanes[k, : len(some)] = some
    # Empty lanes repeat the first obstacle: their numbers must be finite.
    filled = np.where(lanes >= 0, lanes, lanes[:, :1])
    columns = np.concatenate(
        [
            pose[:, :, :3].transpose(0, 2, 1).reshape(-1, 9),
            middle,
            half,
            obstacles.size[:, [BALL, FAR]],
        ],
        axis=1,
    )
    return Boxes(
        box=np.ascontiguousarray(columns[filled].transpose(0, 2, 1)),
        obstacle=lanes,
        bounds=np.array(bounds),
        branch=np.array(branch, np.int64),
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
    R = _frames(body)
    local = body.vertices @ R
    # |r - (r.a) a| for every box axis r; 1 - (r.a)^2 would cancel where they are parallel.
    along = body.disc_axis @ R
    across = R - body.disc_axis[:, None] * along[:, None, :]
    reach = body.disc_radius * np.sqrt((across * across).sum(axis=1))
    low, high = local.min(axis=1) - reach, local.max(axis=1) + reach
    sides = high - low
    best = int((sides + 1e-3 * sides.max(axis=1, keepdims=True)).prod(axis=1).argmin())
    middle, half = 0.5 * (low[best] + high[best]), 0.5 * sides[best]
    rounding = 32.0 * U * (np.abs(body.vertices).max() * 3.0 + body.disc_radius)
    return half * UP + rounding, np.column_stack([R[best], R[best] @ middle]).ravel()


def _frames(body: ConvexBody) -> np.ndarray:
    """Return rotations to try, (m, 3, 3), columns the axes: the frame, pairs of faces, inertia."""
    normals = body.faces[:FACES_TRIED, :3]
    square = np.triu(np.abs(normals @ normals.T) < 1e-9, 1)
    first, second = np.nonzero(square)
    # With each face the first one that is square to it.
    first, once = np.unique(first, return_index=True)
    x, y = normals[first], normals[second[once]]
    if len(body.vertices) > 3:
        _, _, vt = np.linalg.svd(body.vertices - body.vertices.mean(axis=0), full_matrices=False)
        if np.isfinite(vt).all():
            x, y = np.concatenate([x, vt[:1]]), np.concatenate([y, vt[1:2]])
    return np.concatenate([np.eye(3)[None], _orthonormal(x, y)])


def _orthonormal(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the rotations with first axis x and second axis y made perpendicular to it."""
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    z = _cross(x, y)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([x, _cross(z, x), z], axis=2)


def _cross(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the cross products of rows; numpy's own takes its time with few of them."""
    a, b = [1, 2, 0], [2, 0, 1]
    return x[:, a] * y[:, b] - x[:, b] * y[:, a]
