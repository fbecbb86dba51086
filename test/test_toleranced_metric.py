"""The metric of a mass distribution: its laws, the corrected print, rounding, bad input."""

from fractions import Fraction

from exact_orbit import distance_squared, fractions, rho_squared
import numpy as np
import pytest

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.toleranced.displacement_ball import DisplacementBall
from trajectory_guard.toleranced.metric import MassDistribution, stretch_bound
from trajectory_guard.toleranced.minimum_ellipsoid import least_distortion, optimal_weights
from trajectory_guard.toleranced.moments import Moments

SCALES = (1e-6, 1e-3, 1.0, 1e3, 1e6)
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
CUBE_TRIANGLES = np.array(
    [
        *[[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]],
        *[[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]],
    ]
)


def random_points(rng, scale=1.0, offset=0.0):
    """Return feature points and weights, a body of that size so far from the origin."""
    n = int(rng.integers(4, 12))
    points = scale * (rng.normal(size=(n, 3)) * rng.uniform(0.01, 1.0, 3) + offset)
    return points, rng.uniform(0.1, 2.0, n)


def extremal(G, R, x):
    """Return the displacement of norm R, tr(D G D^T) = R^2, that moves x the farthest."""
    lifted = np.append(x, 1.0)
    v = np.linalg.solve(G, lifted)
    return R * np.outer([0.6, 0.0, 0.8], v / np.sqrt(lifted @ v))


def moved(D, x):
    """Return D(x)."""
    return x @ D[:, :3].T + D[:, 3]


def test_distance_and_product_are_those_of_the_feature_points():
    """[SW, (1), (2)]: sums over the feature points."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        points, weights = random_points(rng)
        metric = MassDistribution.of_points(points, weights)
        alpha, beta = rng.normal(size=(2, 3, 4))
        product = (weights * (moved(alpha, points) * moved(beta, points)).sum(axis=1)).sum()
        assert metric.inner(alpha, beta) == pytest.approx(product, rel=1e-9, abs=1e-9)
        square = (weights * (moved(alpha - beta, points) ** 2).sum(axis=1)).sum()
        assert metric.distance(alpha, beta) ** 2 == pytest.approx(square, rel=1e-12)
        lifted = np.column_stack((points, np.ones(len(points))))
        assert np.allclose(metric.G, (weights[:, None] * lifted).T @ lifted, rtol=1e-12)


def test_rho_is_the_largest_displacement():
    """No displacement of norm R moves x by more than R rho(x), and one does by as much."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        metric = MassDistribution.of_points(*random_points(rng))
        x, R = 2.0 * rng.normal(size=3), rng.uniform(0.1, 3.0)
        D = extremal(metric.G, R, x)
        assert metric.distance(D, np.zeros((3, 4))) == pytest.approx(R, rel=1e-9)
        assert np.linalg.norm(moved(D, x)) == pytest.approx(R * metric.rho(x), rel=1e-9)
        others = rng.normal(size=(500, 3, 4))
        others *= (R / np.linalg.norm(metric.coordinates(others), axis=1))[:, None, None]
        ways = np.linalg.norm(np.einsum('nij,j->ni', others, np.append(x, 1.0)), axis=1)
        assert ways.max() <= metric.bound(R, x)
        # A brute-force search climbs to the same maximum.
        best = others[ways.argmax()]
        for _ in range(200):
            step = np.outer(moved(best, x), np.linalg.solve(metric.G, np.append(x, 1.0)))
            best = best + 0.3 * R * step / metric.distance(step, 0.0 * step)
            best *= R / metric.distance(best, 0.0 * best)
        assert np.linalg.norm(moved(best, x)) == pytest.approx(R * metric.rho(x), rel=1e-6)


def inertia_corrected(points, weights):
    """Return J as it is here."""
    return MassDistribution.of_points(points, weights).inertia


def inertia_of_squared_weights(points, weights):
    """Return J about b with the squared weights of the print."""
    y = points - weights @ points / weights.sum()
    return (weights[:, None] ** 2 * y).T @ y


def inertia_about_the_origin(points, weights):
    """Return J about the origin, as (3) has it."""
    return (weights[:, None] * points).T @ points


@pytest.mark.parametrize(
    ('inertia', 'sound'),
    [
        (inertia_corrected, True),
        (inertia_of_squared_weights, False),
        (inertia_about_the_origin, False),
    ],
)
def test_only_the_central_inertia_linear_in_the_weights_is_sound(inertia, sound):
    """The farthest that a displacement of norm R moves x, against R rho(x) by each formula."""
    rng = np.random.default_rng(2)
    exceeded = 0
    for _ in range(200):
        points, weights = random_points(rng, offset=rng.normal(size=3))
        weights *= 3.0
        lifted = np.column_stack((points, np.ones(len(points))))
        G = (weights[:, None] * lifted).T @ lifted
        b = weights @ points / weights.sum()
        x = b + rng.normal(size=3)
        J = inertia(points, weights)
        rho = np.sqrt(1.0 / weights.sum() + (x - b) @ np.linalg.solve(J, x - b))
        way = np.linalg.norm(moved(extremal(G, 1.0, x), x))
        exceeded += way > rho * (1.0 + 1e-6)
    assert exceeded == 0 if sound else exceeded > 100


