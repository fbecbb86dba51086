"""What the demo shows, and what it promises."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from msg_adapters.text import trajectories_from_text
from trajectory_guard.demo.files import config_file
from trajectory_guard.demo.poses import Sampled
from trajectory_guard.errors import Reason, TrajectoryError
from trajectory_guard.paths.trajectory import Trajectory
from trajectory_guard.result import Result, Status, Verdict

SCENE = 'demo_scene.urdf'

# The trajectories do not move the fingers; both are this far from the middle of the hand [m].
FINGERS = {'panda_finger_joint1': 0.02, 'panda_finger_joint2': 0.02}


class Case(NamedTuple):
    """
    One trajectory and the answer that it is made for.

    :param title: what the robot does.
    :param story: what the viewer sees.
    :param file: trajectory in ``config/``.
    :param verdict: answer of the guard.
    :param clearance: distance asked of the guard [m].
    :param obstacle: what the robot hits, or comes nearest to.
    :param closest: range of the smallest distance between robot and scene; negative: they overlap
        [m].
    :param too_much: clearance that the motion does not keep, to be asked for after that [m].
    """

    title: str
    story: str
    file: str
    verdict: Verdict
    clearance: float
    obstacle: str
    closest: tuple[float, float]
    too_much: float | None = None

    def trajectory(self) -> Trajectory:
        """
        Return the trajectory.

        :raises DemoError: its file is missing.
        :raises TrajectoryError: its file has been changed, and not for the better.
        """
        text = config_file(self.file).read_text(encoding='utf-8')
        (trajectory,) = trajectories_from_text(text, self.file)
        if not isinstance(trajectory, Trajectory):
            raise TrajectoryError(
                Reason.TRAJECTORY_UNREADABLE, f'{self.file} has poses, not joint positions'
            )
        return trajectory

    def start(self) -> dict[str, float]:
        """Return where the joints are at time 0, the arm's at the first point [rad or m]."""
        trajectory = self.trajectory()
        arm = zip(trajectory.joint_names, trajectory.positions[0].tolist(), strict=True)
        return {**dict(arm), **FINGERS}

    def problems(
        self, results: Sequence[Result], wider: Result | None, checks: Mapping[str, Sampled]
    ) -> list[str]:
        """
        Return what is not as the case promises.

        :param results: what the guard answered, again and again.
        :param wider: what it answered when it was asked for too much.
        :param checks: what checks of single poses say, by their names.
        """
        result = results[0]
        found = []
        if any(other.intervals != result.intervals for other in results):
            found.append('the guard does not give the same answer twice')
        if result.verdict is not self.verdict:
            found.append(
                f'the verdict is {result.verdict.name}, not {self.verdict.name}; '
                f'{result.reason_code}: {result.message}'
            )
        if wider is not None and wider.verdict is not Verdict.SUSPECT:
            found.append(f'the guard says {wider.verdict.name} when asked for too much')
        ends = [0, *(row.end_ns for row in result.intervals)]
        starts = [*(row.start_ns for row in result.intervals), result.duration_ns]
        if not result.intervals or starts != ends:
            found.append('the intervals do not cover the motion')
        rows = (*result.intervals, *(wider.intervals if wider else ()))
        others = {row.obstacle for row in rows if row.status is not Status.FREE} - {self.obstacle}
        if others:
            found.append(f'{", ".join(sorted(others))} is in the way, not only {self.obstacle}')
        for name, sampled in checks.items():
            if sampled.hits.any():
                found.append(f'the check of {name} is not free')
            if result.verdict is Verdict.FREE and sampled.distances.min() <= self.clearance:
                found.append(f'the check of {name} comes nearer than the clearance')
        return [f'{self.title}: {problem}' for problem in found]


CASES = (
    Case(
        title='Reach into the crate',
        story='The hand goes down between the walls of the crate and comes up again, with '
        'centimetres to spare. One proof covers every instant.',
        file='demo_free.yaml',
        verdict=Verdict.FREE,
        clearance=0.0,
        obstacle='crate',
        closest=(0.02, 0.04),
    ),
    Case(
        title='Sweep over the carton',
        story='The fingertips cross the top of the carton; between the waypoints the spline sags '
        'to 2 mm above it. The guard is asked for a clearance of 1.5 mm and proves it; asked for '
        '3 mm, it says where there is less.',
        file='demo_near.yaml',
        verdict=Verdict.FREE,
        clearance=0.0015,
        obstacle='carton',
        closest=(0.001, 0.003),
        too_much=0.003,
    ),
    Case(
        title='Swing past the sign',
        story='The waypoints are clear of the sign, a sheet of 2 mm, and one sample of the spline '
        'lies just before it, the next just behind it. In between, the spline takes the '
        'fingertips through.',
        file='demo_collision.yaml',
        verdict=Verdict.COLLISION,
        clearance=0.0,
        obstacle='sign',
        closest=(-0.012, -0.005),
    ),
)
