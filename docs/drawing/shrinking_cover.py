"""What balls of displacements cover of space, round one link of an arm, as its motion is cut."""

import math
from pathlib import Path
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch as Swatch
import numpy as np
from scipy.spatial import ConvexHull

from drawing.camera import Camera
from drawing.palette import BODY, FAINT, INK
from trajectory_guard.cell.scene import load_scene
from trajectory_guard.cell.urdf import load_robot
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.motions.link_motion import rational_motion
from trajectory_guard.paths.joint_path import joint_path, JointPath
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.toleranced.bounding_ball import control_ball
from trajectory_guard.toleranced.metric import MassDistribution
from trajectory_guard.toleranced.minimum_ellipsoid import least_distortion

BENCH = Path(__file__).parents[2] / 'test' / 'data' / 'bench'
LINK = 'forearm_link'
START = [0.0, -2.2, 1.3, 0.0, 0.0, 0.0]
END = [0.3, -1.4, 0.5, 0.0, 0.0, 0.0]

LEVELS = (0, 1, 2, 3)

# Poses drawn as true are those at the ends of pieces so short that their error does not show.
TRUE_LEVEL = 4

# Balls are drawn round points of the hull's edges at this distance, far less than their radii [m].
SPACING = 0.01

# Across the arm's plane in the middle of the motion.
CAMERA = Camera(0.15 - 0.5 * math.pi, 0.0)
TINTS = ('#cfe6f5', '#fbe3bf')


class Link(NamedTuple):
    """
    A link of an arm and what moves it.

    :param workcell: the arm.
    :param path: its joints' motion, of one segment.
    :param body: index of the link.
    :param vertices: of the link's hull, (n, 3) in the frame that moves [m].
    :param samples: points of the hull's edges, (m, 3) [m].
    """

    workcell: Workcell
    path: JointPath
    body: int
    vertices: np.ndarray
    samples: np.ndarray


class Cover(NamedTuple):
    """
    The balls round a link's points in which they stay during a piece of the motion.

    :param centers: (m, 3) in the root frame [m].
    :param radii: (m,), the error of the motion included [m].
    """

    centers: np.ndarray
    radii: np.ndarray


def link() -> Link:
    """Return the forearm of a UR5 that reaches out."""
    cell = Workcell(load_robot(BENCH / 'ur5.urdf'), load_scene([BENCH / 'scene.urdf']))
    names = [joint.name for joint in cell.robot.movable]
    trajectory = Trajectory.from_points(names, [Point(0, START), Point(1_000_000_000, END)])
    T = cell.tree.link_pose[LINK]
    vertices = cell.robot.bodies(LINK)[0].vertices @ T[:3, :3].T + T[:3, 3]
    return Link(
        cell,
        joint_path(cell.robot.movable, trajectory, None),
        cell.link_names.index(LINK),
        vertices,
        edge_points(vertices),
    )


def edge_points(vertices: np.ndarray) -> np.ndarray:
    """
    Return points of the edges of a hull, `SPACING` apart at most.

    :param vertices: (n, 3) [m].
    :returns: (m, 3) [m].
    """
    triangles = ConvexHull(vertices).simplices
    sides = np.sort(np.concatenate((triangles[:, :2], triangles[:, 1:], triangles[:, ::2])))
    points = [vertices]
    for a, b in vertices[np.unique(sides, axis=0)]:
        count = math.ceil(float(np.linalg.norm(b - a)) / SPACING)
        share = np.arange(1, count)[:, None] / count
        points.append((1.0 - share) * a + share * b)
    return np.concatenate(points)


def covers(moved: Link, metric: MassDistribution, level: int) -> list[Cover]:
    """
    Return the cover of each of 2^level equal pieces.

    :param moved: the link.
    :param metric: of its displacements.
    :param level: halvings.
    """
    found = []
    for numerator in range(2**level):
        motion = rational_motion(moved.workcell, moved.path, moved.body, 0, numerator, level)
        ball = control_ball(motion, metric)
        radii = metric.bound(ball.radius, moved.samples) + motion.error
        found.append(Cover(ball.images(moved.samples), radii))
    return found


