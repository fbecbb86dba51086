"""The algebraic collision test, as Python calls it; see ``meeting.hpp``."""

import ctypes
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trajectory_guard.kernels.compiled import load
from trajectory_guard.kernels.layout import address

UNIT = Path(__file__).with_suffix('.cpp')

# How roots are proposed.
CLOSED_FORM = 0  # of cubics; of other degrees by halving and secants
HALVING = 1

# Answers to queries of four points on straight lines, and their kinds.
APART, UNDECIDED, MEETING = range(3)
VERTEX_FACE, EDGE_EDGE = range(2)

_POINTER = ctypes.c_void_p
_INTEGER = ctypes.c_int64


class PolyhedronStructure(ctypes.Structure):
    """`Polyhedron` of ``constraints.hpp``."""

    _fields_ = [
        *((name, _INTEGER) for name in ('vertices', 'faces', 'edges')),
        *(
            (name, _POINTER)
            for name in ('vertex', 'plane', 'line', 'edge', 'face_start', 'face_edge', 'face_way')
        ),
    ]


class CourseStructure(ctypes.Structure):
    """`Course` of ``constraints.hpp``."""

    _fields_ = [
        ('position_degree', _INTEGER),
        ('quaternion_degree', _INTEGER),
        ('positions', _POINTER),
        ('quaternions', _POINTER),
    ]


class OverlapsStructure(ctypes.Structure):
    """`Overlaps` of ``canny.cpp``."""

    _fields_ = [
        *((name, _INTEGER) for name in ('possible_count', 'certain_count', 'polynomials')),
        ('possible', ctypes.POINTER(ctypes.c_double)),
        ('certain', ctypes.POINTER(ctypes.c_double)),
    ]


class Polyhedron(NamedTuple):
    """
    A convex polyhedron; every number is the exact one, rounded once.

    :param vertex: (V, 3) [m].
    :param plane: (F, 4) outward normal and offset.
    :param line: (E, 6) direction and moment.
    :param edge: (E, 2) int64 tail and head.
    :param face_start: (F + 1,) int64 into the next two.
    :param face_edge: int64 edges of each face.
    :param face_way: int64, 1 if the edge runs counter-clockwise, else -1.
    """

    vertex: np.ndarray
    plane: np.ndarray
    line: np.ndarray
    edge: np.ndarray
    face_start: np.ndarray
    face_edge: np.ndarray
    face_way: np.ndarray

    def structure(self) -> PolyhedronStructure:
        """Return the structure, which keeps the arrays alive."""
        counts = len(self.vertex), len(self.plane), len(self.edge)
        made: Any = PolyhedronStructure(*counts, *(address(array) for array in self))
        made.arrays = self
        return made


def course_structure(positions: np.ndarray, quaternions: np.ndarray) -> CourseStructure:
    """
    Return the structure of a path, which lives as long as the arrays.

    :param positions: (n + 1, 3) [m].
    :param quaternions: (m + 1, 4).
    """
    degrees = len(positions) - 1, len(quaternions) - 1
    return CourseStructure(*degrees, address(positions), address(quaternions))


class KernelOverlaps(NamedTuple):
    """
    What the kernel found.

    :param possible: rows (start, end) that contain every overlap.
    :param certain: rows (start, end) that every instant of is in overlap.
    :param polynomials: constraints that were built.
    """

    possible: list[tuple[float, float]]
    certain: list[tuple[float, float]]
    polynomials: int


def kernel_overlap(
    a: PolyhedronStructure,
    course_a: CourseStructure,
    b: PolyhedronStructure,
    course_b: CourseStructure,
    method: int = CLOSED_FORM,
    times: int = 1,
) -> KernelOverlaps | None:
    """
    Find the overlaps of a pair.

    :param method: how roots are proposed.
    :param times: do it so many times over, for a clock.
    :returns: None if the degree is too high.
    :raises MemoryError: there is not enough.
    """
    out = OverlapsStructure()
    status = load(UNIT).guard_overlap(
        ctypes.byref(a),
        ctypes.byref(course_a),
        ctypes.byref(b),
        ctypes.byref(course_b),
        _INTEGER(method),
        _INTEGER(times),
        ctypes.byref(out),
    )
    if status == 1:
        raise MemoryError
    if status:
        return None
    return KernelOverlaps(
        _rows(out.possible, out.possible_count),
        _rows(out.certain, out.certain_count),
        out.polynomials,
    )


def _rows(spans: Any, count: int) -> list[tuple[float, float]]:
    flat = spans[: 2 * count] if count else []
    return list(zip(flat[::2], flat[1::2], strict=True))


def kernel_linear(kind: int, rows: np.ndarray) -> np.ndarray:
    """
    Say for each query whether its features meet.

    :param kind: VERTEX_FACE or EDGE_EDGE.
    :param rows: (n, 8, 3) four points at the start, then at the end, contiguous [m].
    :returns: (n,) int64, APART, UNDECIDED or MEETING.
    :raises MemoryError: there is not enough.
    """
    answers = np.empty(len(rows), dtype=np.int64)
    status = load(UNIT).guard_linear(
        _INTEGER(len(rows)), _INTEGER(kind), _POINTER(address(rows)), _POINTER(address(answers))
    )
    if status:
        raise MemoryError
    return answers
