"""The basic tests say 'apart' only where rational arithmetic agrees, and where it clearly does."""

from fractions import Fraction

from exact_orbit import dot, fractions, Pair
import numpy as np
import pytest

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.toleranced.affine import Affine
from trajectory_guard.toleranced.contact import apart
from trajectory_guard.toleranced.displacement_ball import DisplacementBall
from trajectory_guard.toleranced.fat_edge import FatEdge
from trajectory_guard.toleranced.fat_point import FatPoint
from trajectory_guard.toleranced.fat_polygon import FatPolygon
from trajectory_guard.toleranced.metric import MassDistribution
from trajectory_guard.toleranced.polygon import Polygon
from trajectory_guard.toleranced.quadratic import (
    certainly_longer,
    least_value,
    lower_bound,
    Quadratic,
    SEGMENT,
    SQUARE,
    TRIANGLE,
)

SCALES = (1e-6, 1e-3, 1.0, 1e3, 1e6)
# Corners of the fixed and of the moving simplex.
KINDS = {'vertex/face': (3, 1), 'edge/edge': (2, 2), 'face/vertex': (1, 3), 'vertex/edge': (2, 1)}


def case(rng, kind, scale=1.0, offset=0.0, affine=False):
    """Return corners of a fixed and a moving simplex, a metric and a centre."""
    moving = scale * rng.normal(size=(KINDS[kind][1], 3))
    body = np.concatenate((moving, scale * rng.normal(size=(5 - len(moving), 3))))
    metric = MassDistribution.of_points(body, rng.uniform(0.2, 2.0, len(body)))
    A = rng.normal(size=(3, 3))
    A = A if affine else np.linalg.qr(A)[0]
    center = np.column_stack((A, scale * offset * rng.normal(size=3)))
    fixed = scale * rng.normal(size=(KINDS[kind][0], 3))
    way = scale * rng.normal(size=3) * 10.0 ** rng.uniform(-2, 1)
    return fixed + center[:, 3] + way, moving, metric, center


def largest_radius(fixed, moving, metric, center, thickness=0.0):
    """Return the largest R found with which the two are proved apart; 0 if there is none."""

    def proved(R):
        ball = DisplacementBall(metric, center, R)
        return apart(fixed, ball.orbit(moving), thickness)

    low, high = 0.0, 1.0
    while proved(high):
        low, high = high, 2.0 * high
    if low == 0.0 and not proved(2.0**-60):
        return 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if proved(middle) else (low, middle)
    return low


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize(
    ('scale', 'offset'), [(1.0, 0.0), (1.0, 1e3), *[(s, 1.0) for s in SCALES]]
)
def test_apart_means_apart_next_to_tangency(kind, scale, offset):
    """At the largest radius that is proved, exactly apart; with a little more, exactly not."""
    rng = np.random.default_rng(0)
    found = 0
    for k in range(8):
        fixed, moving, metric, center = case(rng, kind, scale, offset, affine=k % 3 == 0)
        R = largest_radius(fixed, moving, metric, center)
        if R == 0.0:
            continue
        found += 1
        least, place = Pair(fixed, moving, DisplacementBall(metric, center, R)).least()
        assert least > 0
        touching = Pair(fixed, moving, DisplacementBall(metric, center, R * (1.0 + 1e-8)))
        assert touching.q(place) <= 0
    assert found > 5


@pytest.mark.parametrize('kind', KINDS)
def test_apart_means_apart_for_any_radius(kind):
    """Random radii, small and large: all three cases of Remark 1 among them."""
    rng = np.random.default_rng(1)
    answers = []
    for k in range(60):
        fixed, moving, metric, center = case(rng, kind, affine=k % 3 == 0)
        ball = DisplacementBall(metric, center, float(10.0 ** rng.uniform(-3, 0.7)))
        least, _ = Pair(fixed, moving, ball).least()
        answers.append(apart(fixed, ball.orbit(moving)))
        assert answers[-1] == (least > 0)  # none of these is within rounding of tangency
    assert 5 < sum(answers) < 55


