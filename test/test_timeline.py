"""Leaves to nanoseconds: the partition is exact and a free interval never grows."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from trajectory_guard.kernels import layout
from trajectory_guard.result import Status
from trajectory_guard.timeline import intervals, with_witnesses

STATUS = {
    layout.FREE: Status.FREE,
    layout.SUSPECT: Status.SUSPECT,
    layout.COLLISION: Status.COLLISION,
}


def leaf(segment, start, end, level, status, **known):
    """Return a leaf; what is not told is zero, and no pair is named."""
    row = np.zeros(1, layout.LEAF)
    row['body'] = row['obstacle'] = -1
    for name, value in dict(
        segment=segment, start=start, end=end, level=level, status=status, **known
    ).items():
        row[name] = value
    return row


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
            if rows and {status, rows[-1]['status'][0]} == {layout.FREE, layout.COLLISION}:
                status = layout.SUSPECT
            rows.append(leaf(segment, k, k + 1, level, status, body=0, obstacle=0))

    for segment in range(segments):
        split(segment, 0, 0)
    return knots, np.concatenate(rows)


def exact(knots, row, column):
    """Return the exact time of a leaf's end [ns]."""
    start, end = int(knots[row['segment']]), int(knots[row['segment'] + 1])
    return start + Fraction((end - start) * int(row[column]), 2 ** int(row['level']))


@pytest.mark.parametrize('seed', range(200))
def test_partition_is_exact_and_free_only_shrinks(seed):
    """Ends meet, cover [0, T], and every instant inside a free interval lies in a free layout."""
    knots, tree = leaves(np.random.default_rng(seed))
    if seed % 2:
        knots = knots - knots[0]
    rows = intervals(knots, tree, ['link'], ['box'], int(knots[0]))
    assert rows[0].start_ns == 0
    assert rows[-1].end_ns == knots[-1]
    for a, b in pairwise(rows):
        assert a.end_ns == b.start_ns
    known = [row for row in rows if row.reason != 'start_state_unknown']
    for row in known:
        assert row.end_ns > row.start_ns
        for row_ in tree:
            start, end = exact(knots, row_, 'start'), exact(knots, row_, 'end')
            overlap = min(end, row.end_ns) - max(start, row.start_ns)
            if overlap <= 0:
                continue
            if row.status == Status.FREE:
                assert STATUS[row_['status']] == Status.FREE
            if row.status == Status.COLLISION:
                assert STATUS[row_['status']] != Status.SUSPECT


@pytest.mark.parametrize('seed', range(40))
def test_leaves_that_end_early_leave_the_rest_suspect(seed):
    """What no leaf speaks of is *not examined*, to the last nanosecond."""
    rng = np.random.default_rng(seed)
    knots, tree = leaves(rng)
    whole = intervals(knots, tree, ['link'], ['box'])
    kept = int(rng.integers(len(tree)))
    rows = intervals(knots, tree[:kept], ['link'], ['box'])
    assert rows[-1].end_ns == knots[-1]
    assert (rows[-1].status, rows[-1].reason) == (Status.SUSPECT, 'not_examined')
    for a, b in pairwise(rows):
        assert a.end_ns == b.start_ns
    end = exact(knots, tree[kept - 1], 'end') if kept else knots[0]
    for row in rows:
        if row.status == Status.FREE:
            assert row.end_ns <= end
            assert any(
                other.status == Status.FREE
                and other.start_ns <= row.start_ns
                and row.end_ns <= other.end_ns
                for other in whole
            )


def test_neighbours_of_one_status_merge_and_name_the_smallest_gap():
    """A run of suspect leaves is one interval with the worst pair's place."""
    tree = np.concatenate(
        [
            leaf(0, 0, 1, 2, layout.FREE),
            leaf(
                0,
                1,
                2,
                2,
                layout.SUSPECT,
                body=0,
                obstacle=0,
                lower=-0.1,
                upper=0.3,
                place=(1, 2, 3),
            ),
            leaf(
                0,
                2,
                3,
                2,
                layout.SUSPECT,
                body=1,
                obstacle=0,
                lower=-0.2,
                upper=0.1,
                place=(4, 5, 6),
            ),
            leaf(0, 3, 4, 2, layout.FREE),
        ]
    )
    rows = intervals(np.array([0, 100]), tree, ['a', 'b'], ['box'])
    assert [(r.start_ns, r.end_ns, r.status) for r in rows] == [
        (0, 25, Status.FREE),
        (25, 75, Status.SUSPECT),
        (75, 100, Status.FREE),
    ]
    suspect = rows[1]
    assert (suspect.body, suspect.at_ns, suspect.location) == ('b', 62, (4.0, 5.0, 6.0))
    assert (suspect.gap_lower, suspect.gap_upper) == (-0.2, 0.1)


