"""The verifier's enclosures: exact poses and off-path motions lie inside."""

from flint import arb, arb_mat, ctx, fmpq
import numpy as np
import pytest
from random_robot import core, link_poses, random_robot

from trajectory_guard.cell.robot import JointType
from trajectory_guard.paths.trajectory import JointState, Point, Trajectory
from trajectory_guard.verify.claims import functional_of
from trajectory_guard.verify.curve import curve
from trajectory_guard.verify.levers import Levers
from trajectory_guard.verify.motion import Arm, Piece
from trajectory_guard.verify.series import DEGREE, elevated, precision
from trajectory_guard.verify.solids import placed, Solid

SECOND = 10**9


def setting(seed, spread=0.7, joints=6):
    """Return a random robot and its curve."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, joints)
    named = [joint.name for joint in robot.movable if joint.mimic is None]
    trajectory = Trajectory.from_points(
        named,
        [
            Point(k * SECOND, *(rng.normal(size=(3, len(named))) * spread))
            for k in range(3)
        ],
    )  # fmt: skip
    return rng, robot, curve(robot.movable, trajectory, JointState(('none',), [0.0]))


def exact_pose(robot, positions, link):
    """Return the pose of a link in the present precision, joint by joint from the root."""
    above = {joint.child: joint for joint in robot.joints}
    chain = []
    while link != robot.root:
        chain.append(above[link])
        link = above[link].parent
    pose = arb_mat(4, 4, np.eye(4).ravel().tolist())
    for joint in reversed(chain):
        pose = pose * arb_mat(joint.T_parent_joint.tolist())
        a = [arb(x) for x in joint.axis.tolist()]
        size = sum(x * x for x in a).sqrt()
        x, y, z = (value / size for value in a)
        q = positions.get(joint.name, arb(0))
        if joint.type is JointType.PRISMATIC:
            motion = [[1, 0, 0, q * x], [0, 1, 0, q * y], [0, 0, 1, q * z], [0, 0, 0, 1]]
        else:
            c, s = q.cos(), q.sin()
            t = 1 - c
            motion = [
                [t * x * x + c, t * x * y - s * z, t * x * z + s * y, 0],
                [t * x * y + s * z, t * y * y + c, t * y * z - s * x, 0],
                [t * x * z - s * y, t * y * z + s * x, t * z * z + c, 0],
                [0, 0, 0, 1],
            ]
        pose = pose * arb_mat(motion)
    return pose


@pytest.mark.parametrize('seed', range(6))
@pytest.mark.parametrize('spread', [0.3, 1.0, 60.0])
def test_poses_in_256_bits_lie_inside(seed, spread):
    """At random instants, and the ends, of pieces short and long, also with spinning joints."""
    rng, robot, motion = setting(seed, spread)
    for level in (0, 2, 7):
        place = int(rng.integers(2)), int(rng.integers(2**level)), level
        with precision():
            piece = Piece(Arm(robot), motion, *place)
            poses = {link: piece.pose(link) for link in robot.links}
        for tau in (fmpq(-1), fmpq(1), fmpq(int(rng.integers(-(2**20), 2**20)), 2**20)):
            s = (place[1] + (tau + 1) / 2) / fmpq(2) ** level
            before, ctx.prec = ctx.prec, 256
            try:
                positions = {j.name: arb(motion.exact(place[0], j)(s)) for j in motion.joints}
                for link, pose in poses.items():
                    exact = exact_pose(robot, positions, link)
                    for r in range(3):
                        for c in range(4):
                            assert pose[r][c](arb(tau)).contains(exact[r, c].mid())
            finally:
                ctx.prec = before


def test_enclosures_are_tight():
    """A piece of a radian a joint loses less than a micrometre, a short one next to nothing."""
    _, robot, motion = setting(1, 0.3)
    with precision():
        for level, error in ((1, 1e-6), (4, 1e-12)):
            piece = Piece(Arm(robot), motion, 0, 1, level)
            for link in robot.links:
                for row in piece.pose(link):
                    for entry in row:
                        assert entry(arb(0)).rad() < error


def test_coefficients_give_the_polynomial_back():
    """Bernstein coefficients sum up to the pose, a functional and a product with a lerp."""
    _, robot, motion = setting(2)
    link = robot.links[-1]
    with precision():
        piece = Piece(Arm(robot), motion, 0, 1, 4)
        n, m = [arb(0.3), arb(-0.5), arb(0.8)], [arb(0.6), arb(0.1), arb(0.2)]
        controls = piece.controls(link)
        turning = elevated(controls * functional_of(n), controls * functional_of(m))
        point = elevated(controls * placed([*n, arb(1)]), controls * placed([*m, arb(1)]))
        for tau in (-1.0, -0.3, 0.6, 1.0):
            s = (1 + arb(tau)) / 2
            pose = [[entry(arb(tau)) for entry in row] for row in piece.pose(link)]
            at = [x + s * (y - x) for x, y in zip(n, m, strict=True)]
            for matrix, expected in (
                (turning, [sum(at[r] * pose[r][c] for r in range(3)) for c in range(4)]),
                (
                    point,
                    [sum(row[c] * at[c] for c in range(3)) + row[3] for row in pose],
                ),
            ):
                degree = matrix.nrows() - 1
                assert degree == DEGREE + 1
                basis = [
                    arb(degree).fac() / (arb(i).fac() * arb(degree - i).fac())
                    * s**i * (1 - s) ** (degree - i)
                    for i in range(degree + 1)
                ]  # fmt: skip
                for c, value in enumerate(expected):
                    total = sum(b * matrix[i, c] for i, b in enumerate(basis))
                    assert total.overlaps(value)
                    assert abs(total - value) < 1e-9


@pytest.mark.parametrize('seed', range(8))
def test_nothing_off_the_path_leaves_the_tube(seed):
    """Random joints in the tolerance carry no point of a core farther than the slack."""
    rng, robot, motion = setting(seed)
    tolerance = {joint.name: float(rng.uniform(0.0, 0.3)) for joint in robot.movable}
    arm = Arm(robot)
    with precision():
        piece = Piece(arm, motion, 0, 0, 1)
        for link in robot.links[1:]:
            for body in robot.bodies(link):
                balls = {name: arb(value) for name, value in tolerance.items()}
                slack = Levers(arm, link, body).slack(piece, balls)
                points = core(body, rng)
                for _ in range(20):
                    s = rng.uniform(0.0, 0.5)
                    q = np.array([float(arb(motion.exact(0, j)(fmpq(*s.as_integer_ratio()))))
                                  for j in robot.movable])  # fmt: skip
                    off = np.array([tolerance[j.name] for j in robot.movable])
                    off *= rng.choice([-1.0, 1.0, rng.uniform(-1, 1)], len(off))
                    T, U = (link_poses(robot, x)[link] for x in (q, q + off))
                    moved = points @ (T - U)[:3, :3].T + (T - U)[:3, 3]
                    assert np.linalg.norm(moved, axis=1).max() <= float(slack) + 1e-12


@pytest.mark.parametrize('seed', range(5))
def test_supports_and_depths_bound_the_solid(seed):
    """No point of a solid is higher than its support; depth is what the faces say."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 5)
    with precision():
        for link in robot.collision_links:
            for body in robot.bodies(link):
                solid = Solid(body)
                d = rng.normal(size=3)
                points = core(body, rng)
                high = float(solid.highest([arb(x) for x in d]))
                assert (points @ d).max() + body.ball * np.linalg.norm(d) <= high + 1e-12
                reach = np.linalg.norm(points - body.center, axis=1).max() + body.ball
                assert reach <= float(solid.sphere) + 1e-12
                place = rng.normal(size=3) * 0.1
                depth = float(solid.depth([[arb(x) for x in place]]))
                if len(body.faces):
                    assert depth == pytest.approx(
                        (body.faces[:, 3] - body.faces[:, :3] @ place).min()
                    )
                else:
                    assert depth < 0.0
