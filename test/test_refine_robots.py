"""Robots with real meshes among small boxes near their links, judged by coal on the surfaces."""

import coal
from coal_judge import shape
import numpy as np
import pytest
from random_robot import link_poses, pose
from test_refine import bvh
from test_robot import ROBOTS

from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.paths.joint_path import joint_path
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.result import Status, Verdict
from trajectory_guard.settings import Settings
from trajectory_guard.shapes.primitive import Box


def ride(robot, rng):
    """Return a scene of boxes about the links' meshes, and a motion that starts among them."""
    lower = np.array([max(joint.lower, -2.5) for joint in robot.movable])
    upper = np.array([min(joint.upper, 2.5) for joint in robot.movable])
    start = rng.uniform(lower, upper)
    end = start + 0.3 * (rng.uniform(lower, upper) - start)
    T = link_poses(robot, start)
    bodies = [
        (link, body)
        for link in robot.collision_links
        for body in robot.bodies(link)
        if link != robot.collision_links[0] and body.surface
    ]
    obstacles = []
    for k in range(3):
        link, body = bodies[rng.integers(len(bodies))]
        place = body.center + 0.6 * body.radius * rng.normal(size=3)
        box = Box(tuple(rng.uniform(0.003, 0.02, 3))).load().body
        there = T[link][:3, :3] @ place + T[link][:3, 3]
        obstacles.append(Obstacle(f'box {k}', (box.moved(pose(there)),)))
    rest = np.zeros(len(start))
    points = [Point(0, start, rest), Point(1_000_000_000, end, rest)]
    names = [joint.name for joint in robot.movable]
    return Scene(tuple(obstacles), ''), Trajectory.from_points(names, points)


def distance(shapes, obstacles, T):
    """Return coal's least distance of the links' surfaces from the boxes [m]."""
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-12
    best = np.inf
    for link, model in shapes:
        here = coal.Transform3s(T[link][:3, :3], T[link][:3, 3])
        for box, there, _ in obstacles:
            other = coal.Transform3s(there[:3, :3], there[:3, 3])
            found = coal.distance(model, here, box, other, request, coal.DistanceResult())
            best = min(best, found)
    return best


@pytest.mark.parametrize(
    ('name', 'count'),
    [('ur_description/urdf/ur5_gripper', 6), ('kinova_description/robots/kinova', 2)],
)
def test_free_is_free_for_real_meshes(name, count):
    """Hulls alone would call most of it suspect; no free instant touches."""
    robot = load_robot(ROBOTS / f'{name}.urdf')
    rng = np.random.default_rng(4)
    shapes = [
        (link, bvh(body.surface))
        for link in robot.collision_links[1:]
        for body in robot.bodies(link)
        if body.surface
    ]
    refined = 0
    for _ in range(count):
        scene, trajectory = ride(robot, rng)
        workcell = Workcell(robot, scene)
        result = judge(workcell, trajectory)
        assert result.verdict is not Verdict.REJECTED, result.message
        hulls = judge(workcell, trajectory, settings=Settings(want_certificate=True))
        refined += free_time(result) > free_time(hulls)
        assert free_time(result) >= free_time(hulls)
        path = joint_path(robot.movable, trajectory)
        obstacles = [shape(obstacle.bodies[0]) for obstacle in scene.obstacles]
        for row in result.intervals:
            if row.status is not Status.FREE:
                continue
            for ns in np.linspace(row.start_ns, row.end_ns, 12):
                q = path.coefficients[0] @ (ns / path.duration_ns) ** np.arange(6)
                assert distance(shapes, obstacles, link_poses(robot, q)) > 0.0
    assert refined


def free_time(result):
    """Return how long a result is free [ns]."""
    return sum(r.end_ns - r.start_ns for r in result.intervals if r.status is Status.FREE)
