"""
Planar polygons in space as triangles on the same corners.

The boundary of the triangles, taken with signs, is the polygon's, so a closed surface stays
closed whatever rounding did to the choice of the triangles.
"""

import numpy as np

# How far a corner may lie off the plane of its polygon, as a part of the polygon's size: more than
# the rounding of any file format, less than anything that was meant.
FLATNESS = 1e-5


def triangulate(points: np.ndarray, polygons: np.ndarray) -> np.ndarray:
    """
    Split polygons of one size into triangles.

    :param points: (n, 3) [m].
    :param polygons: (m, k) indices of the corners in order, k >= 3.
    :returns: (m, k - 2, 3) indices, turning the way their polygon does.
    :raises ValueError: a polygon of four or more corners has no area, is not planar or not simple.
    """
    m, k = polygons.shape
    if k == 3:
        return polygons.reshape(m, 1, 3)
    flat = _flattened(points, polygons)
    last = np.arange(1, k - 1)
    fan = np.stack([np.zeros_like(last), last, last + 1], axis=1)
    # Seen from the first corner all others lie to the left of the second, in turning order: the
    # polygon is star-shaped about that corner.
    to = flat[:, 1:] - flat[:, :1]
    left = _cross(to[:, :1], to[:, 1:]) > 0.0
    turning = _cross(to[:, :-1], to[:, 1:]) > 0.0
    star = left.all(axis=1) & turning.all(axis=1)
    chosen = np.broadcast_to(fan, (m, k - 2, 3)).copy()
    for i in np.flatnonzero(~star):
        try:
            chosen[i] = _ears(flat[i])
        except ValueError as error:
            raise ValueError(f'{error}: corners {polygons[i].tolist()}') from None
    return np.take_along_axis(polygons, chosen.reshape(m, -1), axis=1).reshape(m, k - 2, 3)


def _flattened(points: np.ndarray, polygons: np.ndarray) -> np.ndarray:
    """Return the corners in coordinates of each polygon's plane, (m, k, 2), turning left."""
    corners = points[polygons] - points[polygons[:, :1]]
    size = np.linalg.norm(corners, axis=2).max(axis=1)
    # Twice the vector area, so that rounding of the corners counts as little as it can.
    normal = np.cross(corners, np.roll(corners, -1, axis=1)).sum(axis=1)
    area = np.linalg.norm(normal, axis=1)
    thin = ~(area > 1e-12 * size * size)
    if thin.any():
        raise ValueError(f'a face has no area: corners {polygons[thin.argmax()].tolist()}')
    normal /= area[:, None]
    off = np.abs(np.einsum('mkc,mc->mk', corners, normal)).max(axis=1)
    bent = ~(off <= FLATNESS * size)
    if bent.any():
        raise ValueError(f'a face is not planar: corners {polygons[bent.argmax()].tolist()}')
    # The two coordinates other than the normal's largest keep the polygon simple; a swap of them
    # keeps the way it turns.
    axis = np.abs(normal).argmax(axis=1)
    rows = np.arange(len(polygons))
    swap = normal[rows, axis] < 0.0
    first = np.where(swap, (axis + 2) % 3, (axis + 1) % 3)
    second = np.where(swap, (axis + 1) % 3, (axis + 2) % 3)
    rows = rows[:, None]
    each = np.arange(polygons.shape[1])
    return np.stack([corners[rows, each, first[:, None]], corners[rows, each, second[:, None]]], 2)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _ears(flat: np.ndarray) -> list[tuple[int, int, int]]:
    """
    Cut off ears (Meisters 1975): corners whose triangle holds no other corner.

    :param flat: (k, 2) corners, turning left.
    :raises ValueError: none is left before three corners are.
    """
    ring = list(range(len(flat)))
    triangles = []
    while len(ring) > 3:
        at = _ear(flat, ring)
        triangles.append((ring[at - 1], ring[at], ring[(at + 1) % len(ring)]))
        del ring[at]
    a, b, c = flat[ring]
    if not _cross(b - a, c - a) >= 0.0:
        raise ValueError('a face is not simple')
    return [*triangles, (ring[0], ring[1], ring[2])]


def _ear(flat: np.ndarray, ring: list[int]) -> int:
    """Return the place of an ear in the ring; one without area only if there is no other."""
    straight = None
    for at, corner in enumerate(ring):
        before, after = ring[at - 1], ring[(at + 1) % len(ring)]
        a, b, c = flat[[before, corner, after]]
        area = _cross(b - a, c - a)
        if area < 0.0:
            continue
        others = flat[[v for v in ring if v not in (before, corner, after)]]
        sides = [_cross(q - p, others - p) >= 0.0 for p, q in ((a, b), (b, c), (c, a))]
        inside = sides[0] & sides[1] & sides[2]
        if area > 0.0 and not inside.any():
            return at
        if area == 0.0 and straight is None and (b - a) @ (c - b) > 0.0:
            straight = at
    if straight is None:
        raise ValueError('a face is not simple')
    return straight
