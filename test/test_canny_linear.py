"""Four points on straight lines: against exact geometry at exact instants, and exact data."""

from fractions import Fraction

from canny_judge import cross, dot, minus
import numpy as np
import pytest

from trajectory_guard.canny import Answer, linear_answers, linear_contacts, LinearKind
from trajectory_guard.errors import Reason, RequestError

KINDS = list(LinearKind)
STEPS = 12


def points_at(rows, s):
    """Return the four points at s, exactly."""
    ends = [[Fraction(x) for x in p] for p in np.asarray(rows).tolist()]
    return [
        [(1 - s) * x + s * y for x, y in zip(p, q, strict=True)]
        for p, q in zip(ends[:4], ends[4:], strict=True)
    ]


def on_segment(p, q, r):
    """Say whether p lies in the closed segment q r."""
    return not any(cross(minus(p, q), minus(r, q))) and dot(minus(p, q), minus(p, r)) <= 0


def meet(kind, points):
    """Say whether the features have a common point, by areas along the normal."""
    a, b, c, d = points
    if kind == LinearKind.VERTEX_FACE:
        n = cross(minus(c, b), minus(d, b))
        if not any(n):
            return on_segment(a, b, c) or on_segment(a, c, d) or on_segment(a, d, b)
        shares = [dot(n, cross(minus(p, a), minus(q, a))) for p, q in ((b, c), (c, d), (d, b))]
        return dot(n, minus(a, b)) == 0 and min(shares) >= 0
    n = cross(minus(b, a), minus(d, c))
    if not any(n):
        return any(on_segment(*x) for x in ((a, c, d), (b, c, d), (c, a, b), (d, a, b)))
    across = minus(c, a)
    shares = [dot(n, cross(across, minus(d, c))), dot(n, cross(across, minus(b, a)))]
    return dot(n, across) == 0 and all(0 <= x <= dot(n, n) for x in shares)


def check(kind, rows):
    """Exact spans agree with geometry at many instants; rounded answers with the spans."""
    spans = linear_contacts(kind, rows)
    (answer,) = linear_answers(kind, np.asarray(rows, float)[None])
    assert not (spans and answer == Answer.APART)
    assert spans or answer != Answer.MEETING
    for i in range(STEPS + 1):
        s = Fraction(i, STEPS)
        inside = [x for x in spans if x[0].lower <= s <= x[1].upper]
        if all(x[0].upper <= s <= x[1].lower for x in inside):
            assert meet(kind, points_at(rows, s)) == bool(inside), s
    for first, last in spans:
        for end in (first, last):
            if end.lower == end.upper:
                assert meet(kind, points_at(rows, end.lower))
    return spans, answer


@pytest.mark.parametrize('kind', KINDS)
def test_small_integers_are_full_of_degenerate_cases(kind):
    """Collinear, coplanar, coincident: about a fifth touch."""
    rng = np.random.default_rng(int(kind))
    found = [check(kind, rng.integers(-1, 2, (8, 3))) for _ in range(100)]
    assert 10 < sum(bool(spans) for spans, _ in found) < 90
    assert any(a.upper < b.lower for spans, _ in found for a, b in spans)


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('scale', [1e-6, 1.0, 1e6])
def test_random_queries(kind, scale):
    """In general position nothing stays undecided."""
    rng = np.random.default_rng(5)
    rows = [scale * rng.normal(size=(8, 3)) for _ in range(30)]
    answers = [check(kind, one) for one in rows]
    for spans, answer in answers:
        assert answer == (Answer.MEETING if spans else Answer.APART)
    assert {bool(spans) for spans, _ in answers} == {True, False}


FACE = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]
LINE = [[0, 0, 0], [2, 0, 0], [4, 0, 0]]
CASES = {
    'through the face': (KINDS[0], [[1, 1, -1], *FACE], [[1, 1, 1], *FACE], [(0.5, 0.5)]),
    'past the face': (KINDS[0], [[3, 3, -1], *FACE], [[3, 3, 1], *FACE], []),
    'onto its corner': (KINDS[0], [[0, 0, -1], *FACE], [[0, 0, 0], *FACE], [(1.0, 1.0)]),
    'in its plane': (KINDS[0], [[-4, 1, 0], *FACE], [[4, 1, 0], *FACE], [(0.5, 0.875)]),
    'in its plane, past': (KINDS[0], [[-4, 5, 0], *FACE], [[4, 5, 0], *FACE], []),
    'face without area': (KINDS[0], [[1, -1, 0], *LINE], [[1, 1, 0], *LINE], [(0.5, 0.5)]),
    'beyond its end': (KINDS[0], [[5, -1, 0], *LINE], [[5, 1, 0], *LINE], []),
    'face becomes a line': (KINDS[0], [[1, 0, 0], *FACE], [[1, 0, 0], *LINE], [(0.0, 1.0)]),
    'edges cross': (
        KINDS[1],
        [[-1, 0, 0], [1, 0, 0], [0, -1, 1], [0, 1, 1]],
        [[-1, 0, 0], [1, 0, 0], [0, -1, -1], [0, 1, -1]],
        [(0.5, 0.5)],
    ),
    'parallel edges slide': (
        KINDS[1],
        [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]],
        [[0, 0, 0], [1, 0, 0], [-2, 0, 0], [-1, 0, 0]],
        [(0.25, 0.75)],
    ),
    'parallel edges apart': (
        KINDS[1],
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]],
        [[0, 0, 0], [1, 0, 0], [3, 1, 0], [4, 1, 0]],
        [],
    ),
    'two points': (
        KINDS[1],
        [[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0]],
        [[0, 0, 0], [0, 0, 0], [-1, 0, 0], [-1, 0, 0]],
        [(0.5, 0.5)],
    ),
}


@pytest.mark.parametrize('name', CASES)
def test_cases_known_by_hand(name):
    kind, start, end, wanted = CASES[name]
    spans, _ = check(kind, [*start, *end])
    assert [(float(a), float(b)) for a, b in spans] == wanted


@pytest.mark.parametrize(
    ('rows', 'words'),
    [
        (np.zeros((7, 3)), 'shape'),
        (np.full((8, 3), np.nan), 'not finite'),
        (np.full((8, 3), 2e9), 'exceeds'),
    ],
)
def test_what_is_refused(rows, words):
    for ask, what in ((linear_contacts, rows), (linear_answers, rows[None])):
        with pytest.raises(RequestError, match=words) as caught:
            ask(KINDS[0], what)
        assert caught.value.reason == Reason.INVALID_PARAMETER


def test_no_queries():
    assert len(linear_answers(KINDS[0], np.zeros((0, 8, 3)))) == 0
