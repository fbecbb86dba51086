"""Paths on the command line to trajectories, or to why there is none."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from msg_adapters.bag import is_bag
from msg_adapters.recorded import recorded_trajectories
from msg_adapters.text import documents, MAX_CHARACTERS
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.multi_dof import MultiDofTrajectory
from trajectory_guard.paths.trajectory import JointState, Trajectory


class Source(NamedTuple):
    """
    One trajectory to judge.

    :param name: where it comes from.
    :param trajectory: the trajectory, or why there is none.
    :param start: the joints as measured before it, if that was recorded.
    :param stamp_ns: when it says that it begins, 0: when it arrives [ns].
    :param recorded: it comes from a bag.
    """

    name: str
    trajectory: Trajectory | MultiDofTrajectory | TrajectoryError
    start: JointState | None = None
    stamp_ns: int = 0
    recorded: bool = False


class Selection(NamedTuple):
    """
    What is read of bags.

    :param topics: topics of trajectories of either kind; empty: all.
    :param joint_state_topics: JointState topics; empty: ``/joint_states``.
    """

    topics: Sequence[str] = ()
    joint_state_topics: Sequence[str] = ()


def sources(path: Path, selection: Selection, bags_only: bool = False) -> Iterator[Source]:
    """
    Yield what a path holds; at least one item, as nothing is an error too.

    :param path: text file, bag folder or storage file.
    :param selection: what is read of a bag.
    :param bags_only: a text file is an error.
    """
    found = False
    try:
        for source in _sources(path, selection, bags_only):
            found = True
            yield source
    except (TrajectoryError, OSError) as error:
        yield Source(str(path), _unreadable(path, error))
        return
    if not found:
        yield Source(str(path), _unreadable(path, 'no trajectory in it'))


def _sources(path: Path, selection: Selection, bags_only: bool) -> Iterator[Source]:
    """Yield what a path holds, or raise."""
    if not path.exists():
        raise _unreadable(path, 'no such file or folder')
    if path.suffix == '.bag':
        raise _unreadable(path, 'a ROS 1 bag; `rosbags-convert` makes a ROS 2 bag of it')
    if is_bag(path):
        for recorded in recorded_trajectories(path, *selection):
            yield Source(*recorded, recorded=True)
    elif bags_only:
        raise _unreadable(path, 'not a bag (a folder, .mcap or .db3)')
    else:
        for document in documents(_text(path), str(path)):
            yield Source(document.name, document.trajectory, stamp_ns=document.stamp_ns)


def _text(path: Path) -> str:
    """
    Return the text of a file that is not larger than what is read of it.

    :raises TrajectoryError: it is no text, or too large.
    """
    with path.open('rb') as file:
        data = file.read(MAX_CHARACTERS + 1)
    if len(data) > MAX_CHARACTERS:
        raise TrajectoryError(
            Reason.TOO_LARGE, f'{path}: larger than {MAX_CHARACTERS} bytes, which are read at most'
        )
    try:
        return data.decode('utf-8-sig')
    except UnicodeDecodeError as error:
        raise _unreadable(
            path, f'neither a bag (a folder, .mcap or .db3) nor text: {error}'
        ) from (error)


def _unreadable(path: Path, problem: object) -> TrajectoryError:
    """Return the error of a path; one that says its path already is kept."""
    if isinstance(problem, TrajectoryError):
        return problem
    if isinstance(problem, OSError):
        problem = problem.strerror or type(problem).__name__
    return TrajectoryError(Reason.TRAJECTORY_UNREADABLE, f'{path}: {problem}')
