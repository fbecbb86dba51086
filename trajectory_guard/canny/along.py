r"""
Constraints along a rational motion, as Bernstein polynomials with a bound on their error.

A rational motion g~ = (L, t) has control points C_i and weights; w_i > 0 are these times C(n, i).
The image of a point times the weight, w x~ = sum_i w_i C_i(x) s^i (1 - s)^(n - i), is a polynomial
of degree n. The *true* motion g is rigid and |g(x) - g~(x)| <= e for the points x of the body.
With three corners of a face (c0 c1 c2, counter-clockwise from outside, not collinear), all types
are one triple product of points that are moved or stand:

    A:  (g c1 - g c0) x (g c2 - g c0) . (p_B - g c0)         positive: p_B outside of A's face
    B:  (c1 - c0) x (c2 - c0) . (g p_A - c0)                  positive: p_A outside of B's face
    C:  (g h_A - g t_A) x (h_B - t_B) . (g t_A - t_B)         as in ``constraint.py``

**Weights divided out.** With g~ for g, times w^3, w, w^2, these are polynomials of degree 3 n, n,
2 n. If g~ is a chain of rational rotations M_k / w_k and polynomial slides, w^2, 1, w divide
them: w R is a polynomial, and with t = sum_k R_1 .. R_(k-1) o_k also

    w R^T t = sum_k (M_k .. M_m)^T o_k ...,   w t x R e = sum_k M_1 .. (o_k x M_k .. M_m e) ...,

each of degree n. So w times the value has degree n = 2 sum deg u. The quotient is found by least
squares and then *measured*: for h = W f + r, W > 0,

    |h / W - f| = |r| / W <= max_i |r_i| / W_i

with the scaled Bernstein coefficients of r and W, whatever f is.

**Error.** Differences of two points of the body are off by 2 e; |.| of true differences are those
of the body. With a = c1 - c0, b = c2 - c0 and D the largest distance over s of the moved point
from the standing one (the largest over the control points bounds it), the true value differs from
that with g~ by at most

    A:  (2 e |b| + (|a| + 2 e) 2 e) D + |a| |b| e,
    B:  |a| |b| e,
    C:  |h_B - t_B| (2 e D + |h_A - t_A| e),

because x' x y' - x x y = (x' - x) x y' + x x (y' - y). Times w, this is at most the largest weight
times it. Rounding is carried along with every coefficient: a sum or product of doubles errs by
2^-53 of its result, a convolution with k terms by (k + 1) 2^-53 of that of the absolute values.
"""

from dataclasses import dataclass
import math
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from trajectory_guard.canny.constraint import Kind
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.shapes.body import LARGEST_COORDINATE, U

# Bounds are sums and products of many non-negative terms, each rounded.
UP = 1.0 + 2.0**-40
# Pays for all underflows.
UNDERFLOW_PAID = 2.0**-900


class Along(NamedTuple):
    """
    A constraint along a motion, times the motion's weight.

    The exact w(s) times the value of the true motion lies within `error` of the polynomial.

    :param coefficients: (K,) Bernstein coefficients on the piece.
    :param error: bound, rounding and the error of the motion included; infinite if there is none.
    """

    coefficients: np.ndarray
    error: float


@dataclass(frozen=True, slots=True, eq=False)
class _Scaled:
    """Scaled Bernstein coefficients, each with a bound on its error."""

    c: np.ndarray
    error: np.ndarray

    def __mul__(self, other: '_Scaled') -> '_Scaled':
        size, other_size = np.abs(self.c), np.abs(other.c)
        terms = min(len(size), len(other_size)) + 1
        error = np.convolve(size + self.error, other.error) + np.convolve(self.error, other_size)
        error += terms * U * np.convolve(size, other_size)
        return _Scaled(np.convolve(self.c, other.c), error * UP + UNDERFLOW_PAID)

    def __sub__(self, other: '_Scaled') -> '_Scaled':
        c = self.c - other.c
        return _Scaled(c, (self.error + other.error + U * np.abs(c)) * UP)

    def __add__(self, other: '_Scaled') -> '_Scaled':
        c = self.c + other.c
        return _Scaled(c, (self.error + other.error + U * np.abs(c)) * UP)


