"""Joints that follow others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajectory_guard.cell.robot import Joint
from trajectory_guard.errors import Reason, RobotError

_UNIT = 2.0**-53

# Exceeds what six products lose below the normal range, 2^-1075 each.
_UNDERFLOW = 2.0**-1060


def followers(joints: Sequence[Joint]) -> list[tuple[int, int]]:
    """
    List who mimics whom, a joint after the one it follows.

    :param joints: movable joints of the robot.
    :returns: (mimic joint, followed joint) as indices.
    :raises RobotError: for a joint that mimics nothing movable, or itself in the end.
    """
    number = {joint.name: j for j, joint in enumerate(joints)}
    ordered: dict[int, int] = {}
    for j in range(len(joints)):
        chain: list[tuple[int, int]] = []
        while (mimic := joints[j].mimic) is not None and j not in ordered:
            leader = number.get(mimic.joint)
            if leader is None or len(chain) > len(joints):
                raise RobotError(
                    Reason.ROBOT_INVALID,
                    f'joint {joints[j].name!r} mimics {mimic.joint!r}, '
                    + ('which is no movable joint' if leader is None else 'in a circle'),
                )
            chain.append((j, leader))
            j = leader
        ordered.update(reversed(chain))
    return list(ordered.items())


def follow(coefficients: np.ndarray, error: np.ndarray, joint: Joint, j: int, leader: int) -> None:
    """
    Write the curve of a mimic joint, multiplier * leader + offset.

    Each product errs by u of itself and the sum with the offset by u of the result, so 2 u of
    both with the leader's error scaled up covers them and the rounding of this bound.

    :param coefficients: (S, n, 6); column j is written.
    :param error: (S, n) bound on the errors of the coefficients; column j is written.
    :param joint: the mimic joint.
    :param j: its index.
    :param leader: index of the joint it follows.
    """
    assert joint.mimic is not None
    _, multiplier, offset = joint.mimic
    followed = multiplier * coefficients[:, leader]
    size = np.add.reduce(np.abs(followed), axis=-1)
    followed[:, 0] += offset
    coefficients[:, j] = followed
    error[:, j] = (
        abs(multiplier) * error[:, leader] * (1.0 + 8.0 * _UNIT)
        + 2.0 * _UNIT * (size + np.abs(followed[:, 0]))
        + _UNDERFLOW
    )
