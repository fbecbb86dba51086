r"""
Cover the motion with pieces that are closed by proof (trusted bookkeeping).

A time tree is walked depth first, in time order.  A piece starts with the pairs its parent could not
close; each pair is tried from cheap to dear, and what stays open goes to both halves.  A pair
proved on an interval is proved on all of its parts, so the enclosures of the halves may be fitted
afresh.  A piece ends as

* FREE when no pair is open: every pair was closed on it or on a piece that contains it;
* COLLISION when one pair provably overlaps at every instant of it;
* SUSPECT when, at its centre, one pair is provably closer than clearance + tolerance and halving would only cut finer
  what lies within the tolerance anyway, or when budget or depth are spent.

Pairs that are not closed are never dropped: only ``_open_pairs`` removes a pair, and only after one
of its two inequalities held.
"""

import math

import numpy as np

from trajectory_guard.kernels.deepest import deepest, depth
from trajectory_guard.kernels.enclosure import (
    build,
    centre,
    displacement,
    enclosure,
    fit,
    fit_error,
)
from trajectory_guard.kernels.gjk import OVERLAP, ROUNDS, gjk
from trajectory_guard.kernels.jit import entry, kernel
from trajectory_guard.kernels.margin import UP, chain_margin, sphere_margin
from trajectory_guard.kernels.separation import (
    allowance,
    box_direction,
    box_distance,
    separation,
)
from trajectory_guard.kernels.solids import (
    BALL,
    CENTRE,
    CORE,
    FACE_FIRST,
    FACE_LAST,
    FAR,
    NODE,
)

FREE = 1
SUSPECT = 2
COLLISION = 3

BY_TOLERANCE = 0
BY_DEPTH = 1
BY_BUDGET = 2
BY_STOP = 3

FINEST_WITNESS = 12
DEEPEST_LEVEL = 48  # times are exact dyadic numbers in a double up to here
SWEPT_ROUNDS = 12  # a direction for a whole piece either comes soon or the piece is too long
CLOSED = 0
OPEN = 1
OVERLAPS = 2  # at every instant of the piece

# columns of a leaf's integers and floats
SEGMENT, START, END, LEVEL, STATUS, REASON, BODY, OBSTACLE, WITNESS = range(9)
LOWER, UPPER, X, Y, Z = range(5)


@kernel
def _grow(array, wanted):
    """Return the array, or a copy with room for at least ``wanted`` rows."""
    if wanted <= array.shape[0]:
        return array
    larger = np.empty((max(wanted, 2 * array.shape[0]), array.shape[1]), array.dtype)
    for i in range(array.shape[0]):
        for k in range(array.shape[1]):
            larger[i, k] = array[i, k]
    return larger


@kernel
def _leaf(ints, floats, row, segment, start, end, level, status, reason, pair, info):
    """Write a leaf: [start, end] / 2^level of a segment; ``pair`` is (body, obstacle) or (-1, -1)."""
    ints[row, SEGMENT] = segment
    ints[row, START] = start
    ints[row, END] = end
    ints[row, LEVEL] = level
    ints[row, STATUS] = status
    ints[row, REASON] = reason
    ints[row, BODY] = pair[0]
    ints[row, OBSTACLE] = pair[1]
    ints[row, WITNESS] = 0
    for k in range(5):
        floats[row, k] = info[k]


@kernel
def _need(chain, links, pair_body, live, first, last, e):
    """Mark the nodes between the root and the bodies of open pairs."""
    for j in range(len(chain.parent)):
        e.needed[j] = False
    for i in range(first, last):
        j = links.index[pair_body[live[i, 0]], NODE]
        while j >= 0 and not e.needed[j]:
            e.needed[j] = True
            j = chain.parent[j]


@kernel
def _farthest(x, y, z, px, py, pz, points, node, count):
    """Return the largest distance of a link point's control points from a fixed point."""
    worst = 0.0
    for i in range(count):
        square = 0.0
        for r in range(3):
            value = (
                points[node, i, 4 * r] * x
                + points[node, i, 4 * r + 1] * y
                + points[node, i, 4 * r + 2] * z
                + points[node, i, 4 * r + 3]
            )
            value -= px if r == 0 else (py if r == 1 else pz)
            square += value * value
        worst = max(worst, square)
    return math.sqrt(worst) * UP


