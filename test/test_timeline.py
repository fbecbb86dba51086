"""Leaves to nanoseconds: the partition is exact and a free interval never grows."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from trajectory_guard.kernels import leaf
from trajectory_guard.result import Status
from trajectory_guard.timeline import intervals

STATUS = {leaf.FREE: Status.FREE, leaf.SUSPECT: Status.SUSPECT, leaf.COLLISION: Status.COLLISION}


def leaves(rng):
    """Return knots and the leaves of random dyadic trees with random statuses."""
    segments = int(rng.integers(1, 4))
    steps = 10 ** rng.integers(0, 7, size=segments)
    knots = np.cumsum([rng.integers(0, 6), *steps]).astype(np.int64)
    rows = []

    def split(segment, k, level):
        if level < 24 and rng.random() < 0.45:
            split(segment, 2 * k, level + 1)
            split(segment, 2 * k + 1, level + 1)
        else:
            status = rng.choice(sorted(STATUS))
            # At their common instant a pose would be both free and overlapping.
            if rows and {status, rows[-1][4]} == {leaf.FREE, leaf.COLLISION}:
                status = leaf.SUSPECT
            rows.append((segment, k, k + 1, level, status, 0, 0, 0, 0))

    for segment in range(segments):
        split(segment, 0, 0)
    return knots, np.array(rows, np.int64)


def exact(knots, row, column):
    """Return the exact time of a leaf's end [ns]."""
    start, end = int(knots[row[0]]), int(knots[row[0] + 1])
    return start + Fraction((end - start) * int(row[column]), 2 ** int(row[3]))


@pytest.mark.parametrize('seed', range(200))
def test_partition_is_exact_and_free_only_shrinks(seed):
    """Ends meet, cover [0, T], and every instant inside a free interval lies in a free leaf."""
    knots, ints = leaves(np.random.default_rng(seed))
    if seed % 2:
        knots = knots - knots[0]
    rows = intervals(knots, ints, np.zeros((len(ints), 7)), ['link'], ['box'], int(knots[0]))
    assert rows[0].start_ns == 0
    assert rows[-1].end_ns == knots[-1]
    for a, b in pairwise(rows):
        assert a.end_ns == b.start_ns
    known = [row for row in rows if row.reason != 'start_state_unknown']
    for row in known:
        assert row.end_ns > row.start_ns
        for row_ in ints:
            start, end = exact(knots, row_, 1), exact(knots, row_, 2)
            overlap = min(end, row.end_ns) - max(start, row.start_ns)
            if overlap <= 0:
                continue
            if row.status == Status.FREE:
                assert STATUS[row_[4]] == Status.FREE
            if row.status == Status.COLLISION:
                assert STATUS[row_[4]] != Status.SUSPECT


def test_neighbours_of_one_status_merge_and_name_the_smallest_gap():
    """A run of suspect leaves is one interval with the worst pair's place."""
    ints = np.array(
        [[0, 0, 1, 2, leaf.FREE, 0, -1, -1, 0]]
        + [[0, k, k + 1, 2, leaf.SUSPECT, 0, k - 1, 0, 0] for k in (1, 2)]
        + [[0, 3, 4, 2, leaf.FREE, 0, -1, -1, 0]]
    )
    floats = np.array(
        [[0.0] * 7, [-0.1, 0.3, 1, 2, 3, 0, 0], [-0.2, 0.1, 4, 5, 6, 0, 0], [0.0] * 7]
    )
    rows = intervals(np.array([0, 100]), ints, floats, ['a', 'b'], ['box'])
    assert [(r.start_ns, r.end_ns, r.status) for r in rows] == [
        (0, 25, Status.FREE),
        (25, 75, Status.SUSPECT),
        (75, 100, Status.FREE),
    ]
    suspect = rows[1]
    assert (suspect.body, suspect.at_ns, suspect.location) == ('b', 62, (4.0, 5.0, 6.0))
    assert (suspect.gap_lower, suspect.gap_upper) == (-0.2, 0.1)


def test_a_pose_without_duration_keeps_its_status():
    """A trajectory of one point is an interval of length zero, not an empty answer."""
    ints = np.array([[0, 0, 1, 0, leaf.COLLISION, 0, 0, 0, 0]])
    rows = intervals(np.array([0, 0]), ints, np.zeros((1, 7)), ['a'], ['box'])
    assert [(r.start_ns, r.end_ns, r.status) for r in rows] == [(0, 0, Status.COLLISION)]


def test_unknown_start_is_suspect():
    """The time before the first point is never skipped."""
    ints = np.array([[0, 0, 1, 0, leaf.FREE, 0, -1, -1, 0]])
    rows = intervals(np.array([70, 170]), ints, np.zeros((1, 7)), ['a'], ['box'], 70)
    assert [(r.start_ns, r.end_ns, r.status, r.reason) for r in rows] == [
        (0, 70, Status.SUSPECT, 'start_state_unknown'),
        (70, 170, Status.FREE, ''),
    ]


def test_a_run_without_collision_keeps_its_widest_witness():
    """The widest proved middle is cut out; a run with a collision stays as it is."""
    suspect = [0, 0, 0, 2, leaf.SUSPECT, 0, 0, 0, 0]
    ints = np.array([suspect, suspect, suspect])
    ints[:, leaf.START] = 0, 1, 2
    ints[:, leaf.END] = 1, 2, 4
    ints[:, leaf.WITNESS] = 0, 1, 3
    rows = intervals(np.array([0, 4 << 20]), ints, np.zeros((3, 7)), ['a'], ['box'])
    assert [(r.start_ns, r.end_ns, r.status) for r in rows] == [
        (0, 5 << 18, Status.SUSPECT),
        (5 << 18, 7 << 18, Status.COLLISION),
        (7 << 18, 4 << 20, Status.SUSPECT),
    ]
    ints[0, leaf.STATUS] = leaf.COLLISION
    rows = intervals(np.array([0, 4 << 20]), ints, np.zeros((3, 7)), ['a'], ['box'])
    assert [r.status for r in rows] == [Status.COLLISION, Status.SUSPECT]
