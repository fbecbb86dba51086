"""Orbits: who is in them, their hyperboloids, the projection sigma, and their boundary meshes."""

from exact_orbit import Pair
import numpy as np
import pytest

from trajectory_guard.errors import RequestError
from trajectory_guard.shapes.inscribed import is_closed
from trajectory_guard.toleranced.affine import Affine
from trajectory_guard.toleranced.displacement_ball import DisplacementBall
from trajectory_guard.toleranced.distance import largest_accepted
from trajectory_guard.toleranced.fat_edge import FatEdge
from trajectory_guard.toleranced.fat_point import FatPoint
from trajectory_guard.toleranced.fat_polygon import FatPolygon
from trajectory_guard.toleranced.line_metric import LineMetric
from trajectory_guard.toleranced.metric import MassDistribution
from trajectory_guard.toleranced.patches import Patch
from trajectory_guard.toleranced.plane_metric import PlaneMetric
from trajectory_guard.toleranced.polygon import Polygon
from trajectory_guard.toleranced.quadratic import lower_bound, SEGMENT, TRIANGLE

SCALES = (1e-6, 1e-3, 1.0, 1e3, 1e6)
OCTAGON = np.array([[np.cos(a), 0.6 * np.sin(a), 0.0] for a in np.arange(8) * np.pi / 4.0])
L = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]], dtype=float)
IDENTITY = np.eye(3, 4)


def displacement(rng, affine, scale=1.0):
    """Return a displacement; rigid, or affine and fairly regular."""
    A = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    if affine:
        A = A @ np.diag(rng.uniform(0.5, 2.0, 3)) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.column_stack((A, scale * rng.normal(size=3)))


def random_ball(rng, vertices, share, affine=False):
    """Return a ball whose radius is that share of the least nu of the polygon's plane."""
    metric = MassDistribution.of_polygon(vertices)
    scale = np.ptp(vertices, axis=0).max()
    ball = DisplacementBall(metric, displacement(rng, affine, scale), 1.0)
    polygon = Polygon(vertices)
    nu = PlaneMetric.of(ball, vertices[0], polygon.normal).nu.min()
    return DisplacementBall(metric, ball.center, share * nu), polygon


def inside(rng, polygon, count):
    """Return points of a polygon."""
    corners = polygon.corners[rng.integers(len(polygon.corners), size=count)]
    return np.einsum('nk,nki->ni', rng.dirichlet(np.ones(3), count), corners)


def displaced(rng, ball, x):
    """Return images of points under displacements of the ball, some that move them the most."""
    metric, R = ball.distribution, ball.radius * (1.0 - 1e-9)
    D = rng.normal(size=(len(x), 3, 4)) * rng.uniform(0.1, 1.0, (len(x), 1, 1))
    lifted = np.column_stack((x, np.ones(len(x))))
    best = np.einsum('ni,nj->nij', rng.normal(size=(len(x), 3)), lifted @ np.linalg.inv(metric.G))
    D = np.where(rng.random((len(x), 1, 1)) < 0.5, D, best)
    D *= R / np.linalg.norm(metric.coordinates(D), axis=1)[:, None, None]
    shrink = np.where(rng.random(len(x)) < 0.5, 1.0, rng.random(len(x)))
    return np.einsum('nij,nj->ni', ball.center + shrink[:, None, None] * D, lifted)


def true_distance(ball, points, p):
    """Return the least distance of p from balls over points, as sampled (not below the truth)."""
    away = np.linalg.norm(ball.images(points) - p, axis=1)
    return (away - ball.radius * ball.distribution.rho(points)).min()


def support(polygon, steps=60):
    """Return a fine sample of a polygon, its corners and edges included."""
    weights = np.array(
        [(i, j, steps - i - j) for i in range(steps + 1) for j in range(steps + 1 - i)]
    )
    return np.concatenate([weights / steps @ corners for corners in polygon.corners])


@pytest.mark.parametrize('scale', SCALES)
@pytest.mark.parametrize('share', [0.05, 0.5, 0.99, 1.3, 5.0])
def test_orbits_contain_all_displaced_points(scale, share):
    """Vertices, edges and faces; small and large balls; rigid and affine centres."""
    rng = np.random.default_rng(0)
    for vertices, affine in ((OCTAGON, False), (L, True)):
        ball, polygon = random_ball(rng, scale * vertices, share, affine)
        face = FatPolygon(ball, polygon)
        assert all(face.contains(p) for p in displaced(rng, ball, inside(rng, polygon, 40)))
        for k, edge in enumerate(face.edges[:3]):
            t = rng.random((10, 1))
            x = (1.0 - t) * edge.ends[0] + t * edge.ends[1]
            assert all(edge.contains(p) for p in displaced(rng, ball, x))
            point = face.points[k]
            for p in displaced(rng, ball, np.repeat(point.point[None], 10, axis=0)):
                assert point.contains(p)
                assert np.linalg.norm(p - point.center) <= point.radius


