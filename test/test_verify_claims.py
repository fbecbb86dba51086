"""The inequalities of the verifier: what they accept is true wherever it is looked at."""

from flint import arb, fmpq
import numpy as np
import pytest
from random_robot import box_body, core, link_poses, random_body, random_robot

from trajectory_guard.paths.trajectory import JointState, Point, Trajectory
from trajectory_guard.verify.claims import Ball, Plane, Turning
from trajectory_guard.verify.curve import curve
from trajectory_guard.verify.motion import Arm, Piece
from trajectory_guard.verify.overlap import Collision
from trajectory_guard.verify.series import precision
from trajectory_guard.verify.solids import Box, Link, Moved, Solid

SECOND = 10**9
FRAME = np.eye(3).ravel().tolist()


class Scenario:
    """A body of a random robot on a random piece, and points of it at sampled instants."""

    def __init__(self, seed, tolerance=0.0):
        self.rng = rng = np.random.default_rng(seed)
        robot = random_robot(rng, 5)
        named = [joint.name for joint in robot.movable if joint.mimic is None]
        points = [Point(k * SECOND, *rng.normal(size=(2, len(named))) * 0.5) for k in range(2)]
        trajectory = Trajectory.from_points(named, points)
        motion = curve(robot.movable, trajectory, JointState(('none',), [0.0]))
        level = int(rng.integers(4))
        numerator = int(rng.integers(2**level))
        self.piece = Piece(Arm(robot), motion, 0, numerator, level)
        self.link = robot.collision_links[-1]
        (self.body,) = robot.bodies(self.link)
        tolerances = {joint.name: arb(tolerance) for joint in robot.movable}
        link = Link(Arm(robot), self.link, self.body)
        self.moved = Moved(link, self.piece, tolerances)
        self.samples = []
        for s in np.linspace(0.0, 1.0, 33):
            t = fmpq(*((numerator + s) / 2**level).as_integer_ratio())
            q = np.array([float(arb(motion.exact(0, joint)(t))) for joint in robot.movable])
            off = rng.choice([-1.0, 0.0, 1.0], len(q)) * tolerance
            T = link_poses(robot, q + off)[self.link]
            self.samples.append((s, T, core(self.body, rng) @ T[:3, :3].T + T[:3, 3]))

    def lowest(self, normal):
        """Return the smallest sampled height along a normal that may depend on s."""
        heights = [
            (x @ normal(s)).min() - self.body.ball * np.linalg.norm(normal(s))
            for s, _, x in self.samples
        ]
        return min(heights)


def numbers(values):
    """Return numbers as balls."""
    return [arb(float(x)) for x in values]


@pytest.mark.parametrize('seed', range(25))
@pytest.mark.parametrize('tolerance', [0.0, 0.01])
def test_planes_that_hold_are_held_to(seed, tolerance):
    """Offsets about the lowest point: none above it is accepted, one well below it is."""
    with precision():
        scenario = Scenario(seed, tolerance)
        n = scenario.rng.normal(size=3)
        n /= np.linalg.norm(n)
        lowest = scenario.lowest(lambda s: n)
        below = box_body((0.1, 0.1, 0.1), n * (lowest - 100.0))
        for above in (1e-3, 1e-9):
            claim = Plane(numbers(n), arb(lowest + above))
            assert not claim.margin(scenario.moved, Solid(below), arb(0)) > 0
        room = 1.0 if tolerance else 0.2
        assert (
            Plane(numbers(n), arb(lowest - room)).margin(scenario.moved, Solid(below), arb(1)) > 0
        )


@pytest.mark.parametrize('seed', range(25))
def test_planes_are_tight_on_short_pieces(seed):
    """On a short piece an offset a micrometre below the lowest point is accepted."""
    with precision():
        scenario = Scenario(seed)
        part = scenario.piece
        for _ in range(14):
            part = part.halves[0]
        link = Link(part._arm, scenario.link, scenario.body)
        moved = Moved(link, part, {name: arb(0) for name in part.positions})
        n = scenario.rng.normal(size=3)
        n /= np.linalg.norm(n)
        _, T, _ = scenario.samples[0]
        turned = T[:3, :3].T @ n
        a = scenario.body.disc_axis
        rim = scenario.body.disc_radius * np.linalg.norm(turned - (turned @ a) * a)
        lowest = (scenario.body.vertices @ turned).min() + n @ T[:3, 3]
        lowest -= rim + scenario.body.ball
        below = Solid(box_body((0.1, 0.1, 0.1), n * (lowest - 100.0)))
        assert Plane(numbers(n), arb(lowest - 1e-3)).margin(moved, below, arb(0)) > 0
        assert not Plane(numbers(n), arb(lowest + 1e-9)).margin(moved, below, arb(0)) > 0