@kernel
def _open_pairs(chain, links, obstacles, path, pair_body, pair_obstacle, clearance, e, body, live, way, first, last):
    """
    Copy the pairs that a bounding sphere cannot close behind ``last`` and return their number.

    The body's sphere around the centre pose, swept by the largest displacement, against the
    obstacle's oriented box.

    :param body: (B, 9) out per body with an open pair: sweep, linear sweep, centre error, tracking
        inflation, position of the sphere's centre (3), smallest distance of that centre to a box,
        and the error of the rational motion once :func:`_hopeless` has filled it [m].
    """
    for i in range(first, last):
        body[pair_body[live[i, 0]], 0] = -1.0
    top = last
    for i in range(first, last):
        b = pair_body[live[i, 0]]
        o = pair_obstacle[live[i, 0]]
        node = links.index[b, NODE]
        if body[b, 0] < 0.0:
            sweep, linear, fuzz, slack = displacement(chain, path, b, node, e)
            body[b, 0] = sweep
            body[b, 1] = linear
            body[b, 2] = fuzz
            body[b, 3] = slack
            for r in range(3):
                body[b, 4 + r] = (
                    e.pose[node, 0, 4 * r] * links.place[b, CENTRE]
                    + e.pose[node, 0, 4 * r + 1] * links.place[b, CENTRE + 1]
                    + e.pose[node, 0, 4 * r + 2] * links.place[b, CENTRE + 2]
                    + e.pose[node, 0, 4 * r + 3]
                )
            body[b, 7] = math.inf
            body[b, 8] = -1.0
            body[b, 9] = -1.0
        distance = box_distance(body[b, 4], body[b, 5], body[b, 6], obstacles, o)
        taken = (
            links.size[b, CORE]
            + links.size[b, BALL]
            + obstacles.size[o, BALL]
            + body[b, 0]
            + body[b, 2]
            + body[b, 3]
            + clearance
            + sphere_margin(path.reach[b], obstacles.size[o, FAR])
        )
        if distance > taken * UP:
            continue
        body[b, 7] = min(body[b, 7], distance - obstacles.size[o, BALL])
        live[top, 0] = live[i, 0]
        for k in range(3):
            way[top, k] = way[i, k]
        top += 1
    return top - last


@kernel
def _hopeless(links, pair_body, live, first, last, chain, path, e, body, tolerance):
    """Say whether some open pair cannot be closed because the enclosure is wider than the gap."""
    hopeless = False
    for i in range(first, last):
        b = pair_body[live[i, 0]]
        if body[b, 8] < 0.0:
            body[b, 8] = fit_error(chain, path, b, links.index[b, NODE], e)
            if body[b, 0] > tolerance and not (
                body[b, 8] <= body[b, 7] + 0.05 * (links.size[b, CORE] + links.size[b, BALL])
            ):
                hopeless = True
    return hopeless


@kernel
def _near_pairs(chain, links, obstacles, path, pair_body, pair_obstacle, clearance, e, body, live, way, first, last):
    """
    Drop the pairs that the body's sphere closes along its rational motion; return the new end.

    The control points of the sphere's centre lie within ``body[b, 9]`` of its place at the piece's
    centre, so the centre does during the whole piece, up to the error of the motion.
    """
    top = first
    for i in range(first, last):
        b = pair_body[live[i, 0]]
        o = pair_obstacle[live[i, 0]]
        node = links.index[b, NODE]
        if body[b, 9] < 0.0:
            if e.sound[node]:
                body[b, 9] = _farthest(
                    links.place[b, CENTRE],
                    links.place[b, CENTRE + 1],
                    links.place[b, CENTRE + 2],
                    body[b, 4],
                    body[b, 5],
                    body[b, 6],
                    e.points,
                    node,
                    e.count[node],
                )
            else:
                body[b, 9] = math.inf
        taken = (
            links.size[b, CORE]
            + links.size[b, BALL]
            + obstacles.size[o, BALL]
            + body[b, 9]
            + body[b, 8]
            + body[b, 3]
            + clearance
            + chain_margin(float(chain.depth[node]), e.kappa[node], path.reach[b])
            + sphere_margin(path.reach[b], obstacles.size[o, FAR])
        )
        if box_distance(body[b, 4], body[b, 5], body[b, 6], obstacles, o) > taken * UP:
            continue
        live[top, 0] = live[i, 0]
        for k in range(3):
            way[top, k] = way[i, k]
        top += 1
    return top


@kernel
def _first_direction(way, i, body, b, obstacles, o):
    """Return the inherited direction of a pair, or the one from the obstacle's box to the sphere's centre."""
    nx = way[i, 0]
    ny = way[i, 1]
    nz = way[i, 2]
    if nx == 0.0 and ny == 0.0 and nz == 0.0:
        nx, ny, nz = box_direction(body[b, 4], body[b, 5], body[b, 6], obstacles, o)
    return nx, ny, nz


