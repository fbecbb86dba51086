"""Paths whose segments do not join: what was outside before a jump may be inside after it."""

from meshes import extruded, U
import numpy as np
import pytest

from trajectory_guard.cell.free_body import free_body
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import certify
from trajectory_guard.kernels.layout import Floating, Path
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.free_path import FreePath
from trajectory_guard.paths.jumps import jumps
from trajectory_guard.result import Status
from trajectory_guard.settings import Scope, Settings
from trajectory_guard.shapes.mesh import mesh_body
from trajectory_guard.shapes.primitive import Box

SECOND = 10**9
OPENING, WALL, BEHIND = (0.0, 0.05, 0.0), (-0.15, 0.0, 0.0), (0.02, 0.05, 0.0)


def along(start, end):
    points = np.zeros((2, 3, 4))
    points[:, :, :3] = np.eye(3)
    points[:, :, 3] = start, end
    return RationalMotion(points, np.ones(2))


def statuses(motions, **settings):
    """Certify a pebble against a U with walls thicker than itself; one row per interval."""
    body = mesh_body(extruded(U, height=2.0))
    cell = Workcell(
        free_body('pebble', Box((0.01, 0.01, 0.01))), Scene((Obstacle('bin', (body,)),), '')
    )
    path = FreePath.exact(motions, [SECOND * k for k in range(len(motions) + 1)])
    rows = certify(cell, path, Settings(**settings)).intervals
    return [(row.start_ns // SECOND, row.end_ns // SECOND, row.status, row.reason) for row in rows]


@pytest.mark.parametrize('scope', list(Scope))
def test_a_body_that_jumps_into_a_solid_is_not_free(scope):
    motions = [along(OPENING, OPENING), along(WALL, WALL)]
    rows = statuses(motions, scope=scope)
    assert rows == [(0, 1, Status.FREE, ''), (1, 2, Status.SUSPECT, 'enclosure')]


def test_one_that_jumps_out_again_is_free_again():
    """Leaves of one run are condensed, so the jumps within are found without them."""
    here, there = along(OPENING, BEHIND), along(WALL, WALL)
    rows = statuses([here, there, here, along(BEHIND, OPENING), along(OPENING, OPENING)])
    assert rows == [
        (0, 1, Status.FREE, ''),
        (1, 2, Status.SUSPECT, 'enclosure'),
        (2, 5, Status.FREE, ''),
    ]


def test_one_that_jumps_but_stays_outside_is_free():
    assert statuses([along(OPENING, OPENING), along(BEHIND, BEHIND)]) == [(0, 2, Status.FREE, '')]


def joint_path(ends, errors):
    """Return a path of one joint whose two segments meet at the given values."""
    coefficients = np.zeros((2, 1, 6))
    coefficients[0, 0, :3] = 0.5, ends[0] - 1.0, 0.5
    coefficients[1, 0, 0] = ends[1]
    return Path(coefficients, np.array(errors)[:, None], np.zeros(1))


@pytest.mark.parametrize(
    ('ends', 'errors', 'found'),
    [
        ((1.0, 1.0), (0.0, 0.0), []),
        ((1.0, 1.0 + 2.0**-50), (0.0, 0.0), [1]),
        ((1.0, 1.0 + 2.0**-50), (2.0**-51, 2.0**-50), []),
        ((2.0, 1.0), (0.4, 0.5), [1]),
    ],
)
def test_joints_jump_by_more_than_their_errors(ends, errors, found):
    assert jumps(joint_path(ends, errors)).tolist() == found


@pytest.mark.parametrize(
    ('turn', 'shift', 'found'),
    [(0.0, 0.0, [1]), (0.02, 0.0, [1]), (0.0, 0.3, [1]), (0.02, 0.3, [])],
)
def test_poses_jump_by_more_than_their_errors(turn, shift, found):
    control = np.zeros((4, 4, 4))
    control[:, :3, :3] = np.eye(3)
    control[2:, 0, 1] = 0.03
    control[2:, 3, 2] = 0.5
    bounds = np.array([[turn, shift, 0.0, 1.0]] * 2)
    curves = Floating(np.array([0, 2, 4]), control.reshape(4, 16), np.ones(4), bounds)
    path = Path(np.zeros((2, 6, 6)), np.zeros((2, 6)), np.zeros(6), curves)
    assert jumps(path).tolist() == found