def true_poses(moved: Link) -> np.ndarray:
    """Return poses of the link's frame, (2^TRUE_LEVEL + 1, 3, 4)."""
    pieces = [
        rational_motion(moved.workcell, moved.path, moved.body, 0, numerator, TRUE_LEVEL)
        for numerator in range(2**TRUE_LEVEL)
    ]
    return np.array([piece.pose(0.0) for piece in pieces] + [pieces[-1].pose(1.0)])


def draw() -> Figure:
    """Return the picture: covers by 1, 2, 4 and 8 balls of displacements."""
    moved = link()
    metric = least_distortion(moved.vertices)
    poses = true_poses(moved)
    all_covers = [covers(moved, metric, level) for level in LEVELS]
    figure = Figure(figsize=(8.6, 8.6), layout='constrained')
    grid = figure.subplots(2, 2, sharex=True, sharey=True)
    for axes, level, found in zip(grid.flat, LEVELS, all_covers, strict=True):
        for k, cover in enumerate(found):
            _shadow(axes, cover, TINTS[k % 2])
        _silhouettes(axes, moved.vertices, poses)
        count, widest = 2**level, 1e3 * max(cover.radii.max() for cover in found)
        noun = 'piece' if count == 1 else 'pieces'
        axes.set_title(f'{count} {noun}: balls of radius up to {widest:.0f} mm')
        axes.set_aspect('equal')
    low, high = _frame(all_covers[0])
    grid[0, 0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    for axes in grid[-1]:
        axes.set_xlabel('along the arm [m]')
    for axes in grid[:, 0]:
        axes.set_ylabel('height [m]')
    figure.legend(handles=_legend(), loc='outside lower center', ncols=4, frameon=False)
    return figure


def _legend() -> list[Swatch]:
    return [
        Swatch(facecolor=BODY, edgecolor=INK, label='forearm of a UR5: first and last pose'),
        Swatch(facecolor=BODY, edgecolor=FAINT, label='and between'),
        Swatch(facecolor=TINTS[0], edgecolor=INK, label='its orbits, odd pieces'),
        Swatch(facecolor=TINTS[1], edgecolor=INK, label='even pieces'),
    ]


def _frame(found: list[Cover]) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of the box round the widest cover, and a little more [m]."""
    flat = np.concatenate([CAMERA.flat(cover.centers) for cover in found])
    radii = np.concatenate([cover.radii for cover in found])[:, None]
    return (flat - radii).min(axis=0) - 0.05, (flat + radii).max(axis=0) + 0.05


def _shadow(axes: Axes, cover: Cover, colour: str) -> None:
    """Draw the shadow of a union of balls: the rims first, and what lies within over them."""
    for face, width in ((INK, 1.4), (colour, 0.0)):
        axes.add_collection(
            EllipseCollection(
                2.0 * cover.radii,
                2.0 * cover.radii,
                0.0,
                units='xy',
                offsets=CAMERA.flat(cover.centers),
                offset_transform=axes.transData,
                facecolors=face,
                edgecolors=face,
                linewidths=width,
            )
        )


def _silhouettes(axes: Axes, vertices: np.ndarray, poses: np.ndarray) -> None:
    """Draw the link in its poses."""
    shapes = []
    for pose in poses:
        flat = CAMERA.flat(vertices @ pose[:, :3].T + pose[:, 3])
        shapes.append(flat[ConvexHull(flat).vertices])
    axes.add_collection(PolyCollection(shapes, facecolors=BODY, edgecolors=FAINT, linewidths=0.5))
    for shape in (shapes[0], shapes[-1]):
        axes.add_collection(
            PolyCollection([shape], facecolors='none', edgecolors=INK, linewidths=1.2)
        )
