"""Cover a path, as Python calls it; see ``cover.hpp``."""

from collections.abc import Sequence
import ctypes
from typing import NamedTuple

import numpy as np

from trajectory_guard.kernels.compiled import library
from trajectory_guard.kernels.layout import (
    address,
    Answer,
    check,
    ENTRY,
    KernelRefused,
    LEAF,
    OPENED,
    Packed,
    Path,
    path_structure,
    PathStructure,
    PIECE,
    Request,
    WANTED,
)


class Covered(NamedTuple):
    """
    What a cover found.

    :param leaves: (L,) LEAF in time order.
    :param pieces: motion pieces examined.
    :param seconds: wall-clock time in the kernels [s].
    :param entries: (E,) ENTRY, which inequality closed which pair; empty if not asked for.
    :param proved_on: (K,) PIECE that the entries speak of.
    :param opened: (P,) OPENED, pairs replaced by pairs of parts on pieces.
    :param wanted: (W,) WANTED, solids whose parts should be built, some more than once.
    """

    leaves: np.ndarray
    pieces: int
    seconds: float
    entries: np.ndarray
    proved_on: np.ndarray
    opened: np.ndarray
    wanted: np.ndarray


class Question(NamedTuple):
    """
    One path to cover.

    :param path: the joint path.
    :param bodies: (M,) int64 bodies to check against every obstacle; each hangs on a node.
    """

    path: Path
    bodies: np.ndarray


def cover(
    packed: Packed,
    path: Path,
    bodies: np.ndarray,
    tolerance: float,
    clearance: float,
    max_pieces: int,
    scope: int,
    want_proof: bool,
    stop: np.ndarray,
    *,
    sharpen: bool = False,
) -> Covered:
    """
    Cover all segments of one path; see :func:`cover_all`.

    :raises KernelRefused: the path is out of range.
    """
    (covered,) = cover_all(
        packed,
        [Question(path, bodies)],
        tolerance,
        clearance,
        max_pieces,
        scope,
        want_proof,
        stop,
        sharpen=sharpen,
    )
    if covered is None:
        raise KernelRefused
    return covered


def cover_all(
    packed: Packed,
    questions: Sequence[Question],
    tolerance: float,
    clearance: float,
    max_pieces: int,
    scope: int,
    want_proof: bool,
    stop: np.ndarray,
    *,
    sharpen: bool = False,
) -> list[Covered | None]:
    """
    Cover all segments of several paths in one call, without the interpreter's lock.

    :param packed: robot and scene.
    :param questions: what to cover.
    :param tolerance: gaps above it must be decided [m].
    :param clearance: distance that must be exceeded [m].
    :param max_pieces: pieces of a path to examine before its rest is given up as suspect.
    :param scope: a `settings.Scope`.
    :param want_proof: whether to write down what closed each pair.
    :param stop: (1,) int64; another thread sets it non-zero to have the rest given up.
    :param sharpen: whether to look closer at what is suspect, if no proof is wanted.
    :returns: what was found of each path; None if it is out of range.
    :raises MemoryError: there is not enough.
    """
    count = len(questions)
    paths = (PathStructure * count)(*(path_structure(path) for path, _ in questions))
    limits = (tolerance, clearance, max_pieces, scope, want_proof, sharpen)
    requests = (Request * count)(
        *(Request(*limits, address(bodies), len(bodies)) for _, bodies in questions)
    )
    answers = (Answer * count)()
    status = library().guard_cover(
        ctypes.byref(packed.chain),
        ctypes.byref(packed.links),
        ctypes.byref(packed.obstacles),
        ctypes.byref(packed.boxes),
        ctypes.byref(packed.extents),
        ctypes.c_int64(count),
        paths,
        requests,
        ctypes.c_void_p(address(stop)),
        answers,
    )
    check(status)
    return [
        None
        if answer.leaf_count < 0
        else Covered(
            _copied(answer.leaves, answer.leaf_count, LEAF),
            answer.pieces,
            answer.seconds,
            _copied(answer.entries, answer.entry_count, ENTRY),
            _copied(answer.proved_on, answer.piece_count, PIECE),
            _copied(answer.opened, answer.opened_count, OPENED),
            _copied(answer.wanted, answer.wanted_count, WANTED),
        )
        for answer in answers
    ]


def _copied(pointer: int | None, count: int, dtype: np.dtype) -> np.ndarray:
    """Return a copy of what the kernels will overwrite with the next answers of this thread."""
    if not (pointer and count):
        return np.empty(0, dtype)
    return np.frombuffer(ctypes.string_at(pointer, count * dtype.itemsize), dtype)
