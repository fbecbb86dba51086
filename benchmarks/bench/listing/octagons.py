"""Section 7.1: one moving and one fixed octagon, two motions that differ by a translation."""

from collections.abc import Iterator

from bench.clock import best_ms
from bench.listing.motions import octagon_motion
from bench.listing.shapes import octagon
from trajectory_guard.toleranced.collision import collisions
from trajectory_guard.toleranced.pair import pair_of

EPSILON = 0.02  # one percent of the moving octagon's diameter

# Name, translation, whether it is free; tests, recursion depth and seconds in print.
EXAMPLES = (
    ('example 1', (1.0, 0.0, 0.09), True, (173, 8, 0.1427)),
    ('example 1, half a diameter off', (1.0, 0.0, 1.09), True, (None, None, 0.07)),
    ('example 2', (0.0, 2.0, 0.05), False, (9, 8, 0.0075)),
)

# The paper's; with survivors and a test of clusters; with the extent of the distribution adapted.
LISTINGS = {
    'plain': {'hierarchy': False, 'adapted': False},
    'tree': {'hierarchy': True, 'adapted': False},
    'tree, adapted': {'hierarchy': True, 'adapted': True},
}


def octagon_rows() -> Iterator[dict]:
    """
    Yield a row per example and listing.

    The paper's second example stops at its first open piece (its Listing 1 returns there); here
    all open intervals are found.
    """
    pair = pair_of(octagon(1.0), octagon(1.5))
    for name, shift, free, (tests, depth, seconds) in EXAMPLES:
        motion = octagon_motion(shift)
        for listing, how in LISTINGS.items():
            ms, found = best_ms(
                lambda motion=motion, how=how: collisions(pair, motion, epsilon=EPSILON, **how)
            )
            yield {
                'table': 'octagons',
                'name': name,
                'n': 1,
                'distribution': listing,
                'outcome': 'suspect' if found.suspect else 'free',
                'free': sum(end - start for start, end in found.free),
                'polygon_pairs': found.polygon_pairs,
                'polygon_tests': found.polygon_tests,
                'node_tests': found.node_tests,
                'depth': found.depth,
                'seconds': 1e-3 * ms,
                'paper_tests': tests,
                'paper_depth': depth,
                'paper_seconds': seconds,
                'met': free == (not found.suspect),
            }
