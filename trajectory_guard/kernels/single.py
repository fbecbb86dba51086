"""One body on one piece, for those who want to look at a motion rather than certify it."""

import numpy as np

from trajectory_guard.kernels.chain import POSE
from trajectory_guard.kernels.enclosure import (
    build,
    centre,
    displacement,
    enclosure,
    fit,
    fit_error,
)
from trajectory_guard.kernels.jit import entry
from trajectory_guard.kernels.margin import chain_margin
from trajectory_guard.kernels.solids import NODE


@entry
def link_motion(chain, links, path, body, segment, m, h, builder):
    """
    Build the motion of one body on the piece s = m + h tau.

    :param chain: :class:`~trajectory_guard.kernels.chain.Chain`.
    :param links: :class:`~trajectory_guard.kernels.solids.Solids` in node frames.
    :param path: :class:`~trajectory_guard.kernels.enclosure.Path`.
    :param body: index of the body; it must hang on a node.
    :param segment: index of the segment.
    :param m: centre of the piece, h its half length, in [0, 1].
    :param builder: ``enclosure.RATIONAL`` or ``ECONOMISED``.
    :returns: control matrices (K, 12), scaled weights (K,), error of the motion without tracking,
        what tracking adds, largest displacement from the centre [m], and whether it is usable.
    """
    nodes = len(chain.parent)
    e = enclosure(nodes, nodes, builder)
    node = links.ranges[body, NODE]
    j = node
    while j >= 0:
        e.needed[j] = True
        j = chain.parent[j]
    centre(chain, path, segment, m, h, e)
    fit(chain, e, builder)
    build(chain, e, builder)
    sweep, _, _, slack = displacement(chain, path, body, node, e)
    error = fit_error(chain, path, body, node, e) + chain_margin(
        float(chain.depth[node]), e.kappa[node], path.reach[body]
    )
    count = e.number[node]
    matrices = np.empty((count, POSE))
    weights = np.empty(count)
    for i in range(count):
        weights[i] = e.weights[node, i]
        for k in range(POSE):
            matrices[i, k] = e.points[node, i, k]
    return matrices, weights, error, slack, sweep, e.sound[node]
