"""The boundary of a fat polygon, as figure 1 of [SW]."""

import math

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch as Swatch
import numpy as np

from drawing.arcs import arcs
from drawing.camera import Camera
from drawing.palette import EDGE, FACE, FAINT, INK, OPEN, VERTEX
from trajectory_guard.toleranced.displacement_ball import DisplacementBall
from trajectory_guard.toleranced.fat_polygon import FatPolygon
from trajectory_guard.toleranced.metric import MassDistribution
from trajectory_guard.toleranced.patches import Mesh, Patch
from trajectory_guard.toleranced.polygon import Polygon

CORNERS = np.array(
    [[-1.0, -0.6, 0.0], [0.3, -0.85, 0.0], [1.2, -0.1, 0.0], [0.5, 0.75, 0.0], [-0.8, 0.6, 0.0]]
)
IDENTITY = np.eye(3, 4)

# Of the least radius for which the orbit of the plane is all of space.
SHARE = 0.5

STEPS = 24
# Round the orbit, for the width of lines [m].
MARGIN = 0.05
CAMERA = Camera(math.radians(-68.0), math.radians(30.0))
COLOURS = {Patch.VERTEX: VERTEX, Patch.EDGE: EDGE, Patch.FACE: FACE}


def fat_polygon() -> FatPolygon:
    """Return a pentagon under a ball of displacements round the identity."""
    metric = MassDistribution.of_polygon(CORNERS)
    polygon = Polygon(CORNERS)
    nu = FatPolygon(DisplacementBall(metric, IDENTITY, 0.0), polygon).plane.nu
    return FatPolygon(DisplacementBall(metric, IDENTITY, SHARE * float(nu.min())), polygon)


def scaled(fat: FatPolygon) -> np.ndarray:
    """Return the corners of sigma(P), (n, 3) in the world frame [m] [SW, Proposition 1]."""
    plane = fat.plane
    local = plane.coordinates(fat.ball.images(fat.polygon.vertices))
    local[:, :2] *= plane.sigma(fat.ball.radius)
    corners: np.ndarray = plane.foot + local @ plane.axes.T
    return corners


def draw() -> Figure:
    """Return the picture: curves on the left, surfaces on the right."""
    fat = fat_polygon()
    figure = Figure(figsize=(10.0, 4.1), layout='constrained')
    left, right = figure.subplots(1, 2)
    mesh = fat.boundary_mesh(STEPS)
    _curves(left, fat, mesh)
    _surfaces(right, mesh)
    seen = CAMERA.flat(mesh.vertices)
    low, high = seen.min(axis=0) - MARGIN, seen.max(axis=0) + MARGIN
    for axes in (left, right):
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        axes.set_aspect('equal')
        axes.set_axis_off()
    figure.legend(handles=_legend(), loc='outside lower center', ncols=4, frameon=False)
    return figure


def _curves(axes: Axes, fat: FatPolygon, mesh: Mesh) -> None:
    """Draw P, sigma(P), the arcs over and under its sides, and what is vertical between them."""
    plane, R = fat.plane, fat.ball.radius
    corners = fat.ball.images(fat.polygon.vertices)
    small = scaled(fat)
    over, under = (plane.project(R, corners, side) for side in (1.0, -1.0))
    axes.fill(*CAMERA.flat(small).T, color=FACE, alpha=0.35, lw=0.0)
    CAMERA.lines(axes, np.stack((over, under), axis=1), FAINT, 0.8, 'dotted')
    CAMERA.lines(axes, arcs(mesh, Patch.EDGE, Patch.VERTEX)[0], VERTEX, 1.6)
    CAMERA.lines(axes, arcs(mesh, Patch.FACE, Patch.EDGE)[0], OPEN, 1.6)
    CAMERA.lines(axes, np.concatenate((small, small[:1]))[None], INK, 1.0, 'dashed')
    CAMERA.lines(axes, np.concatenate((corners, corners[:1]))[None], INK, 3.0)


def _surfaces(axes: Axes, mesh: Mesh) -> None:
    """Draw the patches, and of the arcs what is seen of them."""
    CAMERA.surface(axes, mesh, [COLOURS[patch] for patch in Patch])
    seen = CAMERA.faces_eye(mesh)
    for first, second in ((Patch.EDGE, Patch.VERTEX), (Patch.FACE, Patch.EDGE)):
        sides, triangles = arcs(mesh, first, second)
        CAMERA.lines(axes, sides[seen[triangles].any(axis=1)], INK, 0.8)


def _legend() -> list[Line2D | Swatch]:
    return [
        Line2D([], [], color=INK, lw=3.0, label='polygon $P$'),
        Line2D([], [], color=INK, lw=1.0, ls='dashed', label=r'its scaled copy $\sigma(P)$'),
        Line2D([], [], color=OPEN, lw=1.6, label=r'hyperbolic arcs, over $\sigma(P)$'),
        Line2D([], [], color=VERTEX, lw=1.6, label='circular arcs'),
        Swatch(color=VERTEX, label='vertices: spheres'),
        Swatch(color=EDGE, label='edges: one-sheeted hyperboloids'),
        Swatch(color=FACE, label='face: two-sheeted hyperboloid'),
    ]
