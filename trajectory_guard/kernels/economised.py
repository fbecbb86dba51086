r"""
Polynomial motion of every link of a chain, economised after every joint (trusted).

The space of affine displacements is linear, so weights may be 1: keep the pose of a node as a
polynomial of degree 5 in tau on [-1, 1] and push what is above degree 5 down after every product.
Building the rational curve costs degree 6 per joint; this costs the same for every joint.

**Economising** replaces c tau^k by c (tau^k - 2^(1-k) T_k), from the top down, an error of at most
|c| 2^(1-k).

**Angle.**  phi = sum_{i>=1} d_i tau^i, |phi| <= Phi < 1.5.  With y = phi^2 economised (error e_y),
cosine and sine are their Taylor sums to phi^8 and phi^9 by Horner's rule in y; a product of a
factor H with error e_H and y has the error |H| e_y + |y| e_H plus what is dropped, and the series
end with at most Phi^10 / 10! and Phi^11 / 11!.  So the joint's matrix differs from a rotation by
at most delta = sqrt(e_cos^2 + e_sin^2) in the plane across its axis.

**Chain.**  Let G_j be the polynomial pose of node j as stored, rounding included, and q_j the
point in node j's frame at the true positions of all joints beyond j.  Comparing consecutive nodes
*on the same true point* telescopes the error of the whole chain into

    sum_j | G_j(q_j) - G_{j-1}(M_j R_j q_j) |
      <= sum_j rho_j (delta_j (1 + eps_{j-1}) + trunc_j) + rounding_j,

where rho_j bounds the distance of q_j to the axis (the error of the rotation and the dropped
matrices, which have only the columns x and y, act on that distance), trunc_j = sum_k ||c_k||_F
2^(1-k) over the dropped coefficient matrices, and eps_j = eps_{j-1} + delta_j (1 + eps_{j-1}) +
trunc_j bounds the deviation of the linear part from a rotation.  Nothing is transported, because
each difference is taken with the true remainder of the chain.  A slide adds the z column times its
polynomial: only trunc_j, with the norm of the dropped translations and rho_j = 1.

**Rounding** of a node is local for the same reason.  A new column is two products of degree-5
polynomials (11 terms at most, each rounded twice) and five economising steps, whose coefficients
sum to less than 7 in absolute value; relative to

    kappa_j = 8 (|cos|_1 + |sin|_1) S_{j-1},      S = sum_k ||linear part of coefficient k||_F,

that is less than (16 + 4 + 22 + 10) u per entry and less than 128 u per point, to which the
constant transform's 20 u and the six-term Bernstein sums belong too; ``margin.CHAIN`` = 256 covers
them with kappa the largest along the chain, once per joint.
"""

import math

import numpy as np

from trajectory_guard.kernels.chain import POSE, REVOLUTE
from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.margin import UNIT_ROUNDOFF, UP
from trajectory_guard.kernels.piece import TERMS

LARGEST_ANGLE = 1.5
CONTROLS = 13  # control points: degree 5 raised to 12, which draws the hull tight
MAJORANT = 8.0
FACTORIAL_10 = 3628800.0
FACTORIAL_11 = 39916800.0


def _bernstein() -> np.ndarray:
    """Return (13, 6): the Bernstein coefficients of tau^k, tau = 2 s - 1, at degree 12."""
    n = CONTROLS - 1
    rows = np.zeros((CONTROLS, TERMS))
    for k in range(TERMS):
        # tau^k 1^(n-k) = (s - v)^k (s + v)^(n-k) with v = 1 - s, exact in integers
        coefficients = [1]
        for step in range(n):
            sign = -1 if step < k else 1
            longer = [0] * (len(coefficients) + 1)
            for i, c in enumerate(coefficients):
                longer[i] += sign * c
                longer[i + 1] += c
            coefficients = longer
        rows[:, k] = [c / math.comb(n, i) for i, c in enumerate(coefficients)]
    return rows


BERNSTEIN = _bernstein()
BINOMIALS = np.array([float(math.comb(CONTROLS - 1, i)) for i in range(CONTROLS)])


@kernel
def product(a, b):
    """Return the 11 coefficients of the product of two polynomials of degree 5."""
    a0, a1, a2, a3, a4, a5 = a
    b0, b1, b2, b3, b4, b5 = b
    return (
        a0 * b0,
        a0 * b1 + a1 * b0,
        a0 * b2 + a1 * b1 + a2 * b0,
        a0 * b3 + a1 * b2 + a2 * b1 + a3 * b0,
        a0 * b4 + a1 * b3 + a2 * b2 + a3 * b1 + a4 * b0,
        a0 * b5 + a1 * b4 + a2 * b3 + a3 * b2 + a4 * b1 + a5 * b0,
        a1 * b5 + a2 * b4 + a3 * b3 + a4 * b2 + a5 * b1,
        a2 * b5 + a3 * b4 + a4 * b3 + a5 * b2,
        a3 * b5 + a4 * b4 + a5 * b3,
        a4 * b5 + a5 * b4,
        a5 * b5,
    )


