r"""
The inequality that certifies (trusted).

Let P_i = C_i / w_i be the control points of a link's motion on a piece, all weights positive, and
n a unit vector.  The link's point x stays in conv{P_i x}; the link's solid is the convex hull of
its vertices v plus a disc plus a ball of radius r, the obstacle likewise with vertices p and
radius r'.  If e bounds how far the true, toleranced motion can leave the rational one, then during
the whole piece

    distance >= min_{i,v} n.(P_i v) - e - r - (max_p n.p + r') - rounding,

because a linear function on a convex hull is least at one of its generators.  A disc of radius R
and axis a adds -R |g - (g.a) a| with g = P_i^T n, its exact support.  The direction may come from
anywhere; only this number decides.
"""

import math

import numpy as np

from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.margin import chain_margin, plane_margin, UP
from trajectory_guard.kernels.minimum import minimum
from trajectory_guard.kernels.solids import (
    AXIS,
    BALL,
    BOX,
    CENTRE,
    CORE,
    DISC,
    FAR,
    FIRST,
    HALF,
    LAST,
)

# A normalised double vector is this close to unit length; `plane_margin` pays for it.
UNIT_SLACK = 4e-15


@kernel
def disc_support(solids, b, gx, gy, gz):
    """Return R |g - (g.a) a| of a solid's disc."""
    radius = solids.size[b, DISC]
    if radius == 0.0:
        return 0.0
    ax = solids.place[b, AXIS]
    ay = solids.place[b, AXIS + 1]
    az = solids.place[b, AXIS + 2]
    along = gx * ax + gy * ay + gz * az
    px = gx - along * ax
    py = gy - along * ay
    pz = gz - along * az
    return radius * math.sqrt(px * px + py * py + pz * pz)


@kernel
def least(gx, gy, gz, solids, b):
    """
    Return the least g.v over the vertices of a solid, NaN if any term is NaN.

    The indices are unsigned: a signed one may be negative for the compiler, and that keeps the
    loop scalar.
    """
    best = math.inf
    for v in range(np.uint64(solids.ranges[b, FIRST]), np.uint64(solids.ranges[b, LAST])):
        best = minimum(
            best,
            gx * solids.vertices[0, v] + gy * solids.vertices[1, v] + gz * solids.vertices[2, v],
        )
    return best


@kernel
def lowest(nx, ny, nz, points, node, count, links, b):
    """
    Return the least n.(P_i x) over control points and the core of a link, and the control point.

    A control point is skipped only if its sphere around the core cannot go lower; the one whose
    sphere goes lowest is tried first.

    :param points: (n, K, 12) control points of the nodes.
    :param count: how many the node has.
    :returns: value [m], NaN if a term is NaN, and the index of the control point.
    """
    cx = links.place[b, CENTRE]
    cy = links.place[b, CENTRE + 1]
    cz = links.place[b, CENTRE + 2]
    core = links.size[b, CORE]
    guess = 0
    bottom = math.inf
    best = math.inf
    best_i = 0
    for trial in range(-count, count):
        i = trial + count if trial < 0 else trial
        gx = nx * points[node, i, 0] + ny * points[node, i, 4] + nz * points[node, i, 8]
        gy = nx * points[node, i, 1] + ny * points[node, i, 5] + nz * points[node, i, 9]
        gz = nx * points[node, i, 2] + ny * points[node, i, 6] + nz * points[node, i, 10]
        offset = nx * points[node, i, 3] + ny * points[node, i, 7] + nz * points[node, i, 11]
        slope = math.sqrt(gx * gx + gy * gy + gz * gz) * UP
        below = gx * cx + gy * cy + gz * cz + offset - slope * core
        if trial < 0:
            if below < bottom:
                bottom = below
                guess = i
            if trial < -1:
                continue
            i = guess
            gx = nx * points[node, i, 0] + ny * points[node, i, 4] + nz * points[node, i, 8]
            gy = nx * points[node, i, 1] + ny * points[node, i, 5] + nz * points[node, i, 9]
            gz = nx * points[node, i, 2] + ny * points[node, i, 6] + nz * points[node, i, 10]
            offset = nx * points[node, i, 3] + ny * points[node, i, 7] + nz * points[node, i, 11]
        elif below >= best:
            continue
        value = least(gx, gy, gz, links, b) + offset - disc_support(links, b, gx, gy, gz)
        if not value >= best:
            best = value
            best_i = i
            if value != value:
                break
    return best, best_i


