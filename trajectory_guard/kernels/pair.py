"""
One pair on one piece, from cheap to dear: the swept set, the centre, a common point.

Only two comparisons decide: ``separation`` above the limit closes the pair, and a common point
deeper than its motion proves an overlap.  Everything else chooses what they are asked.
"""

import math

from trajectory_guard.kernels.cull import ERROR, farthest, FUZZ, PLACE, SLACK
from trajectory_guard.kernels.gjk import gjk, OVERLAP, ROUNDS
from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.leaf import DEPTH, LOWER, NEAR, UPPER, X, Y, Z
from trajectory_guard.kernels.margin import chain_margin, sphere_margin, UP
from trajectory_guard.kernels.separation import allowance, box_direction, separation
from trajectory_guard.kernels.solids import BALL, FAR, NODE
from trajectory_guard.kernels.witness import common_point, OPEN, OVERLAPS

CLOSED = 0

SWEPT_ROUNDS = 12  # a direction for a whole piece comes soon, or the piece is too long
ACCURACY = 0.02  # of the tolerance, for distances at the centre


@kernel
def _first_direction(way, i, body, b, obstacles, o):
    """Return a pair's inherited direction, or the one from the obstacle's box to the sphere."""
    nx = way[i, 0]
    ny = way[i, 1]
    nz = way[i, 2]
    if nx == 0.0 and ny == 0.0 and nz == 0.0:
        nx, ny, nz = box_direction(
            body[b, PLACE], body[b, PLACE + 1], body[b, PLACE + 2], obstacles, o
        )
    return nx, ny, nz


@kernel
def _keep(way, i, nx, ny, nz, lower, known):
    """Remember a direction if it proves more than the best one so far."""
    if lower > known[LOWER]:
        known[LOWER] = lower
        way[i, 0] = nx
        way[i, 1] = ny
        way[i, 2] = nz


@kernel
def _near(out, balls, e, node, error, known):
    """Write the bound that the nearest link point at the centre gives for the whole piece."""
    x = out[5] + out[0] * out[4] - e.pose[node, 0, 3]
    y = out[6] + out[1] * out[4] - e.pose[node, 0, 7]
    z = out[7] + out[2] * out[4] - e.pose[node, 0, 11]
    lx = e.pose[node, 0, 0] * x + e.pose[node, 0, 4] * y + e.pose[node, 0, 8] * z
    ly = e.pose[node, 0, 1] * x + e.pose[node, 0, 5] * y + e.pose[node, 0, 9] * z
    lz = e.pose[node, 0, 2] * x + e.pose[node, 0, 6] * y + e.pose[node, 0, 10] * z
    known[NEAR] = (
        farthest(lx, ly, lz, out[5], out[6], out[7], e.points, node, e.number[node])
        - balls
        + error
    )


@kernel
def examine(
    chain, links, obstacles, path, pair, tolerance, clearance, e, body, live, way, i, work, known
):
    """
    Try to close one pair on the piece.

    :param pair: body and obstacle.
    :param live: (N, 2) int64; column 1 of row ``i``: the pair overlapped at the parent's centre.
    :param way: (N, 3); row ``i``: the direction inherited, replaced by the best one found.
    :param work: scratch of ``gjk`` (4, 6), (4,), (8,), and of ``witness.common_point`` (a tuple).
    :param known: (7,) out, see ``leaf``.
    :returns: CLOSED, OVERLAPS or OPEN.
    """
    b, o = pair
    s, w, out, search = work
    node = links.ranges[b, NODE]
    sound = e.sound[node]
    fuzz = body[b, FUZZ]
    error = body[b, ERROR]
    balls = links.size[b, BALL] + obstacles.size[o, BALL]
    limit = (clearance + body[b, SLACK]) * UP
    scale = (error, float(chain.depth[node]), e.kappa[node], path.reach[b])
    moving = (e.points, node, e.number[node], links, b, obstacles, o)
    standing = (e.pose, node, 1, links, b, obstacles, o)
    margin = chain_margin(scale[1], scale[2], scale[3])
    margin += sphere_margin(scale[3], obstacles.size[o, FAR])
    want = limit + allowance(links, b, obstacles, o, *scale)
    accuracy = ACCURACY * tolerance
    known[LOWER] = -math.inf
    known[UPPER] = math.inf
    known[DEPTH] = 0.0
    known[NEAR] = math.inf
    nx, ny, nz = _first_direction(way, i, body, b, obstacles, o)
    if sound and live[i, 1] == 0:
        # Most pairs are closed here, and most of them by the first direction.
        gjk(nx, ny, nz, *moving, want, True, accuracy, SWEPT_ROUNDS, s, w, out)
        nx = out[0]
        ny = out[1]
        nz = out[2]
        _keep(way, i, nx, ny, nz, separation(nx, ny, nz, *moving, *scale), known)
        if known[LOWER] > limit:
            return CLOSED
    state = gjk(nx, ny, nz, *standing, want, False, accuracy, ROUNDS, s, w, out)
    known[UPPER] = out[4] - balls + fuzz + margin
    known[X] = out[5]
    known[Y] = out[6]
    known[Z] = out[7]
    if sound and state != OVERLAP:
        _near(out, balls, e, node, error + margin, known)
        nx = out[0]
        ny = out[1]
        nz = out[2]
        _keep(way, i, nx, ny, nz, separation(nx, ny, nz, *moving, *scale), known)
        if known[LOWER] > limit:
            return CLOSED
    if known[UPPER] <= fuzz + margin:
        if common_point(links, b, obstacles, o, e, error, fuzz, margin, search, known) == OVERLAPS:
            return OVERLAPS
        found = search[2]
        nx = found[3]
        ny = found[4]
        nz = found[5]
        if sound and (nx != 0.0 or ny != 0.0 or nz != 0.0):
            _keep(way, i, nx, ny, nz, separation(nx, ny, nz, *moving, *scale), known)
    return OPEN
