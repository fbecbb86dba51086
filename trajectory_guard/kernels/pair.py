"""
One pair on one piece, from cheap to dear: the swept set, the centre, a common point.

Only two comparisons decide: ``separation`` above the limit closes the pair, and a common point
deeper than its motion proves an overlap.  Everything else chooses what they are asked.
"""

import math

from trajectory_guard.kernels.cull import ERROR, farthest, FUZZ, PLACE, SLACK
from trajectory_guard.kernels.deepest import deepest, depth
from trajectory_guard.kernels.gjk import gjk, OVERLAP, ROUNDS
from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.leaf import DEPTH, LOWER, NEAR, UPPER, X, Y, Z
from trajectory_guard.kernels.margin import chain_margin, sphere_margin, UP
from trajectory_guard.kernels.separation import allowance, box_direction, separation
from trajectory_guard.kernels.solids import BALL, FACE_FIRST, FACE_LAST, FAR, NODE

CLOSED = 0
OPEN = 1
OVERLAPS = 2  # at every instant of the piece

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
def _common_point(links, b, obstacles, o, e, error, fuzz, margin, lp, found, known):
    """
    Look for a common point at the centre and prove an overlap of the whole piece from it.

    The balls around the point, inside the link and inside the obstacle, overlap as long as the
    link's point has moved by less than the sum of their radii.

    :param known: UPPER, X, Y, Z and DEPTH are written when the point is proved.
    :returns: OVERLAPS or OPEN; ``found[3:6]`` then holds a direction or zeros.
    """
    node = links.ranges[b, NODE]
    if not deepest(
        e.pose, node, links, b, obstacles, o, lp[0], lp[1], lp[2], lp[3], lp[4], lp[5], found
    ):
        return OPEN
    mine = depth(
        links.faces,
        links.ranges[b, FACE_FIRST],
        links.ranges[b, FACE_LAST],
        found[0],
        found[1],
        found[2],
    )
    for r in range(3):
        found[6 + r] = (
            e.pose[node, 0, 4 * r] * found[0]
            + e.pose[node, 0, 4 * r + 1] * found[1]
            + e.pose[node, 0, 4 * r + 2] * found[2]
            + e.pose[node, 0, 4 * r + 3]
        )
    theirs = depth(
        obstacles.faces,
        obstacles.ranges[o, FACE_FIRST],
        obstacles.ranges[o, FACE_LAST],
        found[6],
        found[7],
        found[8],
    )
    if not (mine > fuzz + margin and theirs > margin):
        return OPEN
    known[X] = found[6]
    known[Y] = found[7]
    known[Z] = found[8]
    known[DEPTH] = mine + theirs - fuzz - 2.0 * margin
    known[UPPER] = -known[DEPTH]
    if not e.sound[node]:
        return OPEN
    moved = farthest(
        found[0], found[1], found[2], found[6], found[7], found[8], e.points, node, e.number[node]
    )
    # The point may lie off the core, within the ball: a linear part that is no rotation moves it.
    error += e.eps[node] * links.size[b, BALL]
    if moved + error + 2.0 * margin < mine + theirs:
        return OVERLAPS
    return OPEN


@kernel
def examine(
    chain, links, obstacles, path, pair, tolerance, clearance, e, body, live, way, i, work, known
):
    """
    Try to close one pair on the piece.

    :param pair: body and obstacle.
    :param live: (N, 2) int64; column 1 of row ``i``: the pair overlapped at the parent's centre.
    :param way: (N, 3); row ``i``: the direction inherited, replaced by the best one found.
    :param work: scratch of ``gjk`` (4, 6), (4,), (8,), of the common point (9,), of ``deepest`` (a
        tuple).
    :param known: (7,) out, see ``leaf``.
    :returns: CLOSED, OVERLAPS or OPEN.
    """
    b, o = pair
    s, w, out, found, lp = work
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
        overlap = _common_point(links, b, obstacles, o, e, error, fuzz, margin, lp, found, known)
        if overlap == OVERLAPS:
            return OVERLAPS
        nx = found[3]
        ny = found[4]
        nz = found[5]
        if sound and (nx != 0.0 or ny != 0.0 or nz != 0.0):
            _keep(way, i, nx, ny, nz, separation(nx, ny, nz, *moving, *scale), known)
    return OPEN
