"""The verb: prove a joint path clear of the scene at every instant, or say where it is not."""

from collections.abc import Sequence
import dataclasses
import logging
import time
from typing import NamedTuple

import numpy as np

from trajectory_guard.cell.workcell import Pairs, Workcell
from trajectory_guard.certificate import certificate
from trajectory_guard.deadline import stop_flag
from trajectory_guard.errors import Reason, RequestError, TrajectoryGuardError
from trajectory_guard.kernels.cover import Covered, Question
from trajectory_guard.kernels.layout import KernelRefused, Path
from trajectory_guard.motions.floating_path import check_floating_joint, floating_path
from trajectory_guard.paths.free_path import FreePath
from trajectory_guard.paths.joint_path import joint_path, JointPath
from trajectory_guard.paths.multi_dof import MultiDofTrajectory
from trajectory_guard.paths.multi_dof_path import multi_dof_path
from trajectory_guard.paths.trajectory import JointState, Trajectory
from trajectory_guard.refine import cover_refined, Seen
from trajectory_guard.request import check_joints, motion_path, refusal, tracking_slack
from trajectory_guard.result import ContactMoment, Interval, NANOSECONDS, Result, Status, Verdict
from trajectory_guard.settings import Cover, Settings
from trajectory_guard.timeline import intervals, with_witnesses

_log = logging.getLogger(__name__)


class _Job(NamedTuple):
    """A path on its way to the kernels, and the time spent on it so far [s]."""

    path: JointPath
    slack: np.ndarray
    motion: Path
    pairs: Pairs
    seconds: float


class _Answer(NamedTuple):
    """A result and what it was made of."""

    result: Result
    leaves: np.ndarray
    covered: Covered


def certify(
    workcell: Workcell,
    path: JointPath | FreePath,
    settings: Settings | None = None,
    slack: np.ndarray | None = None,
) -> Result:
    """
    Certify a joint path against the scene of a workcell.

    :param workcell: robot and scene.
    :param path: the motion of every movable joint of that robot; of a free body, or a robot of
        which nothing but the floating joint can move, that joint's motion is enough.
    :param settings: what is asked; the defaults if None. A certificate speaks of a trajectory, so
        only `judge` writes one.
    :param slack: (n,) tracking tolerance per movable joint [rad or m]; None: the one value
        of ``settings`` for every joint of the path.
    :returns: intervals that partition [0, duration] and the verdict.
    :raises TrajectoryGuardError: the path does not fit the robot, or moves nothing that could hit.
    """
    begin = time.perf_counter()
    settings = settings or Settings()
    if isinstance(path, FreePath):
        path = floating_path(workcell.robot, path)
    check_joints(workcell.robot.movable, path)
    if slack is None:
        slack = tracking_slack(workcell.robot.movable, path, _moved(path), settings)
    job = _job(workcell, path, slack, begin)
    (seen,) = _cover(workcell, [job], settings)
    return _answer(workcell, job, seen, settings).result


def judge(
    workcell: Workcell,
    trajectory: Trajectory | MultiDofTrajectory,
    start: JointState | None = None,
    settings: Settings | None = None,
) -> Result:
    """
    Certify a trajectory message; whatever goes wrong is an answer, and never *free*.

    :param workcell: robot and scene.
    :param trajectory: the message; poses in time are those of the robot's floating joint.
    :param start: where the robot is at time 0.
    :param settings: what is asked; the defaults if None.
    """
    (result,) = judge_some(workcell, [(trajectory, start)], settings)
    return result


