"""Pairs that no joint of a request moves: which touch where they stand (for a warning)."""

import ctypes

import numpy as np

from trajectory_guard.kernels.compiled import library
from trajectory_guard.kernels.layout import address, check, Packed, Path, path_structure


def touching(packed: Packed, path: Path, pairs: np.ndarray) -> np.ndarray:
    """
    Say which pairs touch at the path's first instant.

    :param packed: robot and scene.
    :param path: the joint path.
    :param pairs: (Q, 2) int64: body and obstacle.
    :returns: (Q,) bool.
    :raises MemoryError: there is not enough.
    """
    touch = np.zeros(len(pairs), np.bool_)
    status = library().guard_touching(
        ctypes.byref(packed.chain),
        ctypes.byref(packed.links),
        ctypes.byref(packed.obstacles),
        ctypes.byref(path_structure(path)),
        ctypes.c_void_p(address(pairs)),
        ctypes.c_int64(len(pairs)),
        ctypes.c_void_p(address(touch)),
    )
    check(status)
    return touch