_Point = list[_Scaled]


def along(motion: RationalMotion, kind: Kind, of_a: ArrayLike, of_b: ArrayLike) -> Along:
    """
    Return a constraint between a moving body A and a standing body B.

    Tracking tolerance is not included: `motion.inflation` is what it adds to `motion.error`.

    :param motion: of A's node frame on a piece.
    :param kind: which features.
    :param of_a: points of A in its node frame: three corners of a face, a vertex (3,), or tail and
        head of an edge; they belong to the body that the motion was built for [m].
    :param of_b: points of B in the root frame: a vertex (3,), three corners of a face, or tail and
        head of an edge [m].
    :raises RequestError: a shape is wrong, a value not finite or too large.
    """
    with np.errstate(all='ignore'):
        return _TYPES[kind](motion, *_checked(kind, of_a, of_b))


def _type_a(motion: RationalMotion, corners: np.ndarray, point: np.ndarray) -> Along:
    weight = _weight(motion)
    c0, c1, c2 = (_moved(motion, weight, corner) for corner in corners)
    far = _minus(_still(weight, point), c0)
    whole = _dot(_cross(_minus(c1, c0), _minus(c2, c0)), far)
    a, b = _length(corners[1] - corners[0]), _length(corners[2] - corners[0])
    e = motion.error
    slack = (2 * e * b + (a + 2 * e) * 2 * e) * _reach(motion, corners[0], point) + a * b * e
    return _divided(motion, whole, weight * weight, slack)


def _type_b(motion: RationalMotion, point: np.ndarray, corners: np.ndarray) -> Along:
    weight = _weight(motion)
    one = _Scaled(np.ones(1), np.zeros(1))
    c0, c1, c2 = (_still(one, corner) for corner in corners)
    normal = _cross(_minus(c1, c0), _minus(c2, c0))
    whole = _dot(normal, _minus(_moved(motion, weight, point), _still(weight, corners[0])))
    a, b = _length(corners[1] - corners[0]), _length(corners[2] - corners[0])
    return _divided(motion, whole, None, a * b * motion.error)


def _type_c(motion: RationalMotion, edge_a: np.ndarray, edge_b: np.ndarray) -> Along:
    weight = _weight(motion)
    one = _Scaled(np.ones(1), np.zeros(1))
    tail, head = (_moved(motion, weight, end) for end in edge_a)
    other = _minus(_still(one, edge_b[1]), _still(one, edge_b[0]))
    whole = _dot(_cross(_minus(head, tail), other), _minus(tail, _still(weight, edge_b[0])))
    a, b, e = _length(edge_a[1] - edge_a[0]), _length(edge_b[1] - edge_b[0]), motion.error
    slack = b * (2 * e * _reach(motion, edge_a[0], edge_b[0]) + a * e)
    return _divided(motion, whole, weight, slack)


_TYPES = {Kind.A: _type_a, Kind.B: _type_b, Kind.C: _type_c}
_SHAPES = {Kind.A: ((3, 3), (3,)), Kind.B: ((3,), (3, 3)), Kind.C: ((2, 3), (2, 3))}


def _weight(motion: RationalMotion) -> _Scaled:
    """Return the scaled weights: a binomial, from 57 on rounded, and a product."""
    scaled = motion.weights * _binomials(len(motion.weights) - 1)
    return _Scaled(scaled, 2.0 * U * np.abs(scaled) * UP + UNDERFLOW_PAID)


def _moved(motion: RationalMotion, weight: _Scaled, x: np.ndarray) -> _Point:
    """Return w times the image of a point: sums of four products with the weight, 6 roundings."""
    products = motion.control_points * np.array([*x, 1.0])
    scaled = weight.c[:, None] * products.sum(axis=2)
    size = np.abs(products).sum(axis=2)
    error = (6.0 * U * weight.c + weight.error)[:, None] * size * UP + UNDERFLOW_PAID
    return [_Scaled(scaled[:, r], error[:, r]) for r in range(3)]


