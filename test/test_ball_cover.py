"""The kernels of the ball cover: every bound holds in exact rational arithmetic."""

from fractions import Fraction

import ball_calls
from exact_contact import exact, images, surfaces_meet
import numpy as np
import pytest

from trajectory_guard.kernels.ball import (
    Curve,
    EDGE_EDGE,
    EDGE_PIERCES,
    FACE_PIERCED,
    FACE_VERTEX,
    VERTEX_FACE,
)
from trajectory_guard.shapes.polyhedron import Polyhedron
from trajectory_guard.toleranced.face_moments import given_moments
from trajectory_guard.toleranced.node_metric import node_metric
from trajectory_guard.toleranced.surface import surface

U = Fraction(1, 2**53)
SCALES = [1e-6, 1.0, 1e6]


# The quadratic


def exact_least(z, q, lam, c, triangle):
    """Return the least value of |z|^2 - lambda (1 + |q|^2) - c over the domain."""
    z, q, lam, c = exact(z), exact(q), Fraction(lam), Fraction(c)
    H = z[1:] @ z[1:].T - lam * (q[1:] @ q[1:].T)
    g = z[1:] @ z[0] - lam * (q[1:] @ q[0])
    one = z[0] @ z[0] - lam * (1 + q[0] @ q[0]) - c

    def value(p):
        return p @ H @ p + 2 * (g @ p) + one

    def on_side(start, step):
        bend, rise = step @ H @ step, (H @ start + g) @ step
        found = [start, start + step]
        if bend > 0 and 0 < -rise < bend:
            found.append(start - rise / bend * step)
        return found

    corners = [exact(p) for p in ([0, 0], [1, 0], [0, 1])]
    o, x, y = corners
    sides = [(o, x), (o, y), (x, y - x)] if triangle else [(o, x), (o, y), (y, x), (x, y)]
    found = [p for side in sides for p in on_side(*side)]
    determinant = H[0, 0] * H[1, 1] - H[0, 1] ** 2
    if determinant > 0 and H[0, 0] > 0:
        p = (
            np.array([H[0, 1] * g[1] - H[1, 1] * g[0], H[0, 1] * g[0] - H[0, 0] * g[1]])
            / determinant
        )
        if min(p) >= 0 and (sum(p) <= 1 if triangle else max(p) <= 1):
            found.append(p)
    return min(value(p) for p in found)


def random_planes(rng, kind):
    """Return z and q of one of the kinds of hard cases."""
    z, q = rng.normal(size=(2, 3, 3))
    if kind == 'touching':
        s, t = rng.uniform(0, 0.5, 2)
        z[0] = -s * z[1] - t * z[2]
    elif kind == 'parallel':
        z[2] = z[1] * rng.choice([-1.0, 1.0, 0.5]) + rng.choice([0.0, 1e-9]) * z[2]
    elif kind == 'flat':
        z[:, 2] = 0.0
    if kind == 'saddle':
        # Convex along both parameters, not between them.
        z[2] = z[1] + 0.1 * z[2]
        q[2] = -q[1]
    else:
        q[rng.integers(1, 3)] = 0.0
    return z, q


@pytest.mark.parametrize('triangle', [False, True])
@pytest.mark.parametrize('kind', ['any', 'touching', 'parallel', 'flat', 'saddle'])
@pytest.mark.parametrize('scale', SCALES)
def test_lower_bound_is_one_and_is_tight(kind, triangle, scale):
    rng = np.random.default_rng(7)
    for _ in range(40):
        z, q = random_planes(rng, kind)
        lam = float(rng.choice([0.0, 0.1, 1.0, 5.0])) * scale**2
        c = float(rng.choice([0.0, 0.01])) * scale**2
        bound, _, size = ball_calls.lower_bound(z * scale, q, lam, c, triangle)
        truth = exact_least(z * scale, q, lam, c, triangle)
        assert bound <= truth
        # Nearly parallel sides: the tangent plane is off by the root of the rounding at worst.
        loose = 1e-7 if kind == 'parallel' else 0.0
        assert truth - Fraction(bound) <= (600 * U + Fraction(loose)) * Fraction(size)


