"""Constraints along rational motions: the exact value lies within the error."""

from fractions import Fraction
import itertools
import math
from types import SimpleNamespace

from bench_data import cases, workcell
from canny_judge import bezier, cross, dot, minus, rotated
import numpy as np
import pytest

from trajectory_guard.canny.along import _moved, _Scaled, _weight, along
from trajectory_guard.canny.constraint import Kind
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.motions.link_motion import Builder, rational_motion
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.joint_path import joint_path

KINDS = list(Kind)
SAMPLES = [Fraction(i, 12) for i in range(13)]


class Screw:
    """An exactly rigid motion: x(s) and Q(s) polynomials, and its rational motion rounded once."""

    def __init__(self, rng, degree_x=2, degree_q=2):
        self.x = np.round(rng.normal(size=(degree_x + 1, 3)) * 64) / 64
        turn = np.round(rng.normal(size=(degree_q + 1, 3)) * 16) / 64
        self.Q = np.column_stack((np.ones(degree_q + 1), turn))
        n = degree_x + 2 * degree_q
        self.weights, rows = self.fitted(n)
        controls = [[float(c / w) for c in row] for row, w in zip(rows, self.weights, strict=True)]
        # Both are rounded once: relative errors of 2^-53 on coordinates of a few metres.
        weights = np.array([float(w / math.comb(n, i)) for i, w in enumerate(self.weights)])
        poses = np.array(controls).reshape(-1, 3, 4)
        self.motion = RationalMotion(poses, weights, 1e-13, 0.0, 0.0)

    def pose(self, s):
        """Return w, w R by rows and w x: polynomials, exactly."""
        Q, x = bezier(self.Q, s), bezier(self.x, s)
        w = dot(Q, Q)
        columns = [rotated(e, Q) for e in np.eye(3, dtype=int).tolist()]
        return w, [[w * columns[c][r] for c in range(3)] + [w * x[r]] for r in range(3)]

    def fitted(self, n):
        """Return scaled Bernstein coefficients of degree n by interpolation, exactly."""
        places = [Fraction(i, n) for i in range(n + 1)]
        table = [[s**i * (1 - s) ** (n - i) for i in range(n + 1)] for s in places]
        values = [[w, *itertools.chain(*rows)] for w, rows in map(self.pose, places)]
        for i in range(n + 1):
            pivot = next(r for r in range(i, n + 1) if table[r][i])
            table[i], table[pivot] = table[pivot], table[i]
            values[i], values[pivot] = values[pivot], values[i]
            for r in range(n + 1):
                if r != i and table[r][i]:
                    q = table[r][i] / table[i][i]
                    table[r] = [a - q * b for a, b in zip(table[r], table[i], strict=True)]
                    values[r] = [a - q * b for a, b in zip(values[r], values[i], strict=True)]
        solved = [[v / table[i][i] for v in values[i]] for i in range(n + 1)]
        return [row[0] for row in solved], [row[1:] for row in solved]

    def moved(self, point, s):
        """Return the image of a point, exactly."""
        Q, x = bezier(self.Q, s), bezier(self.x, s)
        return [a + b for a, b in zip(rotated([Fraction(c) for c in point], Q), x, strict=True)]


def exact_value(kind, moved, of_a, of_b):
    """Return the value of a constraint; `moved` gives images of points of A."""
    fractions = [[Fraction(c) for c in p] for p in np.atleast_2d(of_b).tolist()]
    images = [moved(p) for p in np.atleast_2d(of_a).tolist()]
    if kind == Kind.C:
        (tail, head), (t, h) = images, fractions
        return dot(cross(minus(head, tail), minus(h, t)), minus(tail, t))
    (c0, c1, c2), (p,) = (images, fractions) if kind == Kind.A else (fractions, images)
    return dot(cross(minus(c1, c0), minus(c2, c0)), minus(p, c0))


def random_features(rng, kind):
    """Return points of both bodies."""
    shapes = {Kind.A: ((3, 3), 3), Kind.B: (3, (3, 3)), Kind.C: ((2, 3), (2, 3))}[kind]
    return [rng.normal(size=shape) for shape in shapes]


