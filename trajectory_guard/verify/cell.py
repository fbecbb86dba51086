"""Robot, obstacles and motion of a certificate, and the proofs of its entries."""

from collections.abc import Mapping
from itertools import groupby
from typing import Any

from flint import arb

from trajectory_guard.cell.robot import Robot
from trajectory_guard.cell.scene import Scene
from trajectory_guard.errors import TrajectoryGuardError
from trajectory_guard.verify.claims import Ball, Plane, Turning
from trajectory_guard.verify.curve import Curve
from trajectory_guard.verify.entries import Entry
from trajectory_guard.verify.invalid import invalid
from trajectory_guard.verify.motion import Arm, Piece
from trajectory_guard.verify.overlap import Collision
from trajectory_guard.verify.solids import Box, Link, Moved, Solid

# A claim that does not verify on its piece is tried on the halves of it, this often; and so many
# times in all, a few for each entry, so that no certificate takes for ever.
DEEPEST_HALVING = 12
MOST_HALVINGS = 10_000

Claim = Ball | Plane | Turning | Collision


class Cell:
    """
    Robot, obstacles and motion of a certificate.

    :param certificate: one of the right shape that is about this robot and scene.
    :param motion: the curve of its trajectory.
    """

    def __init__(
        self, certificate: Mapping[str, Any], robot: Robot, scene: Scene, motion: Curve
    ) -> None:
        self._pieces = certificate['pieces']
        self._clearance = arb(float(certificate['request']['clearance']))
        tolerance = certificate['request']['tracking_tolerance']
        self._tolerance = {name: arb(float(value)) for name, value in tolerance.items()}
        self._arm, self._motion = Arm(robot), motion
        self.links = [
            Link(self._arm, link, body)
            for link in robot.collision_links
            for body in robot.bodies(link)
        ]
        bodies = [body for obstacle in scene.obstacles for body in obstacle.bodies]
        frames = certificate['scene']['frames']
        self.obstacles = [Solid(body) for body in bodies]
        self._boxes = [Box(*both) for both in zip(bodies, frames, strict=True)]

    def moves(self, link: str) -> bool:
        """Return whether a commanded joint moves a link."""
        while link != self._arm.root:
            joint = self._arm.above[link]
            if joint in self._motion.joints and self._motion.moves(joint):
                return True
            link = joint.parent
        return False

    def prove(self, entries: list[Entry]) -> int:
        """
        Prove all entries.

        :param entries: those of one piece together.
        :returns: number of halvings.
        """
        halvings, most = 0, MOST_HALVINGS + 4 * len(entries)
        for place, group in groupby(entries, key=lambda entry: self._pieces[entry.piece]):
            whole = Piece(self._arm, self._motion, *place)
            moved: dict[tuple[Piece, int], Moved] = {}
            for entry in group:
                todo: list[tuple[Piece, Claim, int]] = [(whole, self._claim(entry), 0)]
                while todo:
                    part, claim, depth = todo.pop()
                    key = part, entry.body
                    if key not in moved:
                        moved[key] = Moved(self.links[entry.body], part, self._tolerance)
                    obstacle = self.obstacles[entry.obstacle]
                    margin = claim.margin(moved[key], obstacle, self._clearance)
                    if margin > 0:
                        continue
                    halvings += 1
                    if depth == DEEPEST_HALVING or halvings > most:
                        raise self._unproved(entry, whole, part, margin)
                    todo += zip(
                        part.halves, claim.halves(moved[key]), (depth + 1,) * 2, strict=True
                    )
        return halvings

    def _claim(self, entry: Entry) -> Claim:
        """Return the inequality of an entry."""
        numbers = [arb(x) for x in entry.numbers]
        if entry.kind == 'balls':
            return Ball(self._boxes[entry.obstacle])
        if entry.kind == 'planes':
            return Plane(numbers[:3], numbers[3])
        if entry.kind == 'collisions':
            return Collision(numbers[:3], numbers[3:])
        powers = list(zip(numbers[:3], numbers[3:6], numbers[6:], strict=True))
        return Turning(
            [n - m + k for n, m, k in powers],
            [n - k for n, _, k in powers],
            [n + m + k for n, m, k in powers],
        )

    def _unproved(
        self, entry: Entry, piece: Piece, part: Piece, margin: arb
    ) -> TrajectoryGuardError:
        """Return the error of an entry."""
        return invalid(
            f'{entry.kind}[{entry.row}]: body {entry.body} ({self.links[entry.body].name}) and '
            f'obstacle {entry.obstacle} on piece {piece}: not proved, on its part {part} the '
            f'margin is {float(margin.mid()):.3g} m'
        )
