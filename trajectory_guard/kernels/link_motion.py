"""One body on one piece, for those who want to look at a motion rather than certify it."""

import ctypes

import numpy as np

from trajectory_guard.kernels.compiled import library
from trajectory_guard.kernels.layout import (
    address,
    check,
    Packed,
    Path,
    path_structure,
    Piece,
    RATIONAL,
)

_FIT_DEGREE = 6  # of a joint's rational motion
_CONTROLS = 13  # of an economised motion


def link_motion(
    packed: Packed, path: Path, body: int, segment: int, numerator: int, level: int, builder: int
) -> tuple[np.ndarray, np.ndarray, float, float, float, bool]:
    """
    Build the motion of one body on [numerator, numerator + 1] / 2^level of a segment.

    :param packed: robot and scene.
    :param path: the joint path.
    :param body: index of the body; it must hang on a node.
    :param builder: RATIONAL or ECONOMISED.
    :returns: control matrices (K, 12), scaled weights (K,), error of the motion without tracking,
        what tracking adds, largest displacement from the centre [m], and whether it is usable.
    :raises MemoryError: there is not enough.
    """
    joints = path.coefficients.shape[1]
    most = _FIT_DEGREE * joints + 1 if builder == RATIONAL else _CONTROLS
    matrices = np.empty((most, 12))
    weights = np.empty(most)
    lengths = np.zeros(4)
    count = ctypes.c_int64()
    status = library().guard_link_motion(
        ctypes.byref(packed.chain),
        ctypes.byref(packed.links),
        ctypes.byref(path_structure(path)),
        ctypes.byref(packed.extents),
        ctypes.c_int64(body),
        ctypes.byref(Piece(segment, numerator, level)),
        ctypes.c_int64(builder),
        ctypes.c_int64(most),
        ctypes.c_void_p(address(matrices)),
        ctypes.c_void_p(address(weights)),
        ctypes.c_void_p(address(lengths)),
        ctypes.byref(count),
    )
    check(status)
    error, slack, sweep, sound = lengths.tolist()
    k = count.value
    return matrices[:k].copy(), weights[:k].copy(), error, slack, sweep, bool(sound)