def judge_some(
    workcell: Workcell,
    asked: Sequence[tuple[Trajectory | MultiDofTrajectory, JointState | None]],
    settings: Settings | None = None,
) -> list[Result]:
    """
    Judge several trajectories with one call of the kernels; each has the answer of `judge`.

    :param workcell: robot and scene.
    :param asked: the messages, each with where the robot is at time 0.
    :param settings: what is asked; the defaults if None. A deadline is one for all of them.
    """
    settings = settings or Settings()
    results: list[Result | None] = []
    jobs: list[_Job] = []
    for trajectory, start in asked:
        try:
            jobs.append(_job_of(workcell, trajectory, start, settings))
            results.append(None)
        except Exception as error:  # fail closed: no error may leave a request open
            results.append(_rejected(error, settings, trajectory.name))
    try:
        seen = iter(_cover(workcell, jobs, settings))
    except Exception as error:  # fail closed
        return [
            result or _rejected(error, settings, trajectory.name)
            for result, (trajectory, _) in zip(results, asked, strict=True)
        ]
    waiting = iter(jobs)
    for i, (trajectory, start) in enumerate(asked):
        if results[i] is None:
            try:
                results[i] = _result(
                    workcell, trajectory, start, next(waiting), next(seen), settings
                )
            except Exception as error:  # fail closed
                results[i] = _rejected(error, settings, trajectory.name)
    return [result for result in results if result is not None]


def _rejected(error: Exception, settings: Settings, name: str) -> Result:
    """Return the answer to what went wrong."""
    if isinstance(error, TrajectoryGuardError):
        return Result.rejected(error, settings, name)
    _log.error('certification of %r failed', name, exc_info=error)
    internal = TrajectoryGuardError(Reason.INTERNAL_ERROR, f'internal error: {error!r}')
    return Result.rejected(internal, settings, name)


def _job_of(
    workcell: Workcell,
    trajectory: Trajectory | MultiDofTrajectory,
    start: JointState | None,
    settings: Settings,
) -> _Job:
    """Return the curve of a trajectory, ready for the kernels."""
    begin = time.perf_counter()
    movable = workcell.robot.movable
    if isinstance(trajectory, MultiDofTrajectory):
        path = _poses_path(workcell, trajectory, start, settings)
        return _job(workcell, path, tracking_slack(movable, path, _moved(path), settings), begin)
    path = joint_path(
        movable,
        trajectory,
        start,
        allowed_start_tolerance=settings.allowed_start_tolerance,
        joint_limit_tolerance=settings.joint_limit_tolerance,
        check_joint_limits=settings.check_joint_limits,
        allow_nonzero_end_velocity=settings.allow_nonzero_end_velocity,
    )
    return _job(
        workcell, path, tracking_slack(movable, path, trajectory.joint_names, settings), begin
    )


def _poses_path(
    workcell: Workcell,
    trajectory: MultiDofTrajectory,
    start: JointState | None,
    settings: Settings,
) -> JointPath:
    """Return the path of a robot whose floating joint is told its poses."""
    if settings.want_certificate:
        raise RequestError(
            Reason.INVALID_PARAMETER, 'certificates are written of joint trajectories only'
        )
    check_floating_joint(workcell.robot, trajectory.joint_names, trajectory.frame_id)
    free = multi_dof_path(
        trajectory, allow_nonzero_end_velocity=settings.allow_nonzero_end_velocity
    )
    return floating_path(workcell.robot, free, start)


def _moved(path: JointPath) -> tuple[str, ...]:
    """Return the parts of the floating joint, the order of two tracking tolerances."""
    if path.floating is None:
        return ()
    return tuple(name for name, moves in zip(path.joint_names, path.in_path, strict=True) if moves)


def _job(workcell: Workcell, path: JointPath, slack: np.ndarray, begin: float) -> _Job:
    pairs = workcell.pairs(path.in_path)
    motion = motion_path(workcell, path, slack)
    return _Job(path, slack, motion, pairs, time.perf_counter() - begin)


def _cover(workcell: Workcell, jobs: Sequence[_Job], settings: Settings) -> list[Seen | None]:
    with stop_flag(settings.deadline_ns) as stop:
        if settings.cover is Cover.BALL:
            return _cover_by_balls(workcell, jobs, settings, stop)
        questions = [Question(job.motion, job.pairs.moving) for job in jobs]
        return cover_refined(workcell.detail, questions, settings, stop)


def _cover_by_balls(
    workcell: Workcell, jobs: Sequence[_Job], settings: Settings, stop: np.ndarray
) -> list[Seen | None]:
    # Brings scipy.
    from trajectory_guard.ball_cover import cover_by_balls

    return [
        None
        if refusal(job.path, job.slack)
        else Seen(
            cover_by_balls(workcell, job.path, job.slack, job.pairs.moving, settings, stop),
            workcell.detail.level,
        )
        for job in jobs
    ]


