"""Pairs that no joint of a request moves: which touch where they stand (for a warning)."""

import numpy as np

from trajectory_guard.kernels.enclosure import centre, enclosure, RATIONAL
from trajectory_guard.kernels.gjk import gjk, OVERLAP, ROUNDS
from trajectory_guard.kernels.jit import entry
from trajectory_guard.kernels.solids import BALL, NODE


@entry
def overlaps(chain, links, obstacles, path, pairs):
    """
    Say which pairs touch at the path's first instant.

    :param chain: :class:`~trajectory_guard.kernels.chain.Chain`.
    :param links: :class:`~trajectory_guard.kernels.solids.Solids` in node frames.
    :param obstacles: the same in the root frame.
    :param path: :class:`~trajectory_guard.kernels.enclosure.Path`.
    :param pairs: (Q, 2) int64: body and obstacle.
    :returns: (Q,) bool.
    """
    nodes = len(chain.parent)
    e = enclosure(nodes + 1, 0, RATIONAL)
    for j in range(nodes):
        e.needed[j] = True
    centre(chain, path, 0, 0.0, 1.0, e)
    root = nodes  # a node of its own for what is fixed to the root
    for i in range(12):
        e.pose[root, 0, i] = 1.0 if i % 5 == 0 else 0.0
    touching = np.zeros(len(pairs), np.bool_)
    s = np.empty((4, 6))
    w = np.empty(4)
    out = np.empty(8)
    for i in range(len(pairs)):
        b = pairs[i, 0]
        o = pairs[i, 1]
        node = links.ranges[b, NODE] if links.ranges[b, NODE] >= 0 else root
        balls = links.size[b, BALL] + obstacles.size[o, BALL]
        state = gjk(
            0.0,
            0.0,
            1.0,
            e.pose,
            node,
            1,
            links,
            b,
            obstacles,
            o,
            balls,
            False,
            1e-9,
            ROUNDS,
            s,
            w,
            out,
        )
        touching[i] = state == OVERLAP or out[4] <= balls
    return touching
