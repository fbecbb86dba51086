"""
All link motions on one piece: poses at its centre, control points, errors (trusted).

One value serves every pair of the piece; nothing is computed for links that no open pair needs.
"""

import math
from typing import NamedTuple

import numpy as np

from trajectory_guard.kernels.chain import (
    divide,
    extend,
    place,
    POSE,
    PRISMATIC,
    turn,
)
from trajectory_guard.kernels.economised import (
    control_points,
    CONTROLS,
    extend_economised,
)
from trajectory_guard.kernels.jit import kernel
from trajectory_guard.kernels.margin import chain_margin, UP
from trajectory_guard.kernels.piece import (
    FIT,
    fit_half_angle,
    fit_slide,
    POWERS,
    restrict,
    TERMS,
)

LARGEST_DEGREE = 2 * FIT  # of one joint
FROZEN = 2.0  # no turn moves a point by more than twice its distance from the axis

# How the motion of a piece is built.
RATIONAL = 0  # exact rational curves: audits, free bodies
ECONOMISED = 1  # polynomials of degree 5: fast


class Path(NamedTuple):
    """
    The joint path of a request, joints in node order.

    coefficients (S, n, 6): power basis in s on [0, 1] of each segment [rad or m].
    rounding (S, n): bound on the error of the coefficients together [rad or m].
    moving (n,) bool: joints with any coefficient beyond the constant; the others must have none.
    slack (n,): tracking tolerance [rad or m].
    rho (B, n), reach (B,): lever arms of every body, see ``reach``.
    """

    coefficients: np.ndarray
    rounding: np.ndarray
    moving: np.ndarray
    slack: np.ndarray
    rho: np.ndarray
    reach: np.ndarray


class Enclosure(NamedTuple):
    """
    Working arrays of one piece.

    d (n, 6), span (n,), fuzz (n,): polynomial in tau, bound on |q - d_0|, rounding of q.
    fitted (n, 4), fit (n,): scaled coefficients of the joint's motion and its error.
    local, pose (n, 1, 12): poses at the centre, in the parent's and in the root frame.
    controls (n, K, 13), points (n, K, 12): control matrices, and the same over their weights.
    number (n,), kappa (n,), sound (n,): their number, column bound, and whether they are usable.
    weights (n, K): scaled Bernstein weights of the control points.
    needed (n,) bool: nodes with an open pair at or beyond them.
    power (16,), cosine, sine, weight (7,), scratch (K, 13): scratch.
    powers (n, 12, 6), eps (n,), size (n,): polynomial poses, see ``economised``; column (12, 6):
    its scratch.
    """

    d: np.ndarray
    span: np.ndarray
    fuzz: np.ndarray
    fitted: np.ndarray
    fit: np.ndarray
    local: np.ndarray
    pose: np.ndarray
    controls: np.ndarray
    points: np.ndarray
    number: np.ndarray
    kappa: np.ndarray
    sound: np.ndarray
    weights: np.ndarray
    needed: np.ndarray
    power: np.ndarray
    cosine: np.ndarray
    sine: np.ndarray
    weight: np.ndarray
    scratch: np.ndarray
    powers: np.ndarray
    eps: np.ndarray
    size: np.ndarray
    column: np.ndarray


@kernel
def enclosure(nodes, longest, builder):
    """
    Allocate the working arrays.

    :param nodes: number of nodes.
    :param longest: largest number of moving joints between the root and a node.
    :param builder: RATIONAL or ECONOMISED.
    """
    most = LARGEST_DEGREE * longest + 1 if builder == RATIONAL else 1
    shown = most if builder == RATIONAL else CONTROLS
    width = LARGEST_DEGREE + 1
    return Enclosure(
        np.empty((nodes, TERMS)),
        np.zeros(nodes),
        np.zeros(nodes),
        np.zeros((nodes, FIT + 1)),
        np.zeros(nodes),
        np.empty((nodes, 1, POSE)),
        np.empty((nodes, 1, POSE)),
        np.empty((nodes, most, POSE + 1)),
        np.empty((nodes, shown, POSE)),
        np.zeros(nodes, np.int64),
        np.ones(nodes),
        np.zeros(nodes, np.bool_),
        np.empty((nodes, shown)),
        np.zeros(nodes, np.bool_),
        np.empty(POWERS),
        np.empty(width),
        np.empty(width),
        np.empty(width),
        np.empty((most, POSE + 1)),
        np.empty((nodes, POSE, TERMS)),
        np.zeros(nodes),
        np.ones(nodes),
        np.empty((POSE, TERMS)),
    )


