"""Cover a rational Bezier motion by balls, as Python calls it; see ``ball_cover.hpp``."""

import ctypes
from typing import NamedTuple

import numpy as np

from trajectory_guard.kernels.compiled import load, SOURCES
from trajectory_guard.kernels.layout import address, check

UNIT = SOURCES / 'ball.cpp'

# Status of a leaf.
PENDING, FREE, SUSPECT = range(3)
# Why a leaf is suspect.
BY_EPSILON, BY_RECURSION, BY_TESTS, BY_PATIENCE = range(4)
# Which test left a place open.
NOTHING = -1
VERTEX_FACE, EDGE_EDGE, FACE_VERTEX, EDGE_PIERCES, FACE_PIERCED = range(5)

# The leaf [numerator, numerator + 1] / 2^level, see `BallLeaf`; place in m.
LEAF = np.dtype(
    [(name, np.int64) for name in ('numerator', 'level', 'status', 'reason')]
    + [(name, np.int64) for name in ('moving_face', 'fixed_face', 'first', 'last', 'kind')]
    + [('moving', np.int64, 2), ('fixed', np.int64, 2), ('place', float, 3)]
)
# The pair of roots.
ROOTS = np.zeros((1, 2), np.int64)


class Surface(NamedTuple):
    """
    A polyhedron and the tree over its faces, see ``surface.hpp``.

    :param corner_first: (F + 1,) int64; the other ``first`` likewise.
    :param corner: (C, 3) corners of the faces in order [m].
    :param vertex: (C,) int64 number of each in the polyhedron.
    :param edge_first: (F + 1,) int64.
    :param edge: (E, 2) int64 sides of a face's triangles, by corners within the face.
    :param triangle_first: (F + 1,) int64.
    :param triangle: (T, 3) int64, by corners within the face.
    :param branch: (N, 3) int64 left, right, -1; or -1, -1 and a face.
    :param box: (N, 6) centre and half sides of a box around the node's faces [m].
    :param reach: no point of a box is farther from the origin [m].
    """

    corner_first: np.ndarray
    corner: np.ndarray
    vertex: np.ndarray
    edge_first: np.ndarray
    edge: np.ndarray
    triangle_first: np.ndarray
    triangle: np.ndarray
    branch: np.ndarray
    box: np.ndarray
    reach: float


class Metric(NamedTuple):
    """
    Mass distributions of the moving surface, see ``surface.hpp``.

    :param frame: (M, 12) barycentre b and K by rows, the inertia is K K^T, the mass 1 [m].
    :param span: (M,) at least |b| + |K| [m].
    :param of: (N,) int64 distribution of each node.
    :param far: (N,) at least |q| in the node's box or face.
    :param turned: (C, 3) q = K^-1 (x - b) of each corner, K and b of its face.
    :param residual: at least |x - b - K q| everywhere [m].
    """

    frame: np.ndarray
    span: np.ndarray
    of: np.ndarray
    far: np.ndarray
    turned: np.ndarray
    residual: float


class Curve(NamedTuple):
    """
    A rational Bezier curve of displacements.

    :param points: (K, 12) control points, rows of [C | t].
    :param weights: (K,) positive Bernstein weights.
    """

    points: np.ndarray
    weights: np.ndarray


class Limits(NamedTuple):
    """
    What is asked of a cover.

    :param clearance: distance that must be exceeded [m].
    :param shift_error: every true image of x is within shift_error + turn_error |x| of the
        curve's [m].
    :param turn_error: [m / m].
    :param epsilon: pairs are not refined further when no point moves more [m].
    :param max_depth: halvings.
    :param max_tests: tests of clusters and of polygons before the rest is given up as suspect.
    :param plain: every pair of faces by itself (Listing 1 as printed).
    :param adapted: every ball has the extent of distributions that suits it.
    """

    clearance: float
    shift_error: float
    turn_error: float
    epsilon: float
    max_depth: int
    max_tests: int
    plain: bool
    adapted: bool


class Counts(NamedTuple):
    """What was done: pieces examined, tests of clusters and of polygons, deepest level."""

    pieces: int
    node_tests: int
    polygon_tests: int
    depth: int


class Covered(NamedTuple):
    """
    What a cover found.

    :param leaves: (L,) LEAF in time order; without hierarchy only those that are suspect.
    :param pairs: (P, 2) int64 open pairs of nodes of the pending leaves.
    :param counts: what was done.
    :param tests_of: (F,) int64 polygon tests of each moving face.
    """

    leaves: np.ndarray
    pairs: np.ndarray
    counts: Counts
    tests_of: np.ndarray


_I, _D, _P = ctypes.c_int64, ctypes.c_double, ctypes.c_void_p


def _structure(name: str, **fields: type) -> type[ctypes.Structure]:
    return type(name, (ctypes.Structure,), {'_fields_': list(fields.items())})


