"""
Search for a separating direction and for nearest points (untrusted: it only proposes).

Gilbert, Johnson and Keerthi's iteration on the difference of two cores; a "link" is the convex
hull of its images under several poses, so one pose gives the distance at an instant and the
control points of a motion give a direction for the whole piece.
"""

import math

import numpy as np

from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.separation import highest, lowest
from trajectory_guard.kernels.solids import AXIS, CORE, DISC, FAR, FIRST, LAST

RELATIVE = 0.02  # far from what is wanted, a nearly best direction is as good
ROUNDS = 40  # enough for the distance of two polytopes; more is rounding
SEPARATED = 0
OVERLAP = 1
REACHED = 2  # the wanted support difference was found


@kernel
def _segment(s, i, k, w):
    """Write the barycentric weights of the point of an edge nearest to the origin."""
    ex = s[k, 0] - s[i, 0]
    ey = s[k, 1] - s[i, 1]
    ez = s[k, 2] - s[i, 2]
    square = ex * ex + ey * ey + ez * ez
    t = 0.0
    if square > 0.0:
        t = -(s[i, 0] * ex + s[i, 1] * ey + s[i, 2] * ez) / square
        t = min(1.0, max(0.0, t))
    for m in range(4):
        w[m] = 0.0
    w[i] = 1.0 - t
    w[k] = t


@kernel
def _triangle(s, a, b, c, w):
    """Write the weights of the point of a triangle nearest to the origin (Voronoi regions)."""
    abx = s[b, 0] - s[a, 0]
    aby = s[b, 1] - s[a, 1]
    abz = s[b, 2] - s[a, 2]
    acx = s[c, 0] - s[a, 0]
    acy = s[c, 1] - s[a, 1]
    acz = s[c, 2] - s[a, 2]
    d1 = -(abx * s[a, 0] + aby * s[a, 1] + abz * s[a, 2])
    d2 = -(acx * s[a, 0] + acy * s[a, 1] + acz * s[a, 2])
    d3 = -(abx * s[b, 0] + aby * s[b, 1] + abz * s[b, 2])
    d4 = -(acx * s[b, 0] + acy * s[b, 1] + acz * s[b, 2])
    d5 = -(abx * s[c, 0] + aby * s[c, 1] + abz * s[c, 2])
    d6 = -(acx * s[c, 0] + acy * s[c, 1] + acz * s[c, 2])
    va = d3 * d6 - d5 * d4
    vb = d5 * d2 - d1 * d6
    vc = d1 * d4 - d3 * d2
    total = va + vb + vc
    if va > 0.0 and vb > 0.0 and vc > 0.0 and total > 0.0:
        for m in range(4):
            w[m] = 0.0
        w[a] = va / total
        w[b] = vb / total
        w[c] = vc / total
        return
    best = math.inf
    best_i = a
    best_k = b
    for side in range(3):
        i = a if side < 2 else b
        k = b if side == 0 else c
        _segment(s, i, k, w)
        x = w[i] * s[i, 0] + w[k] * s[k, 0]
        y = w[i] * s[i, 1] + w[k] * s[k, 1]
        z = w[i] * s[i, 2] + w[k] * s[k, 2]
        square = x * x + y * y + z * z
        if square < best:
            best = square
            best_i = i
            best_k = k
    _segment(s, best_i, best_k, w)


@kernel
def _outside(s, a, b, c, d):
    """Say whether the origin is on the far side of face abc, seen from d (or the face is flat)."""
    ux = s[b, 0] - s[a, 0]
    uy = s[b, 1] - s[a, 1]
    uz = s[b, 2] - s[a, 2]
    vx = s[c, 0] - s[a, 0]
    vy = s[c, 1] - s[a, 1]
    vz = s[c, 2] - s[a, 2]
    nx = uy * vz - uz * vy
    ny = uz * vx - ux * vz
    nz = ux * vy - uy * vx
    origin = -(nx * s[a, 0] + ny * s[a, 1] + nz * s[a, 2])
    apex = nx * (s[d, 0] - s[a, 0]) + ny * (s[d, 1] - s[a, 1]) + nz * (s[d, 2] - s[a, 2])
    return origin * apex <= 0.0


@kernel
def _tetrahedron(s, w):
    """Write the weights of the nearest point; return True if the origin is inside."""
    best = math.inf
    best_face = -1
    for face in range(4):
        a = 0 if face != 3 else 1
        b = 1 if face < 2 else 2
        c = 2 if face == 0 else 3
        d = 3 - face
        if _outside(s, a, b, c, d):
            _triangle(s, a, b, c, w)
            square = 0.0
            for k in range(3):
                x = w[0] * s[0, k] + w[1] * s[1, k] + w[2] * s[2, k] + w[3] * s[3, k]
                square += x * x
            if square < best:
                best = square
                best_face = face
    if best_face < 0:
        return True
    a = 0 if best_face != 3 else 1
    b = 1 if best_face < 2 else 2
    c = 2 if best_face == 0 else 3
    _triangle(s, a, b, c, w)
    return False


@kernel
def _nearest(s, n, w):
    """Write the weights of the simplex point nearest to the origin; True if it contains it."""
    if n == 1:
        w[0] = 1.0
        w[1] = 0.0
        w[2] = 0.0
        w[3] = 0.0
        return False
    if n == 2:
        _segment(s, 0, 1, w)
        return False
    if n == 3:
        _triangle(s, 0, 1, 2, w)
        return False
    return _tetrahedron(s, w)


