"""Two polyhedra, prepared for any number of motions of one of them."""

from dataclasses import dataclass

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.kernels.ball import Packed
from trajectory_guard.shapes.polyhedron import Polyhedron
from trajectory_guard.toleranced.containment import Probe, probe
from trajectory_guard.toleranced.face_moments import given_moments
from trajectory_guard.toleranced.node_metric import node_metric
from trajectory_guard.toleranced.surface import surface


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """
    A moving and a fixed polyhedron.

    :param moving: in its own frame.
    :param fixed: in the frame of the motions' images.
    :param packed: both as the kernels take them, and the metric of the moving one.
    :param probes: both, to see whether one is inside the other.
    """

    moving: Polyhedron
    fixed: Polyhedron
    packed: Packed
    probes: tuple[Probe, Probe]


def pair_of(
    moving: Polyhedron,
    fixed: Polyhedron,
    *,
    individual: bool = True,
    moments: np.ndarray | None = None,
    solids: np.ndarray | None = None,
) -> Pair:
    """
    Prepare two polyhedra.

    :param moving: in its own frame.
    :param fixed: in the frame of the motions' images.
    :param individual: each moving face has its own mass distribution, equal masses at its corners
        and over its barycentre; or all have the sum of these.
    :param moments: (4, 4) matrix G = sum of w_i [m_i; 1] [m_i; 1]^T of the distribution for all
        [m^2].
    :param solids: (F,) int, which of several solids each fixed face bounds; they may overlap, but
        share no vertex. One if None.
    :raises RequestError: moments is not a finite (4, 4) matrix of positive mass, or given for
        individual distributions; solids has another shape or a vertex in common.
    """
    whole = None
    if moments is not None:
        G = np.asarray(moments, dtype=np.float64)
        if individual:
            raise _invalid('moments are for one distribution, not for individual ones')
        if G.shape != (4, 4) or not np.isfinite(G).all() or not G[3, 3] > 0.0:
            raise _invalid(f'moments must be (4, 4), finite, of positive mass, got {G.tolist()}')
        with np.errstate(over='ignore', invalid='ignore'):
            whole = given_moments(G)
        if not (np.isfinite(whole.barycentre).all() and np.isfinite(whole.inertia).all()):
            raise _invalid(f'moments over their mass are not finite: {G.tolist()}')
    if solids is not None:
        _check_solids(fixed, solids)
    own = surface(moving)
    metric = node_metric(own, individual, whole)
    probes = probe(moving), probe(fixed, solids)
    return Pair(moving, fixed, Packed(own, surface(fixed), metric), probes)


def _check_solids(fixed: Polyhedron, solids: np.ndarray) -> None:
    """Solids without a common vertex are closed if all together are."""
    count = len(fixed.faces)
    if solids.shape != (count,) or solids.dtype.kind not in 'iu':
        raise _invalid(
            f'solids must be integers of shape ({count},), got {solids.dtype} {solids.shape}'
        )
    corners = fixed.triangles.ravel()
    owner = np.repeat(solids[fixed.triangle_face], 3)
    one = np.empty(len(fixed.vertices), owner.dtype)
    one[corners] = owner
    wrong = one[corners] != owner
    if wrong.any():
        raise _invalid(f'solids have vertex {corners[wrong.argmax()]} in common')


def _invalid(message: str) -> RequestError:
    return RequestError(Reason.INVALID_PARAMETER, message)
