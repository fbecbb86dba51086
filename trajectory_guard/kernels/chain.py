r"""
Rational motion of every link of a chain on one piece (trusted).

With u = tan(angle / 2) a rotation about z is (1 / (1 + u^2)) [[1-u^2, -2u], [2u, 1-u^2]]: a
rational curve.  A chain of such rotations, constant rigid transforms and polynomial slides is a
rational Bezier curve in the 12-dimensional space of affine displacements [Schroecker & Weber 2014,
sec. 6] of degree 6 per moving revolute joint and 3 per moving prismatic one.  All factors are kept
in the *scaled* Bernstein basis b_i C(n, i), in which a product is a plain convolution and the
binomials cancel in C_i / w_i.  If every weight is positive the link's point x lies, at every
instant of the piece, in the convex hull of the points C_i x / w_i.
"""

import math
from typing import NamedTuple

import numpy as np

from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.piece import FIT

REVOLUTE = 0
PRISMATIC = 1
POSE = 12
# A cubic's Bernstein coefficients exceed its largest value by less than this (25/16).
SLIDE_GROWTH = 2.0
# A weight much smaller than its columns would carry a relative error that no margin counts.
LARGEST_RATIO = 4.0


class Chain(NamedTuple):
    """
    The movable joints of a robot.

    parent (n,) int64: node above, -1 for the root; parents come before children.
    kind (n,) int64: REVOLUTE or PRISMATIC.
    transform (n, 12): constant pose of the node, before its own motion, in its parent node's
    frame.
    depth (n,) int64: number of nodes from the root down to this one.
    """

    parent: np.ndarray
    kind: np.ndarray
    transform: np.ndarray
    depth: np.ndarray


@kernel
def compose(a, i, ai, b, j, bj, out, k, ok):
    """
    Write the product of two poses.

    :param a: (., ., 12) poses; ``a[i, ai]`` is the left factor.
    :param b: (., ., 12) poses; ``b[j, bj]`` is the right factor.
    :param out: (., ., 12) receives the product at ``out[k, ok]``.
    """
    for r in range(0, POSE, 4):
        x = a[i, ai, r]
        y = a[i, ai, r + 1]
        z = a[i, ai, r + 2]
        for c in range(3):
            out[k, ok, r + c] = x * b[j, bj, c] + y * b[j, bj, 4 + c] + z * b[j, bj, 8 + c]
        out[k, ok, r + 3] = x * b[j, bj, 3] + y * b[j, bj, 7] + z * b[j, bj, 11] + a[i, ai, r + 3]


@kernel
def turn(chain, j, value, local):
    """
    Write the pose of a node in its parent's frame at one joint value.

    :param chain: the :class:`Chain`.
    :param j: node.
    :param value: joint position [rad or m].
    :param local: (n, 1, 12) out, row ``j``.
    """
    if chain.kind[j] == REVOLUTE:
        c = math.cos(value)
        s = math.sin(value)
        for r in range(0, POSE, 4):
            x = chain.transform[j, r]
            y = chain.transform[j, r + 1]
            local[j, 0, r] = c * x + s * y
            local[j, 0, r + 1] = c * y - s * x
            local[j, 0, r + 2] = chain.transform[j, r + 2]
            local[j, 0, r + 3] = chain.transform[j, r + 3]
    else:
        for r in range(0, POSE, 4):
            for c in range(3):
                local[j, 0, r + c] = chain.transform[j, r + c]
            local[j, 0, r + 3] = chain.transform[j, r + 3] + value * chain.transform[j, r + 2]


@kernel
def place(chain, j, local, pose):
    """
    Write the pose of a node in the root frame from its parent's.

    :param local: (n, 1, 12) from :func:`turn`.
    :param pose: (n, 1, 12) in/out.
    """
    p = chain.parent[j]
    if p < 0:
        for i in range(POSE):
            pose[j, 0, i] = local[j, 0, i]
    else:
        compose(pose, p, 0, local, j, 0, pose, j, 0)


@kernel
def factors(kind, u, j, cosine, sine, weight):
    """
    Write the scaled Bernstein coefficients of a joint's rational motion.

    :param kind: REVOLUTE or PRISMATIC.
    :param u: (n, 4) scaled coefficients of u, or of the slide [m].
    :param j: node.
    :param cosine: (7,) out: 1 - u^2.
    :param sine: (7,) out: 2 u.
    :param weight: (7,) out: 1 + u^2 (prismatic: the constant 1).
    :returns: degree, and ``max_i (|cosine_i| + |sine_i|) / weight_i`` (NaN or infinite if a weight
        is not positive).
    """
    if kind != REVOLUTE:
        weight[0] = 1.0
        weight[1] = 3.0
        weight[2] = 3.0
        weight[3] = 1.0
        return FIT, SLIDE_GROWTH
    ones = (1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0)
    for i in range(7):
        weight[i] = 0.0
        sine[i] = 0.0
    for i in range(4):
        for k in range(4):
            weight[i + k] += u[j, i] * u[j, k]
        sine[i] += 2.0 * u[j, i]
        sine[i + 1] += 6.0 * u[j, i]
        sine[i + 2] += 6.0 * u[j, i]
        sine[i + 3] += 2.0 * u[j, i]
    kappa = 1.0
    for i in range(7):
        square = weight[i]
        cosine[i] = ones[i] - square
        weight[i] = ones[i] + square
        ratio = (abs(cosine[i]) + abs(sine[i])) / weight[i]
        if not (weight[i] > 0.0 and ratio < LARGEST_RATIO):
            return 6, math.inf
        kappa = max(kappa, ratio)
    return 6, kappa