def test_six_points_of_the_ellipsoid_induce_the_metric():
    """They lie where (x - b)^T J^-1 (x - b) = 3 / mass; the printed ellipsoid's do not do it."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        metric = MassDistribution.of_points(*random_points(rng))
        six = metric.six_points()
        y = six - metric.barycenter
        levels = np.einsum('ni,ij,nj->n', y, np.linalg.inv(metric.inertia), y)
        assert np.allclose(levels * metric.mass, 3.0, rtol=1e-9)
        equal = np.full(6, metric.mass / 6.0)
        assert np.allclose(MassDistribution.of_points(six, equal).G, metric.G, rtol=1e-9)
        # The vertices of (x - b)^T J (x - b) = c, c the best there is for the trace.
        sizes, axes = np.linalg.eigh(metric.inertia)
        printed = (axes / np.sqrt(sizes)).T
        printed *= np.sqrt(3.0 * sizes.sum() / metric.mass / (printed**2).sum())
        both = np.concatenate((metric.barycenter + printed, metric.barycenter - printed))
        assert not np.allclose(MassDistribution.of_points(both, equal).G, metric.G, rtol=1e-2)


@pytest.mark.parametrize('scale', SCALES)
@pytest.mark.parametrize('offset', [0.0, 1.0, 100.0])
def test_bounds_include_the_exact_numbers(scale, offset):
    """Distortion rates and distances in rational arithmetic; thin bodies and far points too."""
    rng = np.random.default_rng(4)
    for thin in (1.0, 1e-3, 1e-7):
        points, weights = random_points(rng, scale, offset)
        first, second = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
        points = points @ first * [1.0, 1.0, thin] @ second
        metric = MassDistribution.of_points(points, weights)
        xs = np.concatenate((points, points.mean(axis=0) + 3.0 * scale * rng.normal(size=(3, 3))))
        for x in xs:
            bound = Fraction(float(metric.rho_bound(x)))
            exact = rho_squared(metric, fractions(x))
            assert exact <= bound**2 <= exact * (1 + Fraction(1, 10**5))
            R = float(10.0 ** rng.uniform(-6, 2))
            assert Fraction(float(metric.bound(R, x))) ** 2 >= exact * Fraction(R) ** 2
        for near in (1.0, 1e-6):
            alpha = rng.normal(size=(3, 4)) * [1.0, 1.0, 1.0, scale]
            beta = alpha + near * rng.normal(size=(3, 4)) * [1.0, 1.0, 1.0, scale]
            bound = Fraction(float(metric.distance_bound(alpha, beta)))
            exact = distance_squared(metric, alpha, beta)
            assert exact <= bound**2
            assert float(bound) <= float(exact) ** 0.5 * (1.0 + 1e-5)


def test_a_coarse_inverse_is_paid_for():
    """Whatever W is: rates from it, with its stretch, are not below the exact ones."""
    rng = np.random.default_rng(10)
    for _ in range(20):
        metric = MassDistribution.of_points(*random_points(rng))
        W = metric.inverse + 1e-2 * np.abs(metric.inverse).max() * rng.normal(
            size=(3, 3)
        ) * rng.choice([1.0, 1e-3])
        try:
            stretch = stretch_bound(W, metric.factor)
        except RequestError:
            continue
        object.__setattr__(metric, 'inverse', W)
        object.__setattr__(metric, 'stretch', stretch)
        ball = DisplacementBall(metric, np.eye(3, 4), 0.7)
        for x in rng.normal(size=(10, 3)):
            exact = rho_squared(metric, fractions(x))
            assert exact <= Fraction(float(metric.rho_bound(x))) ** 2
            h = ball.orbit(x[None]).distortion
            length = sum(y * y for y in fractions(h.origin))
            assert Fraction(0.7) ** 2 * exact <= length * (1 + Fraction(1, 10**12))


@pytest.mark.parametrize('shear', [0.0, 2.0**12])
def test_rounding_of_a_rate_is_paid_for(shear):
    """An exact inverse, so that no stretch helps: cancellation and roots alone."""
    rng = np.random.default_rng(11)
    F = np.array([[1.0, 0.0, 0.0], [shear, 1.0, 0.0], [0.0, 0.0, 0.5]])
    metric = MassDistribution(3.0, rng.normal(size=3), F)
    assert np.array_equal(metric.inverse @ F, np.eye(3))
    object.__setattr__(metric, 'stretch', 1.0)
    for k in range(300):
        object.__setattr__(metric, 'mass', rng.uniform(1.0, 9.0))
        x = metric.barycenter + F @ rng.normal(size=3) * (k % 3)
        assert rho_squared(metric, fractions(x)) <= Fraction(float(metric.rho_bound(x))) ** 2


def test_feature_points_have_their_rates():
    """Sum w_i rho^2(m_i) = 4: no point of the body is moved much farther than the metric says."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        points, weights = random_points(rng, offset=10.0)
        rates = MassDistribution.of_points(points, weights).rho(points) ** 2
        assert weights @ rates == pytest.approx(4.0, rel=1e-9)


