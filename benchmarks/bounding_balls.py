"""
The three bounding balls of a rational motion of degree eight: what they cost, how tight they are.

The motion is of the kind of [Schroecker & Weber 2014, sec. 7]: a quartic quaternion curve gives
the turn and the weights, a polynomial of degree eight the way. It is cut into 1, 4, ... equal
pieces; `excess` is a ball's radius over that of the smallest ball round 200 instants of its piece.
"""

import argparse
from collections.abc import Callable, Iterator
import math
import statistics
import sys
from typing import NamedTuple

from bench.clock import interleaved
from bench.show import as_json, as_tables
import numpy as np

from trajectory_guard.toleranced.bounding_ball import control_ball, curvature_ball, minimal_ball
from trajectory_guard.toleranced.displacement_ball import DisplacementBall
from trajectory_guard.toleranced.metric import MassDistribution
from trajectory_guard.toleranced.smallest_ball import smallest_ball

Make = Callable[['Motion', MassDistribution], DisplacementBall | None]
BALLS: dict[str, Make] = {
    'c(1/2), control points': control_ball,
    'minimal': minimal_ball,
    'length, curvature': curvature_ball,
}
OCTAGON = np.array([[math.cos(a), math.sin(a), 0.0] for a in np.arange(8) * math.pi / 4.0])
INSTANTS = np.linspace(0.0, 1.0, 200)


class Motion(NamedTuple):
    """A rational Bezier motion: control points (K, 3, 4) and positive weights (K,)."""

    control_points: np.ndarray
    weights: np.ndarray


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the Bernstein coefficients of a product of two polynomials."""
    n, m = len(a) - 1, len(b) - 1
    scaled = np.convolve(
        a * [math.comb(n, i) for i in range(n + 1)], b * [math.comb(m, i) for i in range(m + 1)]
    )
    return scaled / [math.comb(n + m, i) for i in range(n + m + 1)]


def octagon_motion() -> Motion:
    """Return a motion of degree eight."""
    rng = np.random.default_rng(0)
    q = np.array([1.0, 0.0, 0.0, 0.0]) + 0.25 * rng.normal(size=(5, 4))
    w, x, y, z = q.T

    def p(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return product(a, b)

    weights = p(w, w) + p(x, x) + p(y, y) + p(z, z)
    rotation = np.array([
        [p(w, w) + p(x, x) - p(y, y) - p(z, z), 2 * (p(x, y) - p(w, z)), 2 * (p(x, z) + p(w, y))],
        [2 * (p(x, y) + p(w, z)), p(w, w) - p(x, x) + p(y, y) - p(z, z), 2 * (p(y, z) - p(w, x))],
        [2 * (p(x, z) - p(w, y)), 2 * (p(y, z) + p(w, x)), p(w, w) - p(x, x) - p(y, y) + p(z, z)],
    ])  # fmt: skip
    matrices = np.moveaxis(rotation, -1, 0) / weights[:, None, None]
    way = np.linspace(0.0, 1.0, 9)[:, None] * [3.0, 1.0, 0.5] + 0.2 * rng.normal(size=(9, 3))
    return Motion(np.concatenate((matrices, way[:, :, None]), axis=2), weights)


def halves(motion: Motion) -> tuple[Motion, Motion]:
    """Return both halves of a motion, by de Casteljau's algorithm."""
    rows = np.column_stack((motion.control_points.reshape(-1, 12), np.ones(len(motion.weights))))
    rows = rows * motion.weights[:, None]
    left, right = [rows[0]], [rows[-1]]
    while len(rows) > 1:
        rows = 0.5 * (rows[1:] + rows[:-1])
        left.append(rows[0])
        right.append(rows[-1])
    first, second = (
        Motion((part[:, :12] / part[:, 12:]).reshape(-1, 3, 4), part[:, 12])
        for part in (np.array(left), np.array(right[::-1]))
    )
    return first, second


def radius_of_samples(motion: Motion, metric: MassDistribution) -> float:
    """Return the radius of the smallest ball round instants of a motion."""
    n = len(motion.weights) - 1
    s = INSTANTS[:, None]
    i = np.arange(n + 1)
    basis = motion.weights * [math.comb(n, k) for k in i] * s**i * (1.0 - s) ** (n - i)
    points = np.tensordot(basis / basis.sum(axis=1, keepdims=True), motion.control_points, axes=1)
    y = metric.coordinates(points)
    return float(np.linalg.norm(y - smallest_ball(y) @ y, axis=1).max())


def all_of(
    make: Make, pieces: list[Motion], metric: MassDistribution
) -> Callable[[], list[DisplacementBall | None]]:
    """Return a call that makes the balls of some pieces."""
    return lambda: [make(piece, metric) for piece in pieces]


def rows(cuts: int) -> Iterator[dict]:
    """Yield a row for each number of pieces and each ball."""
    metric = MassDistribution.of_polygon(OCTAGON)
    pieces = [octagon_motion()]
    for cut in range(cuts + 1):
        if cut:
            for _ in range(2):
                pieces = [half for piece in pieces for half in halves(piece)]
        some = pieces[:: max(1, len(pieces) // 16)]
        truth = [radius_of_samples(piece, metric) for piece in some]
        timed = interleaved({name: all_of(make, some, metric) for name, make in BALLS.items()})
        for name, (seconds, balls) in timed.items():
            found = [
                ball.radius / radius
                for ball, radius in zip(balls, truth, strict=True)
                if ball is not None
            ]
            yield {
                'table': 'bounding balls',
                'pieces': len(pieces),
                'ball': name,
                'found': f'{len(found)} of {len(some)}',
                'us_a_ball': 1e6 * seconds / len(some),
                'median_excess': statistics.median(found) - 1.0 if found else None,
                'worst_excess': max(found) - 1.0 if found else None,
                'unsound': sum(x < 1.0 - 1e-9 for x in found),
            }


def main() -> int:
    """Measure and print; exit 1 if a ball is smaller than the motion."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--cuts', type=int, default=4, help='how often pieces are quartered')
    parser.add_argument('--json', action='store_true', help='one object a row')
    arguments = parser.parse_args()
    found = rows(arguments.cuts)
    shown = as_json(found) if arguments.json else as_tables(found)
    return int(sum(row['unsound'] for row in shown) > 0)


if __name__ == '__main__':
    sys.exit(main())
