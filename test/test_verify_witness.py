"""A collision that stands as the middle of a suspect leaf has a certificate that holds."""

import math

import numpy as np
import pytest
from random_robot import box_body, Given

from trajectory_guard.cell.robot import Collision, Joint, JointType, Robot
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.result import Verdict
from trajectory_guard.settings import Scope, Settings
from trajectory_guard.shapes.primitive import Sphere
from trajectory_guard.verify import verify


@pytest.mark.parametrize(
    ('size', 'obstacle', 'center', 'turn'),
    [
        ((1.0, 0.16, 0.12), (0.06, 0.12, 0.02), (0.91, 0.043, 0.0), 2.0),
        ((1.0, 0.17, 0.13), (0.11, 0.07, 0.03), (0.71, 0.016, 0.0), 0.8),
        ((1.0, 0.07, 0.19), (0.04, 0.16, 0.02), (0.77, 0.074, 0.0), 1.2),
    ],
)
def test_certificate_of_a_witness(size, obstacle, center, turn):
    """Found in review: its place stands at the end of each half, not in the middle."""
    joint = Joint(
        'j',
        JointType.REVOLUTE,
        'base',
        'arm',
        np.eye(4),
        np.array([0.0, 0.0, 1.0]),
        -math.inf,
        math.inf,
        None,
    )
    arm = Collision(np.eye(4), Given(box_body(size, (0.5, 0.0, 0.0))))
    robot = Robot('r', 'base', (joint,), {'arm': (arm,)}, b'')
    scene = Scene((Obstacle('o', (box_body(obstacle, center),)),), 'x')
    trajectory = Trajectory.from_points(['j'], [Point(0, [-turn]), Point(10**9, [turn])])
    settings = Settings(tolerance=1e-3, scope=Scope.VERDICT, want_certificate=True)
    result = judge(Workcell(robot, scene), trajectory, None, settings)
    assert result.verdict == Verdict.COLLISION
    assert verify(result.certificate, robot, scene, trajectory).verdict == 'collision'


@pytest.mark.parametrize('arm', [0.02, 0.05, 0.1])
@pytest.mark.parametrize('turn', [0.3, 1.0, 3.0])
def test_certificate_of_a_ball(arm, turn):
    """Found in review: a point in the ball moves farther than the core that was bounded."""
    joint = Joint(
        'j',
        JointType.REVOLUTE,
        'base',
        'arm',
        np.eye(4),
        np.array([0.0, 0.0, 1.0]),
        -math.inf,
        math.inf,
        None,
    )
    body = Sphere(0.2).load().body
    place = np.eye(4)
    place[0, 3] = arm
    robot = Robot('r', 'base', (joint,), {'arm': (Collision(place, Given(body)),)}, b'')
    scene = Scene((Obstacle('o', (box_body((0.02, 0.05, 0.05), (arm + 0.16, 0.0, 0.0)),)),), 'x')
    trajectory = Trajectory.from_points(['j'], [Point(0, [-turn]), Point(10**9, [turn])])
    settings = Settings(tolerance=1e-3, scope=Scope.VERDICT, want_certificate=True)
    result = judge(Workcell(robot, scene), trajectory, None, settings)
    assert result.verdict == Verdict.COLLISION
    assert verify(result.certificate, robot, scene, trajectory).verdict == 'collision'
