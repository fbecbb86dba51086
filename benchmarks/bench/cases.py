"""Robots, a scene, and trajectories with certified truth, from a folder in the bench layout."""

from dataclasses import dataclass
from functools import cached_property
import json
from pathlib import Path

from bench.peers import Baseline, Spline
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.paths.joint_path import joint_path, JointPath
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.result import NANOSECONDS, Result, Status, Verdict
from trajectory_guard.settings import Settings


@dataclass(frozen=True)
class Case:
    """
    One trajectory and what is known about it.

    :param name: unique in the set.
    :param category: what kind of case it was made as.
    :param trajectory: as a message.
    :param path: the same as a curve of all joints.
    :param colliding: whether it touches anything.
    :param contact: spans that contain every contact [s].
    :param contact_core: spans in contact throughout [s].
    """

    name: str
    category: str
    trajectory: Trajectory
    path: JointPath
    colliding: bool
    contact: tuple[tuple[float, float], ...]
    contact_core: tuple[tuple[float, float], ...]

    @cached_property
    def spline(self) -> Spline:
        """The curve as the baseline takes it."""
        return Spline.from_path(self.path)

    def missed(self, result: Result) -> bool:
        """Say whether a collision was called free."""
        return self.colliding and result.verdict == Verdict.FREE

    def false_alarm(self, result: Result) -> bool:
        """Say whether something free was not called free."""
        return not self.colliding and result.verdict != Verdict.FREE

    def unsound(self, result: Result) -> int:
        """Count what is free and must not be: the verdict, intervals that meet a contact."""
        return self.missed(result) + sum(
            row.start_ns < NANOSECONDS * end and NANOSECONDS * begin < row.end_ns
            for row in result.intervals
            if row.status == Status.FREE
            for begin, end in self.contact_core
        )


@dataclass(frozen=True)
class Bench:
    """
    A robot in its scene with its cases.

    :param name: of the robot.
    :param cell: robot and scene.
    :param cases: in the order of the file.
    """

    name: str
    cell: Workcell
    cases: tuple[Case, ...]

    @cached_property
    def baseline(self) -> Baseline:
        """The baseline for the same bodies."""
        return Baseline(self.cell)

    @property
    def colliding(self) -> list[Case]:
        """The cases that touch something."""
        return [case for case in self.cases if case.colliding]

    @property
    def free(self) -> list[Case]:
        """The cases that touch nothing."""
        return [case for case in self.cases if not case.colliding]


def settings(**changes: object) -> Settings:
    """Return settings for the set, whose splines end at rest only up to the last printed digit."""
    return Settings(**{'allow_nonzero_end_velocity': True, **changes})


def load(folder: Path, most: int | None = None) -> list[Bench]:
    """
    Read a set.

    :param folder: `trajectories.json` and the URDF files that it names.
    :param most: number of cases a robot, spread over the set; None: all.
    """
    robots = json.loads((folder / 'trajectories.json').read_text(encoding='utf-8'))['robots']
    return [
        Bench(name, cell, tuple(case(cell, data['joint_names'], row) for row in some(data, most)))
        for name, data in robots.items()
        for cell in [
            Workcell(
                load_robot(folder / data.get('urdf', f'{name}.urdf')),
                load_scene(folder / data.get('scene', 'scene.urdf')),
            )
        ]
    ]


def some(data: dict, most: int | None) -> list[dict]:
    """Return the trajectories of a robot, or as many as asked for, evenly spread."""
    found = data['trajectories']
    if most is None or most >= len(found):
        return found
    return [found[i * len(found) // most] for i in range(most)]


def points_of(row: dict) -> list[Point]:
    """Return the points of a trajectory of the file."""
    return [
        Point(round(NANOSECONDS * t), p, v)
        for t, p, v in zip(row['times'], row['positions'], row['velocities'], strict=True)
    ]


def waypoints(trajectory: Trajectory) -> list[Point]:
    """Return the points of a trajectory as lists, as a planner has them."""
    return [
        Point(int(t), p, v)
        for t, p, v in zip(
            trajectory.times_ns,
            trajectory.positions.tolist(),
            trajectory.velocities.tolist(),
            strict=True,
        )
    ]


def case(cell: Workcell, joint_names: list[str], row: dict) -> Case:
    """Return a trajectory of the file as a case."""
    trajectory = Trajectory.from_points(joint_names, points_of(row), name=row['id'])
    truth = row['truth']
    return Case(
        name=row['id'],
        category=row['category'],
        trajectory=trajectory,
        path=joint_path(cell.robot.movable, trajectory, None, allow_nonzero_end_velocity=True),
        colliding=truth['colliding'],
        contact=tuple((begin, end) for begin, end in truth['contact']),
        contact_core=tuple((begin, end) for begin, end in truth['contact_core']),
    )