@kernel
def _entangled(links, b, obstacles, o, e, error, fuzz, margin, lp, found, info):
    """
    Look for a common point at the centre and prove an overlap of the whole piece from it.

    The balls around the point, inside the link and inside the obstacle, overlap as long as the link's
    point has moved by less than the sum of their radii.

    :param info: (8,) in/out: UPPER, X, Y, Z, and at 5 the depth sum minus all errors at the centre.
    :returns: OVERLAPS or OPEN; ``found[3:6]`` then holds a direction or zeros.
    """
    node = links.index[b, NODE]
    info[5] = 0.0
    if not deepest(
        e.pose, node, links, b, obstacles, o, lp[0], lp[1], lp[2], lp[3], lp[4], found
    ):
        return OPEN
    mine = depth(
        links.faces, links.index[b, FACE_FIRST], links.index[b, FACE_LAST], found[0], found[1], found[2]
    )
    px = py = pz = 0.0
    for r in range(3):
        value = (
            e.pose[node, 0, 4 * r] * found[0]
            + e.pose[node, 0, 4 * r + 1] * found[1]
            + e.pose[node, 0, 4 * r + 2] * found[2]
            + e.pose[node, 0, 4 * r + 3]
        )
        if r == 0:
            px = value
        elif r == 1:
            py = value
        else:
            pz = value
    theirs = depth(
        obstacles.faces, obstacles.index[o, FACE_FIRST], obstacles.index[o, FACE_LAST], px, py, pz
    )
    if not (mine > fuzz + margin and theirs > margin):
        return OPEN
    info[X] = px
    info[Y] = py
    info[Z] = pz
    info[5] = mine + theirs - fuzz - 2.0 * margin
    info[UPPER] = -info[5]
    if not e.sound[node]:
        return OPEN
    moved = _farthest(
        found[0], found[1], found[2], px, py, pz, e.points, node, e.count[node]
    )
    if moved + error + 2.0 * margin < mine + theirs:
        return OVERLAPS
    return OPEN


@kernel
def _pair(chain, links, obstacles, path, b, o, i, tolerance, clearance, e, body, way, scratch, lp, info):
    """
    Try to close one pair on the piece.

    :param i: row of ``way``: the direction inherited, replaced by the best one found.
    :param info: (8,) out: LOWER, UPPER, X, Y, Z, depth sum at the centre, and at 6 an upper bound of
        the distance that holds at every instant of the piece.
    :returns: CLOSED, OVERLAPS or OPEN.
    """
    node = links.index[b, NODE]
    reach = path.reach[b]
    levels = float(chain.depth[node])
    fuzz = body[b, 2]
    limit = (clearance + body[b, 3]) * UP
    error = body[b, 8]
    sound = e.sound[node]
    kappa = e.kappa[node]
    count = e.count[node]
    s, w, out, found = scratch
    info[LOWER] = -math.inf
    info[UPPER] = math.inf
    info[5] = 0.0
    info[6] = math.inf
    nx, ny, nz = _first_direction(way, i, body, b, obstacles, o)
    balls = links.size[b, BALL] + obstacles.size[o, BALL]
    margin = chain_margin(levels, kappa, reach) + sphere_margin(reach, obstacles.size[o, FAR])
    needed = limit + allowance(links, b, obstacles, o, error, levels, kappa, reach)
    # First the whole piece, then its centre: most pairs are closed by the first direction.
    for attempt in range(2):
        if attempt == 1:
            state = gjk(
                nx, ny, nz, e.pose, node, 1, links, b, obstacles, o, math.inf, 0.02 * tolerance,
                ROUNDS, s, w, out,
            )
            info[UPPER] = out[4] - balls + fuzz + margin
            info[X] = out[5]
            info[Y] = out[6]
            info[Z] = out[7]
            if state == OVERLAP or not sound:
                break
            _near_bound(out[0], out[1], out[2], out, balls, e, node, count, error + margin, info)
        elif sound:
            gjk(
                nx, ny, nz, e.points, node, count, links, b, obstacles, o, needed,
                0.02 * tolerance, SWEPT_ROUNDS, s, w, out,
            )
        else:
            continue
        nx = out[0]
        ny = out[1]
        nz = out[2]
        lower = separation(
            nx, ny, nz, e.points, node, count, links, b, obstacles, o, error, levels, kappa, reach
        )
        if lower > info[LOWER]:
            info[LOWER] = lower
            way[i, 0] = nx
            way[i, 1] = ny
            way[i, 2] = nz
        if lower > limit:
            return CLOSED
    if info[UPPER] <= fuzz + margin:
        if _entangled(links, b, obstacles, o, e, error, fuzz, margin, lp, found, info) == OVERLAPS:
            return OVERLAPS
        if sound and (found[3] != 0.0 or found[4] != 0.0 or found[5] != 0.0):
            lower = separation(
                found[3], found[4], found[5], e.points, node, count, links, b, obstacles, o,
                error, levels, kappa, reach,
            )
            if lower > info[LOWER]:
                info[LOWER] = lower
                for k in range(3):
                    way[i, k] = found[3 + k]
    return OPEN


