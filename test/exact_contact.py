"""Contact of triangles in exact rational arithmetic, and exact images under a rational motion."""

from fractions import Fraction
import itertools
from math import comb

import numpy as np


def exact(array):
    """Return an array of doubles as fractions."""
    return np.vectorize(Fraction, otypes=[object])(np.asarray(array, dtype=float))


def pose(motion, s):
    """Return the exact displacement at a rational instant, (3, 4)."""
    s = Fraction(s)
    n = len(motion.weights) - 1
    basis = [comb(n, i) * s**i * (1 - s) ** (n - i) for i in range(n + 1)]
    shares = [b * Fraction(float(w)) for b, w in zip(basis, motion.weights, strict=True)]
    total = sum(b * P for b, P in zip(shares, exact(motion.control_points), strict=True))
    return total / sum(shares)


def images(displacement, points):
    """Return exact images of points, (n, 3)."""
    return exact(points) @ displacement[:, :3].T + displacement[:, 3]


def _cross(a, b):
    return np.array(
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    )


def _sign(x):
    return (x > 0) - (x < 0)


def _volume(a, b, c, d):
    return _sign(_cross(b - a, c - a) @ (d - a))


def segment_meets(p, q, a, b, c):
    """Say whether a closed segment and a closed triangle have a common point."""
    one, other = _volume(a, b, c, p), _volume(a, b, c, q)
    if one * other > 0:
        return False
    if one == other == 0:
        return _flat_meets(p, q, a, b, c)
    sides = {_volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)}
    return not {-1, 1} <= sides


def _flat_meets(p, q, a, b, c):
    """Say the same in a common plane."""
    normal = _cross(b - a, c - a)
    axis = max(range(3), key=lambda i: abs(normal[i]))
    keep = [i for i in range(3) if i != axis]
    p, q, a, b, c = (x[keep] for x in (p, q, a, b, c))

    def turn(x, y, z):
        return _sign((y[0] - x[0]) * (z[1] - x[1]) - (y[1] - x[1]) * (z[0] - x[0]))

    def crosses(x, y, u, v):
        if any(
            max(x[i], y[i]) < min(u[i], v[i]) or max(u[i], v[i]) < min(x[i], y[i]) for i in (0, 1)
        ):
            return False
        return turn(x, y, u) * turn(x, y, v) <= 0 and turn(u, v, x) * turn(u, v, y) <= 0

    inside = {turn(a, b, p), turn(b, c, p), turn(c, a, p)}
    return not {-1, 1} <= inside or any(crosses(p, q, x, y) for x, y in ((a, b), (b, c), (c, a)))


def triangles_meet(one, other):
    """Say whether two triangles, (3, 3) of fractions, have a common point."""
    for x, y in ((one, other), (other, one)):
        for i in range(3):
            if segment_meets(x[i], x[(i + 1) % 3], *y):
                return True
    return False


def surfaces_meet(one, one_triangles, other, other_triangles):
    """Say whether two surfaces of exact vertices have a common point."""
    for s, t in itertools.product(one_triangles, other_triangles):
        x, y = one[s], other[t]
        if (x.min(axis=0) > y.max(axis=0)).any() or (y.min(axis=0) > x.max(axis=0)).any():
            continue
        if triangles_meet(x, y):
            return True
    return False


def winds_round(point, vertices, triangles):
    """Say whether a closed surface winds round a point in general position (ray upward)."""
    crossings = 0
    for t in triangles:
        a, b, c = vertices[t]
        flat = [x[:2] - point[:2] for x in (a, b, c)]
        turns = [
            _sign(u[0] * v[1] - u[1] * v[0])
            for u, v in ((flat[0], flat[1]), (flat[1], flat[2]), (flat[2], flat[0]))
        ]
        assert 0 not in turns or {-1, 1} <= {*turns}, 'not in general position'
        if len({*turns}) == 1:
            side = _volume(a, b, c, point)
            normal = _sign(_cross(b - a, c - a)[2])
            if side * normal < 0:
                crossings += normal
    return crossings != 0
