"""Where the joints are when a trajectory starts, as far as measurements and options tell."""

from collections.abc import Collection, Mapping

import numpy as np

from trajectory_guard.paths.trajectory import JointState, Trajectory


def completed(measured: JointState | None, given: Mapping[str, float]) -> JointState | None:
    """
    Return the measured state, and what was given for the joints that were not measured.

    :param measured: the joints as measured, if any were.
    :param given: positions of joints at rest [rad or m].
    """
    known = () if measured is None else measured.joint_names
    missing = {name: value for name, value in given.items() if name not in known}
    if not missing:
        return measured
    values = np.array([*missing.values()])
    if measured is None:
        return JointState(tuple(missing), values)
    velocities = measured.velocities
    return JointState(
        joint_names=(*known, *missing),
        positions=np.concatenate((measured.positions, values)),
        velocities=None
        if velocities is None
        else np.concatenate((velocities, np.zeros(len(missing)))),
    )


def without(state: JointState | None, joint_names: Collection[str]) -> JointState | None:
    """
    Return what a state says about all other joints.

    :param state: the state, if there is one.
    :param joint_names: joints to leave out.
    """
    if state is None:
        return None
    kept = [i for i, name in enumerate(state.joint_names) if name not in joint_names]
    if not kept:
        return None
    return JointState(
        joint_names=tuple(state.joint_names[i] for i in kept),
        positions=state.positions[kept],
        velocities=None if state.velocities is None else state.velocities[kept],
    )


def depends_on_duration(trajectory: Trajectory, start: JointState | None) -> bool:
    """
    Return whether the curve from the start to the first point changes with its duration.

    Between two points at rest, and without derivatives, it is the same curve, faster or slower.

    :param trajectory: the trajectory; the curve takes the derivatives that its first point has.
    :param start: where the joints are when it starts; None: there is no such curve.
    """
    if start is None or trajectory.times_ns[0] == 0 or not trajectory.has_velocities[0]:
        return False
    moves = [trajectory.velocities[0]]
    if trajectory.has_accelerations[0]:
        moves.append(trajectory.accelerations[0])
    if start.velocities is not None:
        moves.append(start.velocities)
    return bool(np.concatenate(moves).any())