_Surface = _structure(
    'Surface',
    faces=_I,
    corner_first=_P,
    corner=_P,
    vertex=_P,
    edge_first=_P,
    edge=_P,
    triangle_first=_P,
    triangle=_P,
    branch=_P,
    box=_P,
    nodes=_I,
    reach=_D,
)
_Metric = _structure('Metric', count=_I, frame=_P, span=_P, of=_P, far=_P, turned=_P, residual=_D)
_Curve = _structure('Curve', degree=_I, points=_P, weights=_P)
_Request = _structure(
    'Request',
    clearance=_D,
    shift_error=_D,
    turn_error=_D,
    epsilon=_D,
    max_depth=_I,
    max_tests=_I,
    plain=_I,
    adapted=_I,
    numerator=_I,
    level=_I,
    until=_I,
)
_Answer = _structure(
    'Answer',
    leaf_count=_I,
    pair_count=_I,
    pieces=_I,
    node_tests=_I,
    polygon_tests=_I,
    depth=_I,
    leaves=_P,
    pairs=_P,
)


class Packed:
    """
    What a cover is about; holds the arrays that the structures point to.

    :param moving: in its own frame.
    :param fixed: in the frame of the motion's images.
    :param metric: of the moving surface.
    :raises TypeError: an array is not contiguous or has another type.
    """

    def __init__(self, moving: Surface, fixed: Surface, metric: Metric) -> None:
        self._held = moving, fixed, metric
        self.moving_faces = len(moving.corner_first) - 1
        self.fixed_faces = len(fixed.corner_first) - 1
        self.structures = _surface(moving), _surface(fixed), _metric(metric)


def cover(
    packed: Packed,
    curve: Curve,
    limits: Limits,
    stop: np.ndarray,
    piece: tuple[int, int] = (0, 0),
    pairs: np.ndarray = ROOTS,
    until: int = -1,
) -> Covered:
    """
    Cover one piece of a motion, without the interpreter's lock.

    :param packed: the surfaces and the metric.
    :param curve: the motion.
    :param limits: what is asked.
    :param stop: (1,) int64; another thread sets it non-zero to have the rest given up.
    :param piece: numerator and level: [numerator, numerator + 1] / 2^level.
    :param pairs: (P, 2) int64 pairs of nodes that are open on it.
    :param until: level at which open pieces are handed back as pending; -1: never.
    :raises MemoryError: there is not enough.
    """
    tests_of = np.zeros(packed.moving_faces, np.int64)
    answer = _Answer()
    status = load(UNIT).guard_ball_cover(
        *map(ctypes.byref, packed.structures),
        ctypes.byref(_curve(curve)),
        ctypes.byref(_Request(*limits, *piece, until)),
        _P(_checked(pairs, np.int64)),
        _I(len(pairs)),
        _P(_checked(stop, np.int64)),
        _P(address(tests_of)),
        ctypes.byref(answer),
    )
    check(status)
    return Covered(
        _copied(answer.leaves, answer.leaf_count, LEAF),
        _copied(answer.pairs, 2 * answer.pair_count, np.dtype(np.int64)).reshape(-1, 2),
        Counts(answer.pieces, answer.node_tests, answer.polygon_tests, answer.depth),
        tests_of,
    )


def _surface(surface: Surface) -> ctypes.Structure:
    ints, floats = np.int64, np.float64
    return _Surface(
        len(surface.corner_first) - 1,
        _checked(surface.corner_first, ints),
        _checked(surface.corner, floats),
        _checked(surface.vertex, ints),
        _checked(surface.edge_first, ints),
        _checked(surface.edge, ints),
        _checked(surface.triangle_first, ints),
        _checked(surface.triangle, ints),
        _checked(surface.branch, ints),
        _checked(surface.box, floats),
        len(surface.branch),
        surface.reach,
    )


def _metric(metric: Metric) -> ctypes.Structure:
    return _Metric(
        len(metric.frame),
        _checked(metric.frame, np.float64),
        _checked(metric.span, np.float64),
        _checked(metric.of, np.int64),
        _checked(metric.far, np.float64),
        _checked(metric.turned, np.float64),
        metric.residual,
    )


def _curve(curve: Curve) -> ctypes.Structure:
    points, weights = (_checked(array, np.float64) for array in curve)
    return _Curve(len(curve.weights) - 1, points, weights)


def _checked(array: np.ndarray, dtype: type) -> int:
    if array.dtype != dtype or not array.flags.c_contiguous:
        raise TypeError(f'expected a contiguous array of {dtype}, got {array.dtype}')
    return address(array)


def _copied(pointer: int | None, count: int, dtype: np.dtype) -> np.ndarray:
    """Return a copy of what the kernel will overwrite with this thread's next answer."""
    data = ctypes.string_at(pointer, count * dtype.itemsize) if pointer and count else b''
    return np.frombuffer(data, dtype)
