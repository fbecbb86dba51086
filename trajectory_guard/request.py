"""A request in the kernels' words: tolerances per joint, the path with its lever arms."""

from collections.abc import Sequence

import numpy as np

from trajectory_guard.cell.robot import Joint
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.kernels.layout import Path
from trajectory_guard.motions.floating import floating
from trajectory_guard.paths.joint_path import JointPath
from trajectory_guard.settings import Settings

# Coordinates beyond this would overflow somewhere in a product of control matrices [m or rad].
LARGEST = 1e9


def check_joints(movable: Sequence[Joint], path: JointPath) -> None:
    """
    Refuse a path that was made for other joints.

    :param movable: the robot's movable joints.
    :param path: the joint path.
    :raises RequestError: the joints differ; the message lists both.
    """
    names = tuple(joint.name for joint in movable)
    if path.joint_names != names:
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'the path has joints {path.joint_names}, the robot {names}',
        )


def tracking_slack(
    movable: Sequence[Joint], path: JointPath, commanded: Sequence[str], settings: Settings
) -> np.ndarray:
    """
    Spread the tracking tolerance over the movable joints.

    A mimic joint is off by its multiplier times what the joint it follows may be off.

    :param movable: the robot's movable joints.
    :param path: the joint path.
    :param commanded: joint names of the trajectory, in its order.
    :param settings: the request.
    :returns: (n,) [rad or m].
    :raises RequestError: the number of values is neither one nor the trajectory's joints.
    """
    values = settings.tracking_tolerance
    if len(values) not in (1, len(commanded)):
        raise RequestError(
            Reason.INVALID_TRACKING_TOLERANCE,
            f'tracking_tolerance has {len(values)} values for {len(commanded)} joints',
        )
    in_path = path.in_path.tolist()
    if len(values) == 1:
        named = {
            joint.name: values[0] for joint, inside in zip(movable, in_path, strict=True) if inside
        }
    else:
        named = dict(zip(commanded, values, strict=True))
    by_name = {joint.name: joint for joint in movable}
    slack = []
    for joint, inside in zip(movable, in_path, strict=True):
        factor = 1.0
        leader = joint
        while inside and leader.mimic is not None:
            factor *= abs(leader.mimic.multiplier) * (1.0 + 2.0**-50)
            leader = by_name[leader.mimic.joint]
        slack.append(named[leader.name] * factor if inside else 0.0)
    return np.array(slack, dtype=np.float64)


def motion_path(workcell: Workcell, path: JointPath, slack: np.ndarray) -> Path:
    """
    Return a path as kernel arrays.

    Kernels take shapes on trust, so they are checked here; what the numbers must be the kernels
    check themselves, and `refusal` says what was wrong with them.

    :param workcell: robot and scene.
    :param path: the motion of every movable joint of that robot.
    :param slack: (n,) tracking tolerance per movable joint [rad or m].
    :raises RequestError: the tolerance has another shape or type, the robot has a floating joint
        and the path does not move it, or it moves it as kernels cannot take.
    """
    if (workcell.robot.floating is None) != (path.floating is None):
        raise RequestError(
            Reason.JOINT_POSITION_UNKNOWN,
            f'the path says nothing of the floating joint {workcell.robot.floating!r}'
            if path.floating is None
            else f'robot {workcell.robot.name!r} has no floating joint',
        )
    joints = len(workcell.robot.movable)
    if slack.shape != (joints,) or slack.dtype != np.float64 or not slack.flags.c_contiguous:
        raise RequestError(
            Reason.INVALID_TRACKING_TOLERANCE,
            f'slack must be {joints} doubles, got {slack.dtype} of shape {slack.shape}',
        )
    curves = None if path.floating is None else floating(path.floating)
    return Path(path.coefficients, path.coefficient_error, slack, curves)


def refusal(path: JointPath, slack: np.ndarray) -> RequestError | None:
    """
    Say why the kernels do not take a path; None if they should.

    :param path: the joint path.
    :param slack: (n,) tracking tolerance per movable joint [rad or m].
    """
    if not ((slack >= 0.0) & (slack <= LARGEST)).all():
        return RequestError(
            Reason.INVALID_TRACKING_TOLERANCE, f'slack must lie in [0, {LARGEST:g}], got {slack}'
        )
    if not (path.coefficient_error >= 0.0).all():
        return RequestError(
            Reason.INVALID_PARAMETER, 'coefficient_error must be >= 0 and not NaN everywhere'
        )
    # A sum that overflows is too large, too.
    with np.errstate(over='ignore'):
        size = (np.abs(path.coefficients).sum(axis=2) + path.coefficient_error).max(axis=0)
    # A sum in another order may round to the other side of the limit.
    fits = size <= LARGEST * (1.0 - 2.0**-40)
    if fits.all():
        return None
    worst = int(np.argmin(fits))
    return RequestError(
        Reason.TOO_LARGE,
        f'joint {path.joint_names[worst]!r} moves by {size[worst]:g}, more than {LARGEST:g}',
    )
