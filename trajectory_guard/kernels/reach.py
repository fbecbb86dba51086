r"""
Lever arms: how far a joint's error can move a body (trusted).

If joint j is off by an angle eps, a point at distance r from its axis is off by the chord
2 r sin(eps/2) <= min(eps, 2) r.  Changing one joint after the other, from the root outward, gives

    |x(theta + eps) - x(theta)| <= sum_j min(|eps_j|, 2) rho_j(x),

where rho_j(x) bounds the distance of x to the axis of joint j over *all* configurations of the
joints beyond j (for a prismatic joint the factor is |eps_j| and rho_j = 1).  The distance to the
axis is at most the part of the next joint's origin perpendicular to the axis plus the lengths of
all later offsets and slides plus |x|.
"""

import math

from trajectory_guard.kernels.chain import PRISMATIC
from trajectory_guard.kernels.jit import entry
from trajectory_guard.kernels.margin import UP


@entry
def lever_arms(chain, node, extent, perpendicular, offsets, travel, rho, reach):
    """
    Write the lever arm of every joint on every body, and every body's reach.

    :param chain: the :class:`~trajectory_guard.kernels.chain.Chain`.
    :param node: (B,) int64 node of the body, -1 when it is fixed to the root.
    :param extent: (B,) largest distance of the body from its node's origin [m].
    :param perpendicular: (B,) largest distance of the body from its node's axis [m].
    :param offsets: (B,) sum of the lengths of all joint origins down to the body [m].
    :param travel: (n,) bound on |q| of a prismatic joint over the path and its tolerance [m].
    :param rho: (B, n) out, zero where the joint is not above the body [m, or 1 for a slide].
    :param reach: (B,) out: bound on every length that enters the body's position [m].
    """
    for b in range(len(node)):
        for j in range(len(chain.parent)):
            rho[b, j] = 0.0
        j = node[b]
        # `far`: bound on the distance of the body's points to the origin of the node below j,
        # `axis`: the same to the axis of j.
        far = extent[b]
        axis = perpendicular[b]
        while j >= 0:
            if chain.kind[j] == PRISMATIC:
                rho[b, j] = 1.0
                far += travel[j]
            else:
                rho[b, j] = axis * UP
            x = chain.transform[j, 3]
            y = chain.transform[j, 7]
            z = chain.transform[j, 11]
            axis = far + math.sqrt(x * x + y * y)
            far += math.sqrt(x * x + y * y + z * z)
            j = chain.parent[j]
        reach[b] = (far + offsets[b]) * UP