def _result(
    workcell: Workcell,
    trajectory: Trajectory | MultiDofTrajectory,
    start: JointState | None,
    job: _Job,
    seen: Seen | None,
    settings: Settings,
) -> Result:
    """Return the answer to a trajectory, with its certificate if one is wanted."""
    answer = _answer(workcell, job, seen, settings, trajectory.name)
    if not settings.want_certificate or isinstance(trajectory, MultiDofTrajectory):
        return answer.result
    proof = certificate(workcell, trajectory, start, job.path, job.slack, *answer)
    return dataclasses.replace(answer.result, certificate=proof)


def _answer(
    workcell: Workcell, job: _Job, seen: Seen | None, settings: Settings, name: str = ''
) -> _Answer:
    """Return the result of a covered path; raises what was wrong with a refused one."""
    begin = time.perf_counter()
    if seen is None:
        raise refusal(job.path, job.slack) or KernelRefused
    path, pairs, covered = job.path, job.pairs, seen.covered
    leaves = with_witnesses(_leaves(workcell, job, seen))
    rows = intervals(
        path.knots_ns,
        leaves,
        workcell.link_names,
        workcell.obstacle_names,
        path.unknown_until_ns,
    )
    verdict, reason, message = _verdict(rows)
    warnings = (
        *_warnings(workcell, job.motion, pairs, path),
        *_mesh_warnings(workcell, covered, rows, settings),
    )
    seconds = job.seconds + covered.seconds + time.perf_counter() - begin
    contacts: tuple[ContactMoment, ...] = ()
    if settings.want_contacts:
        # Brings scipy.
        from trajectory_guard.contact_moment import contact_moments

        contacts = tuple(contact_moments(workcell, path, rows))
    result = Result(
        verdict=verdict,
        reason_code=reason,
        message=message,
        intervals=rows,
        tolerance=settings.tolerance,
        clearance=settings.clearance,
        interpolation=path.interpolation,
        robot_hash=workcell.robot_hash,
        scene_hash=workcell.scene_hash,
        compute_time=seconds,
        pieces=covered.pieces,
        pairs_checked=pairs.count,
        unchecked_pairs=pairs.unchecked,
        warnings=warnings,
        duration_ns=path.duration_ns,
        contacts=contacts,
        name=name,
    )
    return _Answer(result, leaves, covered)


def _leaves(workcell: Workcell, job: _Job, seen: Seen) -> np.ndarray:
    """Return leaves that name wholes, free where also none of them is inside another."""
    # Parts come only from pairs that were taken apart.
    if not len(seen.covered.opened):
        return seen.covered.leaves
    # Brings scipy, which is slow to import.
    from trajectory_guard.enclosed import without_enclosures

    return without_enclosures(workcell.detail, seen, job.motion)


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


def _mesh_warnings(
    workcell: Workcell, covered: Covered, rows: Sequence[Interval], settings: Settings
) -> list[str]:
    """Return which meshes were taken for something else than solids of their own shape."""
    warnings = []
    links, obstacles = workcell.detail.surfaces
    moving, still = covered.opened['body'], covered.opened['obstacle']
    if settings.cover is Cover.BALL:
        moving, still = np.arange(len(links)), np.arange(len(obstacles))
    opened = {
        *((links[b], workcell.link_names[b]) for b in moving),
        *((obstacles[o], workcell.obstacle_names[o]) for o in still),
    }
    names = {name for surface, name in opened if surface and not surface.is_watertight}
    if names:
        warnings.append(f'open meshes, so nothing counts as inside: {_listed(names)}')
    if settings.want_certificate:
        named = {name for row in rows for name in (row.body, row.obstacle)}
        names = named & workcell.refinable
        if names:
            warnings.append(
                f'taken as convex hulls, because a certificate speaks of hulls: {_listed(names)}'
            )
    return warnings


def _listed(names: set[str]) -> str:
    return ', '.join(sorted(names))
