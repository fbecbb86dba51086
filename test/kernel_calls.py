"""Kernels that only kernels call, opened to the tests."""

from trajectory_guard.kernels import chain as chain_kernels
from trajectory_guard.kernels import deepest as deepest_kernels
from trajectory_guard.kernels import economised as economised_kernels
from trajectory_guard.kernels import gjk as gjk_kernels
from trajectory_guard.kernels import piece as piece_kernels
from trajectory_guard.kernels import separation as separation_kernels
from trajectory_guard.kernels.jit import entry

_separation = separation_kernels.separation
_box_distance = separation_kernels.box_distance
_gjk = gjk_kernels.gjk
_deepest = deepest_kernels.deepest
_depth = deepest_kernels.depth
_restrict = piece_kernels.restrict
_fit_half_angle = piece_kernels.fit_half_angle
_fit_slide = piece_kernels.fit_slide
_factors = chain_kernels.factors
_fit_rotation = economised_kernels.fit_rotation
_economised = economised_kernels.economised


@entry
def separation(nx, ny, nz, points, node, count, links, b, obstacles, o, error, kappa, reach):
    """Call the trusted inequality with one joint in the chain."""
    return _separation(
        nx, ny, nz, points, node, count, links, b, obstacles, o, error, 1.0, kappa, reach
    )


@entry
def box_distance(x, y, z, solids, o):
    """Call the distance of a point to a solid's box."""
    return _box_distance(x, y, z, solids, o)


@entry
def gjk(n, points, count, links, b, obstacles, o, want, stop, accuracy, rounds, s, w, out):
    """Call the search for a direction."""
    return _gjk(
        n[0],
        n[1],
        n[2],
        points,
        0,
        count,
        links,
        b,
        obstacles,
        o,
        want,
        stop,
        accuracy,
        rounds,
        s,
        w,
        out,
    )


@entry
def deepest(pose, links, b, obstacles, o, scratch, out):
    """Call the search for a common point."""
    return _deepest(pose, 0, links, b, obstacles, o, *scratch, out)


@entry
def depth(faces, x, y, z):
    """Call the depth of a point in a polytope."""
    return _depth(faces, 0, len(faces), x, y, z)


@entry
def restrict(coefficients, m, h, d):
    """Call the restriction of a polynomial to a piece."""
    return _restrict(coefficients, 0, 0, m, h, d)


@entry
def fit_half_angle(d, span, p, controls):
    """Call the half-angle fit."""
    return _fit_half_angle(d, 0, span, p, controls)


@entry
def fit_slide(d, p, controls):
    """Call the reduction of a slide."""
    return _fit_slide(d, 0, p, controls)


@entry
def factors(kind, u, cosine, sine, weight):
    """Call the Bernstein factors of a joint."""
    return _factors(kind, u, 0, cosine, sine, weight)


@entry
def fit_rotation(phi, span):
    """Call the polynomial cosine and sine."""
    return _fit_rotation(phi, span)


@entry
def economised(p):
    """Call the folding of a product to degree 5."""
    return _economised(p)
