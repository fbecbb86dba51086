"""Paths: what is refused, and the half turns that q0 = 1 cannot have."""

import numpy as np
import pytest

from trajectory_guard.canny import Configuration, Motion, recentred, still, straight
from trajectory_guard.errors import Reason, RequestError

ORIGIN = Configuration()
HALF_TURN = Configuration((1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def test_half_turns_are_at_infinity():
    with pytest.raises(RequestError, match='180') as caught:
        straight(ORIGIN, HALF_TURN)
    assert caught.value.reason == Reason.INVALID_PARAMETER


def test_half_turns_are_reached_from_a_frame_between():
    """From 100 over 180 to 260 degrees about z, symmetric about the middle."""
    quarter, three = (
        Configuration((0, 0, 0), (np.cos(t), 0, 0, np.sin(t))) for t in np.radians((50, 130))
    )
    motion = recentred(quarter, three)
    middle = motion.pose(0.5)[:, :3]
    np.testing.assert_allclose(middle, np.diag([-1.0, -1.0, 1.0]), atol=1e-15)


def test_the_shorter_way_is_taken():
    """Q and -Q are one rotation."""
    a, b = Configuration((0, 0, 0), (1, 0.1, 0, 0)), Configuration((0, 0, 0), (-1, 0.1, 0, 0))
    np.testing.assert_allclose(recentred(a, b).pose(0.5)[:, :3], np.eye(3), atol=1e-15)


def test_opposite_ends_are_refused():
    with pytest.raises(RequestError, match='between'):
        recentred(ORIGIN, HALF_TURN)


@pytest.mark.parametrize(
    ('positions', 'quaternions', 'words'),
    [
        (np.zeros((1, 3)), [[1, 0, 0, 0], [-1, 0, 0, 0]], 'vanishes'),
        (np.zeros((1, 3)), [[1, 0, 0, 0], [0, 0, 0, 0]], 'vanishes'),
        (np.zeros((1, 3)), [[1, 0, 0, 0], [-1, 0, 0, 0], [1, 0, 0, 0]], 'vanishes'),
        (np.zeros((1, 3)), [[0, 0, 0, 0]], 'below'),
        (np.zeros((1, 3)), [[1e-20, 0, 0, 0]], 'below'),
        (np.zeros((1, 3)), [[1e20, 0, 0, 0]], 'exceeds'),
        (np.zeros((1, 3)), [[np.nan, 0, 0, 0]], 'not finite'),
        ([[np.inf, 0, 0]], [[1, 0, 0, 0]], 'not finite'),
        ([[2e9, 0, 0]], [[1, 0, 0, 0]], 'exceeds'),
        (np.zeros((1, 2)), [[1, 0, 0, 0]], 'shape'),
        (np.zeros((0, 3)), [[1, 0, 0, 0]], 'shape'),
        (np.zeros((10, 3)), [[1, 0, 0, 0]], 'degree 9'),
    ],
)
def test_what_is_refused(positions, quaternions, words):
    with pytest.raises(RequestError, match=words):
        Motion(np.array(positions, float), np.array(quaternions, float))


@pytest.mark.parametrize('length', [1e-100, 1e-200, 1e-300])
def test_quaternions_of_any_length_have_a_pose(length):
    """Half way the line hardly misses 0, at a half turn about x."""
    motion = Motion(np.zeros((1, 3)), np.array([[1.0, 0, 0, 0], [-1.0, length, 0, 0]]))
    assert motion.pose(0.5)[:, :3].tolist() == np.diag([1.0, -1.0, -1.0]).tolist()


def test_a_standing_body_stands():
    pose = still(Configuration((1, 2, 3), (0, 0, 0, 5))).pose(0.7)
    np.testing.assert_array_equal(pose, [[-1, 0, 0, 1], [0, -1, 0, 2], [0, 0, 1, 3]])


def test_motions_cannot_be_changed():
    with pytest.raises(ValueError, match='read-only'):
        still().positions[0, 0] = 1.0
