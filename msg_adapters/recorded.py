"""The trajectories of a bag, each with the joint states measured before it."""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from msg_adapters.bag import Bag, BagMessage
from msg_adapters.trajectory import (
    joint_state_from_message,
    multi_dof_from_message,
    stamp_from_message,
    trajectory_from_message,
)
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.multi_dof import MultiDofTrajectory
from trajectory_guard.paths.trajectory import JointState, Trajectory
from trajectory_guard.result import NANOSECONDS

JOINT_TRAJECTORY = 'trajectory_msgs/msg/JointTrajectory'
MULTI_DOF = 'trajectory_msgs/msg/MultiDOFJointTrajectory'
JOINT_STATE = 'sensor_msgs/msg/JointState'
DEFAULT_JOINT_STATES = '/joint_states'

# Several publishers may share the topic, each with some of the joints; so many messages are looked
# back over. A joint that none of them has counts as not measured.
LOOK_BACK = 1024


class Recorded(NamedTuple):
    """
    One recorded trajectory.

    :param name: bag, topic and receive time.
    :param trajectory: the trajectory, or why there is none.
    :param start: the joints as last measured at its receive time; None: never.
    :param stamp_ns: when the message says that it begins, 0: when it arrives [ns].
    """

    name: str
    trajectory: Trajectory | MultiDofTrajectory | TrajectoryError
    start: JointState | None = None
    stamp_ns: int = 0


def recorded_trajectories(
    path: Path, topics: Sequence[str] = (), joint_state_topics: Sequence[str] = ()
) -> Iterator[Recorded]:
    """
    Yield the trajectories of a bag in the order in which they were received.

    The start is what the joint state topics said last at or before the receive time, also if the
    trajectory is stamped to begin later: the controller leaves for the first point at once.

    :param path: folder or storage file.
    :param topics: topics of either kind of trajectory; empty: all there are.
    :param joint_state_topics: JointState topics; empty: ``/joint_states`` if it is there.
    :raises TrajectoryError: no such bag or topic; for a damaged bag, after what could be read.
    """
    with Bag(path) as bag:
        states = _chosen(bag, JOINT_STATE, joint_state_topics)
        if not joint_state_topics:
            states = [topic for topic in states if topic == DEFAULT_JOINT_STATES]
        wanted = {JOINT_STATE: states, **_trajectory_topics(bag, topics)}
        latest: deque[_Measured] = deque(maxlen=LOOK_BACK)
        for messages in _instants(bag.messages(wanted)):
            latest.extend(_Measured(m) for m in messages if m.message_type == JOINT_STATE)
            for message in messages:
                if message.message_type != JOINT_STATE:
                    yield _recorded(message, latest, path)


class _Measured:
    """A joint state message that is decoded at most once, and only if a trajectory needs it."""

    def __init__(self, message: BagMessage) -> None:
        self._message = message
        self._state: JointState | None = None
        self._is_decoded = False

    def state(self) -> JointState | None:
        """
        Return the joint state, None if the message has none.

        :raises TrajectoryError: it cannot be used.
        """
        if not self._is_decoded:
            try:
                self._state = joint_state_from_message(self._message.message())
            except TrajectoryError as error:
                if error.reason is not Reason.NO_JOINTS:
                    place = f'{self._message.topic} at {_seconds(self._message.time_ns)}'
                    raise TrajectoryError(error.reason, f'{place}: {error}') from error
            self._is_decoded = True
        return self._state


def _chosen(bag: Bag, message_type: str, topics: Sequence[str]) -> list[str]:
    """
    Return the topics to read of one type.

    :param topics: those asked for; empty: all there are.
    :raises TrajectoryError: a topic that was asked for is not there.
    """
    there = bag.topics(message_type)
    for topic in topics:
        if topic not in there:
            raise TrajectoryError(
                Reason.TRAJECTORY_UNREADABLE,
                f'{bag.path}: no topic {topic!r} of type {message_type}, there are {there}',
            )
    return list(topics) or there


def _trajectory_topics(bag: Bag, topics: Sequence[str]) -> dict[str, list[str]]:
    """
    Return the topics to read by their type.

    :param topics: those asked for; empty: all there are.
    :raises TrajectoryError: a topic that was asked for is not there.
    """
    there = {kind: bag.topics(kind) for kind in (JOINT_TRAJECTORY, MULTI_DOF)}
    for topic in topics:
        if not any(topic in some for some in there.values()):
            # Of the type that most bags have, the error names the topics there are.
            _chosen(bag, JOINT_TRAJECTORY, [topic])
    return {
        kind: [topic for topic in some if not topics or topic in topics]
        for kind, some in there.items()
    }


def _instants(messages: Iterable[BagMessage]) -> Iterator[list[BagMessage]]:
    """
    Yield the messages that were received in the same instant together.

    What was received in an instant is known in that instant, whatever the order of its messages.
    """
    instant: list[BagMessage] = []
    try:
        for message in messages:
            if instant and message.time_ns != instant[0].time_ns:
                yield instant
                instant = []
            instant.append(message)
    except TrajectoryError:
        yield instant
        raise
    yield instant


def _recorded(message: BagMessage, latest: Sequence[_Measured], path: Path) -> Recorded:
    """Return a trajectory message with the joint states before it."""
    name = f'{path}:{message.topic}@{_seconds(message.time_ns)}'
    try:
        content = message.message()
        poses = message.message_type == MULTI_DOF
        trajectory = (multi_dof_from_message if poses else trajectory_from_message)(content, name)
        return Recorded(name, trajectory, _merged(latest), stamp_from_message(content))
    except TrajectoryError as error:
        return Recorded(name, TrajectoryError(error.reason, f'{name}: {error}'))


def _merged(latest: Sequence[_Measured]) -> JointState | None:
    """Return for each joint what was measured last; a velocity that was not counts as zero."""
    positions: dict[str, float] = {}
    velocities: dict[str, float] = {}
    for measured in reversed(latest):
        state = measured.state()
        if state is None:
            continue
        speeds = () if state.velocities is None else state.velocities.tolist()
        for i, (name, position) in enumerate(
            zip(state.joint_names, state.positions.tolist(), strict=True)
        ):
            if name not in positions:
                positions[name] = position
                if speeds:
                    velocities[name] = speeds[i]
    if not positions:
        return None
    return JointState(
        joint_names=tuple(positions),
        positions=np.array([*positions.values()]),
        velocities=np.array([velocities.get(name, 0.0) for name in positions])
        if velocities
        else None,
    )


def _seconds(time_ns: int) -> str:
    """Return a time with all its digits [s]."""
    return f'{time_ns // NANOSECONDS}.{time_ns % NANOSECONDS:09d}'