def test_exact_contact_is_never_apart():
    """Segments that cross at a point of the grid: in exact arithmetic the least value is 0."""
    rng = np.random.default_rng(3)
    for _ in range(300):
        a, b = rng.integers(-8, 9, (2, 3)).astype(float)
        s, t = rng.integers(0, 9, 2) / 8.0
        bound, _, _ = ball_calls.lower_bound(
            [-s * a - t * b, a, b], np.zeros((3, 3)), 0.0, 0.0, False
        )
        assert not bound > 0.0


@pytest.mark.parametrize('value', [np.nan, np.inf, 1e200])
def test_numbers_out_of_range_prove_nothing(value):
    for place in np.ndindex(3, 3):
        z = np.eye(3) + 5.0
        z[place] = value
        for triangle in (False, True):
            bound, _, _ = ball_calls.lower_bound(z, np.zeros((3, 3)), 0.0, 0.0, triangle)
            assert not bound > 0.0
    z = np.eye(3) + 5.0
    assert not ball_calls.lower_bound(z, np.eye(3), value, 0.0, False)[0] > 0.0
    assert not ball_calls.lower_bound(z, np.eye(3), 0.0, value, False)[0] > 0.0


# Pieces and balls


def random_curve(rng, degree=8, scale=1.0):
    """Return a curve near the rotations, with weights of different sizes."""
    points = np.eye(3, 4) + 0.3 * rng.normal(size=(degree + 1, 3, 4))
    points[:, :, 3] *= scale
    return Curve(points.reshape(-1, 12), rng.uniform(0.5, 2.0, degree + 1))


@pytest.mark.parametrize('degree', [0, 1, 3, 8])
def test_pieces_are_those_of_exact_subdivision(degree):
    """Rational de Casteljau in fractions, and the bound that is in the thickness."""
    rng = np.random.default_rng(degree)
    curve = random_curve(rng, degree)
    level, numerator = 7, 77
    rows = np.column_stack(
        [exact(curve.points) * exact(curve.weights)[:, None], exact(curve.weights)]
    )
    lower, upper = Fraction(numerator, 2**level), Fraction(numerator + 1, 2**level)

    def blossom(i):
        part = rows
        for step in range(degree):
            s = upper if step < i else lower
            part = part[:-1] * (1 - s) + part[1:] * s
        return part[0]

    found = exact(ball_calls.piece(curve, numerator, level))
    bound = (
        Fraction(21, 10) * (degree * level + 1) * U * Fraction(float(np.abs(curve.points).max()))
    )
    for i in range(degree + 1):
        truth = blossom(i)
        assert abs(found[i, 12] - truth[12]) <= (degree * level + 1) * U * truth[12]
        assert (np.abs(found[i, :12] / found[i, 12] - truth[:12] / truth[12]) <= bound).all()


@pytest.mark.parametrize('scale', SCALES)
def test_ball_contains_the_curve(scale):
    """The radius is at least the exact distance of every control point in the exact metric."""
    rng = np.random.default_rng(11)
    for _ in range(10):
        curve = random_curve(rng, 8, scale)
        points = scale * rng.normal(size=(5, 3))
        homogeneous = np.column_stack([points, np.ones(5)])
        triangle = surface(Polyhedron(points[:3], (np.arange(3),)))
        metric = node_metric(triangle, False, given_moments(homogeneous.T @ homogeneous))
        radius, (shift, turn), centre = ball_calls.radius(metric, curve)
        frame = exact(metric.frame[0])
        b, K = frame[:3], frame[3:].reshape(3, 3)
        for P in exact(curve.points).reshape(-1, 3, 4):
            D = P - exact(centre)
            moved, turned = D[:, :3] @ b + D[:, 3], D[:, :3] @ K
            assert Fraction(radius) ** 2 >= moved @ moved + (turned * turned).sum()
            assert Fraction(shift) ** 2 >= moved @ moved
            assert Fraction(turn) ** 2 >= (turned * turned).sum()
        # The metric is that of the feature points, mass 1.
        P = curve.points.reshape(-1, 3, 4)
        far = max(np.sqrt(((homogeneous @ (Q - centre).T) ** 2).sum() / len(points)) for Q in P)
        assert radius == pytest.approx(far, rel=1e-6)


