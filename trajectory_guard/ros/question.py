"""A request of the service as a question to the core."""

from collections.abc import Callable, Collection, Sequence
import dataclasses
from typing import Any, NamedTuple, TypeAlias

from msg_adapters.trajectory import (
    joint_state_from_message,
    nanoseconds_from_message,
    trajectory_from_message,
)
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.paths.trajectory import JointState, Trajectory
from trajectory_guard.result import NANOSECONDS
from trajectory_guard.ros.configuration import Configuration
from trajectory_guard.settings import Scope, Settings

# The seconds of a Duration are an int32, and the answer gives the times back as Durations.
LAST_INSTANT_NS = 2**31 * NANOSECONDS - 1

# Values of the field `refine` of a request.
REFINE_DEFAULT, REFINE_ON, REFINE_OFF = range(3)

# Joint names and the greatest age [s] to the state of those that are known, and its age.
Fresh: TypeAlias = Callable[[Collection[str], float], tuple[JointState, float] | None]


class Question(NamedTuple):
    """
    What the core is asked.

    :param trajectory: the motion.
    :param start: where the robot is at time 0; None: unknown.
    :param settings: what is asked of it.
    """

    trajectory: Trajectory
    start: JointState | None
    settings: Settings


def question_from_request(request: Any, configuration: Configuration) -> Question:
    """
    Return what a request asks, with the guard's parameters where it does not say.

    :param request: CertifyTrajectory request.
    :param configuration: the parameters.
    :raises TrajectoryGuardError: it is malformed or too large, or asks for less than it may.
    """
    _check_sizes(request, configuration)
    message = request.trajectory
    stamp = message.header.stamp
    # Not their sum: parts of unlike signs may add up to 0, which no controller takes for it.
    if stamp.sec or stamp.nanosec:
        # A stamp moves the points, but not the moment at which the controller begins: the way to
        # the first point would take longer, or the motion begin in the middle.
        raise RequestError(
            Reason.INVALID_PARAMETER,
            'header.stamp of the trajectory must be 0 (start when it arrives), '
            f'got {stamp.sec} s {stamp.nanosec} ns',
        )
    trajectory = trajectory_from_message(message)
    if trajectory.times_ns[-1] > LAST_INSTANT_NS:
        raise RequestError(
            Reason.TOO_LARGE,
            f'the last point is at {trajectory.times_ns[-1]} ns, later than a Duration can say',
        )
    state = request.start_state
    given = len(state.name) or len(state.position) or len(state.velocity)
    return Question(
        trajectory=trajectory,
        start=joint_state_from_message(state) if given else None,
        settings=_settings(request, trajectory.joint_names, configuration),
    )


def measured_start(
    question: Question, workcell: Workcell, fresh: Fresh, configuration: Configuration
) -> tuple[JointState, float] | None:
    """
    Return where the robot is, if the motion depends on it and it is known.

    It does if the first point is later than time 0, for the controller goes there from wherever
    the robot is; and on joints that the trajectory does not name, which stay where they are. If
    one of the commanded joints is not known, none of them is: half a start is none.

    :param question: without a start state.
    :param workcell: with the robot.
    :param fresh: as `JointStates.fresh`.
    :param configuration: says how old a state may be.
    :returns: the state and its age [s].
    """
    named = set(question.trajectory.joint_names)
    others = {j.name for j in workcell.robot.movable if j.mimic is None and j.name not in named}
    if question.trajectory.times_ns[0] > 0:
        found = fresh(named | others, configuration.max_state_age)
        if found is None or named <= set(found[0].joint_names):
            return found
    return fresh(others, configuration.max_state_age)


def _check_sizes(request: Any, configuration: Configuration) -> None:
    """Refuse what is too large before anything is done with it."""
    for field, values, limit in (
        ('points', request.trajectory.points, 'max_points'),
        ('joint_names', request.trajectory.joint_names, 'max_joints'),
        ('names in start_state', request.start_state.name, 'max_joints'),
        ('positions in start_state', request.start_state.position, 'max_joints'),
        ('velocities in start_state', request.start_state.velocity, 'max_joints'),
        ('values in tracking_tolerance', request.tracking_tolerance, 'max_joints'),
    ):
        most = getattr(configuration, limit)
        if len(values) > most:
            raise RequestError(
                Reason.TOO_LARGE, f'the request has {len(values)} {field}, {limit} is {most}'
            )


def _settings(request: Any, joint_names: Sequence[str], configuration: Configuration) -> Settings:
    """Return the settings of a request; a zero in it stands for the guard's own value."""
    least = dataclasses.replace(
        configuration.settings,
        tracking_tolerance=configuration.least_tracking_tolerance(joint_names),
    )
    asked = dataclasses.replace(
        least,
        tolerance=request.tolerance or least.tolerance,
        clearance=request.clearance or least.clearance,
        tracking_tolerance=_tracking_tolerance(
            request.tracking_tolerance, least.tracking_tolerance
        ),
        deadline_ns=nanoseconds_from_message(request.deadline) or least.deadline_ns,
        scope=_scope(request.scope),
        refine=_refine(request.refine, least.refine),
        want_certificate=bool(request.want_certificate),
    )
    # Settings have refused what is negative or NaN by now.
    if asked.clearance < least.clearance:
        raise RequestError(
            Reason.BELOW_MINIMUM,
            f'clearance {asked.clearance:g} m is less than the {least.clearance:g} m of the guard',
        )
    for name, value, minimum in zip(
        joint_names, asked.tracking_tolerance, least.tracking_tolerance, strict=True
    ):
        if value < minimum:
            raise RequestError(
                Reason.BELOW_MINIMUM,
                f'tracking_tolerance {value:g} of joint {name!r} is less than the {minimum:g} '
                'of the guard',
            )
    return asked


def _scope(value: int) -> Scope:
    """Return the scope of that number."""
    try:
        return Scope(value)
    except ValueError:
        raise RequestError(
            Reason.INVALID_PARAMETER,
            f'scope must be one of {", ".join(f"{s} ({s.name})" for s in Scope)}, got {value}',
        ) from None


def _refine(value: int, default: bool) -> bool:
    """Return whether to look closer at suspect intervals."""
    meanings = {REFINE_DEFAULT: default, REFINE_ON: True, REFINE_OFF: False}
    if value not in meanings:
        raise RequestError(
            Reason.INVALID_PARAMETER, f'refine must be one of {[*meanings]}, got {value}'
        )
    return meanings[value]


def _tracking_tolerance(asked: Sequence[float], least: Sequence[float]) -> tuple[float, ...]:
    """Return one value per joint: the one asked for, or the guard's where that is zero."""
    if len(asked) <= 1:
        asked = [*asked, 0.0][:1] * len(least)
    if len(asked) != len(least):
        raise RequestError(
            Reason.INVALID_TRACKING_TOLERANCE,
            f'tracking_tolerance has {len(asked)} values for {len(least)} joints',
        )
    return tuple(value or minimum for value, minimum in zip(asked, least, strict=True))