@pytest.mark.parametrize('kind', KINDS)
def test_thickness_is_counted(kind):
    """|f - g(e)| > R rho(e) + d at many exact points, also where the least quadratic is."""
    rng = np.random.default_rng(2)
    found = 0
    for k in range(14):
        fixed, moving, metric, center = case(rng, kind, affine=k % 3 == 0)
        d = float(10.0 ** rng.uniform(-4, 0.3))
        R = largest_radius(fixed, moving, metric, center, d)
        if R == 0.0:
            continue
        found += 1
        pair = Pair(fixed, moving, DisplacementBall(metric, center, R))
        _, place = pair.least()
        n = pair.dimension
        places = [place, *np.eye(n), np.zeros(n)]
        for x in rng.dirichlet(np.ones(n + 1), 20):
            places.append(x[:n])
        for x in places:
            assert pair.farther_at([Fraction(float(t)) for t in x], d)
    assert found > 8


def test_thickness_of_a_convex_case_is_tight():
    """Where the minimum is one of a convex function the right k gives nothing away."""
    rng = np.random.default_rng(3)
    for kind in KINDS:
        for _ in range(5):
            fixed, moving, metric, center = case(rng, kind)
            R = largest_radius(fixed, moving, metric, center)
            # Half of the room for each.
            ball = DisplacementBall(metric, center, 1e-3 * R)
            least, place = Pair(fixed, moving, ball).least()
            if least <= 0:
                continue
            away, radius = Pair(fixed, moving, ball).squares(place)
            room = float(away) ** 0.5 - float(radius) ** 0.5
            assert apart(fixed, ball.orbit(moving), room * 0.999)
            assert not apart(fixed, ball.orbit(moving), room * (1.0 + 1e-9))


# Numbers without rounding: total mass 1, barycentre 0, J = I, so rho = 1 in the origin and
# rho^2 = 2 in a distance of 1.
UNIT = MassDistribution(1.0, np.zeros(3), np.eye(3))
IDENTITY = np.eye(3, 4)
BIG = 4.0 * np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])