def test_distortion_rate_bounds_every_displacement():
    """|D x| <= |D| rho(x) on whole faces and boxes, with equality for some D."""
    rng = np.random.default_rng(5)
    points = rng.normal(size=(5, 3)) * [1.0, 2.0, 0.3]
    faces = tuple(np.array(f) for f in ([0, 1, 2], [0, 2, 3], [1, 2, 4]))
    packed = surface(Polyhedron(points, faces))
    for individual in (True, False):
        metric = node_metric(packed, individual)
        for node, (left, _, face) in enumerate(packed.branch):
            frame = metric.frame[metric.of[node]]
            b, K = frame[:3], frame[3:].reshape(3, 3)
            if left < 0:
                x = rng.dirichlet([1, 1, 1], 50) @ points[faces[face]]
            else:
                x = packed.box[node, :3] + packed.box[node, 3:] * rng.uniform(-1, 1, (50, 3))
            for D in rng.normal(size=(20, 3, 4)):
                length = np.sqrt(
                    ((D[:, :3] @ b + D[:, 3]) ** 2).sum() + ((D[:, :3] @ K) ** 2).sum()
                )
                moved = np.linalg.norm(x @ D[:, :3].T + D[:, 3], axis=1)
                assert (moved <= length * np.hypot(1.0, metric.far[node]) * (1 + 1e-9)).all()
        assert metric.residual < 1e-12


def test_ball_round_a_curve_that_stands():
    """One control point, and what rounding makes of it is in the radius."""
    rng = np.random.default_rng(17)
    for _ in range(100):
        point = np.column_stack([np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3)])
        curve = Curve(point.reshape(1, 12), rng.uniform(0.5, 2.0, 1))
        triangle = surface(one_face(rng.normal(size=(3, 3))))
        metric = node_metric(triangle, True)
        radius, _, centre = ball_calls.radius(metric, curve)
        frame = exact(metric.frame[0])
        D = exact(point) - exact(centre)
        moved, turned = D[:, :3] @ frame[:3] + D[:, 3], D[:, :3] @ frame[3:].reshape(3, 3)
        assert Fraction(radius) ** 2 >= moved @ moved + (turned * turned).sum()
        assert radius < 1e-13


@pytest.mark.parametrize('far', [0.0, 1.0, 2.0])
def test_extent_of_a_distribution(far):
    """Any extent is that of a distribution, and the best moves no point by more than T + W f."""
    for shift, turn in ((1.0, 1.0), (1.0, 1e-3), (1e-3, 1.0), (1.0, 0.0), (0.0, 1.0), (1e-6, 1e6)):
        for adapted in (False, True):
            whole = np.nextafter(np.hypot(shift, turn), 9e9)
            radius, spread, uncertain = map(
                Fraction, ball_calls.rate(whole, shift, turn, far, adapted)
            )
            assert radius**2 >= Fraction(shift) ** 2 + Fraction(turn) ** 2 / spread
            assert uncertain**2 >= radius**2 * (1 + spread * Fraction(far) ** 2)
            if adapted:
                # Extents are kept within 2^20 either way.
                loose = 1e-6 * (shift + turn)
                assert float(uncertain) == pytest.approx(shift + turn * far, rel=1e-9, abs=loose)
    for broken in (np.nan, np.inf):
        assert not ball_calls.rate(broken, broken, broken, far, True)[2] < 1e300


# Listing 2 and the static test


def one_face(points, ring=None):
    points = np.array(points, dtype=float)
    return Polyhedron(points, (np.arange(len(points)) if ring is None else np.array(ring),))


def listing_2(moving, fixed, radius, thickness=1e-12):
    """Test two single faces, the moving one where it stands, with its own distribution."""
    metric = node_metric(surface(moving), True)
    return ball_calls.apart(
        surface(moving), surface(fixed), metric.turned, radius, metric.far[0], thickness, 1e-14
    )


SQUARE = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]


