r"""
One joint on one piece of time: its polynomial and the half-angle fit (trusted).

On a piece [k, k+1] / 2^n of a segment, s = m + h tau with tau in [-1, 1]; m and h are dyadic and
exact. The joint moves as q = d_0 + phi(tau), phi = sum_{i>=1} d_i tau^i.

**Half-angle.**  With x = phi / 2 and X = sum_{i>=1} |d_i| / 2 < 1 the rational rotation with
u(tau) ~ tan(x) has the angle 2 atan(u), and because atan is 1-Lipschitz

    |2 atan u - phi| <= 2 |u - tan x| <= 2 (|u - x - x^3/3| + r),
    |r| <= (2/15) X^5 / (1 - 0.41 X^2).

The Taylor coefficients of tan beyond x^3/3 are positive and their ratios increase to 4/pi^2 <
0.41, which gives r.  The polynomial x + x^3/3 is economised to degree 3 from the top down:
tau^k is replaced by tau^k - 2^(1-k) T_k(tau), an error of at most 2^(1-k) times its coefficient.

**Rounding of the angle.**  The Taylor shift of a polynomial of degree 5 to m in [0, 1] is 15
multiply-adds and one scaling; relative to sum |c_k| all coefficients together err by less than
32 u.  Central angle, sine and cosine add 4 u, the fit 64 u X.
"""

import numpy as np

from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.margin import UNIT_ROUNDOFF, UP

TERMS = 6  # coefficients of a quintic
FIT = 3  # degree of u
LARGEST_HALF_ANGLE = 0.9  # beyond it the joint is frozen and its turn is counted as error
SHIFT = 32.0
POWERS = 3 * (TERMS - 1) + 1  # coefficients of x^3


def _economisers() -> np.ndarray:
    """Row k holds tau^k - 2^(1-k) T_k in powers of tau; exact in double for these degrees."""
    rows = np.zeros((POWERS, POWERS))
    for k in range(1, POWERS):
        rows[k, :k] = -np.polynomial.chebyshev.cheb2poly([0.0] * k + [1.0])[:k] * 2.0 ** (1 - k)
    return rows


ECONOMISERS = _economisers()


@kernel
def restrict(coefficients, segment, joint, m, h, d):
    """
    Write the polynomial of a joint on the piece s = m + h tau.

    :param coefficients: (S, n, 6) power basis in s [rad or m].
    :param segment: index of the segment.
    :param joint: index of the joint.
    :param m: centre of the piece in [0, 1], dyadic.
    :param h: half length of the piece, a power of two.
    :param d: (n, 6) out: power basis in tau; row ``joint`` is written.
    :returns: bound on |q - d_0| over the piece, and bound on the rounding of q [rad or m].
    """
    size = 0.0
    for k in range(TERMS):
        d[joint, k] = coefficients[segment, joint, k]
        size += abs(d[joint, k])
    for i in range(TERMS - 1):
        for k in range(TERMS - 2, i - 1, -1):
            d[joint, k] += m * d[joint, k + 1]
    scale = 1.0
    span = 0.0
    for k in range(1, TERMS):
        scale *= h
        d[joint, k] *= scale
        span += abs(d[joint, k])
    return span * UP, SHIFT * UNIT_ROUNDOFF * size + 4.0 * UNIT_ROUNDOFF


@kernel
def economise(p, top):
    """
    Reduce a polynomial on [-1, 1] to degree 3 in place.

    :param p: power coefficients; those above 3 are folded into the lower ones and dropped.
    :param top: degree of p.
    :returns: bound on the change over [-1, 1].
    """
    dropped = 0.0
    for k in range(top, FIT, -1):
        c = p[k]
        if c != 0.0:
            for i in range(k - 2, -1, -2):
                p[i] += c * ECONOMISERS[k, i]
            dropped += abs(c) * 2.0 ** (1 - k)
    return dropped * UP


@kernel
def bernstein(p, joint, controls):
    """
    Write the scaled Bernstein coefficients of a cubic on [-1, 1].

    With r = s, v = 1 - s the basis tau^k 1^(3-k) = (r - v)^k (r + v)^(3-k) expands with small
    integers.

    :param p: power coefficients in tau, degree 3.
    :param joint: row to write.
    :param controls: (n, 4) out: coefficients b_i C(3, i).
    """
    controls[joint, 0] = p[0] - p[1] + p[2] - p[3]
    controls[joint, 1] = 3.0 * p[0] - p[1] - p[2] + 3.0 * p[3]
    controls[joint, 2] = 3.0 * p[0] + p[1] - p[2] - 3.0 * p[3]
    controls[joint, 3] = p[0] + p[1] + p[2] + p[3]


@kernel
def fit_half_angle(d, joint, span, p, controls):
    """
    Fit u ~ tan(phi / 2) by a cubic.

    :param d: (n, 6) polynomial of the joint on the piece.
    :param joint: row.
    :param span: bound on |phi| over the piece [rad].
    :param p: (16,) scratch.
    :param controls: (n, 4) out: scaled Bernstein coefficients of u, zero if the joint is frozen.
    :returns: bound on |2 atan(u) - phi| (frozen: on |phi|) over the piece [rad].
    """
    x_max = 0.5 * span
    if not x_max < LARGEST_HALF_ANGLE:
        for i in range(FIT + 1):
            controls[joint, i] = 0.0
        return span
    for i in range(POWERS):
        p[i] = 0.0
    top = TERMS - 1
    while top > 1 and d[joint, top] == 0.0:
        top -= 1
    for a in range(1, top + 1):
        xa = 0.5 * d[joint, a]
        p[a] += xa
        for b in range(1, top + 1):
            xab = xa * 0.5 * d[joint, b] / 3.0
            for c in range(1, top + 1):
                p[a + b + c] += xab * 0.5 * d[joint, c]
    dropped = economise(p, 3 * top)
    bernstein(p, joint, controls)
    square = x_max * x_max
    rest = (2.0 / 15.0) * square * square * x_max / (1.0 - 0.41 * square)
    return (2.0 * (dropped + rest) + 64.0 * UNIT_ROUNDOFF * x_max) * UP


@kernel
def fit_slide(d, joint, p, controls):
    """
    Reduce the polynomial of a prismatic joint to a cubic about its centre.

    :param d: (n, 6) polynomial of the joint on the piece [m].
    :param joint: row.
    :param p: (16,) scratch.
    :param controls: (n, 4) out: scaled Bernstein coefficients of q - d_0 [m].
    :returns: bound on the change over the piece [m].
    """
    p[0] = 0.0
    size = 0.0
    for i in range(1, TERMS):
        p[i] = d[joint, i]
        size += abs(p[i])
    dropped = economise(p, TERMS - 1)
    bernstein(p, joint, controls)
    return (dropped + 64.0 * UNIT_ROUNDOFF * size) * UP
