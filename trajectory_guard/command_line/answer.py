"""From a request to the results, one per trajectory."""

from collections.abc import Iterator, Mapping
import dataclasses
from itertools import islice
from pathlib import Path

import numpy as np

from trajectory_guard.cell.free_body import load_moving
from trajectory_guard.cell.pose import pose_matrix
from trajectory_guard.cell.robot import Robot
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.command_line.certificates import Certificates, is_folder
from trajectory_guard.command_line.options import Pose
from trajectory_guard.command_line.request import Request, SELF_COLLISION_WARNING
from trajectory_guard.command_line.sources import Selection, Source, sources
from trajectory_guard.command_line.start import completed, depends_on_duration, without
from trajectory_guard.errors import Reason, RequestError, TrajectoryError
from trajectory_guard.paths.multi_dof import MultiDofTrajectory
from trajectory_guard.result import Result
from trajectory_guard.warm import warm_up

UNMEASURED = (
    'no joint state was recorded before this trajectory; --joint-states names the topic if it is '
    'not /joint_states'
)
STAMPED = 'header.stamp is set; the motion was judged as if it began when the message arrives'
APPROACH_UNKNOWN = (
    'the curve to the first point depends on how long before the stamp the message arrived, so it '
    'was not judged'
)


def answers(request: Request) -> Iterator[Result]:
    """
    Yield a result for every trajectory of a request, in order.

    :param request: what to judge, against what.
    :raises TrajectoryGuardError: robot, scene or start state cannot be used, so nothing can.
    """
    robot = load_moving(request.urdf)
    _check_names(robot, request.start)
    workcell = Workcell(robot, load_scene(request.scenes, _matrix(request.scene_pose)))
    # Else the first answer's time would be that of loading or compiling the kernels.
    warm_up(request.settings.cover)
    selection = Selection(request.topics, request.joint_state_topics)
    found = (s for path in request.paths for s in sources(path, selection, request.bags_only))
    if request.certificate is None:
        for source in found:
            yield _answer(source, workcell, request)
        return
    target = Path(request.certificate)
    folder = is_folder(target, request.certificate)
    certificates = Certificates(target, folder)
    for source in found if folder else _only(found, request.certificate):
        result = _answer(source, workcell, request)
        certificates.write(result)
        yield result


def _only(found: Iterator[Source], target: str) -> list[Source]:
    """Return the one source there is; a file has no room for the certificates of several."""
    some = list(islice(found, 2))
    if len(some) > 1:
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'--certificate: there are several trajectories, {target!r} is one file; '
            f'a folder takes them: {target.removesuffix(".json")}/',
        )
    return some


def _answer(source: Source, workcell: Workcell, request: Request) -> Result:
    """Return the result of one source."""
    if isinstance(source.trajectory, TrajectoryError):
        return Result.rejected(source.trajectory, request.settings, source.name)
    start = completed(source.start, request.start)
    measured = source.start is not None or isinstance(source.trajectory, MultiDofTrajectory)
    warnings = [UNMEASURED] if source.recorded and not measured else []
    if source.stamp_ns:
        warnings.append(STAMPED)
        if isinstance(source.trajectory, MultiDofTrajectory):
            pass  # nothing is known of the way to its first point in any case
        elif depends_on_duration(source.trajectory, start):
            warnings.append(APPROACH_UNKNOWN)
            start = without(start, source.trajectory.joint_names)
    if request.self_collision and len(workcell.robot.collision_links) > 1:
        warnings.append(SELF_COLLISION_WARNING)
    result = judge(workcell, source.trajectory, start, request.settings)
    return dataclasses.replace(result, warnings=(*result.warnings, *warnings))


def _check_names(robot: Robot, start: Mapping[str, float]) -> None:
    """Refuse joints of ``--start`` that the robot does not have: they would say nothing."""
    movable = [joint.name for joint in robot.movable]
    for name in start:
        if name not in movable:
            raise TrajectoryError(
                Reason.UNKNOWN_JOINT,
                f"Invalid value for '--start': the robot has no movable joint {name!r}; it has "
                f'{", ".join(movable)}',
            )


def _matrix(pose: Pose | None) -> np.ndarray | None:
    """Return a pose as (4, 4) matrix."""
    if pose is None:
        return None
    return pose_matrix(pose.xyz, pose.rpy)
