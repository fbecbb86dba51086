"""Proofs of overlap: what is claimed to collide does, at every instant and for any error."""

import math

import kernel_calls
from kernel_calls import CONTROLS
import numpy as np
import pytest
from random_robot import box_body, hull_body
from scipy.spatial.transform import Rotation

from trajectory_guard.cell.pack import solids
from trajectory_guard.shapes.body import ConvexBody

WEIGHTS = np.array([math.comb(CONTROLS - 1, i) for i in range(CONTROLS)])


def motion(rng, spread):
    """Return (13, 12) control points of a curve of poses through the obstacle's place."""
    base, step, shift = rng.normal(size=3), rng.normal(size=3) * spread, rng.normal(size=3) * 0.4
    rows = []
    for k in range(CONTROLS):
        tau = 2.0 * k / (CONTROLS - 1) - 1.0
        R = Rotation.from_rotvec(base + tau * step).as_matrix()
        t = shift + spread * (tau * rng.normal(size=3) * 0.2 + rng.normal(size=3) * 0.05)
        rows.append(np.column_stack([R, t]).ravel())
    return np.array(rows)


def pose_at(points, s):
    """Return the curve's pose at s in [0, 1], (3, 4)."""
    i = np.arange(CONTROLS)
    basis = WEIGHTS * s**i * (1.0 - s) ** (CONTROLS - 1 - i)
    return (basis @ points).reshape(3, 4)


def least_depth(faces, x):
    """Return how deep a point lies in a polytope [m]."""
    return (faces[:, 3] - faces[:, :3] @ x).min()


def overlapping(link, obstacle, y, z, x, error):
    """Say whether a link point's image, off by `error`, still proves that the solids meet."""
    if least_depth(obstacle.faces, x) > error and least_depth(link.faces, y) > -1e-12:
        return True
    mine, theirs = least_depth(link.faces, y), least_depth(obstacle.faces, z)
    return theirs > 0.0 and np.linalg.norm(x - z) + error < mine + theirs


def case(rng):
    """Return link and obstacle and both packed."""
    link = box_body(rng.uniform(0.1, 1.0, 3))
    obstacle = hull_body(rng.normal(size=(12, 3)) * rng.uniform(0.1, 0.6))
    return link, obstacle, solids([link], [0]), solids([obstacle], [-1])


@pytest.mark.parametrize('error', [0.0, 0.01, 0.1])
def test_a_moving_point_proves_every_instant(error):
    """Between points common to both at the ends the overlap holds at dense instants."""
    rng = np.random.default_rng(1)
    proved = refused = 0
    for _ in range(600):
        link, obstacle, links, obstacles = case(rng)
        points = motion(rng, 10.0 ** rng.uniform(-2, 0))
        ends = [kernel_calls.deepest(points[i], links, obstacles) for i in (0, -1)]
        if not (ends[0][0] and ends[1][0]):
            continue
        y0, y1 = ends[0][1], ends[1][1]
        found, place, depth, start, end = kernel_calls.witness(
            points, links, obstacles, error, margin=1e-12, ends=(y0, y1)
        )
        if not found:
            refused += 1
            continue
        proved += 1
        assert (start == y0).all() and (end == y1).all()
        x0, x1 = (pose_at(points, s) @ [*y, 1.0] for s, y in ((0.0, y0), (1.0, y1)))
        np.testing.assert_allclose(place, x0, atol=1e-12)
        for s in np.linspace(0.0, 1.0, 33):
            y, z = (1.0 - s) * y0 + s * y1, (1.0 - s) * x0 + s * x1
            x = pose_at(points, s) @ [*y, 1.0]
            assert overlapping(link, obstacle, y, z, x, error)
        assert depth <= least_depth(link.faces, y0) + least_depth(obstacle.faces, x0)
    assert proved > 30 and refused > 5


@pytest.mark.parametrize('error', [0.0, 0.01, 0.1])
def test_a_standing_point_proves_every_instant(error):
    """Balls around a point of the link and a place in the obstacle meet during the whole piece."""
    rng = np.random.default_rng(2)
    proved = refused = 0
    for _ in range(600):
        link, obstacle, links, obstacles = case(rng)
        points = motion(rng, 10.0 ** rng.uniform(-2, 0))
        centre = pose_at(points, 0.5)
        found, place, depth, y, _ = kernel_calls.witness(
            points, links, obstacles, error, fuzz=1e-12, margin=1e-12, centre=centre
        )
        if depth > 0.0:
            np.testing.assert_allclose(place, centre @ [*y, 1.0], atol=1e-12)
            assert depth <= least_depth(link.faces, y) + least_depth(obstacle.faces, place)
        if not found:
            refused += depth > 0.0
            continue
        proved += 1
        mine, theirs = least_depth(link.faces, y), least_depth(obstacle.faces, place)
        for s in np.linspace(0.0, 1.0, 33):
            x = pose_at(points, s) @ [*y, 1.0]
            assert np.linalg.norm(x - place) + error < mine + theirs
    assert proved > 30 and refused > 5


@pytest.mark.parametrize('stands', [True, False])
def test_errors_that_reach_the_depth_undo_a_proof(stands):
    """A cube in a cube by a known depth: proved below it, not above; a ball adds eps of itself."""
    cube = box_body(np.ones(3))
    still = np.tile(np.eye(4)[:3].ravel(), (CONTROLS, 1))
    links, obstacles = solids([cube], [0]), solids([cube], [-1])
    ends = None if stands else ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])

    def proves(**how):
        return kernel_calls.witness(still, links, obstacles, ends=ends, **how)[0]

    # Both balls of 1/2 meet until the point is off by 1.
    assert proves(error=0.999, margin=1e-12)
    assert not proves(error=1.001)
    assert not proves(error=0.9, margin=0.06)
    assert not proves(error=math.nan)
    assert not proves(error=0.0, margin=math.nan)
    if stands:
        assert not proves(error=0.0, fuzz=0.6)
        assert not proves(error=0.0, fuzz=math.nan)
    round_cube = ConvexBody(cube.vertices, 0.5, faces=cube.faces)
    links = solids([round_cube], [0])
    assert proves(error=0.9, eps=0.1)
    assert not proves(error=0.9, eps=0.3)


def test_a_point_outside_is_no_witness():
    """Ends that lie in only one of the solids prove nothing."""
    cube = box_body(np.ones(3))
    still = np.tile(np.eye(4)[:3].ravel(), (CONTROLS, 1))
    links, obstacles = solids([cube], [0]), solids([box_body(np.ones(3), (0.6, 0.0, 0.0))], [-1])
    inside, not_theirs, not_mine = [0.3, 0.0, 0.0], [-0.3, 0.0, 0.0], [0.7, 0.0, 0.0]
    assert kernel_calls.witness(still, links, obstacles, 0.0, ends=(inside, inside))[0]
    for out in (not_theirs, not_mine):
        for ends in ((inside, out), (out, inside), (out, out)):
            assert not kernel_calls.witness(still, links, obstacles, 0.0, ends=ends)[0]
    nowhere = np.full(3, math.nan)
    assert not kernel_calls.witness(still, links, obstacles, 0.0, ends=(inside, nowhere))[0]
