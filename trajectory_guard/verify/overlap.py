"""The inequality of a collision: a common point of two solids at every instant of a piece."""

from collections.abc import Iterator
from typing import NamedTuple

from flint import arb, fmpq

from trajectory_guard.verify.series import DEGREE, elevated
from trajectory_guard.verify.solids import Moved, placed, Solid
from trajectory_guard.verify.vector import largest, least, length, lerp, Vector


class Collision(NamedTuple):
    """
    A point that moves through the link from `first` to `last` shows that the two overlap.

    :param chords: start and end of what may move inside the obstacle, from a larger piece.
    """

    first: Vector
    last: Vector
    chords: tuple[tuple[Vector, Vector], ...] = ()

    def margin(self, body: Moved, obstacle: Solid, clearance: arb) -> arb:
        """
        Return how far the two overlap for certain [m].

        The point's curve x(s) lies as deep in the link as one of its ends, m.  Either it lies in
        the obstacle; or it stays nearer to a z(s), moving along a chord, than m and the depth of
        z together.
        """
        curve = elevated(*(body.controls * placed([*p, arb(1)]) for p in self[:2])).tolist()
        mine = body.solid.depth([self.first, self.last])
        margins = [mine.min(obstacle.depth(curve))]
        for start, end in self._chords(body):
            theirs = obstacle.depth([start, end])
            chord = [lerp(start, end, fmpq(i, DEGREE + 1)) for i in range(len(curve))]
            apart = [
                length([x - z for x, z in zip(place, near, strict=True)])
                for place, near in zip(curve, chord, strict=True)
            ]
            margins.append(least([mine, theirs, mine + theirs - largest(apart)]))
        return next((m for m in margins if m > 0), margins[0])

    def halves(self, body: Moved) -> tuple['Collision', 'Collision']:
        """Return the claim on both halves of its piece."""
        middle = lerp(self.first, self.last, fmpq(1, 2))
        chords = [(a, lerp(a, b, fmpq(1, 2)), b) for a, b in self._chords(body)]
        return (
            Collision(self.first, middle, tuple((a, m) for a, m, _ in chords)),
            Collision(middle, self.last, tuple((m, b) for _, m, b in chords)),
        )

    def _chords(self, body: Moved) -> Iterator[tuple[Vector, Vector]]:
        """Yield the chord of the point's curve, places of it that stand still, inherited ones."""
        middle = lerp(self.first, self.last, fmpq(1, 2))
        a, m, b = (
            [arb(x) for x in body.place(tau, [float(x.mid()) for x in point])]
            for tau, point in ((-1, self.first), (0, middle), (1, self.last))
        )
        yield a, b
        yield from ((z, z) for z in (m, a, b))
        yield from self.chords