@kernel
def economised(p):
    """
    Fold a polynomial of degree 10 into degree 5.

    The constants are those of tau^k - 2^(1-k) T_k, exact in binary.

    :param p: 11 coefficients.
    :returns: 6 coefficients, and the 5 dropped ones of tau^6 ... tau^10; the error is at most
        sum |dropped_k| 2^(1-k).
    """
    p0, p1, p2, p3, p4, p5, p6, p7, p8, p9, p10 = p
    p8 += 2.5 * p10
    p6 -= 2.1875 * p10
    p4 += 0.78125 * p10
    p2 -= 0.09765625 * p10
    p0 += 0.001953125 * p10
    p7 += 2.25 * p9
    p5 -= 1.6875 * p9
    p3 += 0.46875 * p9
    p1 -= 0.03515625 * p9
    p6 += 2.0 * p8
    p4 -= 1.25 * p8
    p2 += 0.25 * p8
    p0 -= 0.0078125 * p8
    p5 += 1.75 * p7
    p3 -= 0.875 * p7
    p1 += 0.109375 * p7
    p4 += 1.5 * p6
    p2 -= 0.5625 * p6
    p0 += 0.03125 * p6
    return (p0, p1, p2, p3, p4, p5), (p6, p7, p8, p9, p10)


@kernel
def multiplied(a, b):
    """Return the economised product of two polynomials of degree 5, and a bound on its error."""
    kept, gone = economised(product(a, b))
    dropped = (
        abs(gone[0]) / 32.0
        + abs(gone[1]) / 64.0
        + abs(gone[2]) / 128.0
        + abs(gone[3]) / 256.0
        + abs(gone[4]) / 512.0
    )
    return kept, dropped


@kernel
def _series(y, a0, a1, a2, a3, a4, y_max, y_error):
    """
    Return a0 + y (a1 + y (a2 + y (a3 + y a4))) by Horner's rule, and a bound on its error.

    :param y: the economised polynomial; y_max bounds the exact one, y_error what economising it
        cost.
    """
    h = (a4 * y[0] + a3, a4 * y[1], a4 * y[2], a4 * y[3], a4 * y[4], a4 * y[5])
    # `size` bounds the exact factor, `error` its distance to the stored one.
    error = abs(a4) * y_error
    size = abs(a4) * y_max + abs(a3)
    for a in (a2, a1, a0):
        (h0, h1, h2, h3, h4, h5), dropped = multiplied(h, y)
        h = (h0 + a, h1, h2, h3, h4, h5)
        error = size * y_error + (y_max + y_error) * error + dropped
        size = size * y_max + abs(a)
    return h, error


@kernel
def fit_rotation(phi, span):
    """
    Return cosine and sine of a joint's turn about the piece's centre as polynomials of degree 5.

    :param phi: 6 coefficients of the turn in tau, the first zero [rad].
    :param span: bound on |phi|, below 1.5 [rad].
    :returns: cosine, sine, and delta, the bound on the distance to the rotation.
    """
    y, y_error = multiplied(phi, phi)
    y_max = span * span
    cosine, cosine_error = _series(
        y, 1.0, -0.5, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0, y_max, y_error
    )
    h, h_error = _series(
        y, 1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362880.0, y_max, y_error
    )
    sine, dropped = multiplied(h, phi)
    fifth = y_max * y_max * y_max * y_max * y_max
    cosine_error += fifth / FACTORIAL_10
    sine_error = span * h_error + dropped + fifth * span / FACTORIAL_11
    delta = math.sqrt(cosine_error * cosine_error + sine_error * sine_error)
    return cosine, sine, (delta + 256.0 * UNIT_ROUNDOFF) * UP


@kernel
def _row(q, e):
    """Return a row of coefficients as a tuple."""
    return q[e, 0], q[e, 1], q[e, 2], q[e, 3], q[e, 4], q[e, 5]


@kernel
def _combined(x, c, y, s, sign):
    """Return x c + sign y s, degree 10."""
    a = product(x, c)
    b = product(y, s)
    return (
        a[0] + sign * b[0],
        a[1] + sign * b[1],
        a[2] + sign * b[2],
        a[3] + sign * b[3],
        a[4] + sign * b[4],
        a[5] + sign * b[5],
        a[6] + sign * b[6],
        a[7] + sign * b[7],
        a[8] + sign * b[8],
        a[9] + sign * b[9],
        a[10] + sign * b[10],
    )


@kernel
def _squares(total, gone):
    """Add the squares of dropped coefficients, power by power."""
    return (
        total[0] + gone[0] * gone[0],
        total[1] + gone[1] * gone[1],
        total[2] + gone[2] * gone[2],
        total[3] + gone[3] * gone[3],
        total[4] + gone[4] * gone[4],
    )


@kernel
def _loss(squares):
    """Return sum_k ||c_k||_F 2^(1-k) over the dropped powers 6 ... 10."""
    return (
        math.sqrt(squares[0]) / 32.0
        + math.sqrt(squares[1]) / 64.0
        + math.sqrt(squares[2]) / 128.0
        + math.sqrt(squares[3]) / 256.0
        + math.sqrt(squares[4]) / 512.0
    )


