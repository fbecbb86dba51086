r"""
Inequalities.  Each claim's margin is a ball; the claim holds where that is positive.

Over a piece a pose is sum_i B_i(s) C_i, B_i >= 0 the Bernstein polynomials, which sum to 1.  So

- a function linear in the pose is at least the least of its coefficients,
- a convex function of something with coefficients g_i, as the support of a disc or the length of
  a normal, is at most sum_i B_i f(g_i).

A body point's height n.x therefore exceeds a level with coefficients L_i at every instant if, for
every i and vertex v,  g_i.v + o_i  >  L_i + rim(g_i) + |n_i| (ball + slack),
(g_i, o_i) being the coefficients of n^T pose and n_i those of n.  With a normal of degree two all
of them have two degrees more than the pose.
"""

from typing import NamedTuple

from flint import arb, arb_mat, fmpq

from trajectory_guard.verify.series import DEGREE, elevated
from trajectory_guard.verify.solids import Box, Moved, Solid
from trajectory_guard.verify.vector import least, length, lerp, Vector


class Ball(NamedTuple):
    """
    A sphere about the body stays off the obstacle, or at least the body does.

    :param box: of the obstacle; proposes the direction that separates.
    """

    box: Box

    def margin(self, body: Moved, obstacle: Solid, clearance: arb) -> arb:
        """Return how far the two are apart beyond what is asked [m]."""
        normal = self.box.direction(*body.place(0, body.solid.center))
        if normal is None:
            return arb(-1)
        size = length(normal)
        level = obstacle.highest(normal) + size * clearance
        centers = (body.centers * arb_mat(3, 1, normal)).entries()
        margin = least(centers) - level - size * (body.solid.sphere + body.slack)
        return margin if margin > 0 else _above(body, _constant(normal), [level] * (DEGREE + 1))

    def halves(self, body: Moved) -> tuple['Ball', 'Ball']:
        """Return the claim on both halves of its piece."""
        return self, self


class Plane(NamedTuple):
    """A plane lies between body and obstacle."""

    normal: Vector
    offset: arb

    def margin(self, body: Moved, obstacle: Solid, clearance: arb) -> arb:
        """Return the smaller of the distances to the plane, times the normal's length [m]."""
        below = self.offset - obstacle.highest(self.normal) - length(self.normal) * clearance
        levels = [self.offset] * (DEGREE + 1)
        return below.min(_above(body, _constant(self.normal), levels))

    def halves(self, body: Moved) -> tuple['Plane', 'Plane']:
        """Return the claim on both halves of its piece."""
        return self, self


class Turning(NamedTuple):
    """
    A plane whose normal turns lies between body and obstacle.

    :param a: first of three Bernstein coefficients of the normal; b and c are the others.
    """

    a: Vector
    b: Vector
    c: Vector

    def margin(self, body: Moved, obstacle: Solid, clearance: arb) -> arb:
        """Return how far the two are apart beyond what is asked, times the normal's length."""
        ones = arb_mat(DEGREE + 1, 1, [1] * (DEGREE + 1))
        normals = _twice(*(ones * arb_mat(1, 3, normal) for normal in self)).tolist()
        functional = _twice(*(body.controls * functional_of(normal) for normal in self))
        levels = [obstacle.highest(n) + length(n) * clearance for n in normals]
        return _above(body, (normals, functional), levels)

    def halves(self, body: Moved) -> tuple['Turning', 'Turning']:
        """Return the claim on both halves of its piece."""
        half = fmpq(1, 2)
        left, right = lerp(self.a, self.b, half), lerp(self.b, self.c, half)
        middle = lerp(left, right, half)
        return Turning(self.a, left, middle), Turning(middle, right, self.c)


def _above(body: Moved, normals: tuple[list[Vector], arb_mat | None], levels: list[arb]) -> arb:
    """
    Return by how much a body keeps above levels.

    :param normals: coefficients of the normal, and of normal^T pose if the normal turns.
    :param levels: coefficients of the level.
    """
    directions, functional = normals
    if functional is None:
        functional = body.controls * functional_of(directions[0])
    solid = body.solid
    heights = (functional * solid.vertices).tolist()
    margins = [
        least(row) - level - solid.rim(g[:3]) - length(n) * (solid.ball + body.slack)
        for row, level, g, n in zip(heights, levels, functional.tolist(), directions, strict=True)
    ]
    return least(margins)


def _constant(normal: Vector) -> tuple[list[Vector], None]:
    return [normal] * (DEGREE + 1), None


def _twice(a: arb_mat, b: arb_mat, c: arb_mat) -> arb_mat:
    """Return coefficients of (1 - s)^2 a(s) + 2 s (1 - s) b(s) + s^2 c(s), two degrees higher."""
    return elevated(elevated(a, b), elevated(b, c))


def functional_of(normal: Vector) -> arb_mat:
    """Return the matrix (12, 4) that takes rows of a pose to normal^T pose."""
    return arb_mat([[normal[i // 4] if i % 4 == c else 0 for c in range(4)] for i in range(12)])
