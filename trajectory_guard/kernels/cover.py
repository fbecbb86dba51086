r"""
Cover the motion with pieces that are closed by proof (trusted bookkeeping).

A time tree is walked depth first, in time order.  A piece starts with the pairs its parent could
not close; each pair is tried from cheap to dear, and what stays open goes to both halves.  A pair
proved on an interval is proved on all of its parts, so the enclosures of the halves may be fitted
afresh.  A piece ends as

* FREE when no pair is open: every pair was closed on it or on a piece that contains it;
* COLLISION when one pair provably overlaps at every instant of it;
* SUSPECT when, at its centre, one pair is provably closer than clearance + tolerance and halving
  would only cut finer what lies within the tolerance anyway, or when budget or depth are spent.

A pair leaves the list of open pairs only after one of the inequalities of ``cull`` or
``separation`` held.
"""

import math

import numpy as np

from trajectory_guard.kernels import leaf
from trajectory_guard.kernels.chain import POSE
from trajectory_guard.kernels.cull import (
    BODY_COLUMNS,
    hopeless,
    LINEAR,
    moving_spheres,
    SLACK,
    SWEEP,
    swept_spheres,
)
from trajectory_guard.kernels.enclosure import build, centre, enclosure, fit
from trajectory_guard.kernels.jit import entry, kernel
from trajectory_guard.kernels.leaf import COLLISION, FREE, grown, SUSPECT, write
from trajectory_guard.kernels.margin import UP
from trajectory_guard.kernels.pair import CLOSED, examine
from trajectory_guard.kernels.solids import FACE_FIRST, FACE_LAST, NODE
from trajectory_guard.kernels.witness import OVERLAPS

DEEPEST_LEVEL = 48  # times are exact dyadic numbers in a double up to here
FINEST_WITNESS = 12
UNDECIDED = 0


@kernel
def _need(chain, links, pairs, live, first, last, e):
    """Mark the nodes between the root and the bodies of open pairs."""
    for j in range(len(chain.parent)):
        e.needed[j] = False
    for i in range(first, last):
        j = links.ranges[pairs[live[i, 0], 0], NODE]
        while j >= 0 and not e.needed[j]:
            e.needed[j] = True
            j = chain.parent[j]


@kernel
def _settled(known, limit, sweep, tolerance):
    """Say whether halving a piece would only cut finer what lies within the tolerance."""
    return known[leaf.UPPER] <= limit + tolerance and (
        known[leaf.LOWER] >= limit - tolerance
        or known[leaf.NEAR] <= limit + tolerance
        or sweep <= tolerance
    )


@kernel
def _witness(depth, linear):
    """
    Return w such that the middle 2^-w of a piece provably collides, 0 if none is known.

    A point common to both solids at the centre by ``depth`` in all stays common until the link has
    moved by that much, and it moves at most linearly in the time from the centre.
    """
    if not depth > 0.0:
        return 0
    w = 1
    reach = 0.5 * linear
    while w < FINEST_WITNESS and not reach < depth:
        w += 1
        reach *= 0.5
    return w if reach < depth else 0


@kernel
def _swap(live, way, i, k):
    """Swap two open pairs."""
    for c in range(2):
        live[i, c], live[k, c] = live[k, c], live[i, c]
    for c in range(3):
        way[i, c], way[k, c] = way[k, c], way[i, c]


@kernel
def _try_pairs(
    chain,
    links,
    obstacles,
    path,
    pairs,
    tolerance,
    clearance,
    e,
    body,
    live,
    way,
    first,
    last,
    deep,
    work,
    known,
    worst,
    named,
):
    """
    Examine the open pairs ``first:last`` of a piece; those that stay open are moved to the front.

    :param deep: whether the piece may not be halved.
    :param worst: (7,) out: what is known about the pair that ends the piece, named (2,) out.
    :returns: FREE, SUSPECT, COLLISION or UNDECIDED, and the new end of the open pairs.
    """
    status = UNDECIDED
    kept = first
    for i in range(first, last):
        b = pairs[live[i, 0], 0]
        o = pairs[live[i, 0], 1]
        outcome = examine(
            chain,
            links,
            obstacles,
            path,
            (b, o),
            tolerance,
            clearance,
            e,
            body,
            live,
            way,
            i,
            work,
            known,
        )
        if outcome == CLOSED:
            continue
        limit = (clearance + body[b, SLACK]) * UP
        # A body that stands in this piece stands in both halves.
        still = body[b, SWEEP] == 0.0
        settled = deep or still or _settled(known, limit, body[b, SWEEP], tolerance)
        nearer = status != SUSPECT or known[leaf.UPPER] < worst[leaf.UPPER]
        if outcome == OVERLAPS or (settled and nearer):
            status = COLLISION if outcome == OVERLAPS else SUSPECT
            named[0] = b
            named[1] = o
            for c in range(leaf.KNOWN):
                worst[c] = known[c]
        if outcome == OVERLAPS:
            return COLLISION, kept
        if kept < i:
            _swap(live, way, kept, i)
        live[kept, 1] = known[leaf.UPPER] < 0.0
        if live[kept, 1]:
            # What overlaps at the centre is likely to overlap in a half: let it be tried first.
            _swap(live, way, first, kept)
        kept += 1
    if status == UNDECIDED and kept == first:
        status = FREE
    return status, kept


@kernel
def _longest(chain, path):
    """Return the largest number of moving joints between the root and a node."""
    longest = 0
    for j in range(len(chain.parent)):
        moving = 0
        i = j
        while i >= 0:
            if path.moving[i]:
                moving += 1
            i = chain.parent[i]
        longest = max(longest, moving)
    return longest