@kernel
def _rim(gx, gy, gz, solids, b, sign, m):
    """Return coordinate m of the disc point that lies farthest along sign * g."""
    radius = solids.size[b, DISC]
    if radius == 0.0:
        return 0.0
    ax = solids.place[b, AXIS]
    ay = solids.place[b, AXIS + 1]
    az = solids.place[b, AXIS + 2]
    along = gx * ax + gy * ay + gz * az
    rx = gx - along * ax
    ry = gy - along * ay
    rz = gz - along * az
    r = math.sqrt(rx * rx + ry * ry + rz * rz)
    if not r > 0.0:
        return 0.0
    return sign * radius * (rx if m == 0 else (ry if m == 1 else rz)) / r


@kernel
def _argleast(gx, gy, gz, solids, b):
    """Return the vertex with the least g.v."""
    best = math.inf
    which = solids.ranges[b, FIRST]
    for v in range(np.uint64(solids.ranges[b, FIRST]), np.uint64(solids.ranges[b, LAST])):
        value = (
            gx * solids.vertices[0, v] + gy * solids.vertices[1, v] + gz * solids.vertices[2, v]
        )
        if value < best:
            best = value
            which = np.int64(v)
    return which


@kernel
def _vertex(nx, ny, nz, points, node, i, links, b, obstacles, o, s, k):
    """Store the difference of two support points and the obstacle's one at simplex place k."""
    gx = nx * points[node, i, 0] + ny * points[node, i, 4] + nz * points[node, i, 8]
    gy = nx * points[node, i, 1] + ny * points[node, i, 5] + nz * points[node, i, 9]
    gz = nx * points[node, i, 2] + ny * points[node, i, 6] + nz * points[node, i, 10]
    v = _argleast(gx, gy, gz, links, b)
    q = _argleast(-nx, -ny, -nz, obstacles, o)
    lx = links.vertices[0, v] + _rim(gx, gy, gz, links, b, -1.0, 0)
    ly = links.vertices[1, v] + _rim(gx, gy, gz, links, b, -1.0, 1)
    lz = links.vertices[2, v] + _rim(gx, gy, gz, links, b, -1.0, 2)
    for m in range(3):
        row = 4 * m
        s[k, 3 + m] = obstacles.vertices[m, q] + _rim(nx, ny, nz, obstacles, o, 1.0, m)
        s[k, m] = (
            points[node, i, row] * lx
            + points[node, i, row + 1] * ly
            + points[node, i, row + 2] * lz
            + points[node, i, row + 3]
            - s[k, 3 + m]
        )


@kernel
def gjk(
    nx,
    ny,
    nz,
    points,
    node,
    count,
    links,
    b,
    obstacles,
    o,
    want,
    stop,
    accuracy,
    rounds,
    s,
    w,
    out,
):
    """
    Propose a direction that separates a link's images from an obstacle.

    :param nx: first direction to try, from the obstacle towards the link, unit length.
    :param points: (n, K, 12) poses; the first ``count`` of ``node`` are used.
    :param want: support difference that a direction should exceed [m].
    :param stop: stop as soon as one does, or when none can; else find the distance.
    :param accuracy: stop when distance and bound differ by less than this [m] and a fraction of
        the distance to ``want``.
    :param rounds: largest number of support points.
    :param s: (4, 6) scratch, simplex: differences and obstacle points.
    :param w: (4,) scratch.
    :param out: (8,) out: best direction, its support difference, distance of the nearest points
        found, and the obstacle's nearest point [m].
    :returns: SEPARATED, OVERLAP or REACHED (cores only: balls are the caller's).
    """
    n = 0
    best = -math.inf
    out[4] = math.inf
    for _ in range(rounds):
        low, i = lowest(nx, ny, nz, points, node, count, links, b)
        high = highest(nx, ny, nz, obstacles, o)
        if low - high > best:
            best = low - high
            out[0] = nx
            out[1] = ny
            out[2] = nz
            out[3] = best
            if stop and best > want:
                return REACHED
        if n > 0 and out[4] - best <= accuracy + RELATIVE * abs(out[4] - want):
            return SEPARATED
        _vertex(nx, ny, nz, points, node, i, links, b, obstacles, o, s, n)
        n += 1
        inside = _nearest(s, n, w)
        if inside:
            out[4] = 0.0
            out[5] = out[6] = out[7] = 0.0
            for k in range(4):
                for m in range(3):
                    out[5 + m] += 0.25 * s[k, 3 + m]
            return OVERLAP
        kept = 0
        x = y = z = px = py = pz = 0.0
        for k in range(n):
            if w[k] > 0.0:
                x += w[k] * s[k, 0]
                y += w[k] * s[k, 1]
                z += w[k] * s[k, 2]
                px += w[k] * s[k, 3]
                py += w[k] * s[k, 4]
                pz += w[k] * s[k, 5]
                if kept < k:
                    for m in range(6):
                        s[kept, m] = s[k, m]
                kept += 1
        n = kept
        length = math.sqrt(x * x + y * y + z * z)
        if not length < out[4]:
            return SEPARATED  # no progress: the nearest points are as good as rounding allows
        out[4] = length
        out[5] = px
        out[6] = py
        out[7] = pz
        if n == 4 or length <= 1e-14 * (obstacles.size[o, FAR] + links.size[b, CORE]):
            return OVERLAP
        if stop and length <= want:
            return SEPARATED  # no direction can do it
        nx = x / length
        ny = y / length
        nz = z / length
    return SEPARATED
