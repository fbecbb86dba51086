"""Leaves to nanoseconds: the partition is exact and a free interval never grows."""

from fractions import Fraction

import numpy as np
import pytest

from trajectory_guard.kernels import cover
from trajectory_guard.result import Status
from trajectory_guard.timeline import intervals

STATUS = {cover.FREE: Status.FREE, cover.SUSPECT: Status.SUSPECT, cover.COLLISION: Status.COLLISION}


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
            if rows and {status, rows[-1][4]} == {cover.FREE, cover.COLLISION}:
                status = cover.SUSPECT
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
    rows = intervals(knots, ints, np.zeros((len(ints), 5)), ['link'], ['box'], int(knots[0]))
    assert rows[0].start_ns == 0
    assert rows[-1].end_ns == knots[-1]
    for a, b in zip(rows, rows[1:]):
        assert a.end_ns == b.start_ns
    known = [row for row in rows if row.reason != 'start_state_unknown']
    for row in known:
        assert row.end_ns > row.start_ns
        for leaf in ints:
            start, end = exact(knots, leaf, 1), exact(knots, leaf, 2)
            overlap = min(end, row.end_ns) - max(start, row.start_ns)
            if overlap <= 0:
                continue
            if row.status == Status.FREE:
                assert STATUS[leaf[4]] == Status.FREE
            if row.status == Status.COLLISION:
                assert STATUS[leaf[4]] != Status.SUSPECT


def test_neighbours_of_one_status_merge_and_name_the_smallest_gap():
    """A run of suspect leaves is one interval with the worst pair's place."""
    ints = np.array(
        [[0, 0, 1, 2, cover.FREE, 0, -1, -1, 0]]
        + [[0, k, k + 1, 2, cover.SUSPECT, 0, k - 1, 0, 0] for k in (1, 2)]
        + [[0, 3, 4, 2, cover.FREE, 0, -1, -1, 0]]
    )
    floats = np.array([[0.0] * 5, [-0.1, 0.3, 1, 2, 3], [-0.2, 0.1, 4, 5, 6], [0.0] * 5])
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
    ints = np.array([[0, 0, 1, 0, cover.COLLISION, 0, 0, 0, 0]])
    rows = intervals(np.array([0, 0]), ints, np.zeros((1, 5)), ['a'], ['box'])
    assert [(r.start_ns, r.end_ns, r.status) for r in rows] == [(0, 0, Status.COLLISION)]


def test_unknown_start_is_suspect():
    """The time before the first point is never skipped."""
    ints = np.array([[0, 0, 1, 0, cover.FREE, 0, -1, -1, 0]])
    rows = intervals(np.array([70, 170]), ints, np.zeros((1, 5)), ['a'], ['box'], 70)
    assert [(r.start_ns, r.end_ns, r.status, r.reason) for r in rows] == [
        (0, 70, Status.SUSPECT, 'start_state_unknown'),
        (70, 170, Status.FREE, ''),
    ]


def test_a_run_without_collision_keeps_its_widest_witness():
    """Of two leaves with a proved middle the wider middle is cut out; a run with a collision is left."""
    suspect = [0, 0, 0, 2, cover.SUSPECT, 0, 0, 0, 0]
    ints = np.array([suspect, suspect, suspect])
    ints[:, cover.START] = 0, 1, 2
    ints[:, cover.END] = 1, 2, 4
    ints[:, cover.WITNESS] = 0, 1, 3
    rows = intervals(np.array([0, 4 << 20]), ints, np.zeros((3, 5)), ['a'], ['box'])
    assert [(r.start_ns, r.end_ns, r.status) for r in rows] == [
        (0, 5 << 18, Status.SUSPECT),
        (5 << 18, 7 << 18, Status.COLLISION),
        (7 << 18, 4 << 20, Status.SUSPECT),
    ]
    ints[0, cover.STATUS] = cover.COLLISION
    rows = intervals(np.array([0, 4 << 20]), ints, np.zeros((3, 5)), ['a'], ['box'])
    assert [r.status for r in rows] == [Status.COLLISION, Status.SUSPECT]