@kernel
def _store(q, e, kept):
    """Write a row of coefficients."""
    for k in range(TERMS):
        q[e, k] = kept[k]


@kernel
def _turn(q, cosine, sine):
    """Turn the x and y columns of a polynomial pose in place; return trunc."""
    squares = (0.0, 0.0, 0.0, 0.0, 0.0)
    for r in range(0, POSE, 4):
        x = _row(q, r)
        y = _row(q, r + 1)
        kept, gone = economised(_combined(x, cosine, y, sine, 1.0))
        _store(q, r, kept)
        squares = _squares(squares, gone)
        kept, gone = economised(_combined(y, cosine, x, sine, -1.0))
        _store(q, r + 1, kept)
        squares = _squares(squares, gone)
    return _loss(squares)


@kernel
def _slide(q, phi):
    """Add the z column times a polynomial to the translation in place; return trunc."""
    squares = (0.0, 0.0, 0.0, 0.0, 0.0)
    for r in range(0, POSE, 4):
        kept, gone = economised(product(_row(q, r + 2), phi))
        squares = _squares(squares, gone)
        for k in range(TERMS):
            q[r + 3, k] += kept[k]
    return _loss(squares)


@kernel
def extend_economised(chain, j, span, d, local, powers, fit, eps, size, kappa, q):
    """
    Write the polynomial pose of a node on a piece from its parent's.

    :param chain: the :class:`~trajectory_guard.kernels.chain.Chain`.
    :param j: node; its parent must be done.
    :param span: (n,) bound on the joint's motion about the centre; zero: it stands.
    :param d: (n, 6) polynomial of the joint.
    :param local: (n, 1, 12) pose in the parent's frame at the centre.
    :param powers: (n, 12, 6) in/out: power coefficients of the node's pose.
    :param fit: (n,) out: what the joint adds per lever arm, see the module.
    :param eps: (n,) out: deviation of the linear part from a rotation.
    :param size: (n,) out: S, and kappa (n,) out: the largest majorant along the chain.
    :param q: (12, 6) scratch.
    """
    up = chain.parent[j]
    if up < 0:
        for e in range(POSE):
            q[e, 0] = local[j, 0, e]
            for k in range(1, TERMS):
                q[e, k] = 0.0
        eps[j] = 0.0
        kappa[j] = MAJORANT
        above = 2.0
    else:
        for r in range(0, POSE, 4):
            for c in range(4):
                for k in range(TERMS):
                    q[r + c, k] = (
                        powers[up, r, k] * local[j, 0, c]
                        + powers[up, r + 1, k] * local[j, 0, 4 + c]
                        + powers[up, r + 2, k] * local[j, 0, 8 + c]
                    )
            for k in range(TERMS):
                q[r + 3, k] += powers[up, r + 3, k]
        eps[j] = eps[up]
        kappa[j] = kappa[up]
        above = size[up]
    fit[j] = 0.0
    if span[j] != 0.0:
        phi = (0.0, d[j, 1], d[j, 2], d[j, 3], d[j, 4], d[j, 5])
        if chain.kind[j] != REVOLUTE:
            kappa[j] = max(kappa[j], MAJORANT * above)
            fit[j] = _slide(q, phi) * UP
        elif span[j] < LARGEST_ANGLE:
            cosine, sine, delta = fit_rotation(phi, span[j])
            length = 0.0
            for k in range(TERMS):
                length += abs(cosine[k]) + abs(sine[k])
            kappa[j] = max(kappa[j], MAJORANT * length * above)
            fit[j] = (delta * (1.0 + eps[j]) + _turn(q, cosine, sine)) * UP
            eps[j] = (eps[j] + fit[j]) * UP
        else:
            # Too far for the series: the joint stands, and its turn is all error.
            fit[j] = min(span[j], 2.0) * (1.0 + eps[j]) * UP
            if not fit[j] >= 0.0:
                fit[j] = math.inf
            eps[j] = (eps[j] + fit[j]) * UP
    total = 0.0
    for k in range(TERMS):
        square = 0.0
        for r in range(0, POSE, 4):
            for c in range(3):
                square += q[r + c, k] * q[r + c, k]
        total += math.sqrt(square)
    size[j] = total
    kappa[j] = max(kappa[j], total)
    for e in range(POSE):
        for k in range(TERMS):
            powers[j, e, k] = q[e, k]


@kernel
def control_points(j, powers, points, weights):
    """
    Write the control points of a node's polynomial pose.

    :param powers: (n, 12, 6) power coefficients.
    :param points: (n, 13, 12) out: Bernstein coefficients of degree 12.
    :param weights: (n, 13) out: the binomials, scaled weights of a polynomial.
    :returns: True if every entry is finite.
    """
    total = 0.0
    for i in range(CONTROLS):
        weights[j, i] = BINOMIALS[i]
        for e in range(POSE):
            value = powers[j, e, 0]
            for k in range(1, TERMS):
                value += BERNSTEIN[i, k] * powers[j, e, k]
            points[j, i, e] = value
            total += abs(value)
    return total < math.inf
