"""Section 7.2: two squares of n x n squares, three motions, one distribution or many."""

from collections.abc import Iterator
import time

import numpy as np

from bench.clock import best_ms
from bench.listing.motions import square_motion
from bench.listing.shapes import squares
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.toleranced.collision import collisions
from trajectory_guard.toleranced.pair import Pair, pair_of

EPSILON = 0.01 * np.sqrt(2.0)  # one percent of the square's diameter
SIZES = (*range(1, 11), 15, 20, 30, 50, 100)
PLAIN = 10  # beyond, every pair by itself takes too long

# Height of the lowest corner, whether it is free, and seconds for n = 1 to 10 in print: table 1
# (one global distribution) and table 2 (individual ones).
OUTCOMES = {
    'collision': (
        -0.05,
        False,
        (0.17, 1.58, 5.91, 16.07, 35.09, 67.41, 118.42, 194.16, 300.88, 448.09),
        (0.17, 1.21, 3.68, 9.12, 19.01, 35.69, 61.59, 99.71, 153.22, 226.60),
    ),
    'near-collision': (
        0.015,
        True,
        (0.49, 2.43, 9.49, 25.78, 57.05, 110.34, 193.47, 318.39, 494.69, 738.22),
        (0.49, 1.85, 5.99, 15.23, 32.59, 62.36, 108.64, 177.00, 274.48, 407.89),
    ),
    'no-collision': (
        0.5,
        True,
        (0.11, 1.12, 4.57, 12.17, 27.60, 54.82, 98.25, 164.00, 258.29, 388.67),
        (0.11, 0.98, 3.22, 8.27, 18.74, 36.97, 66.01, 109.79, 172.29, 258.99),
    ),
}
# One mass distribution or many, as in print; and the latter scaled to suit each ball.
DISTRIBUTIONS = {
    'global': (False, False),
    'individual': (True, False),
    'adapted': (True, True),
}


def square_rows(most: int) -> Iterator[dict]:
    """Yield a row per size, distribution and outcome; the plain listing's counts are beside."""
    for n in (size for size in SIZES if size <= most):
        for distribution, (individual, adapted) in DISTRIBUTIONS.items():
            begin = time.perf_counter()
            pair = pair_of(squares(n), squares(n), individual=individual)
            prepared = time.perf_counter() - begin
            for outcome, (height, free, *printed) in OUTCOMES.items():
                motion = square_motion(height)
                row = {
                    'table': 'squares',
                    'name': 'squares',
                    'n': n,
                    'distribution': distribution,
                    'outcome': outcome,
                }
                ms, found = best_ms(
                    lambda pair=pair, motion=motion, adapted=adapted: collisions(
                        pair, motion, epsilon=EPSILON, adapted=adapted
                    )
                )
                row |= {
                    'polygon_pairs': found.polygon_pairs,
                    'polygon_tests': found.polygon_tests,
                    'node_tests': found.node_tests,
                    'depth': found.depth,
                    'seconds': 1e-3 * ms,
                    'prepare_seconds': prepared,
                    'met': free == (not found.suspect),
                }
                if n <= PLAIN:
                    row |= plain(pair, motion, adapted)
                    row['paper_seconds'] = printed[individual][n - 1]
                    row['met'] &= row['polygon_tests'] <= row['plain_tests']
                yield row


def plain(pair: Pair, motion: RationalMotion, adapted: bool) -> dict:
    """Return what every pair of squares by itself costs."""
    ms, found = best_ms(
        lambda: collisions(pair, motion, epsilon=EPSILON, hierarchy=False, adapted=adapted), 1
    )
    return {
        'plain_tests': found.polygon_tests,
        'plain_seconds': 1e-3 * ms,
        'plain_us_a_pair': 1e3 * ms / found.polygon_pairs,
    }


def scaling_rows(rows: list[dict]) -> Iterator[dict]:
    """
    Yield exponents of growth in the number of pairs of polygons, from the two ends of a range.

    1 is the paper's conclusion, linear in n^4.
    """
    for distribution, (individual, _) in DISTRIBUTIONS.items():
        for outcome, (_, _, *printed) in OUTCOMES.items():
            mine = [
                row
                for row in rows
                if (row['distribution'], row['outcome']) == (distribution, outcome)
            ]
            listed = [row for row in mine if 'plain_tests' in row and row['n'] > 1]
            if len(listed) < 2:
                continue
            large = [row for row in mine if row['n'] >= min(PLAIN, mine[-1]['n'])]
            paper = [
                {'n': n, 'polygon_pairs': n**4, 'seconds': s}
                for n, s in enumerate(printed[individual], 1)
                if n > 1
            ]
            yield {
                'table': 'scaling',
                'distribution': distribution,
                'outcome': outcome,
                'largest_n': mine[-1]['n'],
                'tree_seconds': exponent(mine, 'seconds'),
                'tree_tests': exponent([r | {'all': all_tests(r)} for r in mine], 'all'),
                'tree_seconds_from_10': exponent(large, 'seconds'),
                'plain_seconds': exponent(listed, 'plain_seconds'),
                'plain_tests': exponent(listed, 'plain_tests'),
                'paper_seconds': exponent(paper, 'seconds'),
            }


def all_tests(row: dict) -> int:
    """Return the tests of clusters and of polygons."""
    return row['node_tests'] + row['polygon_tests']


def exponent(rows: list[dict], key: str) -> float | None:
    """Return p such that the value of the last row is (pairs of last / pairs of first)^p times."""
    first, last = rows[0], rows[-1]
    if first is last:
        return None
    pairs = last['polygon_pairs'] / first['polygon_pairs']
    return float(np.log(last[key] / first[key]) / np.log(pairs))


def which_rows(n: int) -> Iterator[dict]:
    """
    Yield how the plain listing's tests are spread over the moving squares (figures 5 and 6).

    They pile up at the corner that comes down, the only one with open pairs.
    """
    for distribution, (individual, adapted) in DISTRIBUTIONS.items():
        pair = pair_of(squares(n), squares(n), individual=individual)
        for outcome, (height, *_) in OUTCOMES.items():
            motion = square_motion(height)
            found = collisions(pair, motion, epsilon=EPSILON, hierarchy=False, adapted=adapted)
            tests = found.tests_of.reshape(n, n)
            at = np.unravel_index(tests.argmax(), tests.shape)
            colored = {suspect.moving_face for suspect in found.suspect}
            yield {
                'table': 'which',
                'n': n,
                'distribution': distribution,
                'outcome': outcome,
                'least_tests': int(tests.min()),
                'median_tests': float(np.median(tests)),
                'most_tests': int(tests.max()),
                'most_at': ', '.join(str(int(i)) for i in at),
                'open_squares': len(colored),
                'farthest_open': max((int(max(divmod(i, n))) for i in colored), default=None),
            }
