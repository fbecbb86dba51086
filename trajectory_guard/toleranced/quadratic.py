r"""
Whether |r(x)| > |h(x)| + thickness for affine maps r, h on a segment, a triangle or a square.

This one question is all the basic tests of [SW, sec. 4]. An orbit is a union of balls: p lies in
the orbit of X under B_R(g) iff |p - g(x)| <= R rho(x) for some x of X, that is iff
min over X of |p - g(x)|^2 - R^2 rho^2(x) <= 0. Both p - g(x) and the vector h(x) in R^4 of length
R rho(x) are affine, so the function is a quadratic q(x) = |r(x)|^2 - |h(x)|^2 in the parameters of
X (and of the fixed feature, where that has some). Its minimum over a convex polytope is

  - where q is convex, bounded from below by every tangent plane of q, hence by the least value of
    one tangent plane over the corners; at the minimiser the bound is attained (Kuhn, Tucker);
  - where q is concave in some direction, on the boundary: through every point goes a segment in
    that direction, and q is least at one of its ends. The sides are treated alike.

For a line q is convex iff R < nu (then its orbit is the hyperboloid (6)), for a plane iff
R < min(nu_1, nu_2) (then (8)): the second case is Remark 1 in all its parts.

**Thickness** d >= 0. (a + d)^2 <= (1 + k) a^2 + (1 + 1/k) d^2 for every k > 0, since
2 a d <= k a^2 + d^2 / k; equality at k = d / a. So |r|^2 > (1 + k) |h|^2 + (1 + 1/k) d^2 suffices:
the same question for the map (sqrt(1 + k) h, sqrt(1 + 1/k) d). Any k proves.

**Rounding.** Let S = s_r^2 + s_h^2, s the sum of the lengths of a map's columns, and U = 2^-53.
  - The maps in doubles are e_r and e_h from the true ones, and at most s_r, s_h long, so
    |r|^2 - |h|^2 is at least the doubles' own q - 2 s_r e_r - 2 s_h e_h - e_h^2.
  - A coefficient of q is a difference of two dot products of at most five terms, within 6 U of the
    same in absolute values. In [0, 1]^d these add up to (sum of the lengths)^2: 6.1 U S.
  - Restricting q to a side (entries 0, 1, -1) is three operations at most, 3 U; a tangent plane's
    value c + 2 b.x + 2 z.A x - z.A z, 12 operations on |c| + 2 |b| + 3 |A| <= 3 S: 36 U S.
  - Together below 50 U S: `VALUE` = 64.
  - A curvature is computed from the rounded coefficients (6.1 U S), restricted (3 U S), and the
    lesser eigenvalue of a 2x2 matrix with four operations on numbers <= S: below 32 U S,
    `CURVATURE`. A curvature l above its negative may be a little negative: q is then above its
    tangent plane at z less |l| |x - z|^2, and |x - z|^2 <= 2 in the square.
A NaN or an infinity anywhere makes the bound NaN or -inf, and the answer no.
"""

import math
from typing import NamedTuple

import numpy as np

from trajectory_guard.shapes.body import U
from trajectory_guard.toleranced.affine import Affine

VALUE = 64.0 * U
CURVATURE = 32.0 * U

# Squares below this are rounding of underflow, not sizes [m^2].
UNDERFLOWN_SQUARE = 2.0**-1000

# k far from 1 gives up as little of the clearance, and no more than rounding does.
LEAST_K, MOST_K = 2.0**-40, 2.0**40

# Domains, by their corners in order. A segment of a polytope is two of them.
POINT = np.empty((1, 0))
SEGMENT = np.array([[0.0], [1.0]])
TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


class Quadratic(NamedTuple):
    """
    The function x.A x + 2 b.x + c.

    :param A: (d, d), symmetric.
    :param b: (d,).
    :param c: constant.
    """

    A: np.ndarray
    b: np.ndarray
    c: float

    def on(self, start: np.ndarray, directions: np.ndarray) -> 'Quadratic':
        """Return y -> self(start + directions @ y)."""
        slope = self.b + self.A @ start
        return Quadratic(
            directions.T @ self.A @ directions,
            directions.T @ slope,
            float(self.c + self.b @ start + slope @ start),
        )

    def curvature(self) -> float:
        """Return the least eigenvalue of A, d <= 2."""
        if len(self.b) == 1:
            return float(self.A[0, 0])
        (a, b), (_, c) = self.A.tolist()
        return 0.5 * (a + c) - math.hypot(0.5 * (a - c), b)


