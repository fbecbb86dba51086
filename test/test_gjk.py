"""The search: distances like coal's, and common points that are really inside."""

import math

import coal
import kernel_calls
import numpy as np
import pytest
from random_robot import box_body, hull_body
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from trajectory_guard.kernels.gjk import OVERLAP, RELATIVE, ROUNDS, SEPARATED
from trajectory_guard.pack import solids


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


def scratch():
    """Return the scratch of the search for a common point."""
    square, column = (4, 4), 4
    return tuple(np.empty(n) for n in (square, column, square, column, column, (200, 4)))


def run(points, links, obstacles):
    """Return state and output of the distance search."""
    s, w, out = np.empty((4, 6)), np.empty(4), np.empty(8)
    state = kernel_calls.gjk(
        np.array([0.0, 0.0, 1.0]),
        points,
        1,
        links,
        0,
        obstacles,
        0,
        0.0,
        False,
        1e-9,
        ROUNDS,
        s,
        w,
        out,
    )
    return state, out


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
        state, out = run(points, links, obstacles)
        if d > 1e-6:
            assert state == SEPARATED
            assert out[3] - 1e-9 <= d <= out[4] + 1e-9
            assert out[4] - out[3] <= 1e-9 + RELATIVE * out[4] + 1e-12
        elif d < -1e-6:
            assert state == OVERLAP


def test_common_point_is_deep_in_both():
    """The proposed point is inside both polytopes, and the depth is the least face distance."""
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(60):
        a, _, points, links, obstacles = scene(rng, 1.5)
        out = np.empty(6)
        inside = kernel_calls.deepest(
            points,
            links,
            0,
            obstacles,
            0,
            scratch(),
            out,
        )
        state, _ = run(points, links, obstacles)
        assert inside == (state == OVERLAP)
        if inside:
            P = points.reshape(3, 4)
            world = P[:, :3] @ out[:3] + P[:, 3]
            mine = kernel_calls.depth(links.faces, *out[:3])
            theirs = kernel_calls.depth(obstacles.faces, *world)
            assert mine > 0.0 and theirs > 0.0
            assert abs(mine - theirs) < 1e-6  # the largest common ball touches both
            assert abs(mine - (a.faces[:, 3] - a.faces[:, :3] @ out[:3]).min()) < 1e-12
            found += 1
    assert found > 20


def test_no_faces_no_claim():
    """Without an inscribed polytope nothing is ever inside."""
    assert kernel_calls.depth(np.empty((0, 4)), 0.0, 0.0, 0.0) == -math.inf
    body = box_body(np.ones(3))
    links, obstacles = solids([body], [0]), solids([body], [-1])
    points = np.array([[[1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0]]])
    bare = links._replace(ranges=links.ranges * np.array([1, 1, 0, 0, 1]))
    out = np.empty(6)
    assert not kernel_calls.deepest(
        points,
        bare,
        0,
        obstacles,
        0,
        scratch(),
        out,
    )
