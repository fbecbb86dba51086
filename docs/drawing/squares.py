"""What each moving square costs against the fixed ones, as figures 5 and 6 of [SW]."""

from bench.listing.motions import square_motion
from bench.listing.shapes import squares
from bench.listing.squares import DISTRIBUTIONS, EPSILON, OUTCOMES
from matplotlib.colors import LightSource
from matplotlib.figure import Figure
from matplotlib.patches import Patch as Swatch
from mpl_toolkits.mplot3d.axes3d import Axes3D
import numpy as np

from drawing.palette import BODY, INK, OPEN
from trajectory_guard.toleranced.collision import Collisions, collisions
from trajectory_guard.toleranced.pair import Pair, pair_of

# Squares along a side: the paper's most.
N = 10

# From the left of the eye, so that tops and both sides differ.
LIGHT = LightSource(azdeg=270.0, altdeg=60.0)

TITLES = {
    'global': 'one mass distribution for all squares [SW, fig. 5]',
    'individual': 'one mass distribution for each square [SW, fig. 6]',
    'adapted': 'one for each square, scaled to suit each ball',
}


def draw() -> Figure:
    """Return the picture: a row a choice of distributions, a column a motion."""
    figure = Figure(figsize=(9.6, 10.2))
    all_axes = []
    heights = [1.0] * len(DISTRIBUTIONS) + [0.1]
    parts = figure.subfigures(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
    for part, (distribution, (individual, adapted)) in zip(
        parts[:-1], DISTRIBUTIONS.items(), strict=True
    ):
        part.suptitle(TITLES[distribution], y=0.99, weight='bold', size=10.0)
        part.subplots_adjust(0.03, 0.04, 0.99, 0.89, 0.1)
        row = part.subplots(1, len(OUTCOMES), subplot_kw={'projection': '3d'})
        pair = pair_of(squares(N), squares(N), individual=individual)
        for axes, (outcome, (height, *_)) in zip(row, OUTCOMES.items(), strict=True):
            found = listing(pair, height, adapted)
            _bars(axes, found)
            count = f'{found.tests_of.sum():,}'.replace(',', '\u2009')
            axes.set_title(f'{outcome}: {count} tests', y=1.0)
        all_axes += list(row)
    highest = max(axes.get_zlim()[1] for axes in all_axes)
    for axes in all_axes:
        axes.set_zlim(0.0, highest)
    parts[-1].legend(handles=_legend(), loc='center', ncols=2, frameon=False)
    return figure


def listing(pair: Pair, height: float, adapted: bool) -> Collisions:
    """
    Return the paper's listing, every pair of squares by itself.

    :param pair: of the moving and the fixed squares.
    :param height: of the lowest corner over the fixed square [m].
    :param adapted: whether distributions are scaled for each ball.
    """
    motion = square_motion(height)
    return collisions(pair, motion, epsilon=EPSILON, hierarchy=False, adapted=adapted)


def _bars(axes: Axes3D, found: Collisions) -> None:
    """Draw a bar a moving square, as high as its tests, coloured if one of its pairs is open."""
    width = 1.0 / N
    x, y = (width * places - 0.5 for places in np.divmod(np.arange(N * N), N))
    open_faces = {suspect.moving_face for suspect in found.suspect}
    colours = [OPEN if face in open_faces else BODY for face in range(N * N)]
    axes.bar3d(
        x,
        y,
        0.0,
        width,
        width,
        found.tests_of,
        color=colours,
        edgecolor=INK,
        linewidth=0.25,
        lightsource=LIGHT,
    )
    axes.view_init(elev=30.0, azim=-140.0)
    axes.set_box_aspect((1.0, 1.0, 0.8), zoom=1.0)
    axes.set(xticks=[-0.5, 0.0, 0.5], yticks=[-0.5, 0.0, 0.5], zticks=[0, 500, 1000, 1500])
    axes.tick_params(pad=0.0, labelsize=8.0)
    axes.set_xlabel('x [m]', labelpad=-4.0)
    axes.set_ylabel('y [m]', labelpad=-4.0)
    axes.text2D(0.03, 0.81, 'tests', transform=axes.transAxes)


def _legend() -> list[Swatch]:
    return [
        Swatch(color=BODY, label='moving square, proved free of all fixed ones'),
        Swatch(color=OPEN, label='no guarantee'),
    ]