def test_pierced_square_is_not_apart():
    """No feature is near another, and yet two edges of the triangle go through the square."""
    square = one_face(SQUARE)
    triangle = one_face([[0, -0.1, -0.8], [0, 0.1, -0.8], [0, 0, 0.9]])
    # Equal masses at the corners and at (0, 0, 0.3), as they are in the metric of mass 1.
    points = np.array([*SQUARE, [0, 0, 0.3]], dtype=float)
    homogeneous = np.column_stack([points, np.ones(5)])
    whole = given_moments(homogeneous.T @ homogeneous)
    metric = node_metric(surface(square), False, whole)
    radius = 0.05 / np.sqrt(5.0)
    for r in (radius, 0.0):
        done, kind = ball_calls.apart(
            surface(square), surface(triangle), metric.turned, r, metric.far[0], 1e-12, 1e-14
        )
        assert not done
        assert kind in (EDGE_PIERCES, FACE_PIERCED)
    done, kind = listing_2(triangle, square, 0.01)
    assert not done
    assert kind in (EDGE_PIERCES, FACE_PIERCED)


@pytest.mark.parametrize(
    ('fixed', 'kind'),
    [
        ([[-3, -3, 0.05], [3, -3, 0.05], [0, 4, 0.05]], VERTEX_FACE),
        ([[1.03, 0, -3], [1.03, 0, 3], [4, 0, 0]], EDGE_EDGE),
        ([[0.1, 0.2, 0.02], [-1, 0, 3], [1, 0, 3]], FACE_VERTEX),
    ],
)
def test_which_feature_is_open(fixed, kind):
    assert listing_2(one_face(SQUARE), one_face(fixed), 0.05) == (False, kind)
    assert listing_2(one_face(SQUARE), one_face(fixed), 0.001)[0]


def test_non_convex_faces():
    """A notch is empty: what stands in it is apart from both of its sides, and not below."""
    notched = [
        [-2, -2, 0],
        [2, -2, 0],
        [2, 2, 0],
        [1, 2, 0],
        [1, 0, 0],
        [-1, 0, 0],
        [-1, 2, 0],
        [-2, 2, 0],
    ]
    upright = one_face([[0, 1, -1], [0.3, 1, -1], [0.3, 1, 1], [0, 1, 1]])
    for pair in ((one_face(notched), upright), (upright, one_face(notched))):
        assert listing_2(*pair, 0.05)[0]
    below = one_face(upright.vertices - [0, 2, 0])
    assert not listing_2(one_face(notched), below, 0.0)[0]
    assert not listing_2(below, one_face(notched), 0.0)[0]


def test_corners_off_the_plane():
    """A face is its triangles: where they meet, above its outline, there is a ridge."""
    h = 4e-6
    ridge = one_face([[-1, 0, h], [0, -1, -h], [1, 0, h], [0, 1, -h]])
    assert {*map(frozenset, ridge.triangles.tolist())} == {
        frozenset((0, 1, 2)),
        frozenset((0, 2, 3)),
    }
    for height, apart in ((3.0, True), (1.1, False), (0.5, False)):
        edge = one_face([[0, -3, height * h], [0, 3, height * h], [0, 0, 3]])
        for pair in ((ridge, edge), (edge, ridge)):
            assert listing_2(*pair, 0.0, thickness=0.5 * h)[0] == apart


def test_coplanar_faces():
    """In one plane nothing pierces, side by side is apart, overlapping is not."""
    square = one_face(SQUARE)
    assert listing_2(square, one_face(square.vertices + [2.5, 0.3, 0]), 0.02)[0]
    assert not listing_2(square, one_face(square.vertices + [2.0, 0.3, 0]), 0.0)[0]
    assert not listing_2(square, one_face(0.25 * square.vertices), 0.0)[0]