def test_surface_and_solid_have_exact_moments():
    """Formulas for a box; affine images; the surface against many small triangles."""
    box = CUBE * [1.0, 2.0, 3.0] + [5.0, -2.0, 1.0]
    solid = MassDistribution.of_solid(box, CUBE_TRIANGLES)
    assert solid.mass == pytest.approx(6.0)
    assert np.allclose(solid.barycenter, [5.5, -1.0, 2.5])
    assert np.allclose(solid.inertia, 6.0 / 12.0 * np.diag([1.0, 4.0, 9.0]))
    rng = np.random.default_rng(6)
    A, t = np.linalg.qr(rng.normal(size=(3, 3)))[0] @ np.diag([1.0, 2.0, 0.5]), rng.normal(size=3)
    image = MassDistribution.of_solid(
        box @ A.T + t, CUBE_TRIANGLES[:, :: int(np.sign(np.linalg.det(A)))]
    )
    det = abs(np.linalg.det(A))
    assert image.mass == pytest.approx(6.0 * det)
    assert np.allclose(image.inertia, det * A @ solid.inertia @ A.T)
    surface = MassDistribution.of_surface(box, CUBE_TRIANGLES)
    assert surface.mass == pytest.approx(22.0)
    triangles = box[CUBE_TRIANGLES]
    middles = (triangles + triangles[:, [1, 2, 0]]) / 2.0
    finer = np.concatenate(
        [np.stack((triangles[:, k], middles[:, k], middles[:, k - 1]), axis=1) for k in range(3)]
        + [middles]
    )
    again = MassDistribution.of_surface(finer.reshape(-1, 3), np.arange(12 * 12).reshape(-1, 3))
    assert np.allclose(again.G, surface.G)
    # x is uniform on four faces, and 5 or 6 on two of area 6.
    x = (10.0 / 12.0 + 12.0 / 4.0) / 22.0
    assert surface.inertia[0, 0] / surface.mass == pytest.approx(x)


def test_moments_give_the_distribution_back():
    """Mass, barycentre and inertia are all there is."""
    metric = MassDistribution.of_points(*random_points(np.random.default_rng(7)))
    again = MassDistribution.of_moments(Moments(metric.mass, metric.barycenter, metric.inertia))
    assert np.allclose(again.G, metric.G, rtol=1e-12)


def test_flat_bodies_get_a_point_off_their_plane():
    """A polygon and a needle; the corners' rates are moderate, the total mass stays."""
    square = np.array([[1.0, 1.0, 5.0], [3.0, 1.0, 5.0], [3.0, 3.0, 5.0], [1.0, 3.0, 5.0]])
    metric = MassDistribution.of_polygon(square, height=0.25)
    points = np.concatenate((square, [[2.0, 2.0, metric.barycenter[2] * 5.0 - 20.0]]))
    assert abs(points[4, 2] - 5.0) == pytest.approx(0.25)
    assert np.allclose(metric.G, MassDistribution.of_points(points).G)
    assert metric.mass == pytest.approx(1.0)
    needle = MassDistribution.thickened(np.linspace([0, 0, 0], [1, 2, 3], 5))
    assert needle.mass == pytest.approx(1.0)
    assert needle.rho(np.array([1.0, 2.0, 3.0])) < 3.0
    # A body with a volume is left as it is.
    points, weights = random_points(np.random.default_rng(8))
    thick = MassDistribution.thickened(points, weights)
    assert np.array_equal(thick.G, MassDistribution.of_points(points, weights).G)


