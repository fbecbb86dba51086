"""The verb: prove a joint path clear of the scene at every instant, or say where it is not."""

from collections.abc import Sequence
import dataclasses
import logging
import time
from typing import NamedTuple

import numpy as np

from trajectory_guard.certificate import certificate
from trajectory_guard.deadline import stop_flag
from trajectory_guard.errors import Reason, TrajectoryGuardError
from trajectory_guard.joint_path import INTERPOLATION, joint_path, JointPath
from trajectory_guard.kernels.cover import cover, Covered
from trajectory_guard.kernels.layout import Path
from trajectory_guard.request import check_joints, motion_path, tracking_slack
from trajectory_guard.result import Interval, NANOSECONDS, Result, Status, Verdict
from trajectory_guard.settings import Settings
from trajectory_guard.timeline import intervals, with_witnesses
from trajectory_guard.trajectory import JointState, Trajectory
from trajectory_guard.workcell import Pairs, Workcell

_log = logging.getLogger(__name__)


class _Answer(NamedTuple):
    """A result and what it was made of."""

    result: Result
    leaves: np.ndarray
    covered: Covered


def certify(
    workcell: Workcell,
    path: JointPath,
    settings: Settings | None = None,
    slack: np.ndarray | None = None,
) -> Result:
    """
    Certify a joint path against the scene of a workcell.

    :param workcell: robot and scene.
    :param path: the motion of every movable joint of that robot.
    :param settings: what is asked; the defaults if None. A certificate speaks of a trajectory, so
        only `judge` writes one.
    :param slack: (n,) tracking tolerance per movable joint [rad or m]; None: the one value
        of ``settings`` for every joint of the path.
    :returns: intervals that partition [0, duration] and the verdict.
    :raises TrajectoryGuardError: the path does not fit the robot, or moves nothing that could hit.
    """
    settings = settings or Settings()
    check_joints(workcell.robot.movable, path)
    if slack is None:
        slack = tracking_slack(workcell.robot.movable, path, (), settings)
    return _answer(workcell, path, settings, slack, time.perf_counter()).result


def _answer(
    workcell: Workcell, path: JointPath, settings: Settings, slack: np.ndarray, begin: float
) -> _Answer:
    pairs = workcell.pairs(path.in_path)
    motion = motion_path(workcell, path, slack)
    with stop_flag(settings.deadline_ns) as stop:
        covered = cover(
            workcell.packed,
            motion,
            pairs.moving,
            settings.tolerance,
            settings.clearance,
            settings.max_pieces,
            settings.scope,
            settings.want_certificate,
            stop,
        )
    leaves = with_witnesses(covered.leaves)
    rows = intervals(
        path.knots_ns,
        leaves,
        workcell.link_names,
        workcell.obstacle_names,
        path.unknown_until_ns,
    )
    verdict, reason, message = _verdict(rows)
    result = Result(
        verdict=verdict,
        reason_code=reason,
        message=message,
        intervals=rows,
        tolerance=settings.tolerance,
        clearance=settings.clearance,
        interpolation=INTERPOLATION,
        robot_hash=workcell.robot_hash,
        scene_hash=workcell.scene_hash,
        compute_time=time.perf_counter() - begin,
        pieces=covered.pieces,
        pairs_checked=pairs.count,
        unchecked_pairs=pairs.unchecked,
        warnings=_warnings(workcell, motion, pairs, path),
        duration_ns=path.duration_ns,
    )
    return _Answer(result, leaves, covered)


def judge(
    workcell: Workcell,
    trajectory: Trajectory,
    start: JointState | None = None,
    settings: Settings | None = None,
) -> Result:
    """
    Certify a trajectory message; whatever goes wrong is an answer, and never *free*.

    :param workcell: robot and scene.
    :param trajectory: the message.
    :param start: where the robot is at time 0.
    :param settings: what is asked; the defaults if None.
    """
    settings = settings or Settings()
    begin = time.perf_counter()
    try:
        movable = workcell.robot.movable
        path = joint_path(
            movable,
            trajectory,
            start,
            allowed_start_tolerance=settings.allowed_start_tolerance,
            joint_limit_tolerance=settings.joint_limit_tolerance,
            check_joint_limits=settings.check_joint_limits,
            allow_nonzero_end_velocity=settings.allow_nonzero_end_velocity,
        )
        slack = tracking_slack(movable, path, trajectory.joint_names, settings)
        answer = _answer(workcell, path, settings, slack, begin)
        proof = None
        if settings.want_certificate:
            proof = certificate(workcell, trajectory, start, path, slack, *answer)
    except TrajectoryGuardError as error:
        return Result.rejected(error, settings, trajectory.name)
    except Exception as error:  # fail closed: an unforeseen error must not leave a request open
        _log.exception('certification of %r failed', trajectory.name)
        internal = TrajectoryGuardError(Reason.INTERNAL_ERROR, f'internal error: {error!r}')
        return Result.rejected(internal, settings, trajectory.name)
    return dataclasses.replace(answer.result, name=trajectory.name, certificate=proof)


def _verdict(rows: Sequence[Interval]) -> tuple[Verdict, str, str]:
    """Return verdict, reason code and sentence for a partition."""
    for status, verdict in (
        (Status.COLLISION, Verdict.COLLISION),
        (Status.SUSPECT, Verdict.SUSPECT),
    ):
        hits = [row for row in rows if row.status == status]
        if hits:
            row = hits[0]
            where = f': {row.body} and {row.obstacle}' if row.body else ''
            word = 'collision' if status == Status.COLLISION else 'not proved free'
            return (
                verdict,
                row.reason,
                f'{word} from {row.start_ns / NANOSECONDS:.6f} s{where}',
            )
    if rows and all(row.status == Status.FREE for row in rows):
        return Verdict.FREE, '', ''
    return Verdict.SUSPECT, Reason.INTERNAL_ERROR.value, 'no interval was certified'


def _warnings(workcell: Workcell, motion: Path, pairs: Pairs, path: JointPath) -> tuple[str, ...]:
    """Return what the verdict does not say: parts that touch without moving, limits unchecked."""
    warnings = []
    names = sorted(pairs.touching | workcell.touching(pairs.still, motion))
    if names:
        listed = ', '.join(f'{body} and {obstacle}' for body, obstacle in names)
        warnings.append(f'touching, but not moved by the trajectory, so not judged: {listed}')
    if not path.limits_checked:
        warnings.append('joint limits were not checked')
    return tuple(warnings)