@kernel
def convolve(source, n, kind, u, j, cosine, sine, weight, degree, out):
    """
    Multiply a link's control matrices by a joint's motion.

    :param source: (K, 13) control matrices and weights after the constant transform.
    :param n: how many.
    :param out: (n, K, 13) receives ``n + degree`` matrices at row ``j``.
    """
    if kind != REVOLUTE:
        for i in range(n + degree):
            for e in range(POSE + 1):
                out[j, i, e] = 0.0
        for k in range(degree + 1):
            w = weight[k]
            for i in range(n):
                for r in range(0, POSE, 4):
                    for e in range(3):
                        out[j, i + k, r + e] += w * source[i, r + e]
                    out[j, i + k, r + 3] += w * source[i, r + 3] + u[j, k] * source[i, r + 2]
                out[j, i + k, POSE] += w * source[i, POSE]
        return
    for i in range(n + degree):
        x0 = x1 = x2 = y0 = y1 = y2 = z0 = z1 = z2 = t0 = t1 = t2 = total = 0.0
        for k in range(max(0, i - n + 1), min(degree, i) + 1):
            c = cosine[k]
            s = sine[k]
            w = weight[k]
            m = i - k
            x0 += c * source[m, 0] + s * source[m, 1]
            y0 += c * source[m, 1] - s * source[m, 0]
            z0 += w * source[m, 2]
            t0 += w * source[m, 3]
            x1 += c * source[m, 4] + s * source[m, 5]
            y1 += c * source[m, 5] - s * source[m, 4]
            z1 += w * source[m, 6]
            t1 += w * source[m, 7]
            x2 += c * source[m, 8] + s * source[m, 9]
            y2 += c * source[m, 9] - s * source[m, 8]
            z2 += w * source[m, 10]
            t2 += w * source[m, 11]
            total += w * source[m, POSE]
        out[j, i, 0] = x0
        out[j, i, 1] = y0
        out[j, i, 2] = z0
        out[j, i, 3] = t0
        out[j, i, 4] = x1
        out[j, i, 5] = y1
        out[j, i, 6] = z1
        out[j, i, 7] = t1
        out[j, i, 8] = x2
        out[j, i, 9] = y2
        out[j, i, 10] = z2
        out[j, i, 11] = t2
        out[j, i, POSE] = total


@kernel
def extend(chain, j, moving, u, local, controls, count, kappa, scratch, cosine, sine, weight):
    """
    Write the control matrices of a node on a piece from its parent's.

    :param chain: the :class:`Chain`.
    :param j: node; its parent must be done.
    :param moving: whether the joint moves on this piece.
    :param u: (n, 4) scaled coefficients of the joint's motion about the piece's centre.
    :param local: (n, 1, 12) pose in the parent's frame at the centre.
    :param controls: (n, K, 13) in/out: scaled control matrices and weights.
    :param count: (n,) int64 out: number of control matrices of the node.
    :param kappa: (n,) out: bound on their column norms over the weight, infinite when the
        enclosure is unusable.
    """
    p = chain.parent[j]
    if p < 0:
        n = 1
        for e in range(POSE):
            scratch[0, e] = local[j, 0, e]
        scratch[0, POSE] = 1.0
        kappa[j] = 1.0
    else:
        n = count[p]
        kappa[j] = kappa[p]
        for i in range(n):
            for r in range(0, POSE, 4):
                x = controls[p, i, r]
                y = controls[p, i, r + 1]
                z = controls[p, i, r + 2]
                for c in range(4):
                    scratch[i, r + c] = (
                        x * local[j, 0, c] + y * local[j, 0, 4 + c] + z * local[j, 0, 8 + c]
                    )
                scratch[i, r + 3] += controls[p, i, r + 3]
            scratch[i, POSE] = controls[p, i, POSE]
    if not moving:
        for i in range(n):
            for e in range(POSE + 1):
                controls[j, i, e] = scratch[i, e]
        count[j] = n
        return
    degree, growth = factors(chain.kind[j], u, j, cosine, sine, weight)
    kappa[j] *= growth
    convolve(scratch, n, chain.kind[j], u, j, cosine, sine, weight, degree, controls)
    count[j] = n + degree


@kernel
def divide(j, controls, count, points, weights):
    """
    Divide the control matrices of a node by their weights.

    :param points: (n, K, 12) out: C_i / w_i; weights (n, K) out: w_i, scaled.
    :returns: True if every weight is positive and every entry finite.
    """
    total = 0.0
    sound = True
    for i in range(count[j]):
        w = controls[j, i, POSE]
        if not (w > 0.0 and w < math.inf):
            sound = False
        weights[j, i] = w
        inverse = 1.0 / w
        for e in range(POSE):
            value = controls[j, i, e] * inverse
            points[j, i, e] = value
            total += abs(value)
    return sound and total < math.inf