def test_extremal_displacements_touch_the_boundary():
    """|D(x)| = R rho(x) is attained: just inside at R, and outside a little farther out."""
    rng = np.random.default_rng(1)
    for _ in range(10):
        ball, polygon = random_ball(rng, OCTAGON, 0.3, affine=True)
        x = polygon.vertices[rng.integers(8)]
        fat = FatPoint(ball, x)
        way = rng.normal(size=3)
        way *= ball.radius * ball.distribution.rho(x) / np.linalg.norm(way)
        assert fat.contains(fat.center + way * (1.0 - 1e-12))
        assert not fat.contains(fat.center + way * (1.0 + 1e-9))
        bound = fat.distance_bound(fat.center + 3.0 * way)
        assert bound == pytest.approx(2.0 * np.linalg.norm(way), rel=1e-8)


@pytest.mark.parametrize('share', [0.05, 0.5, 0.95, 1.2, 4.0])
def test_distance_bounds_are_below_the_distance_and_near_it(share):
    """A fine sample of balls; close where the quadratic is convex, never above."""
    rng = np.random.default_rng(2)
    for vertices in (OCTAGON, L):
        ball, polygon = random_ball(rng, vertices, share, affine=True)
        fat = FatPolygon(ball, polygon)
        sample = support(polygon)
        for _ in range(8):
            center = ball.images(vertices[rng.integers(len(vertices))])
            p = center + (1.0 + 3.0 * share) * rng.normal(size=3)
            distance = true_distance(ball, sample, p)
            bound = fat.distance_bound(p)
            assert 0.0 <= bound <= max(distance, 0.0)
            # With one k for all of a triangle, |h| + d where |h| is not a is overestimated by
            # (|h| - a)^2 / (2 a) at most. Sampling misses the nearest ball by a squared step.
            h = ball.radius * ball.distribution.rho(sample)
            assert bound >= distance - np.ptp(h) ** 2 / (2.0 * h.min()) - 2e-3
            edge, ends = fat.edges[0], fat.edges[0].ends
            t = np.linspace(0.0, 1.0, 2000)[:, None]
            distance = true_distance(ball, (1.0 - t) * ends[0] + t * ends[1], p)
            assert 0.0 <= edge.distance_bound(p) <= max(distance, 0.0)
            assert edge.distance_bound(p) >= 0.5 * distance - 1e-3


def test_distance_bounds_of_large_balls_are_those_of_the_ends():
    """Remark 1: for R >= nu an edge's orbit is the union of two balls."""
    rng = np.random.default_rng(3)
    ball, polygon = random_ball(rng, OCTAGON, 20.0)
    edge = FatEdge(ball, polygon.edges[0])
    assert edge.line.nu < ball.radius
    ends = [FatPoint(ball, end) for end in edge.ends]
    for _ in range(50):
        p = ends[0].center + 60.0 * rng.normal(size=3)
        assert edge.contains(p) == any(end.contains(p) for end in ends)


def test_largest_accepted_never_invents_a_number():
    """What it returns was accepted, whatever the proof is like."""
    assert largest_accepted(lambda d: d < 0.3, 1.0) == pytest.approx(0.3, rel=1e-7)
    assert largest_accepted(lambda d: False, 1.0) == 0.0
    for guess in (0.0, -1.0, np.nan, np.inf):
        assert largest_accepted(lambda d: True, guess) == 0.0


@pytest.mark.parametrize('affine', [False, True])
def test_metric_data_of_lines_and_planes(affine):
    """(5) and (7): the rate along the parameterisation, at points moved back by g."""
    rng = np.random.default_rng(4)
    for _ in range(10):
        body = rng.normal(size=(6, 3))
        metric = MassDistribution.of_points(body)
        ball = DisplacementBall(metric, displacement(rng, affine), 0.1)
        A, t = ball.center[:, :3], ball.center[:, 3]
        line = LineMetric.of(ball, body[0], body[1])
        s = rng.normal(size=20)
        x = np.linalg.solve(A, (line.foot + s[:, None] * line.direction - t).T).T
        assert np.allclose(metric.rho(x) ** 2, line.rho_0**2 + (s / line.nu) ** 2)
        across = np.cross(x - body[0], body[1] - body[0])
        assert np.allclose(across, 0.0, atol=1e-9)
        normal = np.cross(body[1] - body[0], body[2] - body[0])
        plane = PlaneMetric.of(ball, body[0], normal / np.linalg.norm(normal))
        st = rng.normal(size=(20, 2))
        x = np.linalg.solve(A, (plane.foot + st @ plane.axes[:, :2].T - t).T).T
        assert np.allclose(metric.rho(x) ** 2, plane.rho_0**2 + ((st / plane.nu) ** 2).sum(axis=1))
        assert np.allclose((x - body[0]) @ normal, 0.0, atol=1e-9)
        assert np.allclose(plane.axes.T @ plane.axes, np.eye(3))


