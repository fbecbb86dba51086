"""The rational motion of a link against independent kinematics: the truth is inside the bound."""

from bench_data import BENCH, cases, ROBOTS, workcell
import numpy as np
import pinocchio
import pytest
from random_robot import core, link_poses, random_path, random_workcell

from trajectory_guard.errors import RequestError
from trajectory_guard.motions.link_motion import Builder, rational_motion
from trajectory_guard.paths.joint_path import joint_path

# scipy's and pinocchio's own rounding, next to metres.
JUDGE = 1e-14


def pieces(rng, count, segments, deepest):
    """Yield random (segment, numerator, level)."""
    for _ in range(count):
        level = int(rng.integers(deepest))
        yield int(rng.integers(segments)), int(rng.integers(2**level)), level


def place(level, numerator, tau):
    """Return s in [0, 1] of a place in a piece."""
    return (2 * numerator + 1 + tau) / 2 ** (level + 1)


@pytest.mark.parametrize('builder', Builder)
@pytest.mark.parametrize('robot', ROBOTS)
def test_bound_contains_pinocchio_on_real_robots(robot, builder):
    """Every link's vertices, at dense instants of random pieces, lie within the error."""
    rng = np.random.default_rng(1)
    cell = workcell(robot)
    model = pinocchio.buildModelFromUrdf(str(BENCH / f'{robot}.urdf'))
    data = model.createData()
    tightest = 0.0
    for trajectory, _, _ in cases(robot)[::12]:
        path = joint_path(cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True)
        for segment, numerator, level in pieces(rng, 12, len(path.coefficients), 5):
            body = int(rng.choice(np.flatnonzero(cell.link_nodes >= 0)))
            link = cell.link_names[body]
            motion = rational_motion(cell, path, body, segment, numerator, level, builder=builder)
            for tau in np.linspace(-1.0, 1.0, 9):
                s = place(level, numerator, tau)
                q = (path.coefficients[segment] * s ** np.arange(6)).sum(axis=1)
                pinocchio.framesForwardKinematics(model, data, q)
                true = data.oMf[model.getFrameId(link)].homogeneous
                vertices = cell.robot.bodies(link)[0].vertices
                off = distance(
                    true, motion.pose(0.5 * (1.0 + tau)), cell.tree.link_pose[link], vertices
                )
                assert off <= motion.error + JUDGE
                tightest = max(tightest, off / motion.error)
    assert tightest > 0.1  # a bound that is never approached would hide a wrong unit


def distance(true, pose, T_node_link, points):
    """Return how far points of a link are from where a motion's node pose puts them."""
    image = (np.vstack([pose, [0.0, 0.0, 0.0, 1.0]]) @ T_node_link)[:3]
    off = points @ (true[:3, :3] - image[:, :3]).T + (true[:3, 3] - image[:, 3])
    return np.linalg.norm(off, axis=1).max()


@pytest.mark.parametrize('builder', Builder)
@pytest.mark.parametrize('seed', range(6))
@pytest.mark.parametrize('spread', [1e-6, 0.1, 1.0, 30.0])
def test_bound_contains_any_robot(seed, spread, builder):
    """Any axes, slides, branches, fixed and mimic joints, tracking errors, tiny and huge turns."""
    rng = np.random.default_rng(seed)
    cell = random_workcell(rng, joints=6)
    path = random_path(rng, cell.robot, spread=spread)
    slack = rng.uniform(0.0, 0.05, len(path.joint_names))
    for segment, numerator, level in pieces(rng, 12, len(path.coefficients), 7):
        body = int(rng.choice(np.flatnonzero(cell.link_nodes >= 0)))
        link = cell.link_names[body]
        motion = rational_motion(cell, path, body, segment, numerator, level, slack, builder)
        points = core(cell.robot.bodies(link)[0], rng)
        T = cell.tree.link_pose[link]
        middle = None
        for tau in (0.0, -1.0, -0.6, 0.3, 0.8, 1.0):
            q = (path.coefficients[segment] * place(level, numerator, tau) ** np.arange(6)).sum(1)
            true = link_poses(cell.robot, q)[link]
            scale = 1.0 + np.abs(q).max()
            assert (
                distance(true, motion.pose(0.5 * (1.0 + tau)), T, points)
                <= motion.error + JUDGE * scale
            )
            off = q + slack * rng.choice([-1.0, 0.3, 1.0], len(q))
            followed = link_poses(cell.robot, off)[link]
            bound = motion.error + motion.inflation + JUDGE * scale
            assert distance(followed, motion.pose(0.5 * (1.0 + tau)), T, points) <= bound
            middle = true if middle is None else middle
            moved = points @ (true - middle)[:3, :3].T + (true - middle)[:3, 3]
            assert np.linalg.norm(moved, axis=1).max() <= motion.sweep + JUDGE * scale


@pytest.mark.parametrize('builder', Builder)
def test_true_points_lie_in_the_hull_of_the_control_points(builder):
    """In any direction no true point leaves the control points by more than the error."""
    rng = np.random.default_rng(5)
    cell = random_workcell(rng, joints=6)
    path = random_path(rng, cell.robot, spread=0.5)
    for segment, numerator, level in pieces(rng, 30, len(path.coefficients), 4):
        body = int(rng.choice(np.flatnonzero(cell.link_nodes >= 0)))
        link = cell.link_names[body]
        motion = rational_motion(cell, path, body, segment, numerator, level, builder=builder)
        assert (motion.weights > 0.0).all()
        x = cell.robot.bodies(link)[0].vertices[0]
        local = cell.tree.link_pose[link] @ [*x, 1.0]
        hull = motion.control_points @ local
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        for tau in np.linspace(-1.0, 1.0, 11):
            q = (path.coefficients[segment] * place(level, numerator, tau) ** np.arange(6)).sum(1)
            true = (link_poses(cell.robot, q)[link] @ [*x, 1.0])[:3]
            assert n @ true >= (hull @ n).min() - motion.error - JUDGE
            assert n @ true <= (hull @ n).max() + motion.error + JUDGE


def test_rational_rotation_is_exactly_a_rotation():
    """Between control points the curve is rigid, not only close to it."""
    rng = np.random.default_rng(6)
    cell = random_workcell(rng)
    path = random_path(rng, cell.robot, spread=0.3)
    body = int(np.flatnonzero(cell.link_nodes >= 0)[-1])
    motion = rational_motion(cell, path, body, 0)
    for tau in np.linspace(-1.0, 1.0, 7):
        R = motion.pose(0.5 * (1.0 + tau))[:, :3]
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)


@pytest.mark.parametrize(
    ('body', 'segment', 'numerator', 'level'),
    [(0, 9, 0, 0), (0, -1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 60), (99, 0, 0, 0), (-1, 0, 0, 0)],
)
def test_pieces_that_do_not_exist_are_refused(body, segment, numerator, level):
    """A wrong index is an error, not another piece."""
    rng = np.random.default_rng(7)
    cell = random_workcell(rng)
    with pytest.raises(RequestError):
        rational_motion(cell, random_path(rng, cell.robot), body, segment, numerator, level)
