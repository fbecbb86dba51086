"""The search: distances like coal's, and common points that are really inside."""

import math

import coal
import kernel_calls
from kernel_calls import OVERLAP, REACHED, RELATIVE, SEPARATED
import numpy as np
import pytest
from random_robot import box_body, hull_body
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from trajectory_guard.cell.pack import solids


def hull_of(body):
    """Return coal's convex shape of a body."""
    vertices = coal.StdVec_Vec3s()
    for v in body.vertices:
        vertices.append(v)
    triangles = coal.StdVec_Triangle()
    for t in ConvexHull(body.vertices).simplices:
        triangles.append(coal.Triangle(*map(int, t)))
    return coal.Convex(vertices, triangles)


def scene(rng, apart):
    """Return two hulls, packed, and the pose of the first."""
    a, b = (hull_body(rng.normal(size=(15, 3))) for _ in range(2))
    R = Rotation.random(random_state=rng).as_matrix()
    t = rng.normal(size=3)
    t *= apart / np.linalg.norm(t)
    points = np.column_stack([R, t]).reshape(1, 1, 12)
    return a, b, points, solids([a], [0]), solids([b], [-1])


def run(points, links, obstacles):
    """Return state, support difference and distance of the distance search."""
    state, _, best, distance, _ = kernel_calls.gjk([0.0, 0.0, 1.0], points, links, obstacles)
    return state, best, distance


@pytest.mark.parametrize('apart', [0.5, 3.0, 4.0, 10.0])
def test_distance_and_direction_agree_with_coal(apart):
    """Coal's distance lies between the direction's support difference and the nearest points."""
    rng = np.random.default_rng(int(10 * apart))
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-10
    for _ in range(30):
        a, b, points, links, obstacles = scene(rng, apart)
        P = points.reshape(3, 4)
        result = coal.DistanceResult()
        d = coal.distance(
            hull_of(a),
            coal.Transform3s(P[:, :3], P[:, 3]),
            hull_of(b),
            coal.Transform3s(),
            request,
            result,
        )
        state, best, distance = run(points, links, obstacles)
        if d > 1e-6:
            assert state == SEPARATED
            assert best - 1e-9 <= d <= distance + 1e-9
            assert distance - best <= 1e-9 + RELATIVE * distance + 1e-12
        elif d < -1e-6:
            assert state == OVERLAP


def test_common_point_is_deep_in_both():
    """The proposed point is inside both polytopes, and the depth is the least face distance."""
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(60):
        a, _, points, links, obstacles = scene(rng, 1.5)
        inside, point, _, place, mine, theirs = kernel_calls.deepest(points, links, obstacles)
        state, *_ = run(points, links, obstacles)
        assert inside == (state == OVERLAP)
        if inside:
            P = points.reshape(3, 4)
            world = P[:, :3] @ point + P[:, 3]
            np.testing.assert_allclose(place, world, atol=1e-14)
            assert mine == kernel_calls.depth(links, point)
            assert abs(theirs - kernel_calls.depth(obstacles, world)) < 1e-14
            assert mine > 0.0 and theirs > 0.0
            assert abs(mine - theirs) < 1e-6  # the largest common ball touches both
            assert abs(mine - (a.faces[:, 3] - a.faces[:, :3] @ point).min()) < 1e-12
            found += 1
    assert found > 20


def test_no_faces_no_claim():
    """Without an inscribed polytope nothing is ever inside."""
    body = box_body(np.ones(3))
    links, obstacles = solids([body], [0]), solids([body], [-1])
    points = np.array([[1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0]])
    assert kernel_calls.deepest(points, links, obstacles)[0]
    bare = links._replace(ranges=links.ranges * np.array([1, 1, 0, 0, 1, 1, 1, 1]))
    assert kernel_calls.depth(bare, [0.0, 0.0, 0.0]) == -math.inf
    assert not kernel_calls.deepest(points, bare, obstacles)[0]
    assert not kernel_calls.deepest(points, links, bare)[0]


@pytest.mark.parametrize('count', [2, 5, 13])
def test_a_direction_for_a_swept_set_is_what_it_says(count):
    """The support difference belongs to the direction, and no better one is promised."""
    rng = np.random.default_rng(count)
    reached = 0
    for _ in range(40):
        a, b, points, links, obstacles = scene(rng, 5.0)
        points = points.reshape(1, 12) + 0.1 * rng.normal(size=(count, 12))
        state, n, best, _, _ = kernel_calls.gjk(
            [0.0, 0.0, 1.0], points, links, obstacles, want=0.1, stop=True, rounds=12
        )
        image = np.concatenate(
            [a.vertices @ P[:, :3].T + P[:, 3] for P in points.reshape(-1, 3, 4)]
        )
        exact = (image @ n).min() - (b.vertices @ n).max()
        assert abs(np.linalg.norm(n) - 1.0) < 1e-14
        assert best <= exact + 1e-12
        if state == REACHED:
            assert exact > 0.1 - 1e-12
            reached += 1
    assert reached > 20
