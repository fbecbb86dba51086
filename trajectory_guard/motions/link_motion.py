"""The rational motion of a robot's link on a piece of time, with a certified error."""

from enum import IntEnum
import math

import numpy as np

from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.kernels import layout
from trajectory_guard.kernels.link_motion import link_motion
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.joint_path import JointPath
from trajectory_guard.request import check_joints, motion_path, refusal

_UNIT = 2.0**-53


class Builder(IntEnum):
    """How a motion is built: exact rational curves, or polynomials economised along the chain."""

    RATIONAL = layout.RATIONAL
    ECONOMISED = layout.ECONOMISED


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

    It is the motion of the body's node frame in the root frame, and its error bounds every point
    of the body's core (vertices and disc); the body's ball looks the same from every side.

    :param workcell: robot and scene.
    :param path: the joint path.
    :param body: index into ``workcell.link_names``; the body must hang on a movable joint.
    :param segment: index of the path's segment.
    :param numerator: dyadic place of the piece.
    :param level: its power of two.
    :param slack: (n,) tracking tolerance per movable joint; none if None.
    :param builder: how; an economised motion is a polynomial, its weights are 1.
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
        matrices, scaled, error, inflation, sweep, sound = link_motion(
            workcell.packed, motion, body, segment, numerator, level, int(builder)
        )
    except layout.KernelRefused as refused:
        raise refusal(path, slack) or refused from refused
    if not (sound and math.isfinite(error)):
        raise RequestError(
            Reason.INVALID_PARAMETER, f'piece {numerator}/2^{level} turns too far for one motion'
        )
    points = matrices.reshape(-1, 3, 4)
    weights = scaled / _binomials(len(scaled) - 1)
    if builder is Builder.RATIONAL:
        error += _division_error(points, float(workcell.links.size[body, layout.FAR]))
    return RationalMotion(points, weights, error, inflation, sweep)


def _binomials(degree: int) -> np.ndarray:
    # Exact up to degree 56; the kernels' is at most 6 a joint. Beyond, they are one rounding off.
    return np.array([float(math.comb(degree, i)) for i in range(degree + 1)])


def _division_error(points: np.ndarray, far: float) -> float:
    """
    Bound what rounding the Bernstein weights does to a point at most ``far`` from the node [m].

    With weights off by a factor 1 + e_i, |e_i| <= 2 u (the binomial, the division), the curve's
    point is off by |sum l_i e_i (P_i x - p)| / |sum l_i (1 + e_i)|, where l_i >= 0 sum to 1 and p
    is the curve's point: at most 2 u / (1 - 2 u) times the diameter of the points P_i x, which is
    at most twice the largest |P_i x - P_0 x|. So 4 u; 8 u covers the rounding of this bound.
    """
    off = points - points[0]
    turned = np.sqrt((off[:, :, :3] ** 2).sum(axis=(1, 2))) * far
    moved = np.sqrt((off[:, :, 3] ** 2).sum(axis=1))
    return 8.0 * _UNIT * float((turned + moved).max())