@pytest.mark.parametrize('scale', SCALES)
def test_apart_means_disjoint_for_every_displacement(scale):
    """Random displacements of the ball, the farthest included, judged exactly."""
    rng = np.random.default_rng(13)
    proved = 0
    for _ in range(60):
        moving = one_face(scale * rng.normal(size=(3, 3)))
        fixed = one_face(scale * (rng.normal(size=(3, 3)) + rng.normal(size=3)))
        metric = node_metric(surface(moving), True)
        radius = scale * float(rng.choice([0.0, 0.02, 0.1, 0.4]))
        if not listing_2(moving, fixed, radius, 1e-12 * scale)[0]:
            continue
        proved += 1
        b, K = metric.frame[0, :3], metric.frame[0, 3:].reshape(3, 3)
        for k in range(6):
            # D with D b' = columns of the factored metric on the sphere of the radius; half of
            # them move one point as far as any can.
            E = rng.normal(size=(3, 4))
            if k % 2:
                x = rng.dirichlet([1, 1, 1]) @ moving.vertices
                E = np.outer(rng.normal(size=3), [*np.linalg.solve(K, x - b), 1.0])
            E *= 0.999 * radius / np.sqrt((E**2).sum())
            C = E[:, :3] @ np.linalg.inv(K)
            D = np.eye(3, 4) + np.column_stack([C, E[:, 3] - C @ b])
            moved = images(exact(D), moving.vertices)
            assert not surfaces_meet(
                moved, moving.triangles, exact(fixed.vertices), fixed.triangles
            )
    assert proved > 15


@pytest.mark.parametrize('bits', [0, 1, -1])
def test_one_unit_in_the_last_place(bits):
    """A vertex on a face, or one unit off it, is not proved apart; a thickness decides as well."""
    height = bits * 2.0**-52
    down = one_face([[0.25, 0.25, height], [1, 0, 3], [0, 1, 3]])
    assert not listing_2(one_face(SQUARE), down, 0.0)[0]
    lifted = one_face([[0.25, 0.25, 1.0 + height], [1, 0, 3], [0, 1, 3]])
    assert not listing_2(one_face(SQUARE), lifted, 0.0, thickness=1.0 + max(height, 0.0))[0]
    assert listing_2(one_face(SQUARE), lifted, 0.0, thickness=1.0 - 1e-9)[0]


@pytest.mark.parametrize('radius', [0.0, 1e-9, 1e-3, 0.1, 0.3])
@pytest.mark.parametrize('thickness', [1e-12, 1e-6, 1e-2, 0.3])
def test_radius_and_thickness_add_up(radius, thickness):
    """A corner above a face is apart from it beyond R rho + r, and not before."""
    up = one_face([[0, 0, 0], [1, 0, 3], [0, 1, 3]])
    rate = np.sqrt(1.0 + (node_metric(surface(up), True).turned[0] ** 2).sum())
    need = radius * rate + thickness
    for factor, apart in ((1.0 - 1e-9, False), (1.3, True)):
        plate = one_face(
            [[-9, -9, -factor * need], [9, -9, -factor * need], [0, 9, -factor * need]]
        )
        # Squares of lengths of 20 m resolve no gap below some micrometres.
        assert listing_2(up, plate, radius, thickness)[0] == (apart and need > 1e-4)


def test_large_radii_need_no_hyperboloids():
    """Beyond nu the fat vertices envelop the fat polygon (Remark 1): apart only if they are."""
    square = one_face(SQUARE)
    for height in (1.0, 4.0, 10.0, 30.0):
        above = one_face(square.vertices * 0.3 + [0, 0, height])
        rate = np.hypot(1.0, node_metric(surface(square), True).far[0])
        for radius in (0.5, 1.0, 3.0, 10.0):
            if listing_2(square, above, radius)[0]:
                assert radius * rate < np.hypot(height, 0.7 * np.sqrt(2.0)) + 1e-9
            elif radius * rate < height - 1e-6:
                pytest.fail('a plane above all fat vertices is above the fat polygon')


def test_basis_of_these_tests():
    """The exact judge itself, where the answer is plain."""
    square, up = one_face(SQUARE), np.array([0, 0, 1.0])
    corners = exact(square.vertices)
    for shift, meets in ((0.0, True), (0.5, True), (2.0, True), (2.0 + 2.0**-50, False)):
        moved = exact(square.vertices + [shift, 0, 0])
        assert surfaces_meet(corners, square.triangles, moved, square.triangles) == meets
    lifted = exact(square.vertices + 2.0**-60 * up)
    assert not surfaces_meet(corners, square.triangles, lifted, square.triangles)
