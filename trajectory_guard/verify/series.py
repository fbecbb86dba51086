r"""
Polynomials in tau in [-1, 1] that enclose functions: coefficients are balls.

At every tau the exact value lies in the value of the polynomial.  What exceeds DEGREE goes into
the radius of the constant coefficient:

- sin and cos of q(tau) = q_0 + p(tau): the coefficients of exp(i q) are at most those of exp(P),
  P the sum of |p_k| tau^k.  Beyond DEGREE they sum to exp(P(1)) less the sum of the others.
- of a product: the value of what lies beyond DEGREE, for tau in the ball [-1, 1].
"""

from collections.abc import Iterator
from contextlib import contextmanager
import functools
import math

from flint import arb, arb_mat, arb_poly, arb_series, ctx, fmpq, fmpq_poly

BITS = 128
DEGREE = 16

# The ball [-1, 1].
ANY = arb(0, 1)

# Beyond this turn [rad] no series helps; the joint may then be at any angle.
_LARGEST_TURN = 4.0


@contextmanager
def precision() -> Iterator[None]:
    """Compute with BITS, and keep as many terms of a series as a piece needs."""
    before = ctx.prec, ctx.cap
    ctx.prec, ctx.cap = BITS, DEGREE + 1
    try:
        yield
    finally:
        ctx.prec, ctx.cap = before


def shortened(p: arb_poly) -> arb_poly:
    """Return a polynomial of at most DEGREE that encloses another one."""
    if p.degree() <= DEGREE:
        return p
    coefficients = p.coeffs()
    rest = arb_poly(coefficients[DEGREE + 1 :])(ANY)
    return arb_poly(coefficients[: DEGREE + 1]) + arb(0, rest.abs_upper())


def cos_sin(q: arb_poly) -> tuple[arb_poly, arb_poly]:
    """Return enclosures of cos q and sin q."""
    coefficients = q.coeffs() or [arb(0)]
    sizes = [c.abs_upper() for c in coefficients[1:]]
    turn = sum(sizes, arb(0))
    if not turn < _LARGEST_TURN:
        return arb_poly([ANY]), arb_poly([ANY])
    sin, cos = (s.coeffs() for s in arb_series(coefficients, prec=DEGREE + 1).sin_cos())
    majorant = arb_series([0, *sizes], prec=DEGREE + 1).exp().coeffs()
    kept = sum(majorant[: min(len(cos), len(sin))], arb(0))
    rest = arb(0, (turn.exp() - kept).abs_upper() if sizes else 0)
    return arb_poly(cos) + rest, arb_poly(sin) + rest


@functools.cache
def bernstein() -> arb_mat:
    """Return the matrix from powers of tau to coefficients of the Bernstein polynomials."""
    n = DEGREE
    tau = fmpq_poly([-1, 2])
    rows = [[fmpq(0)] * (n + 1) for _ in range(n + 1)]
    for k in range(n + 1):
        for j, c in enumerate((tau**k).coeffs()):
            for i in range(j, n + 1):
                rows[i][k] += c * fmpq(math.comb(i, j), math.comb(n, j))
    return arb_mat([[arb(x) for x in row] for row in rows])


def elevated(a: arb_mat, b: arb_mat) -> arb_mat:
    """Return Bernstein coefficients of (1 - s) a(s) + s b(s), one degree higher."""
    first, last = _elevation(a.nrows())
    return first * a + last * b


@functools.cache
def _elevation(n: int) -> tuple[arb_mat, arb_mat]:
    """Return the matrices of (1 - s) and of s from n to n + 1 Bernstein coefficients."""
    rows, columns = range(n + 1), range(n)
    return (
        arb_mat([[arb(fmpq(n - i, n)) if k == i else 0 for k in columns] for i in rows]),
        arb_mat([[arb(fmpq(i, n)) if k == i - 1 else 0 for k in columns] for i in rows]),
    )