def certainly_longer(r: Affine, h: Affine, domain: np.ndarray, thickness: float) -> bool:
    """
    Say whether |r(x)| > |h(x)| + thickness is proved for every x of the domain.

    :param r: map into R^3 [m].
    :param h: map into R^4 [m].
    :param domain: `POINT`, `SEGMENT`, `TRIANGLE` or `SQUARE`.
    :param thickness: d >= 0; a NaN or a negative one proves nothing [m].
    """
    if not 0.0 <= thickness < math.inf:
        return False
    if thickness == 0.0:
        return lower_bound(r, h, domain) > 0.0
    # Tight for the longest |h|; where q is least, if that still holds, it is tight for that.
    longest = max(float(np.linalg.norm(h.at(x))) for x in domain)
    place = minimiser(quadratic(r, h), domain)
    return any(
        lower_bound(r, _with_thickness(h, thickness, a), domain) > 0.0
        for a in (float(np.linalg.norm(h.at(place))), longest)
    )


def _with_thickness(h: Affine, thickness: float, a: float) -> Affine:
    """
    Return the map whose length is at least |h| + thickness, tight where |h| is a.

    With alpha, beta > 1 and (alpha^2 - 1)(beta^2 - 1) >= 1 the k = alpha^2 - 1 does; the roots are
    rounded by less than 2 U and then raised by 8 U, so both brackets are at least k and 1/k.
    """
    k = min(max(thickness / a if a > 0.0 else MOST_K, LEAST_K), MOST_K)
    alpha = math.sqrt(1.0 + k) * (1.0 + 8.0 * U)
    beta = math.sqrt(1.0 + 1.0 / k) * (1.0 + 8.0 * U)
    return h.widened(alpha, beta * thickness * (1.0 + 2.0 * U))


def quadratic(r: Affine, h: Affine) -> Quadratic:
    """Return |r|^2 - |h|^2, coefficients rounded."""
    return Quadratic(
        r.directions.T @ r.directions - h.directions.T @ h.directions,
        r.directions.T @ r.origin - h.directions.T @ h.origin,
        float(r.origin @ r.origin - h.origin @ h.origin),
    )


def lower_bound(r: Affine, h: Affine, domain: np.ndarray) -> float:
    """
    Return a lower bound of |r(x)|^2 - |h(x)|^2 over a domain; NaN if something overflows [m^2].

    :param r: map into R^3 [m].
    :param h: map into R^4 or R^5 [m].
    :param domain: corners, (n, d).
    """
    size_r, size_h = r.size, h.size
    S = size_r**2 + size_h**2
    margin = VALUE * S + 2.0 * size_r * r.error + (2.0 * size_h + h.error) * h.error
    least = least_value(quadratic(r, h), domain, CURVATURE * S)
    return least - margin * (1.0 + 32.0 * U) - UNDERFLOWN_SQUARE


def least_value(q: Quadratic, domain: np.ndarray, doubt: float) -> float:
    """
    Return a lower bound over a domain.

    :param q: the quadratic.
    :param domain: corners, (n, d).
    :param doubt: how far a computed curvature may be from the true one.
    """
    if len(domain) == 1:
        return q.c
    curvature = q.curvature()
    if curvature < -doubt:
        return min(least_value(q.on(*side), unit, doubt) for side, unit in _boundary(domain))
    z = minimiser(q, domain)
    slope = 2.0 * (q.b + q.A @ z)
    tangent = q.c + domain @ slope - z @ q.A @ z
    # NaN if anything is.
    return float(tangent.min() - 2.0 * np.maximum(0.0, doubt - curvature))


def _boundary(domain: np.ndarray) -> list[tuple[tuple[np.ndarray, np.ndarray], np.ndarray]]:
    """Return ((start, directions), domain of the side) for each side: ends, or edges in order."""
    if len(domain) == 2:
        return [((corner, np.empty((len(corner), 0))), POINT) for corner in domain]
    ends = np.roll(domain, -1, axis=0)
    return [
        ((start, (end - start)[:, None]), SEGMENT) for start, end in zip(domain, ends, strict=True)
    ]


def minimiser(q: Quadratic, domain: np.ndarray) -> np.ndarray:
    """
    Return about where a quadratic is least over a domain: a proposal.

    :param q: the quadratic.
    :param domain: corners, (n, d).
    """
    if len(domain) == 1:
        return domain[0]
    if len(q.b) == 1:
        a, b = float(q.A[0, 0]), float(q.b[0])
        if a > 0.0:
            return np.array([min(max(-b / a, 0.0), 1.0)])
        return np.array([float(a + 2.0 * b < 0.0)])
    (a, b), (_, c) = q.A.tolist()
    det = a * c - b * b
    if det > 0.0 and a > 0.0:
        x = np.array([b * q.b[1] - c * q.b[0], b * q.b[0] - a * q.b[1]]) / det
        if _inside(x, domain):
            return x
    places = []
    for (start, directions), unit in _boundary(domain):
        along = minimiser(q.on(start, directions), unit)
        places.append(start + directions @ along)
    return min(places, key=lambda x: q.on(x, np.empty((2, 0))).c)


def _inside(x: np.ndarray, domain: np.ndarray) -> bool:
    side = np.roll(domain, -1, axis=0) - domain
    away = x - domain
    return bool((side[:, 0] * away[:, 1] - side[:, 1] * away[:, 0] >= 0.0).all())