BAD_DISTRIBUTIONS = {
    'zero weight': (lambda: MassDistribution.of_points(CUBE, [0.0, *[1.0] * 7]), 'weight 0'),
    'negative weight': (lambda: MassDistribution.of_points(CUBE, [*[1.0] * 7, -1.0]), 'weight 7'),
    'nan weight': (lambda: MassDistribution.of_points(CUBE, [np.nan, *[1.0] * 7]), 'weight 0'),
    'too few weights': (lambda: MassDistribution.of_points(CUBE, [1.0]), '8 feature points'),
    'nan point': (lambda: MassDistribution.of_points([[0, 0, np.nan]] * 5), 'feature point 0'),
    'no points': (lambda: MassDistribution.of_points(np.empty((0, 3))), 'feature points'),
    'one point': (lambda: MassDistribution.of_points([[1.0, 2.0, 3.0]]), '1 feature points'),
    'repeated point': (lambda: MassDistribution.of_points([[1.0, 2.0, 3.0]] * 9), 'flat'),
    'flat': (lambda: MassDistribution.of_points(CUBE * [1, 1, 0]), 'flat'),
    'collinear': (
        lambda: MassDistribution.of_points(np.linspace([0, 0, 0], [1, 2, 3], 7)),
        'flat',
    ),
    'one point, thickened': (lambda: MassDistribution.thickened([[1.0, 2.0, 3.0]]), 'are one'),
    'no height': (lambda: MassDistribution.of_polygon(CUBE[:3], 0.0), 'height'),
    'open mesh': (lambda: MassDistribution.of_solid(CUBE, CUBE_TRIANGLES[1:]), 'closed'),
    'inside out': (lambda: MassDistribution.of_solid(CUBE, CUBE_TRIANGLES[:, ::-1]), 'volume'),
    'no index': (lambda: MassDistribution.of_surface(CUBE, [[0, 1, 8]]), 'triangles'),
    'no area': (lambda: MassDistribution.of_surface(CUBE, [[0, 1, 1]]), 'no area'),
    'fractional index': (lambda: MassDistribution.of_surface(CUBE, [[0.0, 1, 2]]), 'triangles'),
    'flat solid': (
        lambda: MassDistribution.of_moments(Moments(1.0, np.zeros(3), np.diag([1.0, 1.0, 0.0]))),
        'singular',
    ),
    'no mass': (lambda: MassDistribution(0.0, np.zeros(3), np.eye(3)), 'mass'),
    'not triangular': (lambda: MassDistribution(1.0, np.zeros(3), np.ones((3, 3))), 'factor'),
    'far': (lambda: MassDistribution(1.0, np.full(3, 1e300), np.eye(3)), 'barycenter'),
    'flat ellipsoid': (lambda: optimal_weights(CUBE * [1, 1, 0]), 'flat'),
}


@pytest.mark.parametrize('name', BAD_DISTRIBUTIONS)
def test_bad_distributions_are_refused_by_name(name):
    """Each with the stable code and the thing that is wrong."""
    make, word = BAD_DISTRIBUTIONS[name]
    with pytest.raises(RequestError, match=word) as refused:
        make()
    assert refused.value.reason is Reason.INVALID_PARAMETER


def test_no_bound_holds_for_a_bad_radius():
    """NaN certifies nothing."""
    metric = MassDistribution.of_points(CUBE)
    assert np.isnan(metric.bound(-1.0, CUBE)).all()
    assert np.isnan(metric.bound(np.nan, CUBE)).all()


def test_optimal_weights_reach_the_least_worst_rate():
    """The maximum of rho^2 is 4 at best, with equality at the D-optimal weights."""
    rng = np.random.default_rng(9)
    for n in (5, 20, 200):
        points = rng.normal(size=(n, 3)) * [1.0, 0.1, 10.0] + 100.0
        best = optimal_weights(points, gap=1e-7)
        assert 4.0 - 1e-9 <= best.worst <= 4.0 * (1.0 + 2e-7)
        assert best.weights.sum() == pytest.approx(1.0)
        metric = least_distortion(points)
        assert (metric.rho(points) ** 2).max() <= 4.0 * (1.0 + 2e-6)
        assert metric.mass == pytest.approx(1.0)
        # All others are worse, and their determinant is smaller.
        for _ in range(20):
            other = MassDistribution.of_points(points, rng.dirichlet(np.ones(n)) + 1e-12)
            worst = other.mass * (other.rho(points) ** 2).max()
            assert worst >= 4.0 - 1e-9
            assert np.linalg.det(other.inertia) <= np.linalg.det(metric.inertia) * (1.0 + 1e-5)


def test_optimal_weights_of_a_regular_body_are_equal():
    """A cube's corners; a point at its centre gets none."""
    best = optimal_weights(np.concatenate((CUBE, [[0.5, 0.5, 0.5]])), gap=1e-10)
    assert np.allclose(best.weights[:8], 0.125, atol=1e-4)
    assert best.weights[8] < 1e-4
    with pytest.raises(RequestError, match='gap'):
        least_distortion(np.random.default_rng(0).normal(size=(50, 3)), steps=3)
