"""Joints that follow others."""

from fractions import Fraction

import numpy as np
import pytest

from trajectory_guard.cell.robot import Joint, JointType, Mimic
from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.paths.mimic import follow, followers


def joint(name, mimic=None):
    return Joint(
        name, JointType.REVOLUTE, 'p', 'c', np.eye(4), np.array([0.0, 0.0, 1.0]), -9.0, 9.0, mimic
    )


def test_a_joint_comes_after_the_one_it_follows():
    joints = [
        joint('c', Mimic('b', 1.0, 0.0)),
        joint('b', Mimic('a', 1.0, 0.0)),
        joint('a'),
        joint('d', Mimic('a', 1.0, 0.0)),
    ]
    assert followers(joints) == [(1, 2), (0, 1), (3, 2)]


@pytest.mark.parametrize('leaders', [('a', 'a'), ('b', 'a'), ('b', 'b')])
def test_a_circle_is_refused(leaders):
    joints = [joint(name, Mimic(to, 1.0, 0.0)) for name, to in zip('ab', leaders, strict=True)]
    with pytest.raises(RobotError, match='circle') as caught:
        followers(joints)
    assert caught.value.reason is Reason.ROBOT_INVALID


def test_a_leader_must_exist():
    with pytest.raises(RobotError, match="'b' mimics 'x'") as caught:
        followers([joint('a'), joint('b', Mimic('x', 1.0, 0.0))])
    assert caught.value.reason is Reason.ROBOT_INVALID


@pytest.mark.parametrize('leader_error', [0.0, 1e-9])
def test_exact_values_are_inside_the_error(leader_error):
    rng = np.random.default_rng(4)
    for _ in range(200):
        multiplier, offset = rng.uniform(-3, 3, 2) * 10.0 ** rng.integers(-320, 20, 2)
        coefficients = np.zeros((1, 2, 6))
        coefficients[0, 0] = rng.uniform(-3, 3, 6) * 10.0 ** rng.integers(-20, 20)
        error = np.array([[leader_error, 0.0]])
        exact = [Fraction(multiplier) * Fraction(c) for c in coefficients[0, 0]]
        exact[0] += Fraction(multiplier) * Fraction(error[0, 0]) + Fraction(offset)
        follow(coefficients, error, joint('b', Mimic('a', multiplier, offset)), 1, 0)
        off = sum(abs(Fraction(c) - e) for c, e in zip(coefficients[0, 1], exact, strict=True))
        assert off <= Fraction(error[0, 1])


def test_what_underflows_is_inside_the_error():
    coefficients = np.zeros((1, 2, 6))
    coefficients[0, 0] = 5e-324
    error = np.zeros((1, 2))
    follow(coefficients, error, joint('b', Mimic('a', 0.3, 0.0)), 1, 0)
    assert not coefficients[0, 1].any()
    assert Fraction(error[0, 1]) >= 6 * Fraction(0.3) * Fraction(5e-324)