@kernel
def _near_bound(nx, ny, nz, out, balls, e, node, count, error, info):
    """Write the bound that the nearest link point at the centre gives for the whole piece."""
    x = out[5] + nx * out[4] - e.pose[node, 0, 3]
    y = out[6] + ny * out[4] - e.pose[node, 0, 7]
    z = out[7] + nz * out[4] - e.pose[node, 0, 11]
    lx = e.pose[node, 0, 0] * x + e.pose[node, 0, 4] * y + e.pose[node, 0, 8] * z
    ly = e.pose[node, 0, 1] * x + e.pose[node, 0, 5] * y + e.pose[node, 0, 9] * z
    lz = e.pose[node, 0, 2] * x + e.pose[node, 0, 6] * y + e.pose[node, 0, 10] * z
    info[6] = (
        _farthest(lx, ly, lz, out[5], out[6], out[7], e.points, node, count) - balls + error
    )


@kernel
def _settled(info, limit, sweep, tolerance):
    """Say whether halving a piece would only cut finer what lies within the tolerance."""
    return info[UPPER] <= limit + tolerance and (
        info[LOWER] >= limit - tolerance or info[6] <= limit + tolerance or sweep <= tolerance
    )


@kernel
def _witness(level, depth_sum, linear):
    """
    Return w such that the middle 2^-w of a piece provably collides, 0 if none is known.

    A point common to both solids at the centre by ``depth_sum`` in all stays common until the link has
    moved by that much, and it moves at most linearly in the time from the centre.
    """
    if not depth_sum > 0.0:
        return 0
    w = 1
    reach = 0.5 * linear
    while w < FINEST_WITNESS and not reach < depth_sum:
        w += 1
        reach *= 0.5
    if reach < depth_sum and level + w + 1 <= DEEPEST_LEVEL + FINEST_WITNESS:
        return w
    return 0


@kernel
def _swap(live, way, i, k):
    """Swap two open pairs, so that a pair seen overlapping is tried first by the children."""
    live[i, 0], live[k, 0] = live[k, 0], live[i, 0]
    for c in range(3):
        way[i, c], way[k, c] = way[k, c], way[i, c]


@kernel
def _push(stack, row, k, level, first, last):
    """Write a stack entry: piece k / 2^level and its open pairs."""
    stack[row, 0] = k
    stack[row, 1] = level
    stack[row, 2] = first
    stack[row, 3] = last