def test_leaves_of_one_status_and_two_reasons_stay_apart():
    """Why a span is suspect is said for each span."""
    tree = np.concatenate(
        [
            leaf(0, 0, 1, 1, layout.SUSPECT, reason=layout.BY_TOLERANCE),
            leaf(0, 1, 2, 1, layout.SUSPECT, reason=layout.BY_BUDGET),
        ]
    )
    rows = intervals(np.array([0, 100]), tree, ['a'], ['box'])
    assert [(r.end_ns, r.reason) for r in rows] == [(50, 'tolerance'), (100, 'budget')]


def test_a_pose_without_duration_keeps_its_status():
    """A trajectory of one point is an interval of length zero, not an empty answer."""
    tree = leaf(0, 0, 1, 0, layout.COLLISION, body=0, obstacle=0)
    rows = intervals(np.array([0, 0]), tree, ['a'], ['box'])
    assert [(r.start_ns, r.end_ns, r.status) for r in rows] == [(0, 0, Status.COLLISION)]


def test_unknown_start_is_suspect():
    """The time before the first point is never skipped."""
    tree = leaf(0, 0, 1, 0, layout.FREE)
    rows = intervals(np.array([70, 170]), tree, ['a'], ['box'], 70)
    assert [(r.start_ns, r.end_ns, r.status, r.reason) for r in rows] == [
        (0, 70, Status.SUSPECT, 'start_state_unknown'),
        (70, 170, Status.FREE, ''),
    ]


def test_a_run_without_collision_keeps_its_widest_witness():
    """The widest proved middle is cut out; a run with a collision stays as it is."""
    tree = np.concatenate(
        [
            leaf(0, start, end, 2, layout.SUSPECT, body=0, obstacle=0, witness=witness)
            for start, end, witness in ((0, 1, 0), (1, 2, 1), (2, 4, 3))
        ]
    )
    rows = intervals(np.array([0, 4 << 20]), with_witnesses(tree), ['a'], ['box'])
    assert [(r.start_ns, r.end_ns, r.status) for r in rows] == [
        (0, 5 << 18, Status.SUSPECT),
        (5 << 18, 7 << 18, Status.COLLISION),
        (7 << 18, 4 << 20, Status.SUSPECT),
    ]
    tree['status'][0] = layout.COLLISION
    rows = intervals(np.array([0, 4 << 20]), with_witnesses(tree), ['a'], ['box'])
    assert [r.status for r in rows] == [Status.COLLISION, Status.SUSPECT]


def test_a_witness_beside_free_leaves_is_cut_out_of_its_own_run():
    """Free leaves keep their place, and each run of other leaves has its own witness."""
    tree = np.concatenate(
        [
            leaf(0, 0, 1, 2, layout.SUSPECT, body=0, obstacle=0, witness=1),
            leaf(0, 1, 2, 2, layout.FREE),
            leaf(0, 2, 3, 2, layout.SUSPECT, body=0, obstacle=0, witness=2),
            leaf(0, 3, 4, 2, layout.FREE),
        ]
    )
    rows = intervals(np.array([0, 64]), with_witnesses(tree), ['a'], ['box'])
    assert [(r.start_ns, r.end_ns, r.status) for r in rows] == [
        (0, 4, Status.SUSPECT),
        (4, 12, Status.COLLISION),
        (12, 16, Status.SUSPECT),
        (16, 32, Status.FREE),
        (32, 38, Status.SUSPECT),
        (38, 42, Status.COLLISION),
        (42, 48, Status.SUSPECT),
        (48, 64, Status.FREE),
    ]
