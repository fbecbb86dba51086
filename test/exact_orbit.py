"""Orbits and distances of toleranced features in rational arithmetic, on the doubles given."""

from fractions import Fraction
import itertools

import numpy as np


def fractions(array):
    """Return nested lists of exact numbers."""
    if isinstance(array, Fraction):
        return array
    return [fractions(row) for row in array] if np.ndim(array) else Fraction(float(array))


def dot(a, b):
    """Return a scalar product."""
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def solve_lower(F, y):
    """Return F^-1 y for a lower triangular F."""
    x = []
    for row, value in zip(F, y, strict=True):
        x.append((value - dot(row[: len(x)], x)) / row[len(x)])
    return x


def rho_squared(metric, x):
    """Return the exact rho^2 of the metric that the distribution's doubles define."""
    y = [a - b for a, b in zip(x, fractions(metric.barycenter), strict=True)]
    v = solve_lower(fractions(metric.factor), y)
    return 1 / Fraction(metric.mass) + dot(v, v)


def distance_squared(metric, alpha, beta):
    """Return the exact squared distance of two displacements."""
    F, b = fractions(metric.factor), [*fractions(metric.barycenter), Fraction(1)]
    D = [
        [x - y for x, y in zip(*rows, strict=True)]
        for rows in zip(fractions(alpha), fractions(beta), strict=True)
    ]
    moved = [dot(row, b) for row in D]
    turned = [dot(row[:3], column) for row in D for column in zip(*F, strict=True)]
    return Fraction(metric.mass) * dot(moved, moved) + dot(turned, turned)


class Pair:
    """
    A fixed simplex and a moving one under a ball of displacements.

    :param fixed: corners, (d + 1, 3).
    :param moving: corners, (d + 1, 3).
    :param ball: the displacements.
    """

    def __init__(self, fixed, moving, ball):
        self.fixed, self.moving = fractions(fixed), fractions(moving)
        self.metric, self.R = ball.distribution, Fraction(ball.radius)
        self.g = fractions(ball.center)
        self.dimension = len(fixed) + len(moving) - 2
        self.square = len(fixed) == len(moving) == 2

    def point(self, corners, x):
        """Return the point of a simplex with these parameters."""
        return [c[0] + dot([y - c[0] for y in c[1:]], x) for c in zip(*corners, strict=True)]

    def squares(self, x):
        """Return |f - g(e)|^2 and R^2 rho^2(e) at parameters x."""
        split = len(self.fixed) - 1
        f, e = self.point(self.fixed, x[:split]), self.point(self.moving, x[split:])
        image = [dot(row, [*e, Fraction(1)]) for row in self.g]
        r = [a - b for a, b in zip(f, image, strict=True)]
        return dot(r, r), self.R**2 * rho_squared(self.metric, e)

    def q(self, x):
        """Return the quadratic: <= 0 where the ball over e contains f."""
        away, radius = self.squares(x)
        return away - radius

    def least(self):
        """Return the exact minimum and where it is: a corner, on a side, or inside."""
        one, zero = Fraction(1), Fraction(0)
        d = self.dimension
        if d == 0:
            return self.q([]), []
        corners = [[zero] * d] + [[one * (i == j) for j in range(d)] for i in range(d)]
        if self.square:
            corners = [corners[0], corners[1], [one, one], corners[2]]
        places = list(corners)
        sides = itertools.pairwise([*corners, corners[0]]) if d == 2 else [corners]
        for a, b in sides:
            t = self._stationary(a, b)
            if t is not None and 0 <= t <= 1:
                places.append([x + t * (y - x) for x, y in zip(a, b, strict=True)])
        inside = self._inside() if d == 2 else None
        if inside is not None:
            places.append(inside)
        return min(((self.q(x), x) for x in places), key=lambda found: found[0])

    def _stationary(self, a, b):
        """Return where on the line through a and b the quadratic is least, None if nowhere."""
        middle = [(x + y) / 2 for x, y in zip(a, b, strict=True)]
        q0, q1, q2 = self.q(a), self.q(middle), self.q(b)
        curvature = 2 * (q0 - 2 * q1 + q2)
        return (curvature - (q2 - q0)) / (2 * curvature) if curvature > 0 else None

    def _inside(self):
        """Return the stationary point in the domain of two parameters, None if there is none."""
        one, zero = Fraction(1), Fraction(0)
        q = {x: self.q([Fraction(x[0]), Fraction(x[1])]) for x in [(0, 0), (1, 0), (0, 1)]}
        c = q[0, 0]
        a = 2 * (q[1, 0] + c) - 4 * self.q([one / 2, zero])
        e = 2 * (q[0, 1] + c) - 4 * self.q([zero, one / 2])
        bx, by = (q[1, 0] - c - a) / 2, (q[0, 1] - c - e) / 2
        m = (self.q([one, one]) - c - a - e - 2 * bx - 2 * by) / 2
        det = a * e - m * m
        if a <= 0 or det <= 0:
            return None
        x = [(m * by - e * bx) / det, (m * bx - a * by) / det]
        bounded = max(x) <= 1 if self.square else sum(x) <= 1
        return x if min(x) >= 0 and bounded else None

    def farther_at(self, x, thickness):
        """Say whether |f - g(e)| > R rho(e) + thickness at parameters x."""
        away, radius = self.squares(x)
        d = Fraction(thickness)
        rest = away - radius - d * d
        return rest > 0 and rest * rest > 4 * d * d * radius
