"""Tables of the algebraic contact times, each a function that yields rows."""

from collections.abc import Callable, Iterator
import math
import statistics

import numpy as np

from bench.clock import best_ms
from bench.figure2 import contacts, l_shape, obstacles, PAPER_SECONDS, path
from bench.pinned import pin
from trajectory_guard.canny import (
    Configuration,
    ConvexPolyhedron,
    fast_overlap,
    Motion,
    recentred,
    still,
)
from trajectory_guard.canny.fast import kernel_answer
from trajectory_guard.canny.overlap import exact_overlaps
from trajectory_guard.kernels.canny import CLOSED_FORM, HALVING

CASES = 60  # random motions of a table
REPEATS = 20  # calls inside of the kernel for a clock
PAIR_US = 50.0  # what a cubic pair of boxes may cost
GROWING = (4, 8, 16, 32, 64, 96)

METHODS = {'closed form': CLOSED_FORM, 'halving': HALVING}
LARGE = ConvexPolyhedron.box([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0])
SMALL = ConvexPolyhedron.box([-0.5, -0.5, -0.5], [0.5, 0.5, 0.5])


def figure2() -> Iterator[dict]:
    """Yield a row for each overlap of the paper's example, and one for the time."""
    for one in contacts():
        for event, moment, touching in (
            ('enters', one.start, one.opening),
            ('leaves', one.end, one.closing),
        ):
            yield {
                'table': 'figure2',
                'event': event,
                's': float(moment),
                'obstacle': ', '.join(sorted({str(c.part_b) for c in touching})),
                'contact': ', '.join(sorted({c.kind.value for c in touching})),
                'at': '; '.join('({:.3f}, {:.3f}, {:.3f})'.format(*c.point) for c in touching[:2]),
            }
    exact_ms, _ = best_ms(contacts)
    parts, others, motion, here = l_shape(), obstacles(), path(), still()
    fast_ms, _ = best_ms(lambda: [fast_overlap(a, motion, b, here) for a in parts for b in others])
    for name, ms in (('exact', exact_ms), ('with bounds', fast_ms)):
        yield {
            'table': 'figure2 time',
            'arithmetic': name,
            'paper_s': PAPER_SECONDS,
            'ours_ms': ms,
            'times_faster': 1e3 * PAPER_SECONDS / ms,
        }


def pair() -> Iterator[dict]:
    """Yield what a pair of boxes costs: cubics and quintics, both ways to propose roots."""
    medians = {}
    for movers in (1, 2):
        cases = motions(movers)
        meeting = [bool(kernel_answer(SMALL, a, LARGE, b).possible) for a, b in cases]
        for method, code in METHODS.items():
            us = [kernel_us(SMALL, a, LARGE, b, code) for a, b in cases]
            for state, wanted in (('meet', True), ('apart', False)):
                chosen = [t for t, m in zip(us, meeting, strict=True) if m == wanted]
                medians[movers, method, wanted] = statistics.median(chosen)
                row = {
                    'table': 'pair',
                    'movers': movers,
                    'degree': (3, 5)[movers - 1],
                    'roots': method,
                    'boxes': state,
                    'cases': len(chosen),
                    'median_us': statistics.median(chosen),
                    'most_us': max(chosen),
                }
                if movers == 1 and code == CLOSED_FORM:
                    row['target'] = f'<= {PAIR_US:.0f} us'
                    row['met'] = row['median_us'] <= PAIR_US
                yield row
    for wanted, state in ((True, 'meet'), (False, 'apart')):
        ratio = medians[2, 'closed form', wanted] / medians[1, 'closed form', wanted]
        yield {
            'table': 'two movers',
            'boxes': state,
            'x_one_mover': ratio,
            'target': 'less than 10',
            'met': ratio < 10.0,
        }


def exact() -> Iterator[dict]:
    """Yield what the same costs in exact arithmetic."""
    for movers in (1, 2):
        cases = motions(movers)[:10]
        ms = [
            best_ms(lambda a=a, b=b: exact_overlaps([SMALL], a, [LARGE], b, [(0, 0)]), 2)[0]
            for a, b in cases
        ]
        yield {
            'table': 'exact',
            'movers': movers,
            'cases': len(ms),
            'median_ms': statistics.median(ms),
        }


def growth() -> Iterator[dict]:
    """Yield cost against the number of constraints, for bodies of more and more vertices."""
    rng = np.random.default_rng(0)
    before = None
    for n in GROWING:
        a, b = (ball(rng, n) for _ in range(2))
        motion = recentred(
            Configuration((-3.0, 0.1, 0.2)), Configuration((3.0, 0.0, 0.1), rng.normal(size=4))
        )
        count = constraints(a, b)
        answer = kernel_answer(a, motion, b, still())
        us = kernel_us(a, motion, b, still(), CLOSED_FORM, max(1, REPEATS * 240 // count))
        order = None if before is None else math.log(us / before[1]) / math.log(count / before[0])
        yield {
            'table': 'growth of bodies',
            'vertices': n,
            'constraints': count,
            'built': 0 if answer is None else answer.polynomials,
            'us': us,
            'ns_per_constraint': 1e3 * us / count,
            'ns_per_n_log_n': 1e3 * us / (count * math.log2(count)),
            'order': order,
        }
        before = count, us


def motions(movers: int) -> list[tuple[Motion, Motion]]:
    """Return random lines of A, and of B or a B that stands."""
    rng = np.random.default_rng(1)

    def somewhere() -> Motion:
        a, b = (Configuration(rng.normal(size=3) * 1.5, rng.normal(size=4)) for _ in range(2))
        return recentred(a, b)

    return [(somewhere(), somewhere() if movers == 2 else still()) for _ in range(CASES)]


def ball(rng: np.random.Generator, n: int) -> ConvexPolyhedron:
    """Return the hull of n points of a sphere."""
    points = rng.normal(size=(n, 3))
    return ConvexPolyhedron.hull(points / np.linalg.norm(points, axis=1, keepdims=True))


def constraints(a: ConvexPolyhedron, b: ConvexPolyhedron) -> int:
    """Return N_c = E_A E_B + F_A V_B + F_B V_A."""
    return (
        len(a.edges) * len(b.edges)
        + len(a.faces) * len(b.vertices)
        + len(b.faces) * len(a.vertices)
    )


def kernel_us(
    a: ConvexPolyhedron,
    motion_a: Motion,
    b: ConvexPolyhedron,
    motion_b: Motion,
    method: int,
    times: int = REPEATS,
) -> float:
    """Return the time of a pair in the kernel [us]."""
    ms, _ = best_ms(lambda: kernel_answer(a, motion_a, b, motion_b, method, times), 3)
    return 1e3 * ms / times


TABLES: dict[str, Callable[[], Iterator[dict]]] = {
    'figure2': figure2,
    'pair': pair,
    'exact': exact,
    'growth': growth,
    'pin': pin,
}
