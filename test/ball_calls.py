"""Kernels of the ball cover that only kernels call, opened to the tests (``ball_calls.cpp``)."""

import ctypes
from pathlib import Path

import numpy as np

from trajectory_guard.kernels import ball
from trajectory_guard.kernels.compiled import load
from trajectory_guard.kernels.layout import address


def _call(name, *arguments, returns=ctypes.c_int64):
    function = load(Path(__file__).with_suffix('.cpp'))[name]
    function.restype = returns
    return function(*arguments)


def _array(x):
    return ctypes.c_void_p(address(x))


def lower_bound(z, q, lam, c, triangle, spread=1.0):
    """Return the bound, where the least value is thought to be, and `size`; z, q are (3, 3)."""
    z, q = (np.ascontiguousarray(x, float) for x in (z, q))
    out = np.zeros(3)
    numbers = [ctypes.c_double(x) for x in (lam, spread, c)]
    numbers.append(ctypes.c_int64(triangle))
    bound = _call(
        'call_lower_bound', _array(z), _array(q), *numbers, _array(out), returns=ctypes.c_double
    )
    return bound, out[:2], out[2]


def apart(moving, fixed, turned, radius, far, thickness, between=0.0):
    """Say whether the first faces of two packed surfaces are proved apart, and what was open."""
    kind = np.zeros(1, np.int64)
    numbers = [ctypes.c_double(x) for x in (radius, far, thickness, between)]
    surfaces = [ctypes.byref(ball._surface(s)) for s in (moving, fixed)]
    turned = np.ascontiguousarray(turned, float)
    done = _call('call_apart', *surfaces, _array(turned), *numbers, _array(kind))
    return bool(done), int(kind[0])


def radius(metric, curve):
    """Return radius, its two parts, and centre of the ball round a curve, in one distribution."""
    centre, parts = np.zeros(12), np.zeros(2)
    structures = ctypes.byref(ball._metric(metric)), ctypes.byref(ball._curve(curve))
    found = _call(
        'call_radius', *structures, _array(centre), _array(parts), returns=ctypes.c_double
    )
    return found, parts, centre.reshape(3, 4)


def rate(whole, shift, turn, far, adapted):
    """Return radius, spread and uncertainty of the distribution that a ball is given."""
    out = np.zeros(3)
    numbers = [ctypes.c_double(x) for x in (whole, shift, turn, far)]
    _call('call_rate', *numbers, ctypes.c_int64(adapted), _array(out))
    return out


def piece(curve, numerator, level):
    """Return the homogeneous control points of a piece, (K, 13)."""
    out = np.zeros((len(curve.weights), 13))
    numbers = ctypes.c_int64(numerator), ctypes.c_int64(level)
    _call('call_piece', ctypes.byref(ball._curve(curve)), *numbers, _array(out))
    return out