def _still(weight: _Scaled, x: np.ndarray) -> _Point:
    """Return w times a point that stands."""
    constants = (_Scaled(np.array([value]), np.zeros(1)) for value in x)
    return [weight * one for one in constants]


def _minus(a: _Point, b: _Point) -> _Point:
    return [x - y for x, y in zip(a, b, strict=True)]


def _cross(a: _Point, b: _Point) -> _Point:
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def _dot(a: _Point, b: _Point) -> _Scaled:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _length(x: np.ndarray) -> float:
    """Return |x| or a little more."""
    return math.hypot(*x.tolist()) * UP + UNDERFLOW_PAID


def _reach(motion: RationalMotion, x: np.ndarray, place: np.ndarray) -> float:
    """Bound the distance of a moved point from a place: a control point is farthest."""
    products = motion.control_points * np.array([*x, 1.0])
    off = np.abs(products.sum(axis=2) - place)
    rounding = 8.0 * U * (np.abs(products).sum(axis=2) + np.abs(place))
    return float(np.linalg.norm(off + rounding, axis=1).max()) * UP


def _divided(
    motion: RationalMotion, whole: _Scaled, divisor: _Scaled | None, slack: float
) -> Along:
    """Return the quotient with all that it may be off, see the head of the file; by 1 if None."""
    n = len(motion.weights) - 1
    binomials = _binomials(n)
    if divisor is None:
        scaled, off = whole.c, float((whole.error / binomials).max())
    else:
        scaled = _proposed(whole.c, divisor.c, n)
        rest = whole - divisor * _Scaled(scaled, np.zeros(n + 1))
        # The divisor in the degree of the rest: times 1, whose scaled coefficients are binomials.
        raised = divisor * _Scaled(binomials, np.zeros(n + 1))
        smallest = raised.c - raised.error
        off = float(((np.abs(rest.c) + rest.error) / smallest).max())
        off = off if smallest.min() > 0.0 else math.inf
    heaviest = float(motion.weights.max())
    coefficients = scaled / binomials
    # Dividing by a binomial is one more rounding.
    error = (off + slack * heaviest + 2.0 * U * float(np.abs(coefficients).max())) * UP
    if not (np.isfinite(coefficients).all() and (motion.weights > 0.0).all() and error < math.inf):
        error = math.inf
    coefficients.setflags(write=False)
    return Along(coefficients, error)


def _proposed(whole: np.ndarray, divisor: np.ndarray, n: int) -> np.ndarray:
    """Return n + 1 scaled coefficients f with whole ~ divisor f: least squares, a proposal."""
    top, binomials = _binomials(len(whole) - 1), _binomials(n)
    matrix = np.zeros((len(whole), n + 1))
    for j in range(n + 1):
        matrix[j : j + len(divisor), j] = divisor * binomials[j]
    matrix /= top[:, None]
    if not (np.isfinite(matrix).all() and np.isfinite(whole).all()):
        return np.full(n + 1, math.nan)
    found, *_ = np.linalg.lstsq(matrix, whole / top, rcond=None)
    return np.asarray(found * binomials)


def _binomials(n: int) -> np.ndarray:
    return np.array([math.comb(n, i) for i in range(n + 1)], dtype=np.float64)


def _checked(kind: Kind, *points: ArrayLike) -> list[np.ndarray]:
    """Return the points of both bodies as arrays."""
    arrays = [np.asarray(x, dtype=np.float64) for x in points]
    for name, array, shape in zip(('of_a', 'of_b'), arrays, _SHAPES[kind], strict=True):
        if array.shape != shape:
            _refuse(f'{name}: shape {array.shape} is not {shape} ({kind.value})')
        if not np.abs(array).max() <= LARGEST_COORDINATE:
            _refuse(f'{name}: one exceeds {LARGEST_COORDINATE:g} m or is not finite')
    return arrays


def _refuse(what: str) -> NoReturn:
    raise RequestError(Reason.INVALID_PARAMETER, what)
