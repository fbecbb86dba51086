"""Lever arms: no joint ever moves a point of the body by more than its turn times its arm."""

from exact_chain import random_chain
import kernel_calls
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajectory_guard.kernels import layout


def places(chain, q):
    """Return the body's points (P, 3) at joint values q, and every axis' point and direction."""
    T, axes = np.eye(4), []
    transform = np.array(chain.packed._held[0].transform).reshape(-1, 3, 4)
    for kind, fixed, value in zip(chain.kinds, transform, q, strict=True):
        T = T @ np.vstack([fixed, [0.0, 0.0, 0.0, 1.0]])
        axes.append((T[:3, 3].copy(), T[:3, 2].copy()))
        motion = np.eye(4)
        if kind == layout.REVOLUTE:
            motion[:3, :3] = Rotation.from_rotvec([0.0, 0.0, value]).as_matrix()
        else:
            motion[2, 3] = value
        T = T @ motion
    return chain.points @ T[:3, :3].T + T[:3, 3], axes


@pytest.mark.parametrize('joints', [1, 2, 5, 9])
@pytest.mark.parametrize('scale', [1e-6, 1.0, 1e6])
def test_arms_bound_the_distance_to_the_axis(joints, scale):
    """Over random configurations no point lies farther from an axis, or from the root."""
    rng = np.random.default_rng(joints)
    tightest = 0.0
    for _ in range(12):
        chain = random_chain(rng, joints, scale)
        slides = chain.kinds == layout.PRISMATIC
        travel = np.where(slides, rng.uniform(0.0, scale, joints), 0.0)
        rho, reach = kernel_calls.lever_arms(chain.packed, travel, 0, joints - 1)
        assert (rho[slides] == 1.0).all()
        for _ in range(20):
            q = np.where(slides, rng.choice([-1.0, 1.0], joints) * travel, rng.normal(size=joints))
            x, axes = places(chain, q)
            assert np.linalg.norm(x, axis=1).max() <= reach * (1.0 + 1e-12)
            for j, (origin, direction) in enumerate(axes):
                if not slides[j]:
                    off = np.linalg.norm(np.cross(x - origin, direction), axis=1).max()
                    assert off <= rho[j] * (1.0 + 1e-12)
                    tightest = max(tightest, off / rho[j])
    assert tightest > 0.9  # the last joint's arm is exact


@pytest.mark.parametrize('seed', range(5))
def test_the_sum_bounds_every_deviation(seed):
    """Any errors of all joints together, small, a turn or many: sum min(|eps|, 2) rho."""
    rng = np.random.default_rng(seed)
    for size in (1e-6, 0.01, 1.0, 3.2, 100.0):
        chain = random_chain(rng, 6, 1.0)
        slides = chain.kinds == layout.PRISMATIC
        q = rng.normal(size=6)
        for _ in range(20):
            off = rng.choice([-1.0, 0.5, 1.0], 6) * size
            travel = np.where(slides, np.abs(q) + np.abs(off), 0.0)
            rho, _ = kernel_calls.lever_arms(chain.packed, travel, 0, 5)
            eps = np.where(slides, np.abs(off), np.minimum(np.abs(off), 2.0))
            moved = places(chain, q + off)[0] - places(chain, q)[0]
            assert np.linalg.norm(moved, axis=1).max() <= eps @ rho * (1.0 + 1e-12) + 1e-13 * size


def test_a_joint_beside_the_body_has_no_arm():
    """Joints below the body's node do not move it."""
    chain = random_chain(np.random.default_rng(0), 5, 1.0)
    rho, _ = kernel_calls.lever_arms(chain.packed, np.zeros(5), 0, 2)
    assert (rho[3:] == 0.0).all()
    assert (rho[:3] > 0.0).all()
