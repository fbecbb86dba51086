"""
When four points on straight lines make a vertex meet a triangle, or two edges meet, exactly.

The points are polynomials of degree 1 in s. The four lie in one plane where a cubic vanishes, the
constraint of [Canny 1984] for features that need not stay rigid; then they meet if they do so in
a projection that keeps the plane, and in degenerate cases if an end lies in a segment. The
conditions are those of ``linear.hpp``, with exact weak signs:

    vertex v, face a b c:  f = 0, and for an axis k with A_k != 0 the areas of (v b c), (v c a),
                           (v a b) along k have the sign of A_k = area (a b c) or vanish;
    edges a b, c d:        f = 0, and for an axis k with D_k != 0, D = (b - a) x (d - c), both
                           m D = (c - a) x (b - a) and l D = (c - a) x (d - c) lie between 0 and D.

If every A_k (D_k) vanishes, the triangle is one of its sides (the edges are parallel), and the
features meet if and only if a vertex lies in a segment: p in q r where (p - q) x (r - q) = 0 and
(p - q) . (p - r) <= 0.
"""

from collections.abc import Sequence
from enum import IntEnum
import functools
import itertools
from typing import NoReturn

from flint import fmpz_poly
import numpy as np

from trajectory_guard.canny.integers import exponent, scaled
from trajectory_guard.canny.moment import Moment, moment
from trajectory_guard.canny.polynomial import (
    cross_product,
    dot_product,
    from_bernstein,
    to_bernstein,
    Vector,
)
from trajectory_guard.canny.signs import place, Signs, trace
from trajectory_guard.canny.transitions import all_of, any_of, both, runs, Transitions
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.kernels import canny as kernel
from trajectory_guard.shapes.body import LARGEST_COORDINATE

DEGREE = 3


class LinearKind(IntEnum):
    """Which features the four points are."""

    VERTEX_FACE = kernel.VERTEX_FACE  # v, a, b, c
    EDGE_EDGE = kernel.EDGE_EDGE  # a, b, c, d


class Answer(IntEnum):
    """What rounded arithmetic knows of a query; only APART is a proof that nothing meets."""

    APART = kernel.APART
    UNDECIDED = kernel.UNDECIDED
    MEETING = kernel.MEETING


def linear_answers(kind: LinearKind, rows: np.ndarray) -> np.ndarray:
    """
    Say for each query whether its features meet, by rounded arithmetic with bounds.

    :param kind: which features.
    :param rows: (n, 8, 3): the four points at s = 0, then at s = 1 [m].
    :returns: (n,) values of :class:`Answer`.
    :raises RequestError: the shape is another, or a coordinate is not finite or too large.
    """
    return kernel.kernel_linear(int(kind), _checked(np.asarray(rows, dtype=np.float64)))


def linear_contacts(kind: LinearKind, rows: np.ndarray) -> tuple[tuple[Moment, Moment], ...]:
    """
    Return the closed spans of s in which the features have a point in common, exactly.

    :param kind: which features.
    :param rows: (8, 3) as above [m].
    :raises RequestError: the shape is another, or a coordinate is not finite or too large.
    """
    (array,) = _checked(np.asarray(rows, dtype=np.float64)[None])
    ends = scaled(array, exponent(array))
    points = [
        [from_bernstein([a, b]) for a, b in zip(start, end, strict=True)]
        for start, end in zip(ends[:4], ends[4:], strict=True)
    ]
    plane, projections, segments = (_faces, _edges)[kind](points)
    polynomials = [plane, *itertools.chain(*projections), *itertools.chain(*segments)]
    traces = [trace(to_bernstein(f, DEGREE), functools.partial(_same, f)) for f in polynomials]
    if not traces[0].roots and 0 not in (*traces[0].ends, *traces[0].gaps):
        return ()
    roots, signs = place(traces)
    rest = iter(signs[1:])
    touching = any_of(
        [
            *(_agreeing([next(rest) for _ in row]) for row in projections),
            *(_in_segment([next(rest) for _ in row]) for row in segments),
        ]
    )
    return tuple(
        (moment(roots, first), moment(roots, last - 1))
        for first, last in runs(both(signs[0].zero(), touching))
    )


def _faces(points: Sequence[Vector]) -> tuple[fmpz_poly, list[Vector], list[Vector]]:
    """Return f, for each axis A and the areas, and for each side the polynomials of a segment."""
    vertex, *corners = points
    u, v, w = (_from(vertex, corner) for corner in corners)
    areas = cross_product(v, w), cross_product(w, u), cross_product(u, v)
    sides = itertools.combinations(corners, 2)
    projections: list[Vector] = [[x + y + z, x, y, z] for x, y, z in zip(*areas, strict=True)]
    return dot_product(u, areas[0]), projections, [_segment(vertex, q, r) for q, r in sides]


def _edges(points: Sequence[Vector]) -> tuple[fmpz_poly, list[Vector], list[Vector]]:
    """Return f, for each axis D, m D, (1 - m) D, l D, (1 - l) D, and the segments."""
    a, b, c, d = points
    u, v, w = _from(a, b), _from(a, c), _from(c, d)
    D, m, t = cross_product(u, w), cross_product(v, u), cross_product(v, w)
    projections: list[Vector] = [[x, y, x - y, z, x - z] for x, y, z in zip(D, m, t, strict=True)]
    ends = (a, c, d), (b, c, d), (c, a, b), (d, a, b)
    return dot_product(v, D), projections, [_segment(*end) for end in ends]


def _segment(p: Vector, q: Vector, r: Vector) -> Vector:
    """Return (p - q) x (r - q) and (p - q) . (p - r)."""
    return [*cross_product(_from(q, p), _from(q, r)), dot_product(_from(q, p), _from(r, p))]


def _agreeing(signs: Sequence[Signs]) -> Transitions:
    """Return where the first sign is not 0 and no other is its opposite."""
    whole, *parts = signs
    return any_of(
        all_of(part)
        for part in (
            [whole.positive(), *(one.not_below() for one in parts)],
            [whole.negative(), *(one.not_above() for one in parts)],
        )
    )


def _in_segment(signs: Sequence[Signs]) -> Transitions:
    """Return where a point lies in a segment."""
    *across, along = signs
    return all_of([*(one.zero() for one in across), along.not_above()])


def _from(a: Vector, b: Vector) -> Vector:
    return [y - x for x, y in zip(a, b, strict=True)]


def _same(f: fmpz_poly) -> fmpz_poly:
    return f


def _checked(rows: np.ndarray) -> np.ndarray:
    if rows.ndim != 3 or rows.shape[1:] != (8, 3):
        _refuse(f'shape {rows.shape} is not (n, 8, 3)')
    if rows.size and not np.abs(rows).max() <= LARGEST_COORDINATE:
        _refuse(f'a coordinate exceeds {LARGEST_COORDINATE:g} m or is not finite')
    return np.ascontiguousarray(rows)


def _refuse(what: str) -> NoReturn:
    raise RequestError(Reason.INVALID_PARAMETER, f'rows: {what}')
