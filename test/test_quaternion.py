"""A quaternion's rotation is within its bound of the exact one, and comes back."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajectory_guard.cell.quaternion import quaternion_length, quaternion_of, quaternion_pose
from trajectory_guard.shapes.body import rigid_defect, RIGID_TOLERANCE, U

BOUND = 10 * Fraction(U)


def exact_rotation(quaternion):
    """Return the rotation of a quaternion of any length, in rationals."""
    x, y, z, w = map(Fraction, quaternion)
    n = x * x + y * y + z * z + w * w
    rows = (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    return [[entry / n for entry in row] for row in rows]


def quaternions(count=500):
    """Yield quaternions of nearly length 1: random ones, half turns, and small ones."""
    rng = np.random.default_rng(0)
    for k in range(count):
        q = rng.normal(size=4) * (1.0, 1.0, 1.0, (1.0, 1e-9, 1e9, 0.0)[k % 4])
        yield (q / np.linalg.norm(q) * (1.0 + rng.uniform(-1e-3, 1e-3))).tolist()
    yield from np.eye(4).tolist()


def test_every_entry_is_within_its_bound():
    for q in quaternions():
        T = quaternion_pose((1.0, 2.0, 3.0), q)
        exact = exact_rotation(q)
        worst = max(abs(Fraction(T[i, j]) - exact[i][j]) for i in range(3) for j in range(3))
        assert worst <= BOUND
        assert rigid_defect(T) <= RIGID_TOLERANCE
        assert T[:3, 3].tolist() == [1.0, 2.0, 3.0]


def test_agrees_with_another_library():
    for q in quaternions(50):
        ours = quaternion_pose((0.0, 0.0, 0.0), q)[:3, :3]
        assert np.abs(ours - Rotation.from_quat(q).as_matrix()).max() < 1e-14


@pytest.mark.parametrize('scale', [1.0, -1.0])
def test_a_rotation_comes_back(scale):
    for q in quaternions():
        R = quaternion_pose((0.0, 0.0, 0.0), np.multiply(scale, q))[:3, :3]
        back = quaternion_of(R)
        assert abs(quaternion_length(back) - 1.0) < 1e-15
        assert np.abs(quaternion_pose((0.0, 0.0, 0.0), back)[:3, :3] - R).max() < 1e-14
