"""The rational motion of a link on a piece of time, with a certified error."""

from dataclasses import dataclass
from enum import IntEnum
import math

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.joint_path import JointPath
from trajectory_guard.kernels import layout
from trajectory_guard.kernels.link_motion import link_motion
from trajectory_guard.request import check_joints, motion_path, refusal
from trajectory_guard.workcell import Workcell


class Builder(IntEnum):
    """How a motion is built: exact rational curves, or polynomials economised along the chain."""

    RATIONAL = layout.RATIONAL
    ECONOMISED = layout.ECONOMISED


@dataclass(frozen=True, slots=True, eq=False)
class RationalMotion:
    """
    A curve of affine displacements, degree K - 1 in tau in [-1, 1].

    The image of a point x at tau lies within ``error`` of ``pose(tau)`` applied to x, for every x
    of the core (vertices and disc) of the body the motion was built for; its ball looks the same
    from every side. With the joints off by their tracking tolerance it is ``error + inflation``.
    All weights are positive, so it also lies that close to the convex hull of the control points
    applied to x [Schroecker & Weber 2014, sec. 5].

    :param control_points: (K, 3, 4) poses of the body's node frame in the root frame [m].
    :param weights: (K,) positive Bernstein weights, binomials included.
    :param error: bound on the distance to the true motion, rounding included [m].
    :param inflation: what the tracking tolerance adds [m].
    :param sweep: bound on the displacement of the body's points from the piece's centre [m].
    """

    control_points: np.ndarray
    weights: np.ndarray
    error: float
    inflation: float
    sweep: float

    def pose(self, tau: float) -> np.ndarray:
        """
        Evaluate the motion, to rounding.

        :param tau: place in the piece, [-1, 1].
        :returns: (3, 4) pose of the node frame in the root frame.
        """
        degree = len(self.weights) - 1
        s = 0.5 * (1.0 + tau)
        i = np.arange(degree + 1)
        basis = self.weights * s**i * (1.0 - s) ** (degree - i)
        return np.einsum('i,irc->rc', basis, self.control_points) / basis.sum()


def rational_motion(
    workcell: Workcell,
    path: JointPath,
    body: int,
    segment: int,
    numerator: int = 0,
    level: int = 0,
    slack: np.ndarray | None = None,
    builder: Builder = Builder.RATIONAL,
) -> RationalMotion:
    """
    Build the rational motion of a body on [numerator, numerator + 1] / 2^level of a segment.

    :param workcell: robot and scene.
    :param path: the joint path.
    :param body: index into ``workcell.link_names``; the body must hang on a movable joint.
    :param segment: index of the path's segment.
    :param numerator: dyadic place of the piece.
    :param level: its power of two.
    :param slack: (n,) tracking tolerance per movable joint; none if None.
    :param builder: how; an economised motion is a polynomial, its weights are the binomials.
    :raises RequestError: the path is another robot's, the piece does not exist, the body does not
        move, or the joints turn too far in the piece for positive weights.
    """
    if not (0 <= segment < len(path.coefficients) and 0 <= numerator < 2**level <= 2**48):
        raise RequestError(
            Reason.INVALID_PARAMETER, f'no piece {numerator}/2^{level} of segment {segment}'
        )
    if not (0 <= body < len(workcell.link_names) and workcell.link_nodes[body] >= 0):
        raise RequestError(Reason.INVALID_PARAMETER, f'body {body} hangs on no movable joint')
    check_joints(workcell.robot.movable, path)
    slack = np.zeros(len(path.joint_names)) if slack is None else slack
    motion = motion_path(workcell, path, slack)
    try:
        matrices, weights, error, inflation, sweep, sound = link_motion(
            workcell.packed, motion, body, segment, numerator, level, int(builder)
        )
    except layout.KernelRefused as refused:
        raise refusal(path, slack) or refused from refused
    if not (sound and math.isfinite(error)):
        raise RequestError(
            Reason.INVALID_PARAMETER, f'piece {numerator}/2^{level} turns too far for one motion'
        )
    for array in (matrices, weights):
        array.setflags(write=False)
    return RationalMotion(matrices.reshape(-1, 3, 4), weights, error, inflation, sweep)
