"""
Guaranteed collision detection with toleranced motions [Schroecker & Weber 2014, sec. 6].

A motion is a rational Bezier curve in the space of affine displacements. Pieces of it are enclosed
in balls; where no face of the moving polyhedron can touch or overlap one of the fixed polyhedron
for any displacement of the ball, the piece is free. The rest is suspect: the uncertainty of the
motion there is below epsilon, so some faces come within about that of each other.
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.kernels import ball
from trajectory_guard.kernels.ball import Curve, Limits
from trajectory_guard.shapes.polyhedron import Polyhedron
from trajectory_guard.toleranced.containment import surely_apart
from trajectory_guard.toleranced.curve import curve_of, errors_of, Motion
from trajectory_guard.toleranced.pair import Pair, pair_of
from trajectory_guard.toleranced.suspect import Kind, Suspect, suspect_of, Why

# Halvings before the work is shared out: sixteen parts, whatever the number of threads, so that
# the answer does not depend on it.
SHARED_LEVEL = 4

# Times are exact in a double up to here.
DEEPEST = 48

# More tests than this nobody waits for, and the kernels cannot count.
MOST_TESTS = 2**62


@dataclass(frozen=True, slots=True, eq=False)
class Collisions:
    """
    The answer; free and suspect intervals together are [0, 1].

    :param free: closed intervals at whose every instant the polyhedra are disjoint, farther apart
        than the clearance and the motion's errors; in order, disjoint up to their ends.
    :param suspect: the others, in order of their starts; without hierarchy one for each pair of
        faces that is open.
    :param polygon_pairs: pairs of a moving and a fixed face.
    :param polygon_tests: tests of a fat polygon against a polygon (Listing 2).
    :param node_tests: tests of clusters.
    :param pieces: motion pieces examined.
    :param depth: deepest recursion.
    :param tests_of: (F,) polygon tests by moving face.
    """

    free: tuple[tuple[float, float], ...]
    suspect: tuple[Suspect, ...]
    polygon_pairs: int
    polygon_tests: int
    node_tests: int
    pieces: int
    depth: int
    tests_of: np.ndarray


def collide(
    moving: Polyhedron,
    fixed: Polyhedron,
    motion: Motion,
    *,
    epsilon: float,
    clearance: float = 0.0,
    individual: bool = True,
    moments: np.ndarray | None = None,
    hierarchy: bool = True,
    adapted: bool = True,
    max_depth: int = 32,
    max_tests: int = 100_000_000,
    threads: int = 1,
    stop: np.ndarray | None = None,
) -> Collisions:
    """Prepare two polyhedra and find when they may collide; see `pair_of` and `collisions`."""
    return collisions(
        pair_of(moving, fixed, individual=individual, moments=moments),
        motion,
        epsilon=epsilon,
        clearance=clearance,
        hierarchy=hierarchy,
        adapted=adapted,
        max_depth=max_depth,
        max_tests=max_tests,
        threads=threads,
        stop=stop,
    )


def collisions(
    pair: Pair,
    motion: Motion,
    *,
    epsilon: float,
    clearance: float = 0.0,
    hierarchy: bool = True,
    adapted: bool = True,
    max_depth: int = 32,
    max_tests: int = 100_000_000,
    threads: int = 1,
    stop: np.ndarray | None = None,
) -> Collisions:
    """
    Say when a moving polyhedron may touch or overlap a fixed one (Listing 1).

    :param pair: the polyhedra.
    :param motion: rational Bezier curve of displacements, with bounds on its error if it has any.
    :param epsilon: places are not refined any further where no point of a face moves more than
        this from the middle of a piece (11) [m].
    :param clearance: distance that must be exceeded [m].
    :param hierarchy: search by trees over the faces; or every pair of faces by itself, as the
        paper's Listing 1 does.
    :param adapted: scale each distribution about its barycentre as suits the ball at hand; or take
        it as it is, as the paper does.
    :param max_depth: halvings of the motion, 0 to 48.
    :param max_tests: tests before what is left is given up as suspect.
    :param threads: to share the hierarchical search; the answer does not depend on it.
    :param stop: (1,) int64 that another thread sets to have the rest given up as suspect.
    :returns: free and suspect intervals. Free is proved: of surfaces, and where a polyhedron is
        watertight, of the solid: nothing of the other is inside.
    :raises RequestError: naming the argument and its value.
    """
    curve = curve_of(motion)
    if not 0.0 <= clearance < np.inf:
        raise _invalid(f'clearance must be >= 0, got {clearance}', Reason.INVALID_CLEARANCE)
    if not 0.0 < epsilon < np.inf:
        raise _invalid(f'epsilon must be > 0, got {epsilon}', Reason.INVALID_TOLERANCE)
    for name, value, least in (
        ('max_depth', max_depth, 0),
        ('max_tests', max_tests, 1),
        ('threads', threads, 1),
    ):
        if not (isinstance(value, int | np.integer) and value >= least):
            raise _invalid(f'{name} must be a whole number >= {least}, got {value!r}')
    if max_depth > DEEPEST:
        raise _invalid(f'max_depth must be <= {DEEPEST}, got {max_depth}')
    flag = np.zeros(1, np.int64) if stop is None else stop
    if flag.shape != (1,) or flag.dtype != np.int64:
        raise _invalid(f'stop must be int64 of shape (1,), got {flag.dtype} of shape {flag.shape}')
    errors = errors_of(motion)
    tests = min(max_tests, MOST_TESTS)
    limits = Limits(clearance, *errors, epsilon, max_depth, tests, not hierarchy, adapted)
    ask = partial(ball.cover, pair.packed, curve, stop=flag)
    done = list(_shared(ask, limits, threads)) if hierarchy else [ask(limits)]
    return _answer(pair, curve, done)


def _invalid(message: str, reason: Reason = Reason.INVALID_PARAMETER) -> RequestError:
    return RequestError(reason, message)


def _shared(ask: partial[ball.Covered], limits: Limits, threads: int) -> Iterator[ball.Covered]:
    """Yield the covers of all parts in time order, pending leaves replaced by what they became."""
    begun = ask(limits, until=SHARED_LEVEL)
    pending = begun.leaves['status'] == ball.PENDING
    tasks = begun.leaves[pending]
    if not len(tasks):
        yield begun
        return
    used = begun.counts.node_tests + begun.counts.polygon_tests
    each = limits._replace(max_tests=max(1, (limits.max_tests - used) // len(tasks)))

    def finish(leaf: np.void) -> ball.Covered:
        pairs = np.ascontiguousarray(begun.pairs[leaf['first'] : leaf['last']])
        return ask(each, piece=(int(leaf['numerator']), int(leaf['level'])), pairs=pairs)

    if threads == 1:
        finished = list(map(finish, tasks))
    else:
        with ThreadPoolExecutor(threads) as pool:
            finished = list(pool.map(finish, tasks))
    yield begun._replace(leaves=begun.leaves[~pending])
    yield from finished


def _answer(pair: Pair, curve: Curve, done: list[ball.Covered]) -> Collisions:
    leaves = np.concatenate([covered.leaves for covered in done])
    suspects = [suspect_of(leaf) for leaf in leaves[leaves['status'] == ball.SUSPECT]]
    free = _complement(suspects)
    kept = []
    for start, end in free:
        if not surely_apart(*pair.probes, curve, 0.5 * (start + end)):
            named = (Why.CONTAINED, Kind.CONTAINED, -1, -1, (), (), None)
            suspects.append(Suspect(start, end, *named))
        else:
            kept.append((start, end))
    suspects.sort(key=lambda s: (s.start, s.end, s.moving_face, s.fixed_face))
    return Collisions(
        tuple(kept),
        tuple(suspects),
        pair.packed.moving_faces * pair.packed.fixed_faces,
        sum(covered.counts.polygon_tests for covered in done),
        sum(covered.counts.node_tests for covered in done),
        sum(covered.counts.pieces for covered in done),
        max(covered.counts.depth for covered in done),
        np.add.reduce([covered.tests_of for covered in done]),
    )


def _complement(suspects: list[Suspect]) -> list[tuple[float, float]]:
    """
    Return the rest of [0, 1].

    The ends of a free interval belong to it as well: they are ends of free pieces, which are
    closed.
    """
    free, at = [], 0.0
    for suspect in sorted(suspects, key=lambda s: s.start):
        if suspect.start > at:
            free.append((at, suspect.start))
        at = max(at, suspect.end)
    if at < 1.0:
        free.append((at, 1.0))
    return free