@kernel
def centre(chain, path, segment, m, h, e):
    """
    Fill polynomials and the poses at the centre of the piece s = m + h tau, for needed nodes.

    :param chain: :class:`~trajectory_guard.kernels.chain.Chain`.
    :param path: :class:`Path`.
    :param e: :class:`Enclosure`, in/out.
    """
    for j in range(len(chain.parent)):
        if e.needed[j]:
            span, fuzz = restrict(path.coefficients, segment, j, m, h, e.d)
            e.span[j] = span
            e.fuzz[j] = fuzz + path.rounding[segment, j]
            turn(chain, j, e.d[j, 0], e.local)
            place(chain, j, e.local, e.pose)


@kernel
def fit(chain, e, builder):
    """Fit the motion of every needed joint and its error per lever arm."""
    for j in range(len(chain.parent)):
        if e.needed[j]:
            if builder == ECONOMISED:
                extend_economised(
                    chain,
                    j,
                    e.span,
                    e.d,
                    e.local,
                    e.powers,
                    e.fit,
                    e.eps,
                    e.size,
                    e.kappa,
                    e.column,
                )
            elif e.span[j] == 0.0:
                e.fit[j] = 0.0
            elif chain.kind[j] == PRISMATIC:
                e.fit[j] = fit_slide(e.d, j, e.power, e.fitted)
            else:
                e.fit[j] = min(fit_half_angle(e.d, j, e.span[j], e.power, e.fitted), FROZEN)


@kernel
def build(chain, e, builder):
    """Write the control points of every needed node."""
    for j in range(len(chain.parent)):
        if not e.needed[j]:
            continue
        if builder == ECONOMISED:
            e.number[j] = CONTROLS
            e.sound[j] = control_points(j, e.powers, e.points, e.weights)
        else:
            extend(
                chain,
                j,
                e.span[j] != 0.0,
                e.fitted,
                e.local,
                e.controls,
                e.number,
                e.kappa,
                e.scratch,
                e.cosine,
                e.sine,
                e.weight,
            )
            e.sound[j] = divide(j, e.controls, e.number, e.points, e.weights)
        e.sound[j] = e.sound[j] and e.kappa[j] < math.inf


@kernel
def displacement(chain, path, b, node, e):
    """
    Bound how far a body can be from where its enclosures put it; see ``reach``.

    :param b: body.
    :param node: its node.
    :returns: four lengths [m]: largest displacement from the centre pose over the piece; the same
        without the chord's cap (linear in the piece's length); error of the centre pose; tracking
        inflation.
    """
    sweep = 0.0
    linear = 0.0
    fuzz = 0.0
    slack = 0.0
    j = node
    while j >= 0:
        rho = path.rho[b, j]
        linear += e.span[j] * rho
        fuzz += e.fuzz[j] * rho
        if chain.kind[j] == PRISMATIC:
            sweep += e.span[j] * rho
            slack += path.slack[j] * rho
        else:
            sweep += min(e.span[j], FROZEN) * rho
            slack += min(path.slack[j], FROZEN) * rho
        j = chain.parent[j]
    fuzz += chain_margin(float(chain.depth[node]), 1.0, path.reach[b])
    return sweep * UP, linear * UP, fuzz * UP, slack * UP


@kernel
def fit_error(chain, path, b, node, e):
    """
    Bound the distance between a body's true motion and the built one.

    :returns: the bound without tracking and without the rounding of the control points [m].
    """
    total = 0.0
    j = node
    while j >= 0:
        total += (e.fit[j] + e.fuzz[j]) * path.rho[b, j]
        j = chain.parent[j]
    return total * UP
