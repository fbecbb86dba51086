r"""
How far the tracking tolerance can carry a body off its nominal motion.

If joint j is off by e, a point at distance r from its axis moves by the chord, at most
min(|e|, 2) r; one joint after the other, from the root outward,

    |x(q + e) - x(q)| <= sum_j min(|e_j|, 2) rho_j(x)        (|e_j| for a slide),

rho_j(x) a bound on the distance of x to the axis of j wherever the joints beyond j are: that of
the next joint's origin to the axis of j, and from there on the lengths of all offsets and slides.
"""

from collections.abc import Mapping
from typing import NamedTuple

from flint import arb, arb_mat

from trajectory_guard.cell.robot import Joint, JointType
from trajectory_guard.shapes.body import ConvexBody
from trajectory_guard.verify.motion import Arm, Piece
from trajectory_guard.verify.vector import largest, length


class _Step(NamedTuple):
    """
    A movable joint on the way from a body to the root.

    :param far: distance of what hangs below, at the joint below, to this joint's origin [m].
    :param side: the same to its axis [m].
    """

    joint: Joint
    far: arb
    side: arb


class Levers:
    """
    The way from a body to the root.

    :param arm: the robot.
    :param link: link of the body.
    :param body: the body in that link's frame.
    """

    def __init__(self, arm: Arm, link: str, body: ConvexBody) -> None:
        self.steps: list[_Step] = []
        points = arb_mat(body.vertices.T.tolist())
        # Only the core, points and disc: a ball turned about its centre is the same ball.
        extra = arb(body.disc_radius)
        while link != arm.root:
            joint = arm.above[link]
            if joint.type is not JointType.FIXED:
                a = arm.axis[joint.name]
                along = a * (a.transpose() * points)
                far, side = _longest(points), _longest(points - along)
                self.steps.append(_Step(joint, far + extra, side + extra))
                points, extra = arb_mat(3, 1, [0, 0, 0]), arb(0)
            R, t = arm.rotation[joint.name], arm.origin[joint.name]
            points = R * points + t * arb_mat(1, points.ncols(), [1] * points.ncols())
            link = joint.parent

    def slack(self, piece: Piece, tolerance: Mapping[str, arb]) -> arb:
        """
        Return how far a point of the body can be off during a piece [m].

        :param tolerance: per movable joint [rad or m].
        """
        total, below = arb(0), arb(0)
        for joint, far, side in self.steps:
            if joint.type is JointType.PRISMATIC:
                total += tolerance[joint.name]
                below += far + (piece.largest(joint.name) + tolerance[joint.name]).upper()
            else:
                total += min(tolerance[joint.name], arb(2), key=float) * (below + side)
                below += far
        return total.upper()


def _longest(columns: arb_mat) -> arb:
    """Return an upper bound of the lengths of the columns of a matrix."""
    return largest([length(column) for column in columns.transpose().tolist()])