@pytest.mark.parametrize('scale', [2.0**-20, 1.0, 2.0**20])
@pytest.mark.parametrize('thickness', [0.0, 0.25])
def test_exact_touch_and_one_ulp_either_side(scale, thickness):
    """A ball of radius 1/2 touches a face; one ulp beyond is never certified wrongly."""
    metric = MassDistribution(1.0, np.zeros(3), scale * np.eye(3))
    R, d = 0.5 * scale, thickness * scale
    ball = DisplacementBall(metric, IDENTITY, R)
    touch = R + d
    for height in (np.nextafter(touch, 0.0), touch):
        face = scale * BIG + [0.0, 0.0, height]
        assert not apart(face, ball.orbit(np.zeros((1, 3))), d)
        assert not apart(face[:2] + [0, 0, 0], ball.orbit(np.zeros((1, 3))), d + 4.0 * scale)
        point = np.array([[0.0, 0.0, height]])
        assert not apart(point, ball.orbit(np.zeros((1, 3))), d)
        # The face and the edges have their least rate in the origin, too.
        assert not apart(point, ball.orbit(scale * BIG), d)
        x = scale * np.array([[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
        y = scale * np.array([[0.0, -3.0, 0.0], [0.0, 3.0, 0.0]]) + [0.0, 0.0, height]
        assert not apart(y, ball.orbit(x), d)
        assert not apart(x + [0.0, 0.0, height], ball.orbit(x), d)  # parallel
    # The margin goes with the squares of the features' sizes.
    clear = [0.0, 0.0, touch * (1.0 + 1e-10)]
    assert apart(scale * BIG + clear, ball.orbit(np.zeros((1, 3))), d)
    assert apart(np.array([clear]), ball.orbit(np.zeros((1, 3))), d)
    x = scale * np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert apart(x[:, [1, 0, 2]] + clear, ball.orbit(x), d)
    assert apart(np.array([clear]), ball.orbit(scale * BIG), d)


@pytest.mark.parametrize('R', [0.5, 1.0, np.nextafter(1.0, 0.0), np.nextafter(1.0, 2.0), 3.0])
def test_parallel_edges_and_radii_about_nu(R):
    """Nu = 1: with R = nu the quadratic has no curvature, beyond it the ends decide."""
    ball = DisplacementBall(UNIT, IDENTITY, R)
    x = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    for height in np.linspace(0.1, 2.0, 20) * R * 2.0**0.5:
        for fixed in (x + [0.0, 0.0, height], x[:, [1, 0, 2]] + [0.0, 0.0, height]):
            least, _ = Pair(fixed, x, ball).least()
            proved = apart(fixed, ball.orbit(x))
            assert proved == (least > 0) or (not proved and abs(float(least)) < 1e-12)


def test_concave_quadratics_are_not_certified_by_their_tangents():
    """A saddle and a cap, positive at one stationary point, negative on the boundary."""
    one = np.array([1.0, 0.0, 0.0])
    for directions, domain in (
        (np.diag([0.0, 3.0, 0.0])[:, 1:], SQUARE),
        (np.diag([3.0, 3.0, 0.0])[:, :2], TRIANGLE),
    ):
        h = Affine(np.array([-1.5, -1.5, 0.0]), directions)
        r = Affine(3.0 * one, np.zeros((3, 2)))
        values = [(r.at(x) ** 2).sum() - (h.at(x) ** 2).sum() for x in domain]
        bound = lower_bound(r, h, domain)
        assert bound <= min(values)
        assert bound == pytest.approx(min(values), rel=1e-9)
        near = Affine(1.0 * one, np.zeros((3, 2)))
        assert not certainly_longer(near, h, domain, 0.0)


def test_lower_bounds_are_below_samples():
    """Any pair of affine maps, also with nearly singular and indefinite quadratics."""
    rng = np.random.default_rng(4)
    for k in range(300):
        r = Affine(rng.normal(size=3), rng.normal(size=(3, 2)) * [1.0, 10.0 ** -rng.integers(12)])
        h = Affine(rng.normal(size=4), rng.normal(size=(4, 2)))
        if k % 3 == 0:  # curvature zero to rounding
            h = Affine(h.origin, np.vstack((r.directions, [[0.0, 0.0]])))
        domain = (SQUARE, TRIANGLE)[k % 2]
        x = rng.dirichlet(np.ones(len(domain)), 400) @ domain
        x = np.concatenate((x, domain))
        values = ((r.origin + x @ r.directions.T) ** 2).sum(axis=1)
        values -= ((h.origin + x @ h.directions.T) ** 2).sum(axis=1)
        bound = lower_bound(r, h, domain)
        assert bound <= values.min()
        assert bound >= values.min() - 0.5 * (r.size + h.size) ** 2
        assert certainly_longer(r, h, domain, 0.0) == (bound > 0.0)


def test_curvature_in_doubt_is_paid_for():
    """A computed curvature of nearly zero may be a negative one: still below the least value."""
    for d, domain in ((1, SEGMENT), (2, TRIANGLE), (2, SQUARE)):
        for doubt, slope in ((1e-3, 0.0), (1e-3, 1e-3), (1e-3, 0.6e-3)):
            computed = Quadratic(np.zeros((d, d)), np.full(d, 0.5 * slope), 1.0)
            true = Quadratic(-doubt * np.eye(d), 0.5 * (slope + doubt) * np.ones(d), 1.0)
            # Two functions within the doubt, compared where they share their values at corners.
            bound = least_value(true, domain, doubt)
            grid = np.random.default_rng(0).dirichlet(np.ones(len(domain)), 500) @ domain
            for x in np.concatenate((grid, domain)):
                assert bound <= true.c + 2.0 * true.b @ x + x @ true.A @ x
            assert least_value(computed, domain, doubt) >= 1.0 - 2.0 * doubt


@pytest.mark.parametrize('kind', KINDS)
def test_maps_stay_within_their_errors(kind):
    """Image, difference and distortion at exact places, far from the origin and of thin bodies."""
    rng = np.random.default_rng(6)
    needed = [0, 0]
    for _ in range(20):
        fixed, moving, _, center = case(rng, kind, offset=10.0 ** rng.integers(4), affine=True)
        body = np.concatenate((moving, rng.normal(size=(5 - len(moving), 3))))
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        body = body @ frame * [1.0, 1.0, 1e-5] @ frame.T + 10.0
        moving = body[: len(moving)]
        ball = DisplacementBall(MassDistribution.of_points(body), center, 0.3)
        pair, orbit = Pair(fixed, moving, ball), ball.orbit(moving)
        split = len(fixed) - 1
        difference = Affine.of_corners(fixed) - orbit.image
        h = orbit.distortion.behind(split)
        for x in (
            *np.eye(pair.dimension),
            np.ones(pair.dimension) / 4.0,
            np.zeros(pair.dimension),
        ):
            x = fractions(x)
            f, e = pair.point(pair.fixed, x[:split]), pair.point(pair.moving, x[split:])
            r = [a - dot(row, [*e, Fraction(1)]) for a, row in zip(f, pair.g, strict=True)]
            off = [a - b for a, b in zip(r, value(difference, x), strict=True)]
            assert dot(off, off) <= Fraction(difference.error) ** 2
            needed[0] += dot(off, off) > 0
            # R s W (x - b), in the doubles of the metric; its first entry is a constant.
            metric = ball.distribution
            y = [a - b for a, b in zip(e, fractions(metric.barycenter), strict=True)]
            scale = Fraction(ball.radius) * Fraction(metric.stretch)
            exact = [scale * dot(row, y) for row in fractions(metric.inverse)]
            off = [a - b for a, b in zip(exact, value(h, x)[1:], strict=True)]
            assert dot(off, off) <= Fraction(h.error) ** 2
            needed[1] += dot(off, off) > 0
    assert min(needed) > 5


def value(affine, x):
    """Return the exact value of a map in doubles."""
    return [
        o + dot(row, x)
        for o, row in zip(fractions(affine.origin), fractions(affine.directions), strict=True)
    ]


@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_nonsense_proves_nothing(bad):
    """NaN and infinity in any number, and a negative thickness."""
    far = Affine(np.array([9.0, 0.0, 0.0]), np.zeros((3, 2)))
    small = Affine(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros((4, 2)))
    assert certainly_longer(far, small, SQUARE, 0.1)
    for thickness in (bad, -1.0):
        assert not certainly_longer(far, small, SQUARE, thickness)
    for entry in range(9):
        for which in (far, small):
            origin, directions = which.origin.copy(), which.directions.copy()
            error = 0.0
            if entry < 3:
                origin[entry] = bad
            elif entry < 8:
                directions.ravel()[entry - 3] = bad
            else:
                error = abs(bad)
            wrong = Affine(origin, directions, error)
            pair = (wrong, small) if which is far else (far, wrong)
            with np.errstate(all='ignore'):
                assert not certainly_longer(*pair, SQUARE, 0.0)
                assert not certainly_longer(*pair, TRIANGLE, 0.1)


def test_huge_numbers_prove_nothing():
    """Where squares overflow or underflow there is no answer."""
    ball = DisplacementBall(UNIT, IDENTITY, 2.0**499)
    assert not apart(np.array([[1e9, 0.0, 0.0]]), ball.orbit(np.zeros((1, 3))))
    tiny = DisplacementBall(UNIT, IDENTITY, 0.0)
    assert not apart(np.array([[1e-200, 0.0, 0.0]]), tiny.orbit(np.zeros((1, 3))))
    assert apart(np.array([[1e-100, 0.0, 0.0]]), tiny.orbit(np.zeros((1, 3))))


def test_a_reflex_notch_is_open_space():
    """A fixed and a moving L: a point in the notch is apart from the L, not from its hull."""
    L = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]], dtype=float)
    metric = MassDistribution.of_polygon(L)
    ball = DisplacementBall(metric, IDENTITY, 0.02)
    p = np.array([1.3, 1.3, 0.0])
    assert FatPolygon(ball, Polygon(L)).apart(p)
    assert FatPolygon(ball, Polygon(L[::-1])).apart(p, 0.2)
    assert not FatPolygon(ball, Polygon(L[[0, 1, 2, 4, 5]])).apart(p)
    assert FatPoint(ball, p).apart(Polygon(L), 0.2)
    assert not FatPoint(ball, p).apart(Polygon(L), 0.3)
    assert not FatPoint(ball, np.array([0.5, 0.5, 0.0])).apart(Polygon(L))