@pytest.mark.parametrize('affine', [False, True])
def test_hyperboloids_bound_the_orbits_of_lines_and_planes(affine):
    """(6) and (8) have the sign of the exact least quadratic, where ends do not matter."""
    rng = np.random.default_rng(5)
    signs = []
    for _ in range(60):
        body = rng.normal(size=(5, 3))
        metric = MassDistribution.of_points(body)
        g = displacement(rng, affine)
        unit = DisplacementBall(metric, g, 1.0)
        line = LineMetric.of(unit, body[0], body[1])
        R = float(rng.uniform(0.1, 0.9) * line.nu)
        ball = DisplacementBall(metric, g, R)
        p = line.foot + rng.normal() * line.direction + 2.0 * R * line.rho_0 * rng.normal(size=3)
        long = 100.0 * (body[1] - body[0])
        least, _ = Pair(p[None], np.array([body[0] - long, body[1] + long]), ball).least()
        signs.append(least > 0)
        assert (line.hyperboloid(R, p) > 0.0) == (least > 0)
        u, v = body[1] - body[0], body[2] - body[0]
        normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
        plane = PlaneMetric.of(unit, body[0], normal)
        R = float(rng.uniform(0.1, 0.9) * plane.nu.min())
        ball = DisplacementBall(metric, g, R)
        p = plane.foot + plane.axes @ (rng.normal(size=3) * [1.0, 1.0, 2.0 * R * plane.rho_0])
        wide = body[0] + 100.0 * np.array([u + v, v - 2.0 * u, u - 2.0 * v])
        least, _ = Pair(p[None], wide, ball).least()
        signs.append(least > 0)
        assert (plane.hyperboloid(R, p) > 0.0) == (least > 0)
    assert 20 < sum(signs) < 100


def test_sigma_projects_along_the_normals():
    """Proposition 1: the surface's normal in the projected point passes through the point."""
    rng = np.random.default_rng(6)
    for affine in (False, True):
        ball, polygon = random_ball(rng, OCTAGON, 0.7, affine)
        plane, R = FatPolygon(ball, polygon).plane, ball.radius
        x = ball.images(inside(rng, polygon, 30))
        for side in (1.0, -1.0):
            y = plane.project(R, x, side)
            assert np.allclose(plane.hyperboloid(R, y), 0.0, atol=1e-12)
            assert (side * plane.coordinates(y)[:, 2] > 0.0).all()
            # The normal is the gradient of (8).
            factors = np.append(1.0 / (1.0 - (plane.nu / R) ** 2), 1.0)
            gradient = (plane.coordinates(y) * factors) @ plane.axes.T
            away = x - y
            cosine = np.abs((gradient * away).sum(axis=1))
            cosine /= np.linalg.norm(gradient, axis=1) * np.linalg.norm(away, axis=1)
            assert np.allclose(cosine, 1.0, atol=1e-12)
            # And the orthographic projection is sigma's, (9) with a^2, c^2 as in (10).
            c2 = (R * plane.rho_0) ** 2
            a2 = ((plane.nu / R) ** 2 - 1.0) * c2
            scaled = plane.coordinates(x)[:, :2] * (a2 / (a2 + c2))
            assert np.allclose(plane.coordinates(y)[:, :2], scaled, atol=1e-12)


def test_the_paper_s_face_test_agrees():
    """Between the sheets and over sigma(P): there the nearest ball is one over the face."""
    rng = np.random.default_rng(7)
    ball, polygon = random_ball(rng, OCTAGON, 0.6)
    fat = FatPolygon(ball, polygon)
    plane, R = fat.plane, ball.radius
    x = ball.images(inside(rng, polygon, 200))
    over = plane.project(R, x, 1.0)
    foot = over - (plane.coordinates(over)[:, 2:] * plane.axes[:, 2])
    height = plane.coordinates(over)[:, 2]
    for share, expected in ((0.999, True), (1.001, False)):
        p = foot + (share * height)[:, None] * plane.axes[:, 2]
        assert all(fat.contains(y) == expected for y in p)
        assert ((plane.hyperboloid(R, p) <= 0.0) == expected).all()


