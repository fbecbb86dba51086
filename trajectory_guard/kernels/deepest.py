r"""
A point deep inside both solids at one instant (search), and how deep it is (trusted for G3).

Maximise t subject to a.y + t <= d over the faces of both solids: the centre of the largest common
ball of two polytopes.  Dual simplex on a 4x4 basis: start from an artificial tetrahedron, bring in
the most violated face, drop the one that keeps the multipliers positive.  The optimum only falls,
so t <= 0 ends the search. The multipliers of the link's faces add up to the direction in which the
two are least entangled.
"""

import math

from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.solids import BALL, CENTRE, CORE, FACE_FIRST, FACE_LAST

PIVOTS = 60


@kernel
def _artificial(basis, value, inverse, cx, cy, cz, far):
    """
    Start from a regular tetrahedron around the solid, multipliers 1/4 each.

    The rows (n, 1), n corners of a cube over sqrt(3), are orthogonal: their inverse is known.
    """
    root = 1.0 / math.sqrt(3.0)
    for k in range(4):
        basis[k, 0] = root if k in (0, 3) else -root
        basis[k, 1] = root if k in (0, 2) else -root
        basis[k, 2] = root if k in (0, 1) else -root
        basis[k, 3] = 1.0
        value[k] = far + basis[k, 0] * cx + basis[k, 1] * cy + basis[k, 2] * cz
        for m in range(3):
            inverse[m, k] = 0.75 * basis[k, m]
        inverse[3, k] = 0.25


@kernel
def _exchange(inverse, share, leave):
    """Update the inverse when row ``leave`` of the basis becomes the row with these shares."""
    for m in range(4):
        inverse[m, leave] /= share[leave]
    for k in range(4):
        if k != leave:
            for m in range(4):
                inverse[m, k] -= share[k] * inverse[m, leave]


@kernel
def depth(faces, first, last, x, y, z):
    """
    Return how deep a point lies inside a polytope, negative outside.

    :param faces: (F, 4) rows (unit n, d); rows ``first:last`` are the polytope's.
    :returns: min (d - n.x) [m]; minus infinity without faces.
    """
    best = math.inf
    for f in range(first, last):
        best = min(best, faces[f, 3] - faces[f, 0] * x - faces[f, 1] * y - faces[f, 2] * z)
    if last > first:
        return best
    return -math.inf


@kernel
def deepest(pose, node, links, b, obstacles, o, basis, value, inverse, weight, shares, moved, out):
    """
    Propose a point deep inside a link and an obstacle at one instant.

    :param pose: (n, 1, 12) pose of the nodes at the instant.
    :param basis: (4, 4), value (4,), inverse (4, 4), weight (4,), shares (4,) scratch.
    :param moved: (F, 4) scratch for the obstacle's faces in the node frame.
    :param out: (6,) out: point in the node frame [m], then the direction from the obstacle towards
        the link in the root frame that separates them soonest (zero if none).
    :returns: True if some point is inside both.
    """
    first = links.ranges[b, FACE_FIRST]
    last = links.ranges[b, FACE_LAST]
    count = obstacles.ranges[o, FACE_LAST] - obstacles.ranges[o, FACE_FIRST]
    for k in range(6):
        out[k] = 0.0
    if last == first or count == 0:
        return False
    for f in range(count):
        row = obstacles.ranges[o, FACE_FIRST] + f
        nx = obstacles.faces[row, 0]
        ny = obstacles.faces[row, 1]
        nz = obstacles.faces[row, 2]
        for c in range(3):
            moved[f, c] = (
                nx * pose[node, 0, c] + ny * pose[node, 0, 4 + c] + nz * pose[node, 0, 8 + c]
            )
        moved[f, 3] = obstacles.faces[row, 3] - (
            nx * pose[node, 0, 3] + ny * pose[node, 0, 7] + nz * pose[node, 0, 11]
        )
    radius = links.size[b, CORE] + links.size[b, BALL]
    tiny = 1e-12 * radius
    _artificial(
        basis,
        value,
        inverse,
        links.place[b, CENTRE],
        links.place[b, CENTRE + 1],
        links.place[b, CENTRE + 2],
        4.0 * radius,
    )
    for k in range(4):
        weight[k] = 0.25
    mine = (0, 0, 0, 0)  # which basis rows are faces of the link
    x = y = z = t = 0.0
    for _ in range(PIVOTS):
        x = y = z = t = 0.0
        for k in range(4):
            x += inverse[0, k] * value[k]
            y += inverse[1, k] * value[k]
            z += inverse[2, k] * value[k]
            t += inverse[3, k] * value[k]
        worst = tiny
        which = -1
        for f in range(first, last):
            excess = (
                links.faces[f, 0] * x + links.faces[f, 1] * y + links.faces[f, 2] * z + t
            ) - links.faces[f, 3]
            if excess > worst:
                worst = excess
                which = f
        own = 1
        for f in range(count):
            excess = moved[f, 0] * x + moved[f, 1] * y + moved[f, 2] * z + t - moved[f, 3]
            if excess > worst:
                worst = excess
                which = f
                own = 0
        if which < 0 or t <= 0.0:
            break
        ax = links.faces[which, 0] if own else moved[which, 0]
        ay = links.faces[which, 1] if own else moved[which, 1]
        az = links.faces[which, 2] if own else moved[which, 2]
        bound = links.faces[which, 3] if own else moved[which, 3]
        leave = -1
        ratio = math.inf
        for k in range(4):
            share = ax * inverse[0, k] + ay * inverse[1, k] + az * inverse[2, k] + inverse[3, k]
            shares[k] = share
            if share > 1e-12 and weight[k] / share < ratio:
                ratio = weight[k] / share
                leave = k
        if leave < 0:
            break
        for k in range(4):
            weight[k] -= ratio * shares[k]
        weight[leave] = ratio
        _exchange(inverse, shares, leave)
        basis[leave, 0] = ax
        basis[leave, 1] = ay
        basis[leave, 2] = az
        basis[leave, 3] = 1.0
        value[leave] = bound
        mine = (
            own if leave == 0 else mine[0],
            own if leave == 1 else mine[1],
            own if leave == 2 else mine[2],
            own if leave == 3 else mine[3],
        )
    out[0] = x
    out[1] = y
    out[2] = z
    gx = gy = gz = 0.0
    for k in range(4):
        if mine[k] == 1:
            gx -= weight[k] * basis[k, 0]
            gy -= weight[k] * basis[k, 1]
            gz -= weight[k] * basis[k, 2]
    wx = gx * pose[node, 0, 0] + gy * pose[node, 0, 1] + gz * pose[node, 0, 2]
    wy = gx * pose[node, 0, 4] + gy * pose[node, 0, 5] + gz * pose[node, 0, 6]
    wz = gx * pose[node, 0, 8] + gy * pose[node, 0, 9] + gz * pose[node, 0, 10]
    length = math.sqrt(wx * wx + wy * wy + wz * wz)
    if length > 1e-9:
        out[3] = wx / length
        out[4] = wy / length
        out[5] = wz / length
    return t > 0.0