def test_features_miss_what_pierces():
    """A counterexample to Listing 2: all tests say apart, though the polygons cross."""
    P = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float)
    metric = MassDistribution.of_points(np.concatenate((P, [[0, 0, 0.3]])), np.ones(5))
    F = np.array([[0, -0.1, -0.8], [0, 0.1, -0.8], [0, 0, 0.9]])
    fat = FatPolygon(DisplacementBall(metric, IDENTITY, 0.05), Polygon(P))
    assert all(fat.apart(y) for y in F)
    assert all(point.apart(Polygon(F)) for point in fat.points)
    assert all(edge.apart(ends) for edge in fat.edges for ends in Polygon(F).edges)


BAD_POLYGONS = {
    'two corners': ([[0, 0, 0], [1, 0, 0]], 'shape'),
    'nan': ([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], 'not finite'),
    'repeated': ([[0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0]], 'vertex 1 is repeated'),
    'collinear': ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], 'no area'),
    'bent': ([[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0]], 'off a plane'),
    'bow tie': ([[0, 0, 0], [2, 1, 0], [2, 0, 0], [0, 2, 0]], 'intersects itself'),
    'spike': ([[0, 0, 0], [2, 0, 0], [2, 1, 0], [2, 3, 0], [2, 1, 0], [0, 1, 0]], 'intersects'),
}