@kernel
def _scratch(obstacles):
    """Allocate the scratch of ``pair.examine``."""
    faces = 1
    for o in range(len(obstacles.ranges)):
        faces = max(faces, obstacles.ranges[o, FACE_LAST] - obstacles.ranges[o, FACE_FIRST])
    lp = (
        np.empty((4, 4)),
        np.empty(4),
        np.empty((4, 4)),
        np.empty(4),
        np.empty(4),
        np.empty((faces, 4)),
    )
    search = (lp, np.empty((1, 1, POSE)), np.zeros(11), np.zeros(11), np.zeros(11))
    return np.empty((4, 6)), np.empty(4), np.empty(8), search


@kernel
def _push(stack, row, k, level, first, last):
    """Write a stack entry: piece k / 2^level and its open pairs."""
    stack[row, 0] = k
    stack[row, 1] = level
    stack[row, 2] = first
    stack[row, 3] = last


@entry
def cover(chain, links, obstacles, path, pairs, tolerance, clearance, max_pieces, stop, builder):
    """
    Cover all segments of a path.

    :param chain: :class:`~trajectory_guard.kernels.chain.Chain`.
    :param links: :class:`~trajectory_guard.kernels.solids.Solids` in node frames.
    :param obstacles: the same in the root frame.
    :param path: :class:`~trajectory_guard.kernels.enclosure.Path`.
    :param pairs: (P, 2) int64: body and obstacle of every pair to check.
    :param tolerance: gaps above it must be decided [m].
    :param clearance: distance that must be exceeded [m].
    :param max_pieces: pieces to examine before the rest is given up as suspect.
    :param stop: (1,) int64; another thread sets it non-zero to have the rest given up.
    :param builder: how motions are built, ``enclosure.RATIONAL`` or ``ECONOMISED``.
    :returns: leaves in time order, integers (L, 9) and floats (L, 7), and the pieces examined.
    """
    e = enclosure(len(chain.parent), _longest(chain, path), builder)
    body = np.empty((len(links.ranges), BODY_COLUMNS))
    # Open pairs of the pieces on the stack, end to end; both halves of a piece share its rows.
    live = np.zeros((4 * len(pairs) + 16, 2), np.int64)
    way = np.zeros((4 * len(pairs) + 16, 3))
    for i in range(len(pairs)):
        live[i, 0] = i
    work = _scratch(obstacles)
    known = np.zeros(leaf.KNOWN)
    worst = np.zeros(leaf.KNOWN)
    named = np.empty(2, np.int64)
    stack = np.empty((DEEPEST_LEVEL + 4, 4), np.int64)
    ints = np.empty((64, leaf.COLUMNS), np.int64)
    floats = np.empty((64, leaf.KNOWN))
    leaves = 0
    pieces = 0
    given_up = -1
    for segment in range(path.coefficients.shape[0]):
        _push(stack, 0, 0, 0, 0, len(pairs))
        height = 1
        while height > 0:
            height -= 1
            k = stack[height, 0]
            level = stack[height, 1]
            first = stack[height, 2]
            last = stack[height, 3]
            ints = grown(ints, leaves + 1)
            floats = grown(floats, leaves + 1)
            named[:] = -1
            if given_up < 0 and pieces >= max_pieces:
                given_up = leaf.BY_BUDGET
            if given_up < 0 and stop[0] != 0:
                given_up = leaf.BY_STOP
            if given_up >= 0:
                worst[leaf.LOWER] = -math.inf
                worst[leaf.UPPER] = math.inf
                write(ints, floats, leaves, segment, k, level, SUSPECT, given_up, -1, -1, worst)
                leaves += 1
                continue
            pieces += 1
            h = 0.5 ** (level + 1)
            live = grown(live, 2 * last - first)
            way = grown(way, 2 * last - first)
            _need(chain, links, pairs, live, first, last, e)
            centre(chain, path, segment, (2 * k + 1) * h, h, e)
            top = swept_spheres(
                chain, links, obstacles, path, pairs, clearance, e, body, live, way, first, last
            )
            status = FREE
            if top > last:
                status = UNDECIDED
                deep = level >= DEEPEST_LEVEL
                _need(chain, links, pairs, live, last, top, e)
                fit(chain, e, builder)
                wide = hopeless(chain, links, path, pairs, e, body, live, last, top, tolerance)
                if deep or not wide:
                    build(chain, e, builder)
                    top = moving_spheres(
                        chain,
                        links,
                        obstacles,
                        path,
                        pairs,
                        clearance,
                        e,
                        body,
                        live,
                        way,
                        last,
                        top,
                    )
                    status, top = _try_pairs(
                        chain,
                        links,
                        obstacles,
                        path,
                        pairs,
                        tolerance,
                        clearance,
                        e,
                        body,
                        live,
                        way,
                        last,
                        top,
                        deep,
                        work,
                        known,
                        worst,
                        named,
                    )
            if status == UNDECIDED:
                _push(stack, height, 2 * k + 1, level + 1, last, top)
                _push(stack, height + 1, 2 * k, level + 1, last, top)
                height += 2
                continue
            reason = leaf.BY_TOLERANCE
            if status == SUSPECT and not (
                worst[leaf.UPPER] <= (clearance + body[named[0], SLACK]) * UP + tolerance
            ):
                reason = leaf.BY_DEPTH
            write(
                ints,
                floats,
                leaves,
                segment,
                k,
                level,
                status,
                reason,
                named[0],
                named[1],
                worst,
            )
            if status == SUSPECT and named[0] >= 0:
                ints[leaves, leaf.WITNESS] = _witness(worst[leaf.DEPTH], body[named[0], LINEAR])
            leaves += 1
    return ints[:leaves], floats[:leaves], pieces
