"""What one run of a command asks for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from trajectory_guard.command_line.options import Pose
from trajectory_guard.settings import Settings

SELF_COLLISION_WARNING = (
    'links of the robot are not checked against each other; --no-self-collision accepts that'
)


@dataclass(frozen=True, slots=True)
class Request:
    """
    What one run of a command asks for.

    :param urdf: the robot.
    :param scenes: files of the scene.
    :param scene_pose: of the scene in the root link; None: the same frame.
    :param settings: of every certification.
    :param start: joint positions at time 0 [rad or m].
    :param paths: where the trajectories are.
    :param topics: JointTrajectory topics read of bags; empty: all.
    :param joint_state_topics: JointState topics read of bags; empty: ``/joint_states``.
    :param bags_only: refuse text files.
    :param self_collision: links were to be checked against each other.
    :param certificate: file or folder for certificates, as it was written; None: none.
    """

    urdf: Path
    scenes: Sequence[Path]
    scene_pose: Pose | None
    settings: Settings
    start: Mapping[str, float]
    paths: Sequence[Path]
    topics: Sequence[str] = ()
    joint_state_topics: Sequence[str] = ()
    bags_only: bool = False
    self_collision: bool = True
    certificate: str | None = None


@dataclass(frozen=True, slots=True)
class Verification:
    """
    What one run of ``verify`` asks for.

    :param urdf: the robot.
    :param scenes: files of the scene.
    :param scene_pose: of the scene in the root link; None: the same frame.
    :param certificates: files, or folders of them.
    :param trajectories: where the trajectories are that the certificates are about.
    """

    urdf: Path
    scenes: Sequence[Path]
    scene_pose: Pose | None
    certificates: Sequence[Path]
    trajectories: Sequence[Path]
