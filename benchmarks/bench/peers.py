"""The baseline from Python: sampling and conservative advancement on the bodies of a workcell."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cache
import math
from typing import NamedTuple
import weakref

import numpy as np
from scipy.spatial import ConvexHull

from bench.compiled import library
from bench.kinematics import moved_links
from trajectory_guard.cell.robot import Joint, JointType
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.paths.joint_path import JointPath
from trajectory_guard.result import NANOSECONDS
from trajectory_guard.shapes.body import ConvexBody
from trajectory_guard.shapes.primitive import sphere_directions

# What counts as contact, as coal's distance may be too large [m], and the shortest span [s].
MARGIN = 1e-6
SHORTEST_OF_VERDICT = 1e-5
SHORTEST_OF_INTERVALS = 1e-4

# Spans that are not free for which there is room.
ROOM = 100_000

# Rounding radii below this are those of our own arithmetic [m].
ROUNDING = 1e-9

FREE, CONTACT, UNDECIDED = 0, 1, 2
VERDICTS = ('free', 'contact', 'undecided')


@dataclass(frozen=True)
class Spline:
    """
    A path as cubic polynomials in seconds.

    :param knots: (S + 1,) [s].
    :param coefficients: (S, n, 4), of 1, u, u^2, u^3, u the time from the segment's start.
    """

    knots: np.ndarray
    coefficients: np.ndarray

    @classmethod
    def from_path(cls, path: JointPath) -> Spline:
        """Return the same curve; refuse one that is no cubic."""
        if path.coefficients[:, :, 4:].any():
            raise ValueError('the baseline takes cubic splines only')
        knots = path.knots_ns / NANOSECONDS
        powers = np.diff(knots)[:, None, None] ** np.arange(4)
        return cls(knots, np.ascontiguousarray(path.coefficients[:, :, :4] / powers))


class Samples(NamedTuple):
    """Whether a pose collided, and how many were looked at."""

    colliding: bool
    poses: int


class Baseline:
    """Checks the links that joints move against the scene, as `peers/baseline.cpp` does."""

    def __init__(self, cell: Workcell):
        self._library = _library()
        text = '\n'.join((*_links(cell), *_obstacles(cell)))
        self._handle = ctypes.c_void_p(self._library.baseline_load(text.encode()))
        self._out = np.zeros((ROOM, 3))
        weakref.finalize(self, self._library.baseline_free, self._handle)

    @property
    def pairs(self) -> int:
        """Number of pairs of a body and an obstacle body."""
        return self._library.baseline_pairs(self._handle)

    def sample(self, spline: Spline, step: float) -> Samples:
        """Look at poses no farther apart than a step of the fastest joint [rad]."""
        hit = self._call(self._library.baseline_sample, spline, ctypes.c_double(step))
        return Samples(bool(hit), int(self._out[0, 1]))

    def verdict(self, spline: Spline) -> int:
        """Return FREE, CONTACT or UNDECIDED."""
        return self._call(
            self._library.baseline_verdict,
            spline,
            ctypes.c_double(MARGIN),
            ctypes.c_double(SHORTEST_OF_VERDICT),
        )

    def intervals(self, spline: Spline) -> np.ndarray:
        """Return (N, 3): begin, end [s] and CONTACT or UNDECIDED; the rest of time is free."""
        count = self._call(
            self._library.baseline_intervals,
            spline,
            ctypes.c_double(MARGIN),
            ctypes.c_double(SHORTEST_OF_INTERVALS),
            last=(ROOM,),
        )
        if count > ROOM:
            raise ValueError(f'{count} spans, and room for {ROOM}')
        return self._out[:count].copy()

    def _call(self, function, spline: Spline, *numbers, last=()) -> int:
        return function(
            self._handle,
            len(spline.knots) - 1,
            ctypes.c_void_p(spline.knots.ctypes.data),
            ctypes.c_void_p(spline.coefficients.ctypes.data),
            *numbers,
            ctypes.c_void_p(self._out.ctypes.data),
            *last,
        )


@cache
def _library() -> ctypes.CDLL:
    loaded = ctypes.CDLL(str(library()))
    loaded.baseline_load.restype = ctypes.c_void_p
    return loaded


def _links(cell: Workcell) -> list[str]:
    """Write a line of counts, then four a link; further bodies of a link hang fixed on it."""
    robot = cell.robot
    index = {joint.name: i for i, joint in enumerate(robot.movable)}
    moving = moved_links(robot)
    rows, at = [], {}
    for link, joint in zip(robot.links, (None, *robot.joints), strict=True):
        bodies = robot.bodies(link) or (None,)
        moved = int(link in moving)
        for n, body in enumerate(bodies):
            own = joint is not None and n == 0
            parent = at[link] if n else -1 if joint is None else at[joint.parent]
            kind, number = (_kind(joint), index.get(joint.name, -1)) if own else (0, -1)
            rows += [
                f'{parent} {kind} {number} {moved}',
                _pose(joint.T_parent_joint if own else np.eye(4)),
                _numbers(joint.axis if own else (0.0, 0.0, 1.0)),
                'none' if body is None else _hull(body),
            ]
            at.setdefault(link, len(rows) // 4 - 1)
    return [f'{len(rows) // 4} {len(index)}', *rows]


def _obstacles(cell: Workcell) -> list[str]:
    """Write a line for their number, then two an obstacle body."""
    rows = [
        line
        for obstacle in cell.scene.obstacles
        for body in obstacle.bodies
        for line in (_box(body) or (_pose(np.eye(4)), _hull(body)))
    ]
    return [str(len(rows) // 2), *rows]


def _kind(joint: Joint) -> int:
    if joint.type is JointType.PRISMATIC or joint.mimic is not None:
        raise ValueError(f'joint {joint.name!r}: the baseline knows independent turns only')
    return int(joint.type is not JointType.FIXED)


def _box(body: ConvexBody) -> tuple[str, str] | None:
    """Return pose and size if the body is a box, which coal treats faster than a hull."""
    if len(body.vertices) != 8 or len(body.faces) != 6 or body.ball > ROUNDING:
        return None
    R = body.faces[:3, :3].T
    low, high = (body.vertices @ R).min(axis=0), (body.vertices @ R).max(axis=0)
    corners = np.abs(body.vertices @ R - (low + high) / 2)
    if not np.allclose(R.T @ R, np.eye(3)) or not np.allclose(corners, (high - low) / 2):
        return None
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, R @ (low + high) / 2
    return _pose(T), f'box {_numbers(high - low)}'


def _hull(body: ConvexBody) -> str:
    points = polytope(body)
    try:
        hull = ConvexHull(points)
    except Exception:  # qhull's own type for flat bodies; joggled ones have a volume
        hull = ConvexHull(points, qhull_options='QJ')
    number = {int(v): i for i, v in enumerate(hull.vertices)}
    triangles = [number[int(v)] for triangle in hull.simplices for v in triangle]
    return (
        f'hull {len(number)} {_numbers(points[hull.vertices])} '
        f'{len(hull.simplices)} {" ".join(map(str, triangles))}'
    )


def polytope(body: ConvexBody, sides: int = 48) -> np.ndarray:
    """Return vertices of a polytope that contains the body, and is a body without curves."""
    points = body.vertices
    if body.disc_radius:
        x = np.cross(body.disc_axis, np.eye(3)[np.abs(body.disc_axis).argmin()])
        x *= body.disc_radius / math.cos(math.pi / sides) / np.linalg.norm(x)
        y = np.cross(body.disc_axis, x)
        angle = 2.0 * math.pi / sides * np.arange(sides)[:, None]
        ring = np.cos(angle) * x + np.sin(angle) * y
        points = (points[:, None] + ring).reshape(-1, 3)
    if body.ball > ROUNDING:
        directions, inradius = sphere_directions()
        points = (points[:, None] + body.ball / inradius * directions).reshape(-1, 3)
    return points


def _pose(T: np.ndarray) -> str:
    return _numbers(T[:3].ravel())


def _numbers(values) -> str:
    return ' '.join(f'{value:.17g}' for value in np.ravel(values))