@pytest.mark.parametrize('name', BAD_POLYGONS)
def test_bad_polygons_are_refused_by_name(name):
    """No polygon is repaired."""
    vertices, word = BAD_POLYGONS[name]
    with pytest.raises(RequestError, match=word) as refused:
        Polygon(np.array(vertices, dtype=float))
    assert refused.value.reason is Reason.INVALID_PARAMETER


def star(rng, n):
    """Return a star-shaped polygon with n corners somewhere in space, and its area."""
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, n) * 0.2 + np.arange(n)) * 2.0 * np.pi / n / 1.2
    radii = rng.uniform(0.2, 1.0, n)
    flat = radii[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    x, y = flat.T
    area = 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0][:, :2]
    return flat @ frame.T + rng.normal(size=3), area


def test_triangles_tile_a_polygon():
    """Their areas add up, all wound alike; straight angles are kept."""
    rng = np.random.default_rng(5)
    for n in (3, 4, 8, 30):
        for _ in range(5):
            vertices, area = star(rng, n)
            polygon = Polygon(vertices)
            a, b, c = np.moveaxis(polygon.corners, 1, 0)
            areas = 0.5 * np.cross(b - a, c - a) @ polygon.normal
            assert len(areas) == n - 2
            assert areas.min() >= 0.0
            assert areas.sum() == pytest.approx(area)
    square = Polygon(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2.0, 0]]))
    assert len(square.triangles) == 3
    assert set(square.triangles.ravel()) == set(range(5))


def test_bad_features_and_balls_are_refused():
    """Each names the field."""
    ball = DisplacementBall(UNIT, IDENTITY, 0.1)
    for make, word in (
        (lambda: DisplacementBall(UNIT, IDENTITY, np.nan), 'radius'),
        (lambda: DisplacementBall(UNIT, IDENTITY, -1.0), 'radius'),
        (lambda: DisplacementBall(UNIT, np.eye(4), 1.0), 'center'),
        (lambda: DisplacementBall(UNIT, np.full((3, 4), np.nan), 1.0), 'center'),
        (lambda: FatPoint(ball, np.zeros(2)), 'point'),
        (lambda: FatPoint(ball, np.full(3, np.inf)), 'point'),
        (lambda: FatEdge(ball, np.zeros((2, 3))), 'edge'),
        (lambda: FatEdge(ball, np.eye(3)[:2]).apart(np.full((2, 3), np.nan)), 'segment'),
        (lambda: FatPoint(ball, np.zeros(3)).contains(np.full(3, np.nan)), 'p is'),
    ):
        with pytest.raises(RequestError, match=word):
            make()
