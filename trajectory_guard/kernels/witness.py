r"""
Proofs of overlap (trusted for G3): a common point, at one instant or during a whole piece.

**Standing.**  A point y of the link at the centre lies inside the link by m and its place p inside
the obstacle by t.  The balls of these radii overlap as long as the link's point is nearer to p
than m + t.

**Moving.**  With points y0, y1 deep in both at the two *ends* of the piece, y(s) = (1 - s) y0 + s
y1 stays in the convex link, at least as deep as at the worse end.  Its image under the motion with
control points P_k and scaled weights W_k has the control points

    Q_k = (W_k P_k y0 + W_{k-1} P_{k-1} y1) / (W_k + W_{k-1}),        k = 0 ... n + 1.

The piece overlaps at every instant if all Q_k lie inside the obstacle by more than the error, or
if they stay nearer to the chord of the two places than the depths together.
"""

import math

from trajectory_guard.kernels.chain import POSE
from trajectory_guard.kernels.cull import farthest
from trajectory_guard.kernels.deepest import deepest, depth
from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.leaf import DEPTH, UPPER, X, Y, Z
from trajectory_guard.kernels.solids import BALL, FACE_FIRST, FACE_LAST, NODE

OPEN = 1
OVERLAPS = 2  # at every instant of the piece


@kernel
def _common(pose, node, links, b, obstacles, o, lp, found):
    """
    Look for a point inside both solids at one instant.

    :param pose: (., ., 12); the pose at ``[node, 0]``.
    :param found: (11,) out: point in the node frame, direction, place [m], depth in the link and
        in the obstacle.
    :returns: whether one was proposed.
    """
    if not deepest(pose, node, links, b, obstacles, o, *lp, found):
        return False
    for r in range(3):
        found[6 + r] = (
            pose[node, 0, 4 * r] * found[0]
            + pose[node, 0, 4 * r + 1] * found[1]
            + pose[node, 0, 4 * r + 2] * found[2]
            + pose[node, 0, 4 * r + 3]
        )
    found[9] = depth(
        links.faces,
        links.ranges[b, FACE_FIRST],
        links.ranges[b, FACE_LAST],
        found[0],
        found[1],
        found[2],
    )
    found[10] = _inside(obstacles, o, found[6], found[7], found[8])
    return True


@kernel
def _inside(obstacles, o, x, y, z):
    """Return how deep a place lies inside an obstacle, negative outside [m]."""
    return depth(
        obstacles.faces, obstacles.ranges[o, FACE_FIRST], obstacles.ranges[o, FACE_LAST], x, y, z
    )


@kernel
def _moving(links, b, obstacles, o, e, error, margin, lp, end, first, last):
    """
    Say whether a point that moves through the link proves the overlap of the whole piece.

    :param end: (1, 1, 12) scratch for the pose of an end.
    :param first: (11,) and last (11,) scratch for the points at both ends.
    """
    node = links.ranges[b, NODE]
    top = e.number[node] - 1
    for side in range(2):
        for k in range(POSE):
            end[0, 0, k] = e.points[node, top if side else 0, k]
        if not _common(end, 0, links, b, obstacles, o, lp, last if side else first):
            return False
    mine = min(first[9], last[9])
    theirs = min(first[10], last[10])
    if not (mine > 0.0 and theirs > 0.0):
        return False
    shallow = math.inf
    stray = 0.0
    for k in range(top + 2):
        # scaled weights: of W_k and W_{k-1}, one is missing at either end
        here = e.weights[node, k] if k <= top else 0.0
        before = e.weights[node, k - 1] if k > 0 else 0.0
        share = before / (here + before)
        square = 0.0
        for r in range(3):
            value = 0.0
            if k <= top:
                value += (1.0 - share) * (
                    e.points[node, k, 4 * r] * first[0]
                    + e.points[node, k, 4 * r + 1] * first[1]
                    + e.points[node, k, 4 * r + 2] * first[2]
                    + e.points[node, k, 4 * r + 3]
                )
            if k > 0:
                value += share * (
                    e.points[node, k - 1, 4 * r] * last[0]
                    + e.points[node, k - 1, 4 * r + 1] * last[1]
                    + e.points[node, k - 1, 4 * r + 2] * last[2]
                    + e.points[node, k - 1, 4 * r + 3]
                )
            end[0, 0, r] = value
            off = value - first[6 + r] - (last[6 + r] - first[6 + r]) * k / (top + 1.0)
            square += off * off
        shallow = min(shallow, _inside(obstacles, o, end[0, 0, 0], end[0, 0, 1], end[0, 0, 2]))
        stray = max(stray, square)
        if not square < math.inf:
            return False
    return (
        shallow > error + 2.0 * margin or math.sqrt(stray) + error + 2.0 * margin < mine + theirs
    )


@kernel
def common_point(links, b, obstacles, o, e, error, fuzz, margin, scratch, known):
    """
    Look for a common point at the centre and prove an overlap of the whole piece.

    :param error: bound on the distance of the true motion to the built one [m].
    :param fuzz: bound on the error of the centre pose; margin: on rounding [m].
    :param scratch: of ``deepest`` (a tuple), (1, 1, 12), (11,), (11,), (11,).
    :param known: UPPER, X, Y, Z and DEPTH are written when the point is proved.
    :returns: OVERLAPS or OPEN; ``scratch[2][3:6]`` then holds a direction or zeros.
    """
    lp, end, found, first, last = scratch
    node = links.ranges[b, NODE]
    if not _common(e.pose, node, links, b, obstacles, o, lp, found):
        return OPEN
    mine = found[9]
    theirs = found[10]
    if not (mine > fuzz + margin and theirs > margin):
        return OPEN
    known[X] = found[6]
    known[Y] = found[7]
    known[Z] = found[8]
    known[DEPTH] = mine + theirs - fuzz - 2.0 * margin
    known[UPPER] = -known[DEPTH]
    if not e.sound[node]:
        return OPEN
    # The point may lie off the core, within the ball: a linear part that is no rotation moves it.
    error += e.eps[node] * links.size[b, BALL]
    moved = farthest(
        found[0], found[1], found[2], found[6], found[7], found[8], e.points, node, e.number[node]
    )
    if moved + error + 2.0 * margin < mine + theirs:
        return OVERLAPS
    if _moving(links, b, obstacles, o, e, error, margin, lp, end, first, last):
        return OVERLAPS
    return OPEN