@entry
def cover(chain, links, obstacles, path, pair_body, pair_obstacle, tolerance, clearance, max_pieces, stop, builder):
    """
    Cover all segments of a path.

    :param chain: :class:`~trajectory_guard.kernels.chain.Chain`.
    :param links: :class:`~trajectory_guard.kernels.solids.Solids` in node frames.
    :param obstacles: the same in the root frame.
    :param path: :class:`~trajectory_guard.kernels.enclosure.Path`.
    :param pair_body: (P,) int64 bodies, and pair_obstacle (P,) int64 obstacles, of the pairs to check.
    :param tolerance: gaps above it must be decided [m].
    :param clearance: distance that must be exceeded [m].
    :param max_pieces: pieces to examine before the rest is given up as suspect.
    :param stop: (1,) int64; another thread sets it non-zero to have the rest given up.
    :param builder: how motions are built, ``enclosure.RATIONAL`` or ``ECONOMISED``.
    :returns: leaves in time order, integers (L, 9) and floats (L, 5), and the pieces examined.
    """
    nodes = len(chain.parent)
    longest = 0
    for j in range(nodes):
        moving = 0
        i = j
        while i >= 0:
            if path.moving[i]:
                moving += 1
            i = chain.parent[i]
        longest = max(longest, moving)
    e = enclosure(nodes, longest, builder)
    pairs = len(pair_body)
    body = np.empty((len(links.index), 10))
    live = np.empty((4 * pairs + 16, 1), np.int64)
    way = np.zeros((4 * pairs + 16, 3))
    for i in range(pairs):
        live[i, 0] = i
    most_faces = 1
    for o in range(len(obstacles.index)):
        most_faces = max(most_faces, obstacles.index[o, FACE_LAST] - obstacles.index[o, FACE_FIRST])
    scratch = (np.empty((4, 6)), np.empty(4), np.empty(8), np.empty(6))
    lp = (np.empty((4, 4)), np.empty(4), np.empty((4, 8)), np.empty(4), np.empty((most_faces, 4)))
    info = np.zeros(8)
    worst = np.zeros(8)
    stack = np.empty((2 * DEEPEST_LEVEL + 4, 4), np.int64)
    ints = np.empty((64, 9), np.int64)
    floats = np.empty((64, 5))
    leaves = 0
    pieces = 0
    reason = -1
    for segment in range(path.coefficients.shape[0]):
        _push(stack, 0, 0, 0, 0, pairs)
        height = 1
        while height > 0:
            height -= 1
            k = stack[height, 0]
            level = stack[height, 1]
            first = stack[height, 2]
            last = stack[height, 3]
            ints = _grow(ints, leaves + 1)
            floats = _grow(floats, leaves + 1)
            if reason < 0 and pieces >= max_pieces:
                reason = BY_BUDGET
            if reason < 0 and stop[0] != 0:
                reason = BY_STOP
            if reason >= 0:
                info[LOWER] = -math.inf
                info[UPPER] = math.inf
                _leaf(ints, floats, leaves, segment, k, k + 1, level, SUSPECT, reason, (-1, -1), info)
                leaves += 1
                continue
            pieces += 1
            h = 0.5 ** (level + 1)
            m = (2 * k + 1) * h
            live = _grow(live, 2 * last - first)
            way = _grow(way, 2 * last - first)
            _need(chain, links, pair_body, live, first, last, e)
            centre(chain, path, segment, m, h, e)
            top = last + _open_pairs(
                chain, links, obstacles, path, pair_body, pair_obstacle, clearance, e, body, live,
                way, first, last,
            )
            status = FREE
            pair = (-1, -1)
            worst[UPPER] = math.inf
            if top > last:
                status = -1
                _need(chain, links, pair_body, live, last, top, e)
                fit(chain, e, builder)
                hopeless = _hopeless(
                    links, pair_body, live, last, top, chain, path, e, body, tolerance
                )
                if level >= DEEPEST_LEVEL or not hopeless:
                    build(chain, e, builder)
                    top = _near_pairs(
                        chain, links, obstacles, path, pair_body, pair_obstacle, clearance, e,
                        body, live, way, last, top,
                    )
                    kept = last
                    for i in range(last, top):
                        b = pair_body[live[i, 0]]
                        o = pair_obstacle[live[i, 0]]
                        outcome = _pair(
                            chain, links, obstacles, path, b, o, i, tolerance, clearance, e,
                            body, way, scratch, lp, info,
                        )
                        if outcome == CLOSED:
                            continue
                        if outcome == OVERLAPS:
                            status = COLLISION
                            pair = (b, o)
                            for c in range(8):
                                worst[c] = info[c]
                            break
                        limit = (clearance + body[b, 3]) * UP
                        if (
                            level >= DEEPEST_LEVEL
                            or _settled(info, limit, body[b, 0], tolerance)
                        ) and (status != SUSPECT or info[UPPER] < worst[UPPER]):
                            status = SUSPECT
                            pair = (b, o)
                            for c in range(8):
                                worst[c] = info[c]
                        live[kept, 0] = live[i, 0]
                        for c in range(3):
                            way[kept, c] = way[i, c]
                        if info[UPPER] < 0.0:
                            _swap(live, way, kept, last)
                        kept += 1
                    top = kept
                    if status == -1 and top == last:
                        status = FREE
            if status == FREE or status == COLLISION:
                worst[LOWER] = worst[LOWER] if status == COLLISION else 0.0
                _leaf(ints, floats, leaves, segment, k, k + 1, level, status, BY_TOLERANCE, pair, worst)
                leaves += 1
            elif status == SUSPECT:
                if level >= DEEPEST_LEVEL:
                    _leaf(ints, floats, leaves, segment, k, k + 1, level, SUSPECT, BY_DEPTH, pair, worst)
                    leaves += 1
                else:
                    _leaf(ints, floats, leaves, segment, k, k + 1, level, SUSPECT, BY_TOLERANCE, pair, worst)
                    ints[leaves, WITNESS] = _witness(level, worst[5], body[pair[0], 1])
                    leaves += 1
            else:
                _push(stack, height, 2 * k + 1, level + 1, last, top)
                _push(stack, height + 1, 2 * k, level + 1, last, top)
                height += 2
    return ints[:leaves], floats[:leaves], pieces