@kernel
def highest(nx, ny, nz, obstacles, o):
    """Return the largest n.x over the core of an obstacle [m], NaN if a term is NaN."""
    return disc_support(obstacles, o, nx, ny, nz) - least(-nx, -ny, -nz, obstacles, o)


@kernel
def allowance(links, b, obstacles, o, error, depth, kappa, reach):
    """
    Return what a support difference must exceed for a positive distance.

    :param error: bound on the distance between the true motion and the rational one [m].
    :param depth: joints between the root and the link.
    :param kappa: column bound of the control points.
    :param reach: bound on the link's coordinates [m].
    :returns: balls, error and rounding together [m].
    """
    rounding = chain_margin(depth, kappa, reach) + plane_margin(
        kappa, reach, obstacles.size[o, FAR]
    )
    return (links.size[b, BALL] + obstacles.size[o, BALL] + error + rounding) * UP


@kernel
def separation(
    nx, ny, nz, points, node, count, links, b, obstacles, o, error, depth, kappa, reach
):
    """
    Return a proved lower bound of the distance between a moving link and an obstacle.

    :param nx: proposed direction, from the obstacle towards the link; must be of unit length.
    :returns: the bound for the whole piece [m]; minus infinity for a direction that is not unit.
    """
    square = nx * nx + ny * ny + nz * nz
    if not abs(square - 1.0) < UNIT_SLACK:
        return -math.inf
    low, _ = lowest(nx, ny, nz, points, node, count, links, b)
    high = highest(nx, ny, nz, obstacles, o)
    gap = low - high - allowance(links, b, obstacles, o, error, depth, kappa, reach)
    if gap < math.inf:
        return gap
    return -math.inf


@kernel
def box_distance(x, y, z, solids, o):
    """
    Return the distance of a point to the oriented box of a solid, zero inside.

    :param x: point in the solid's frame [m].
    :returns: distance [m], rounding not included.
    """
    dx = x - solids.place[o, BOX + 3]
    dy = y - solids.place[o, BOX + 7]
    dz = z - solids.place[o, BOX + 11]
    total = 0.0
    for k in range(3):
        along = abs(
            dx * solids.place[o, BOX + k]
            + dy * solids.place[o, BOX + 4 + k]
            + dz * solids.place[o, BOX + 8 + k]
        )
        outside = along - solids.place[o, HALF + k]
        if outside > 0.0:
            total += outside * outside
    return math.sqrt(total)


@kernel
def box_direction(x, y, z, solids, o):
    """
    Propose the direction from the oriented box of a solid to a point outside it.

    :returns: a unit vector; from the box's centre if the point is inside.
    """
    dx = x - solids.place[o, BOX + 3]
    dy = y - solids.place[o, BOX + 7]
    dz = z - solids.place[o, BOX + 11]
    nx = ny = nz = 0.0
    for k in range(3):
        ax = solids.place[o, BOX + k]
        ay = solids.place[o, BOX + 4 + k]
        az = solids.place[o, BOX + 8 + k]
        along = dx * ax + dy * ay + dz * az
        half = solids.place[o, HALF + k]
        outside = along - min(max(along, -half), half)
        nx += outside * ax
        ny += outside * ay
        nz += outside * az
    if nx == 0.0 and ny == 0.0 and nz == 0.0:
        nx = dx
        ny = dy
        nz = dz
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if not length > 0.0:
        return 0.0, 0.0, 1.0
    return nx / length, ny / length, nz / length
