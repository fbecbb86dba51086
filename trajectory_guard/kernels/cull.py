"""
Close the pairs that a body's bounding sphere already keeps apart (trusted).

Two inequalities, both against the obstacle's oriented box: the sphere at the piece's centre swept
by the largest displacement, and the sphere along the control points of its centre.
"""

import math

from trajectory_guard.kernels.enclosure import displacement, fit_error
from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.margin import chain_margin, sphere_margin, UP
from trajectory_guard.kernels.separation import box_distance
from trajectory_guard.kernels.solids import BALL, CENTRE, CORE, FAR, NODE

# Columns of what a piece knows about a body [m]: displacement from the centre pose, the same
# without the chord's cap, error of the centre pose, tracking inflation, place of the sphere's
# centre (3), least distance of that place to a box, error of the motion, radius of the control
# points of the centre.
SWEEP, LINEAR, FUZZ, SLACK, PLACE, NEAREST, ERROR, RADIUS = 0, 1, 2, 3, 4, 7, 8, 9
BODY_COLUMNS = 10
UNKNOWN = -1.0

# An enclosure wider than the gap and this part of the body is not worth building.
WORTH = 0.05


@kernel
def farthest(x, y, z, px, py, pz, points, node, count):
    """Bound the distance of a link point's control points from a fixed point."""
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
        if not square <= worst:
            worst = square
            if worst != worst:
                return math.inf
    return math.sqrt(worst) * UP


@kernel
def _copy(live, way, source, target):
    """Copy an open pair and its direction."""
    live[target, 0] = live[source, 0]
    live[target, 1] = live[source, 1]
    for k in range(3):
        way[target, k] = way[source, k]


@kernel
def _taken(links, b, obstacles, o, clearance, body, reach):
    """Return what a sphere's distance to a box must exceed, without the motion itself [m]."""
    return (
        links.size[b, CORE]
        + links.size[b, BALL]
        + obstacles.size[o, BALL]
        + body[b, SLACK]
        + clearance
        + sphere_margin(reach, obstacles.size[o, FAR])
    )


@kernel
def _stand(chain, links, path, b, e, body):
    """Fill the columns of a body that the centre pose gives."""
    node = links.ranges[b, NODE]
    sweep, linear, fuzz, slack = displacement(chain, path, b, node, e)
    body[b, SWEEP] = sweep
    body[b, LINEAR] = linear
    body[b, FUZZ] = fuzz
    body[b, SLACK] = slack
    for r in range(3):
        body[b, PLACE + r] = (
            e.pose[node, 0, 4 * r] * links.place[b, CENTRE]
            + e.pose[node, 0, 4 * r + 1] * links.place[b, CENTRE + 1]
            + e.pose[node, 0, 4 * r + 2] * links.place[b, CENTRE + 2]
            + e.pose[node, 0, 4 * r + 3]
        )
    body[b, NEAREST] = math.inf
    body[b, ERROR] = UNKNOWN
    body[b, RADIUS] = UNKNOWN


@kernel
def swept_spheres(
    chain, links, obstacles, path, pairs, clearance, e, body, live, way, first, last
):
    """
    Copy the pairs that the swept sphere does not close behind ``last``; return the new end.

    :param pairs: (P, 2) int64: body and obstacle of every pair.
    :param body: (B, 10) out, for bodies with an open pair.
    :param live: (N, 2) int64 open pairs, rows ``first:last``; way (N, 3) their directions.
    """
    for i in range(first, last):
        body[pairs[live[i, 0], 0], SWEEP] = UNKNOWN
    top = last
    for i in range(first, last):
        b = pairs[live[i, 0], 0]
        o = pairs[live[i, 0], 1]
        if body[b, SWEEP] == UNKNOWN:
            _stand(chain, links, path, b, e, body)
        distance = box_distance(
            body[b, PLACE], body[b, PLACE + 1], body[b, PLACE + 2], obstacles, o
        )
        taken = _taken(links, b, obstacles, o, clearance, body, path.reach[b])
        if distance > (taken + body[b, SWEEP] + body[b, FUZZ]) * UP:
            continue
        body[b, NEAREST] = min(body[b, NEAREST], distance - obstacles.size[o, BALL])
        _copy(live, way, i, top)
        top += 1
    return top


@kernel
def hopeless(chain, links, path, pairs, e, body, live, first, last, tolerance):
    """
    Say whether some open pair cannot be closed because the enclosure is wider than the gap.

    :param body: column ERROR is filled for the bodies with an open pair.
    """
    found = False
    for i in range(first, last):
        b = pairs[live[i, 0], 0]
        if body[b, ERROR] == UNKNOWN:
            body[b, ERROR] = fit_error(chain, path, b, links.ranges[b, NODE], e)
            worth = body[b, NEAREST] + WORTH * (links.size[b, CORE] + links.size[b, BALL])
            if body[b, SWEEP] > tolerance and not body[b, ERROR] <= worth:
                found = True
    return found


@kernel
def moving_spheres(
    chain, links, obstacles, path, pairs, clearance, e, body, live, way, first, last
):
    """
    Drop the pairs that the sphere along the motion closes; return the new end.

    The control points of the sphere's centre lie within RADIUS of its place at the piece's centre,
    so the centre does during the whole piece, up to the error of the motion.
    """
    top = first
    for i in range(first, last):
        b = pairs[live[i, 0], 0]
        o = pairs[live[i, 0], 1]
        node = links.ranges[b, NODE]
        if body[b, RADIUS] == UNKNOWN:
            body[b, RADIUS] = math.inf
            if e.sound[node]:
                body[b, RADIUS] = farthest(
                    links.place[b, CENTRE],
                    links.place[b, CENTRE + 1],
                    links.place[b, CENTRE + 2],
                    body[b, PLACE],
                    body[b, PLACE + 1],
                    body[b, PLACE + 2],
                    e.points,
                    node,
                    e.number[node],
                )
        taken = (
            _taken(links, b, obstacles, o, clearance, body, path.reach[b])
            + body[b, RADIUS]
            + body[b, ERROR]
            + chain_margin(float(chain.depth[node]), e.kappa[node], path.reach[b])
        )
        distance = box_distance(
            body[b, PLACE], body[b, PLACE + 1], body[b, PLACE + 2], obstacles, o
        )
        if distance > taken * UP:
            continue
        _copy(live, way, i, top)
        top += 1
    return top
