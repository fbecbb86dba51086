"""What the gate asks the guard, and whether an answer proves what was asked."""

from collections.abc import Sequence

from builtin_interfaces.msg import Duration
from sensor_msgs.msg import JointState
from trajectory_guard_interfaces.msg import CertificationResult
from trajectory_guard_interfaces.srv import CertifyTrajectory
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.result import nanoseconds_to_message, result_from_message
from msg_adapters.trajectory import nanoseconds_from_message
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.paths.entry import Entry
from trajectory_guard.paths.joint_path import INTERPOLATION
from trajectory_guard.paths.takeover import Takeover
from trajectory_guard.result import Result, Status, Verdict

# Sums of two tolerances are rounded; what is asked for must not be less.
_UP = 1.0 + 2.0**-50


def request_for(
    message: JointTrajectory, plan: Takeover, tracking_tolerance: Sequence[float]
) -> CertifyTrajectory.Request:
    """
    Return the request to certify what the controller would play.

    :param message: the trajectory; its points are shared, not copied, where they do not change.
    :param plan: how the controller takes it over.
    :param tracking_tolerance: how far each joint may follow off the path [rad or m].
    :raises TrajectoryError: a time does not fit a message.
    """
    return CertifyTrajectory.Request(
        trajectory=JointTrajectory(joint_names=message.joint_names, points=_points(message, plan)),
        start_state=_start_state(plan),
        tracking_tolerance=[
            (own + more) * _UP for own, more in zip(tracking_tolerance, plan.cover, strict=True)
        ],
    )


def _points(message: JointTrajectory, plan: Takeover) -> list[JointTrajectoryPoint]:
    """Return the points from time 0 on, the state that is approached from in front."""
    times_ns = plan.trajectory.times_ns.tolist()
    shift_ns = plan.approach_ns - times_ns[0]
    points = [
        JointTrajectoryPoint(
            positions=point.positions,
            velocities=point.velocities,
            accelerations=point.accelerations,
            effort=point.effort,
            time_from_start=nanoseconds_to_message(time_ns + shift_ns, Duration),
        )
        for point, time_ns in zip(message.points, times_ns, strict=True)
    ]
    if plan.entry is Entry.APPROACH:
        # It carries what the controller reads, so the guard takes the degree that it takes.
        first = JointTrajectoryPoint(positions=plan.positions, velocities=plan.velocities or ())
        points.insert(0, first)
    return points


def _start_state(plan: Takeover) -> JointState:
    """
    Return where the joints are at the begin of the path.

    Where the controller begins in the middle, the path's own joints are at its first point then.
    The state is never empty, so the guard takes none of its own that nobody has checked.

    Whole turns that were taken off a joint are in the state: the guard, who knows the robot, does
    not take them for nothing where the joint is not continuous.
    """
    positions = {name: joint.position for name, joint in plan.measured.items()}
    if plan.entry is Entry.MIDDLE:
        first = plan.trajectory.positions[0].tolist()
        for name, q0, turned in zip(
            plan.trajectory.joint_names, first, plan.positions, strict=True
        ):
            positions[name] = q0 + (positions[name] - turned)
    return JointState(name=list(positions), position=list(positions.values()))


def refusal(
    asked: CertifyTrajectory.Request, result: CertificationResult
) -> tuple[str, str] | None:
    """
    Say why an answer does not prove what was asked; None: it does.

    :param asked: the request.
    :param result: the result in the response.
    :returns: stable code, and the same in words: those of the guard if it does not say free.
    """
    try:
        answer = result_from_message(result)
    except ValueError as error:
        return Reason.ANSWER_INVALID.value, f'the answer cannot be read: {error}'
    if answer.verdict is not Verdict.FREE:
        return answer.reason_code or answer.verdict.name.lower(), answer.message
    try:
        _check(asked, answer)
    except RequestError as error:
        return error.reason.value, str(error)
    return None


def _check(asked: CertifyTrajectory.Request, answer: Result) -> None:
    """
    Check that a free verdict speaks of the whole trajectory and of no less than was asked.

    :raises RequestError: it does not.
    """
    duration_ns = nanoseconds_from_message(asked.trajectory.points[-1].time_from_start)
    ends = [0, *(interval.end_ns for interval in answer.intervals)]
    starts = [*(interval.start_ns for interval in answer.intervals), duration_ns]
    for wrong, what in (
        (answer.duration_ns != duration_ns, f'the duration {answer.duration_ns} ns'),
        (not answer.intervals, 'no intervals'),
        (starts != ends, 'intervals that are no partition of the duration'),
        (
            any(i.status is not Status.FREE for i in answer.intervals),
            'intervals that are not free',
        ),
        (not answer.clearance >= asked.clearance, f'the clearance {answer.clearance:g} m'),
        (answer.interpolation != INTERPOLATION, f'the interpolation {answer.interpolation!r}'),
        (not (answer.robot_hash and answer.scene_hash), 'no hash of the robot or the scene'),
    ):
        if wrong:
            raise RequestError(
                Reason.ANSWER_INVALID,
                f'the guard says free, but of {what}; asked were {duration_ns} ns with '
                f'{asked.clearance:g} m of clearance',
            )
