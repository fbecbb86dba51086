"""The moments of a motion that people should look at: where it is not free, and with what."""

from typing import NamedTuple

import numpy as np

from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.markers.drawing import Drawing, link_drawings
from trajectory_guard.markers.link_pose import link_pose
from trajectory_guard.paths.joint_path import joint_path, JointPath
from trajectory_guard.paths.multi_dof import MultiDofTrajectory
from trajectory_guard.paths.trajectory import JointState, Trajectory
from trajectory_guard.result import Interval, Result, Status

# How many are shown unless something else is asked for.
MOST = 50

# The path of a result has been judged; to draw it nothing is refused again [rad or m].
ANY_DISTANCE = 1e9


class Moment(NamedTuple):
    """
    An interval that is not free, and a picture of its witness.

    :param interval: what is known; its instant, pair, place and gap.
    :param ghost: collision geometry of the link at the instant, in the robot's root frame; empty
        if the interval names no link, or nothing tells where it is.
    """

    interval: Interval
    ghost: tuple[Drawing, ...]


class Moments(NamedTuple):
    """
    What there is to see of a result.

    :param shown: the first moments in time.
    :param left_out: number of the later ones.
    :param frame: the robot's root link, the frame of everything.
    """

    shown: tuple[Moment, ...]
    left_out: int
    frame: str


def moments(
    result: Result,
    workcell: Workcell,
    trajectory: Trajectory | MultiDofTrajectory,
    start: JointState | None = None,
    most: int = MOST,
) -> Moments:
    """
    Return the moments of a result; none of a rejected one, which has no intervals.

    :param result: of `judge` for the other three.
    :param workcell: robot and scene.
    :param trajectory: what was judged; for poses in time there are no ghosts.
    :param start: where the robot is at time 0.
    :param most: how many are shown.
    :raises TrajectoryGuardError: the result is of another trajectory or robot.
    """
    rows = [row for row in result.intervals if row.status in (Status.SUSPECT, Status.COLLISION)]
    path = None
    if rows and isinstance(trajectory, Trajectory) and workcell.robot.floating is None:
        path = joint_path(
            workcell.robot.movable,
            trajectory,
            start,
            allowed_start_tolerance=ANY_DISTANCE,
            check_joint_limits=False,
            allow_nonzero_end_velocity=True,
        )
    drawn: dict[str, tuple[Drawing, ...]] = {}
    shown = []
    for row in rows[:most]:
        if row.body and row.body not in drawn:
            drawn[row.body] = link_drawings(workcell.robot, row.body)
        T = _pose(workcell, path, row)
        ghost = () if T is None else tuple(part.moved(T) for part in drawn[row.body])
        shown.append(Moment(row, ghost))
    return Moments(tuple(shown), len(rows) - len(shown), workcell.robot.root)


def _pose(workcell: Workcell, path: JointPath | None, row: Interval) -> np.ndarray | None:
    """Return the pose of an interval's link at its instant, (4, 4); None if it has none."""
    if path is None or not row.body or row.at_ns is None:
        return None
    if not path.unknown_until_ns <= row.at_ns <= path.duration_ns:
        return None
    q = path.position(row.at_ns).tolist()
    return link_pose(workcell.robot, row.body, dict(zip(path.joint_names, q, strict=True)))