def polynomial(coefficients, s):
    """Evaluate Bernstein coefficients exactly."""
    n = len(coefficients) - 1
    exact = [Fraction(c) for c in coefficients.tolist()]
    return sum(math.comb(n, i) * c * s**i * (1 - s) ** (n - i) for i, c in enumerate(exact))


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('seed', range(4))
def test_exact_value_lies_within_the_error(kind, seed):
    """Of a motion that is a polynomial displacement, as a free body has it."""
    rng = np.random.default_rng(seed)
    screw = Screw(rng)
    of_a, of_b = random_features(rng, kind)
    found = along(screw.motion, kind, of_a, of_b)
    assert len(found.coefficients) == len(screw.motion.weights)
    assert found.error < 1e-10
    exact_weights = [Fraction(w) for w in screw.motion.weights.tolist()]
    n = len(exact_weights) - 1
    for s in SAMPLES:
        w = sum(
            math.comb(n, i) * c * s**i * (1 - s) ** (n - i) for i, c in enumerate(exact_weights)
        )
        value = exact_value(kind, lambda p, s=s: screw.moved(p, s), of_a, of_b)
        assert abs(polynomial(found.coefficients, s) - w * value) <= Fraction(found.error)


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('weight', [1.0, 0.125, 3.0, 1e3])
def test_a_body_that_stands_has_a_weight_like_any_other(kind, weight):
    """One control point: the value is still that times the weight, and so is its error."""
    rng = np.random.default_rng(8)
    pose = np.column_stack((np.eye(3), [0.5, -0.25, 2.0]))
    of_a, of_b = random_features(rng, kind)
    found = along(RationalMotion(pose[None], np.array([weight]), 0.0, 0.0, 0.0), kind, of_a, of_b)
    shift = [Fraction(c) for c in pose[:, 3].tolist()]
    value = exact_value(
        kind, lambda p: [Fraction(x) + t for x, t in zip(p, shift, strict=True)], of_a, of_b
    )
    (constant,) = found.coefficients.tolist()
    assert abs(Fraction(constant) - Fraction(weight) * value) <= Fraction(found.error)
    assert found.error < 1e-12 * weight


@pytest.mark.parametrize('kind', KINDS)
def test_a_motion_with_an_error_has_one_that_covers_it(kind):
    """True points moved off by up to e: a rigid shift of e in any direction."""
    rng = np.random.default_rng(3)
    screw = Screw(rng)
    of_a, of_b = random_features(rng, kind)
    e = 0.01
    loose = RationalMotion(screw.motion.control_points, screw.motion.weights, e, 0.0, 0.0)
    found = along(loose, kind, of_a, of_b)
    largest = 0.0
    for s, shift in itertools.product(
        SAMPLES, np.concatenate((np.eye(3), -np.eye(3))) * (e - 1e-12)
    ):
        shift = [Fraction(x) for x in shift.tolist()]
        w, _ = screw.pose(s)

        def moved(p, s=s, shift=shift):
            return [a + b for a, b in zip(screw.moved(p, s), shift, strict=True)]

        off = abs(polynomial(found.coefficients, s) - w * exact_value(kind, moved, of_a, of_b))
        assert off <= Fraction(found.error)
        largest = max(largest, float(off) / found.error)
    assert largest > 0.02  # a bound far from every case would hide a wrong unit


@pytest.mark.parametrize('kind', [Kind.A, Kind.C])
@pytest.mark.parametrize('far', [0.0, 20.0])
def test_both_parts_of_the_error_are_needed(kind, far):
    """A small turn seen from far away; a small shift where the features touch."""
    e, angle = 0.01, Fraction(1, 256)
    corners = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    of_a = corners if kind == Kind.A else corners[:2]
    place = corners[0] + [far, 0.0, 0.0]
    of_b = place if kind == Kind.A else np.array([place, place + [0.0, 1.0, 0.0]])
    still = np.eye(3, 4)[None]
    found = along(RationalMotion(still, np.ones(1), e, 0.0, 0.0), kind, of_a, of_b)
    largest = 0.0
    for axis in np.eye(3, dtype=int).tolist():
        if far:
            # tan(angle / 2) = 1 / 256: points at a distance of 1 move by less than 2 / 256 < e.
            turn = [Fraction(1), *(angle * x for x in axis)]

            def moved(p, turn=turn):
                return rotated([Fraction(x) for x in p], turn)
        else:

            def moved(p, axis=axis):
                return [Fraction(x) + Fraction(e) * y for x, y in zip(p, axis, strict=True)]

        value = exact_value(kind, moved, of_a, of_b)
        off = abs(Fraction(found.coefficients[0]) - value)
        assert off <= Fraction(found.error)
        largest = max(largest, float(off) / found.error)
    assert largest > 0.15


