"""Where a link is during a piece of time: its pose as polynomials in tau in [-1, 1]."""

import functools
from typing import Any

from flint import arb, arb_mat, arb_poly, fmpq

from trajectory_guard.cell.robot import Joint, JointType, Robot
from trajectory_guard.verify.curve import Curve
from trajectory_guard.verify.series import ANY, bernstein, cos_sin, DEGREE, shortened

# See `Joint`: its floats are this close to the exact rotation and axis.
_ROTATION_ERROR = arb(fmpq(16, 2**53))
_AXIS_ERROR = arb(fmpq(8, 2**53))

Pose = list[list[arb_poly]]


class Arm:
    """
    The constant part of a robot in balls.

    :param robot: the robot.
    """

    def __init__(self, robot: Robot) -> None:
        self.root = robot.root
        self.above = {joint.child: joint for joint in robot.joints}
        one = arb_mat(3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1])
        self.rotation, self.origin, self.axis, self.turning = {}, {}, {}, {}
        for joint in robot.joints:
            T = joint.T_parent_joint.tolist()
            R = arb_mat(3, 3, [arb(x, _ROTATION_ERROR) for row in T[:3] for x in row[:3]])
            x, y, z = (arb(value, _AXIS_ERROR) for value in joint.axis.tolist())
            a = arb_mat(3, 1, [x, y, z])
            along = a * a.transpose()
            cross = arb_mat(3, 3, [0, -z, y, z, 0, -x, -y, x, 0])
            name = joint.name
            self.rotation[name], self.axis[name] = R, a
            self.origin[name] = arb_mat(3, 1, [row[3] for row in T[:3]])
            # The turned pose is the first of these, plus cos times the second, plus sin times ...
            parts = (R * along, R * (one - along), R * cross)
            self.turning[name] = [part.entries() for part in parts]

    def local(self, joint: Joint, q: arb_poly | None) -> list[list[arb | arb_poly]]:
        """
        Return rows of the pose of a joint's child in its parent, (3, 4).

        :param q: position of the joint, None for a fixed one [rad or m].
        """
        rotation: list[Any] = self.rotation[joint.name].entries()
        origin: list[Any] = self.origin[joint.name].entries()
        if q is not None and joint.type is JointType.PRISMATIC:
            slide = (self.rotation[joint.name] * self.axis[joint.name]).entries()
            origin = [x + q * along for x, along in zip(origin, slide, strict=True)]
        elif q is not None:
            cos, sin = cos_sin(q)
            parts = zip(*self.turning[joint.name], strict=True)
            rotation = [a + cos * b + sin * c for a, b, c in parts]
        return [[*rotation[3 * r : 3 * r + 3], origin[r]] for r in range(3)]


class Piece:
    """
    All link motions on [numerator, numerator + 1] / 2^level of a segment, each built once.

    :param arm: the robot.
    :param curve: the motion of its movable joints.
    """

    def __init__(self, arm: Arm, curve: Curve, segment: int, numerator: int, level: int) -> None:
        self._arm, self._curve, self.place = arm, curve, (segment, numerator, level)
        polynomials = curve.on(segment, numerator, level)
        self.positions = {
            joint.name: p for joint, p in zip(curve.joints, polynomials, strict=True)
        }
        one, none = arb_poly([1]), arb_poly([])
        identity = [[one if r == c else none for c in range(4)] for r in range(3)]
        self._poses: dict[str, Pose] = {arm.root: identity}
        self._controls: dict[str, arb_mat] = {}

    def __str__(self) -> str:
        """Return the piece as the certificate writes it."""
        segment, numerator, level = self.place
        return f'[{segment}, {numerator}, {level}]'

    @functools.cached_property
    def halves(self) -> tuple['Piece', 'Piece']:
        """The earlier and the later half."""
        segment, numerator, level = self.place
        earlier, later = (
            Piece(self._arm, self._curve, segment, 2 * numerator + k, level + 1) for k in (0, 1)
        )
        return earlier, later

    def largest(self, joint: str) -> arb:
        """Return a bound on the absolute position of a joint [rad or m]."""
        return self.positions[joint](ANY).abs_upper()

    def pose(self, link: str) -> Pose:
        """Return rows of the pose of a link in the root frame, (3, 4)."""
        above = []
        while link not in self._poses:
            joint = self._arm.above[link]
            above.append(joint)
            link = joint.parent
        for joint in reversed(above):
            local = self._arm.local(joint, self.positions.get(joint.name))
            self._poses[joint.child] = _product(self._poses[joint.parent], local)
        return self._poses[above[0].child if above else link]

    def controls(self, link: str) -> arb_mat:
        """Return the Bernstein coefficients of a link's pose, (DEGREE + 1, 12)."""
        if link not in self._controls:
            columns = [entry.coeffs() for row in self.pose(link) for entry in row]
            powers = [[*c, *[arb(0)] * (DEGREE + 1 - len(c))] for c in columns]
            flat = [column[k] for k in range(DEGREE + 1) for column in powers]
            self._controls[link] = bernstein() * arb_mat(DEGREE + 1, 12, flat)
        return self._controls[link]


def _product(above: Pose, local: list[list[arb | arb_poly]]) -> Pose:
    """Return the pose `above` times the pose `local`."""
    pose = []
    for x, y, z, w in above:
        row = [x * local[0][c] + y * local[1][c] + z * local[2][c] for c in range(4)]
        row[3] += w
        pose.append([shortened(entry) for entry in row])
    return pose
