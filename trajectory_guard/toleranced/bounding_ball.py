"""
Balls of displacements that contain a rational Bezier motion [SW, sec. 5].

A point of the curve is a convex combination of the control points, since the weights are positive,
so a ball that contains these contains the curve. All radii are rounded up.
"""

import math

import numpy as np

from trajectory_guard.shapes.body import U, UNDERFLOW
from trajectory_guard.toleranced.curve_bounds import (
    checked,
    curvature_bound,
    length_bound,
    RationalCurve,
)
from trajectory_guard.toleranced.displacement_ball import DisplacementBall
from trajectory_guard.toleranced.metric import MassDistribution
from trajectory_guard.toleranced.smallest_ball import smallest_ball

# Below pi / 2, as Proposition 2 requires of length times curvature.
RIGHT_ANGLE = 1.5707


def control_ball(motion: RationalCurve, metric: MassDistribution) -> DisplacementBall:
    """
    Return the ball round the curve's point c(1/2) through the farthest control point.

    The centre may be rounded: the radius is measured from what it became.

    :param motion: the motion.
    :param metric: the metric.
    :raises RequestError: INVALID_PARAMETER, the motion is not one.
    """
    points, weights = checked(motion)
    n = len(points) - 1
    share = weights / weights.max() * [math.comb(n, i) / 2**n for i in range(n + 1)]
    return _round(np.tensordot(share / share.sum(), points, axes=1), points, metric)


def minimal_ball(motion: RationalCurve, metric: MassDistribution) -> DisplacementBall:
    """
    Return the smallest ball that contains the control points, to rounding.

    :param motion: the motion.
    :param metric: the metric.
    :raises RequestError: INVALID_PARAMETER, the motion is not one.
    """
    points, _ = checked(motion)
    share = smallest_ball(metric.coordinates(points - points[0]))
    center = points[0] + np.tensordot(share, points - points[0], axes=1)
    return _round(center, points, metric)


def curvature_ball(motion: RationalCurve, metric: MassDistribution) -> DisplacementBall | None:
    """
    Return the ball of [SW, Proposition 2], or None where its hypothesis is not proved.

    **Proposition.** A curve of length l = r t, t < pi/2, with curvature at most 1/r, lies in the
    ball of radius k = r tan(t/2) whose centre is k along the tangent from the start.

    Proof, for r = 1, start 0, tangent e at the start (r scales). The angle theta(s) of the tangent
    to e is at most s and not negative. With X = int cos theta and Y = int sin theta up to S <= t
    the curve's point c has c.e = X and |c - X e| <= Y, so |c - k e|^2 - k^2 <= X^2 + Y^2 - 2 k X.
    Let Z = X + iY.
      - For gamma in [0, S], Re(Z e^(-i gamma)) = int cos(theta - gamma) is at most what it is for
        theta(s) = min(s, gamma), an arc of angle gamma and then straight on, ending in Z(gamma).
      - For gamma = beta + pi/2, beta = arg Z, it is 0, and at most what it is for theta(s) = s,
        int sin(s - beta) = cos beta - cos(S - beta): so beta <= S/2, the direction of Z(S).
      - So some Z(gamma) has the direction of Z, and Z lies between 0 and it. On that chord
        X^2 + Y^2 - 2 k X is convex and 0 at 0; it remains to show that it is <= 0 at Z(gamma).
      - With a = S - gamma it is 2 (1 - cos gamma) + a^2 + 2 a sin gamma - 2 k (sin gamma +
        a cos gamma), convex in a in [0, t - gamma]. At a = 0 it is
        2 sin gamma (tan(gamma/2) - k) <= 0. At a = t - gamma its derivative by gamma is
        2 (t - gamma) sin gamma (k - tan(gamma/2)) >= 0, and at gamma = t it is 0: so <= 0 before.

    :param motion: the motion.
    :param metric: the metric.
    :raises RequestError: INVALID_PARAMETER, the motion is not one.
    """
    points, _ = checked(motion)
    length, curvature = length_bound(motion, metric), curvature_bound(motion, metric)
    turned = length * curvature * (1.0 + 2.0 * U)
    if not turned <= RIGHT_ANGLE:
        return None
    k = 0.5 * length * tangent_ratio(0.5 * turned) * (1.0 + 8.0 * U)
    # The exact tangent is that of the exact difference; the centre may be off along it and across.
    side = points[1] - points[0]
    way = metric.distance(points[1], points[0])
    step = k / way
    center = points[0] + step * side
    along = k * (8.0 * U * float(metric.size_bound(side)) / way + 32.0 * U)
    across = float(metric.size_bound(2.0 * U * np.abs(points[0]) + 4.0 * U * step * np.abs(side)))
    radius = (k + along + across) * (1.0 + 8.0 * U) + UNDERFLOW
    return DisplacementBall(metric, center, radius)


def tangent_ratio(x: float) -> float:
    """
    Return an upper bound of tan(x) / x for 0 <= x <= pi/4: 1 + x^2/3 + 0.178 x^4.

    The quotient of the remainder tan x - x - x^3/3 by x^5 increases, as its power series has
    positive coefficients, and is less than 0.1778 at pi/4.
    """
    square = x * x
    return (1.0 + square / 3.0 + 0.178 * square * square) * (1.0 + 8.0 * U)


def _round(center: np.ndarray, points: np.ndarray, metric: MassDistribution) -> DisplacementBall:
    """Return the ball round a centre that contains the points."""
    return DisplacementBall(metric, center, float(metric.distance_bound(points, center).max()))
