"""Overlaps by rounded arithmetic with certified bounds: microseconds a pair, and never too few."""

from collections.abc import Sequence
import functools
from typing import NamedTuple

import numpy as np

from trajectory_guard.canny.constraint import features
from trajectory_guard.canny.integers import exponent
from trajectory_guard.canny.motion import Motion
from trajectory_guard.canny.polyhedron import ConvexPolyhedron
from trajectory_guard.kernels.canny import (
    CLOSED_FORM,
    course_structure,
    kernel_overlap,
    KernelOverlaps,
    Polyhedron,
    PolyhedronStructure,
)

# Bodies whose features are kept.
REMEMBERED = 1024

EVERYWHERE = (0.0, 1.0)


class FastOverlap(NamedTuple):
    """
    What is known about the overlap of two convex polyhedra on a path.

    :param possible: disjoint closed spans of s, in order; every instant at which the closed bodies
        have a point in common lies in one. Empty: they are certainly apart on the whole path.
    :param certain: the same, but at every instant of them they certainly overlap. Around the
        instants where other features take over there may be gaps of some 1e-15.
    """

    possible: tuple[tuple[float, float], ...]
    certain: tuple[tuple[float, float], ...]


def fast_overlap(
    a: ConvexPolyhedron, motion_a: Motion, b: ConvexPolyhedron, motion_b: Motion
) -> FastOverlap:
    """
    Enclose the spans on which two convex polyhedra overlap.

    :param a: A.
    :param motion_a: path of A.
    :param b: B.
    :param motion_b: path of B.
    """
    found = kernel_answer(a, motion_a, b, motion_b)
    if found is None:
        return FastOverlap((EVERYWHERE,), ())
    return FastOverlap(tuple(found.possible), tuple(found.certain))


def kernel_answer(
    a: ConvexPolyhedron,
    motion_a: Motion,
    b: ConvexPolyhedron,
    motion_b: Motion,
    method: int = CLOSED_FORM,
    times: int = 1,
) -> KernelOverlaps | None:
    """Ask the kernel, see :func:`trajectory_guard.kernels.canny.kernel_overlap`."""
    return kernel_overlap(
        _structure(a),
        course_structure(motion_a.positions, motion_a.quaternions),
        _structure(b),
        course_structure(motion_b.positions, motion_b.quaternions),
        method,
        times,
    )


@functools.lru_cache(maxsize=REMEMBERED)
def _structure(body: ConvexPolyhedron) -> PolyhedronStructure:
    """Return a polyhedron as the kernel takes it, every number rounded once."""
    k = exponent(body.vertices)
    exact = features(body, k)
    edges = [edge for face in body.face_edges for edge in face]
    return Polyhedron(
        body.vertices,
        np.column_stack(
            (
                _rounded([n for n, _ in exact.planes], 2 * k),
                _rounded([[d] for _, d in exact.planes], 3 * k),
            )
        ),
        np.column_stack(
            (
                _rounded([e for e, _ in exact.lines], k),
                _rounded([m for _, m in exact.lines], 2 * k),
            )
        ),
        body.edges,
        np.cumsum([0, *(len(face) for face in body.face_edges)]),
        np.array([edge for edge, _ in edges]),
        np.array([way for _, way in edges]),
    ).structure()


def _rounded(rows: Sequence[Sequence[int]], k: int) -> np.ndarray:
    """Return integers over 2^k; Python rounds the quotient of two integers once."""
    return np.array([[x / (1 << k) for x in row] for row in rows])
