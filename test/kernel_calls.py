"""Kernels that only kernels call, opened to the tests (``kernel_calls.cpp``)."""

import ctypes
from pathlib import Path
from typing import NamedTuple

import numpy as np

from trajectory_guard.kernels import layout
from trajectory_guard.kernels.compiled import load

TERMS = layout.TERMS
POSE = 16
CONTROLS = 13
CONTROL_ROW = 16
POWERS = 16
SEPARATED, OVERLAP, REACHED = range(3)
ROUNDS = 40
RELATIVE = 0.02
LARGEST_ANGLE = 1.5


class Built(NamedTuple):
    """
    The motion of a body on a piece.

    :param matrices: (K, 12) control matrices, rows of [C | t].
    :param weights: (K,) scaled Bernstein weights.
    :param centre: (12,) pose at the piece's centre.
    :param fit: error without tracking and without the rounding of the chain [m].
    :param margin: the rounding of the chain [m].
    :param fuzz: error of the centre pose [m].
    :param kappa: column bound of the control points.
    :param reach: bound on the body's coordinates [m].
    :param depth: rounded transforms between the root and the body.
    :param eps: deviation of the linear part from a rotation.
    :param sound: whether the motion is usable.
    """

    matrices: np.ndarray
    weights: np.ndarray
    centre: np.ndarray
    fit: float
    margin: float
    fuzz: float
    kappa: float
    reach: float
    depth: float
    eps: float
    sound: bool


def call(name, *arguments, returns=ctypes.c_double):
    """Call an exported function; arrays go as pointers, structures by reference."""
    function = load(Path(__file__).with_suffix('.cpp'))[name]
    function.restype = returns
    passed = []
    for x in arguments:
        if isinstance(x, np.ndarray):
            assert x.flags.c_contiguous and x.dtype in (np.float64, np.int64)
            passed.append(ctypes.c_void_p(layout.address(x)))
        elif isinstance(x, ctypes.Structure):
            passed.append(ctypes.byref(x))
        elif x is None:
            passed.append(ctypes.c_void_p(None))
        elif isinstance(x, float):
            passed.append(ctypes.c_double(x))
        else:
            passed.append(ctypes.c_int64(int(x)))
    return function(*passed)


def _floats(x):
    return np.ascontiguousarray(x, float)


def _solids(solids):
    return layout._solids(solids)


def separation(n, points, links, b, obstacles, o, error, kappa, reach, depth=1.0, wanted=1e300):
    """Call the trusted inequality; all vertices are asked."""
    points = _floats(points).reshape(-1, 12)
    return call(
        'call_separation',
        _floats(n),
        points,
        len(points),
        _solids(links),
        b,
        _solids(obstacles),
        o,
        float(error),
        float(depth),
        float(kappa),
        float(reach),
        float(wanted),
    )


def turning(n, m, k, points, links, b, obstacles, o, error, kappa, reach, distance, depth=1.0):
    """Call the inequality of the turning plane n + tau m + tau^2 k on 13 control points."""
    points = _floats(points).reshape(CONTROLS, 12)
    return bool(
        call(
            'call_turning',
            _floats(n),
            _floats(m),
            _floats(k),
            points,
            _solids(links),
            b,
            _solids(obstacles),
            o,
            float(error),
            float(depth),
            float(kappa),
            float(reach),
            float(distance),
            returns=ctypes.c_int64,
        )
    )


def box_distance(x, solids, o=0):
    """Call the distance of a point to a solid's box."""
    return call('call_box_distance', _floats(x), _solids(solids), o)


def gjk(
    first,
    points,
    links,
    obstacles,
    want=0.0,
    stop=False,
    accuracy=1e-9,
    rounds=ROUNDS,
    b=0,
    o=0,
):
    """
    Call the search: under one pose the distance, under several control points a direction.

    :returns: state, direction (3,), its support difference, distance, obstacle point (3,).
    """
    points, out = _floats(points).reshape(-1, 12), np.empty(8)
    state = call(
        'call_gjk',
        _floats(first),
        points,
        len(points),
        _solids(links),
        b,
        _solids(obstacles),
        o,
        float(want),
        stop,
        float(accuracy),
        rounds,
        out,
        returns=ctypes.c_int64,
    )
    return state, out[:3], out[3], out[4], out[5:]