def test_between_nu_1_and_nu_2_edges_are_enough():
    """Remark 1, the mixed case: a point in the orbit is in that of an edge."""
    rng = np.random.default_rng(8)
    stretched = OCTAGON * [1.0, 0.2, 1.0]
    ball, polygon = random_ball(rng, stretched, 2.0)
    fat = FatPolygon(ball, polygon)
    assert fat.plane.nu.min() < ball.radius < fat.plane.nu.max()
    answers = []
    for p in displaced(rng, ball, inside(rng, polygon, 40)) * 1.3:
        answers.append(fat.contains(p))
        assert answers[-1] == any(edge.contains(p) for edge in fat.edges)
    assert any(answers)


def least_square(p, orbits, domain):
    """Return the least |p - g(x)|^2 - R^2 rho^2(x), to rounding: 0 on the boundary of orbits."""
    fixed = Affine.of_corners(p[None])
    return min(lower_bound(fixed - o.image, o.distortion, domain) for o in orbits)


def closed_volume(mesh):
    """Return the volume in a mesh whose repeated vertices are merged; None if it is open."""
    size = np.ptp(mesh.vertices, axis=0).max()
    keys = np.round(mesh.vertices / size, 9) + 0.0
    points, index = np.unique(keys, axis=0, return_inverse=True)
    triangles = index.ravel()[mesh.triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    if not is_closed(triangles, len(points)):
        return None
    v = points[triangles] * size
    return np.einsum('ni,ni->', v[:, 0], np.cross(v[:, 1], v[:, 2])) / 6.0


@pytest.mark.parametrize(('share', 'affine'), [(0.1, False), (0.6, True), (0.97, False)])
def test_meshes_of_convex_orbits_are_closed_and_on_the_boundary(share, affine):
    """Watertight, outward, every vertex at distance zero from the union of the balls."""
    rng = np.random.default_rng(9)
    ball, polygon = random_ball(rng, OCTAGON + [3.0, 1.0, 2.0], share, affine)
    fat = FatPolygon(ball, polygon)
    volumes = [closed_volume(fat.boundary_mesh(n)) for n in (2, 5, 12)]
    assert volumes[0] > 0.0
    assert abs(volumes[2] - volumes[1]) < 0.25 * abs(volumes[1] - volumes[0])
    mesh = fat.boundary_mesh(3)
    assert set(mesh.labels) == set(Patch)
    assert len(mesh.labels) == len(mesh.triangles)
    square = (ball.radius * ball.distribution.rho(polygon.vertices).max()) ** 2
    for p in mesh.vertices:
        assert abs(least_square(p, fat.orbits, TRIANGLE)) < 1e-9 * square
    for edge in fat.edges[:2]:
        volumes = [closed_volume(edge.boundary_mesh(n)) for n in (2, 5, 12)]
        assert volumes[0] > 0.0
        assert abs(volumes[2] - volumes[1]) < 0.25 * abs(volumes[1] - volumes[0])
        for p in edge.boundary_mesh(3).vertices:
            assert abs(least_square(p, [edge.orbit], SEGMENT)) < 1e-9 * square
    point = fat.points[0]
    volume = 4.0 / 3.0 * np.pi * point.radius**3
    assert closed_volume(point.boundary_mesh(32)) == pytest.approx(volume, rel=1e-2)


@pytest.mark.parametrize('share', [0.3, 1.5, 10.0])
def test_meshes_of_other_orbits_lie_in_them(share):
    """A polygon with a reflex corner, and balls so large that the face has no patch."""
    rng = np.random.default_rng(10)
    ball, polygon = random_ball(rng, L, share)
    fat = FatPolygon(ball, polygon)
    mesh = fat.boundary_mesh(3)
    square = (ball.radius * ball.distribution.rho(polygon.vertices).max()) ** 2
    for p in mesh.vertices:
        assert least_square(p, fat.orbits, TRIANGLE) < 1e-9 * square
    assert (Patch.FACE in mesh.labels) == (share < 1.0)


def test_flattening_centres_have_no_hyperboloid_but_still_an_orbit():
    """A centre of rank 1 or 2: the basic tests need no inverse."""
    metric = MassDistribution.of_polygon(OCTAGON)
    ball = DisplacementBall(metric, np.diag([1.0, 0.0, 0.0])[:, [0, 1, 2, 2]], 0.1)
    fat = FatPolygon(ball, Polygon(OCTAGON))
    assert fat.contains(np.array([0.5, 0.0, 0.1]))
    assert not fat.contains(np.array([0.5, 0.0, 0.5]))
    with pytest.raises(RequestError, match='center'):
        fat.boundary_mesh()
    with pytest.raises(RequestError, match='edge'):
        LineMetric.of(ball, np.zeros(3), np.array([0.0, 1.0, 0.0]))