@pytest.mark.parametrize('seed', range(40))
@pytest.mark.parametrize('tolerance', [0.0, 0.01])
def test_turning_planes_that_are_accepted_separate(seed, tolerance):
    """Obstacles nearer and farther: an accepted normal separates all sampled points."""
    with precision():
        scenario = Scenario(seed, tolerance)
        rng = scenario.rng
        a, b, c = rng.normal(size=(3, 3)) * 0.4 + rng.normal(size=3)
        curve_of = lambda s: (1 - s) ** 2 * a + 2 * s * (1 - s) * b + s**2 * c  # noqa: E731
        accepted = 0
        for distance in (0.0, 0.3, 1.0, 3.0, 10.0):
            center = -distance * (a + b + c) / np.linalg.norm(a + b + c)
            obstacle = random_body(rng, 0.1)
            obstacle = type(obstacle)(
                obstacle.vertices + center, obstacle.ball, obstacle.disc_radius, obstacle.disc_axis
            )
            clearance = 0.05
            claim = Turning(*map(numbers, (a, b, c)))
            halves = claim.halves(scenario.moved)
            for half, s in ((claim, 0.5), (halves[0], 0.25), (halves[1], 0.75)):
                at = np.array([float((p + 2 * q + r) / 4) for p, q, r in zip(*half, strict=True)])
                expected = curve_of(s)
                np.testing.assert_allclose(at, expected, atol=1e-12)
            if not claim.margin(scenario.moved, Solid(obstacle), arb(clearance)) > 0:
                continue
            accepted += 1
            fixed = core(obstacle, rng)
            for s, _, points in scenario.samples:
                n = curve_of(s)
                balls = scenario.body.ball + obstacle.ball + clearance
                gap = (points @ n).min() - (fixed @ n).max() - balls * np.linalg.norm(n)
                assert gap > 0.0
        assert accepted or np.linalg.norm(a + b + c) < 3.0


@pytest.mark.parametrize('seed', range(40))
@pytest.mark.parametrize('tolerance', [0.0, 0.01])
def test_spheres_that_are_accepted_are_apart(seed, tolerance):
    """Whatever direction the box proposes, the accepted pairs are apart by the clearance."""
    with precision():
        scenario = Scenario(seed, tolerance)
        rng = scenario.rng
        for distance in (0.3, 0.6, 1.2, 5.0):
            shift = rng.normal(size=3)
            shift *= distance / np.linalg.norm(shift)
            obstacle = box_body(rng.uniform(0.01, 0.5, 3), shift)
            frame = FRAME if rng.random() < 0.5 else rng.normal(size=9).tolist()
            claim = Ball(Box(obstacle, frame))
            if not claim.margin(scenario.moved, Solid(obstacle), arb(0.02)) > 0:
                continue
            low, high = obstacle.vertices.min(axis=0), obstacle.vertices.max(axis=0)
            for _, _, points in scenario.samples:
                nearest = np.clip(points, low, high)
                gap = np.linalg.norm(points - nearest, axis=1).min() - scenario.body.ball
                assert gap > 0.02


@pytest.mark.parametrize('seed', range(60))
def test_collisions_that_are_accepted_overlap(seed):
    """An accepted witness lies in the link, and its ball meets the obstacle at each instant."""
    with precision():
        scenario = Scenario(seed)
        body, rng = scenario.body, scenario.rng
        if not len(body.faces):
            return
        y0, y1 = (body.vertices[rng.integers(len(body.vertices), size=3)].mean(0) for _ in 'ab')
        y0, y1 = 0.8 * body.center + 0.2 * y0, 0.8 * body.center + 0.2 * y1
        middle = scenario.samples[16][1]
        place = middle[:3, :3] @ (0.5 * (y0 + y1)) + middle[:3, 3]
        for size, off in ((3.0, 0.0), (0.4, 0.05), (0.1, 0.02), (0.02, 0.01), (0.1, 2.0)):
            obstacle = box_body((size,) * 3, place + rng.normal(size=3) * off)
            claim = Collision(numbers(y0), numbers(y1))
            if not claim.margin(scenario.moved, Solid(obstacle), arb(0)) > 0:
                assert size < 3.0 or (body.faces[:, :3] @ y0 > body.faces[:, 3]).any()
                continue
            assert off < 2.0
            for s, T, _ in scenario.samples:
                y = (1.0 - s) * y0 + s * y1
                depth = (body.faces[:, 3] - body.faces[:, :3] @ y).min()
                x = T[:3, :3] @ y + T[:3, 3]
                low, high = obstacle.vertices.min(axis=0), obstacle.vertices.max(axis=0)
                assert depth > 0.0
                assert np.linalg.norm(x - np.clip(x, low, high)) <= depth