def deepest(pose, links, obstacles, b=0, o=0):
    """
    Call the search for a common point.

    :returns: whether one was found, point (3,), direction (3,), place (3,), depth in the link and
        in the obstacle.
    """
    out = np.empty(11)
    inside = call(
        'call_deepest',
        _floats(pose).reshape(12),
        _solids(links),
        b,
        _solids(obstacles),
        o,
        out,
        returns=ctypes.c_int64,
    )
    return bool(inside), out[:3], out[3:6], out[6:9], out[9], out[10]


def shallow(pose, links, obstacles, normal):
    """
    Call the search for a common point of solids that overlap by little along a normal.

    :returns: whether one was found, point (3,), place (3,), depth in the link and the obstacle.
    """
    out = np.empty(8)
    inside = call(
        'call_shallow',
        _floats(pose).reshape(12),
        _solids(links),
        0,
        _solids(obstacles),
        0,
        _floats(normal),
        out,
        returns=ctypes.c_int64,
    )
    return bool(inside), out[:3], out[3:6], out[6], out[7]


def witness(
    points,
    links,
    obstacles,
    error,
    fuzz=0.0,
    margin=0.0,
    eps=0.0,
    centre=None,
    normal=(0.0, 0.0, 1.0),
    ends=None,
):
    """
    Call the proof of an overlap by a point that moves between two `ends`, or that stands.

    :returns: whether it is proved, place (3,), depth, the point at both ends.
    """
    points, known = _floats(points).reshape(CONTROLS, 12), np.zeros(10)
    centre = points[CONTROLS // 2] if centre is None else _floats(centre).reshape(12)
    y0, y1 = (None, None) if ends is None else map(_floats, ends)
    proved = call(
        'call_witness',
        points,
        float(eps),
        centre,
        _solids(links),
        0,
        _solids(obstacles),
        0,
        float(error),
        float(fuzz),
        float(margin),
        _floats(normal),
        y0,
        y1,
        known,
        returns=ctypes.c_int64,
    )
    return bool(proved), known[:3], known[3], known[4:7], known[7:]


def crossing(mine, theirs):
    """Call the proof that two triangles cross; returns how far they may move, and the place."""
    place = np.zeros(3)
    rim = call('call_crossing', _floats(mine), _floats(theirs), place)
    return rim, place


def contact(pose, links, obstacles):
    """
    Call the search for a contact of a triangle with a triangle or a polytope.

    :returns: how far it may move, not positive if there is none; link point (3,), place (3,).
    """
    out = np.zeros(6)
    slack = call(
        'call_contact', _floats(pose).reshape(12), _solids(links), _solids(obstacles), out
    )
    return slack, out[:3], out[3:]


def depth(solids, x, b=0):
    """Call the depth of a point in what is known to be inside of a solid."""
    return call('call_depth', _solids(solids), b, _floats(x))


def farthest(x, place, points):
    """Call the bound on the distance of a point's control points from a place."""
    points = _floats(points).reshape(-1, 12)
    return call('call_farthest', _floats(x), _floats(place), points, len(points))


def restrict(coefficients, m, h):
    """
    Call the restriction of a polynomial to a piece.

    :returns: coefficients (6,), bound on |q - d_0|, bound on the rounding.
    """
    d, out = np.empty(TERMS), np.empty(2)
    call('call_restrict', _floats(coefficients), float(m), float(h), d, out, returns=None)
    return d, out[0], out[1]


def fit_half_angle(d, span):
    """Call the half-angle fit; returns (4,) scaled coefficients and the bound."""
    u = np.ones(4)
    bound = call('call_fit_half_angle', _floats(d), float(span), u)
    return u, bound


def fit_slide(d):
    """Call the reduction of a slide; returns (4,) scaled coefficients and the bound."""
    u = np.ones(4)
    bound = call('call_fit_slide', _floats(d), u)
    return u, bound


def economise_to_cubic(p):
    """Call the reduction to degree 3; returns what it leaves of (16,) and the bound."""
    p = np.pad(_floats(p), (0, POWERS - len(p)))
    bound = call('call_economise_to_cubic', p, POWERS - 1)
    return p, bound


def factors(kind, u):
    """Call the Bernstein factors of a joint; returns cosine, sine, weight, degree, kappa."""
    cosine, sine, weight, kappa = (np.empty(n) for n in (7, 7, 7, 1))
    degree = call(
        'call_factors', kind, _floats(u), cosine, sine, weight, kappa, returns=ctypes.c_int64
    )
    return cosine, sine, weight, degree, kappa[0]


def fit_rotation(phi, span):
    """Call the polynomial cosine and sine; returns both and delta."""
    cosine, sine = np.empty(TERMS), np.empty(TERMS)
    delta = call('call_fit_rotation', _floats(phi), float(span), cosine, sine)
    return cosine, sine, delta


def fit_rotations(phi, span):
    """Call the same for eight turns at once, (6, 8) and (8,)."""
    cosine, sine, delta = np.empty((TERMS, 8)), np.empty((TERMS, 8)), np.empty(8)
    call('call_fit_rotations', _floats(phi), _floats(span), cosine, sine, delta, returns=None)
    return cosine, sine, delta


def economise(p):
    """Call the folding of a product to degree 5; returns the kept and the dropped."""
    p = _floats(p).copy()
    call('call_economise', p, returns=None)
    return p[:TERMS], p[TERMS:]


def bernstein():
    """Return the (6, 13) Bernstein coefficients of the powers."""
    out = np.empty((TERMS, CONTROL_ROW))
    call('call_bernstein', out, returns=None)
    assert (out[:, CONTROLS:] == out[:, CONTROLS - 1 : CONTROLS]).all()
    return out[:, :CONTROLS]


def lever_arms(packed, travel, b, node):
    """Call the lever arms of a body; returns them and the reach."""
    rho = np.zeros(packed.chain.nodes)
    reach = call('call_lever_arms', packed.chain, _floats(travel), packed.extents, b, node, rho)
    return rho, reach


def chain_margin(depth, kappa, reach):
    """Call the rounding of a control point."""
    return call('call_chain_margin', float(depth), float(kappa), float(reach))


def plane_margin(kappa, reach, obstacle):
    """Call the rounding of the separating inequality."""
    return call('call_plane_margin', float(kappa), float(reach), float(obstacle))


def sphere_margin(reach, obstacle):
    """Call the rounding of sphere against box."""
    return call('call_sphere_margin', float(reach), float(obstacle))


def scan(links, b, packed, clearance, place, reach, slack=0.0, sweep=0.0, fuzz=0.0):
    """Call the scan of all boxes; returns the obstacles that stay open, sorted."""
    out = np.empty(packed.obstacles.count, np.int64)
    count = call(
        'call_scan',
        _solids(links),
        b,
        packed.boxes,
        float(clearance),
        _floats(place),
        float(reach),
        float(slack),
        float(sweep),
        float(fuzz),
        out,
        returns=ctypes.c_int64,
    )
    return np.sort(out[:count])


def motion(packed, path, body, segment, numerator, level, rational):
    """Build a motion and say what its error is made of."""
    room = 6 * packed.chain.nodes + CONTROLS
    matrices, weights = np.empty((room, 12)), np.empty(room)
    centre, lengths = np.empty(12), np.zeros(7)
    structure = layout.path_structure(path)
    count = call(
        'call_motion',
        packed.chain,
        packed.links,
        structure,
        packed.extents,
        body,
        layout.Piece(segment, numerator, level),
        rational,
        matrices,
        weights,
        centre,
        lengths,
        returns=ctypes.c_int64,
    )
    fit, kappa, reach, depth_, fuzz, eps, sound = lengths
    return Built(
        matrices[:count],
        weights[:count],
        centre,
        fit,
        chain_margin(depth_, kappa, reach),
        fuzz,
        kappa,
        reach,
        depth_,
        eps,
        bool(sound),
    )


def layout_values():
    """Return what the headers say, by name."""
    text = ctypes.create_string_buffer(1 << 14)
    used = load(Path(__file__).with_suffix('.cpp')).call_layout(text, ctypes.c_int64(len(text)))
    assert 0 < used < len(text)
    rows = (line.rsplit(' ', 1) for line in text.value.decode().splitlines())
    return {
        name.removeprefix('guard::').replace('.turn.', '.'): int(value) for name, value in rows
    }