@pytest.mark.parametrize('seed', range(4))
def test_rounding_is_carried_along(seed):
    """Products, sums and moved points against exact ones, of operands that err or not."""
    rng = np.random.default_rng(seed)
    for error in (0.0, 1e-3):
        f, g = (_Scaled(rng.normal(size=n), np.full(n, error)) for n in (4, 7))
        x, y = ([Fraction(c) + Fraction(error) for c in one.c.tolist()] for one in (f, g))
        product = [Fraction(0)] * 10
        for (i, a), (j, b) in itertools.product(enumerate(x), enumerate(y)):
            product[i + j] += a * b
        check_scaled(f * g, product)
        h = _Scaled(rng.normal(size=4) * 3, np.full(4, error))
        z = [Fraction(c) + Fraction(error) for c in h.c.tolist()]
        check_scaled(f + h, [a + b for a, b in zip(x, z, strict=True)])
        opposite = [Fraction(c) - Fraction(error) for c in h.c.tolist()]
        check_scaled(f - h, [a - b for a, b in zip(x, opposite, strict=True)])
    motion = RationalMotion(rng.normal(size=(5, 3, 4)), rng.uniform(1, 2, 5), 0.0, 0.0, 0.0)
    point = rng.normal(size=3)
    ends = [Fraction(c) for c in [*point.tolist(), 1.0]]
    for r, one in enumerate(_moved(motion, _weight(motion), point)):
        rows = [[Fraction(c) for c in row] for row in motion.control_points[:, r].tolist()]
        weights = [math.comb(4, i) * Fraction(w) for i, w in enumerate(motion.weights.tolist())]
        check_scaled(one, [w * dot(row, ends) for w, row in zip(weights, rows, strict=True)])


def check_scaled(found, exact):
    """Check every coefficient; rounding alone makes some differ."""
    off = [abs(Fraction(c) - x) for c, x in zip(found.c.tolist(), exact, strict=True)]
    assert max(off) > 0
    assert all(o <= Fraction(e) for o, e in zip(off, found.error.tolist(), strict=True))


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('robot', ['panda', 'ur5'])
def test_on_real_robots_both_builders_agree(kind, robot):
    """A chain of rational rotations divides out; so does, within its error, an economised one."""
    rng = np.random.default_rng(2)
    cell = workcell(robot)
    trajectory, *_ = cases(robot)[5]
    path = joint_path(cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
    (body,) = np.flatnonzero(cell.link_nodes >= 0)[2:3]
    link = cell.link_names[body]
    T = cell.tree.link_pose[link]
    vertices = cell.robot.bodies(link)[0].vertices @ T[:3, :3].T + T[:3, 3]
    count = {Kind.A: 3, Kind.B: 1, Kind.C: 2}[kind]
    of_a = vertices[rng.choice(len(vertices), count, False)]
    of_a = of_a[0] if kind == Kind.B else of_a
    of_b = random_features(rng, kind)[1]
    found = {}
    for builder in Builder:
        motion = rational_motion(cell, path, int(body), 1, 1, 3, builder=builder)
        found[builder] = motion, along(motion, kind, of_a, of_b)
    rational, result = found[Builder.RATIONAL]
    assert len(result.coefficients) == len(rational.weights)
    for s in SAMPLES:
        spans = []
        for motion, one in found.values():
            w = float(polynomial(motion.weights, s))
            value = float(polynomial(one.coefficients, s))
            spans.append(((value - one.error) / w - 1e-12, (value + one.error) / w + 1e-12))
        (a, b), (c, d) = spans
        assert max(a, c) <= min(b, d)
    # Little beyond what the motion itself errs.
    size = np.abs(result.coefficients).max()
    assert result.error <= 100 * rational.error * rational.weights.max() + 1e-9 * size


@pytest.mark.parametrize(
    ('kind', 'of_a', 'of_b', 'words'),
    [
        (Kind.A, np.zeros((2, 3)), np.zeros(3), r'of_a: shape \(2, 3\)'),
        (Kind.B, np.zeros(3), np.zeros(3), r'of_b: shape \(3,\)'),
        (Kind.C, np.zeros((2, 3)), np.full((2, 3), np.nan), 'of_b: .* not finite'),
        (Kind.B, np.full(3, 1e10), np.zeros((3, 3)), 'of_a: one exceeds'),
    ],
)
def test_what_is_refused(kind, of_a, of_b, words):
    motion = Screw(np.random.default_rng(0)).motion
    with pytest.raises(RequestError, match=words) as caught:
        along(motion, kind, of_a, of_b)
    assert caught.value.reason == Reason.INVALID_PARAMETER


@pytest.mark.parametrize('kind', KINDS)
def test_nonsense_has_no_bound(kind):
    """A motion that is not a number certifies nothing."""
    rng = np.random.default_rng(0)
    good = Screw(rng).motion
    bad = SimpleNamespace(
        control_points=good.control_points * math.nan, weights=good.weights, error=0.0
    )
    assert along(bad, kind, *random_features(rng, kind)).error == math.inf
