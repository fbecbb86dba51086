"""The pictures of the docs: the script draws them, and what they show is what the library says."""

import os
from pathlib import Path
import re
import subprocess
import sys

from matplotlib.colors import to_rgb
import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

ROOT = Path(__file__).parent.parent
DOCS = ROOT / 'docs'
PAGE = (DOCS / 'toleranced_motions.md').read_text(encoding='utf-8')
sys.path[:0] = [str(DOCS), str(ROOT / 'benchmarks')]

from drawing import fat_polygon, shrinking_cover, squares  # noqa: E402
from drawing.arcs import arcs  # noqa: E402
from drawing.palette import OPEN  # noqa: E402

from trajectory_guard.motions.link_motion import rational_motion  # noqa: E402
from trajectory_guard.toleranced.minimum_ellipsoid import least_distortion  # noqa: E402
from trajectory_guard.toleranced.patches import Patch  # noqa: E402

# What rounding adds to lengths of about a metre [m].
ROUNDING = 1e-9
LARGEST_FILE = 200_000


def run(*command):
    """Run Python on this tree's code, whatever is installed."""
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get('PYTHONPATH')])])
    return subprocess.run(
        [sys.executable, *command],
        cwd=ROOT,
        env={**os.environ, 'PYTHONPATH': path},
        capture_output=True,
        text=True,
        check=False,
    )


def test_script_draws_the_pictures_of_the_page(tmp_path):
    """Small ones; each has more than a background, and a committed twin of the same shape."""
    done = run(str(DOCS / 'pictures.py'), '--out', str(tmp_path / 'new'), '--dpi', '24')
    assert done.returncode == 0, done.stderr
    shown = re.findall(r'\(pictures/(\w+\.png)\)', PAGE)
    assert sorted(path.name for path in (tmp_path / 'new').iterdir()) == sorted(shown)
    assert sorted(path.name for path in (DOCS / 'pictures').iterdir()) == sorted(shown)
    for name in shown:
        committed = DOCS / 'pictures' / name
        assert committed.stat().st_size < LARGEST_FILE
        with Image.open(tmp_path / 'new' / name) as new, Image.open(committed) as old:
            assert len(np.unique(np.array(new))) > 20
            assert np.allclose(np.array(old.size) / new.size, 120 / 24, rtol=0.02)


def test_bad_resolution_is_refused(tmp_path):
    """The message names the option, and nothing is drawn."""
    done = run(str(DOCS / 'pictures.py'), '--out', str(tmp_path / 'new'), '--dpi', '0')
    assert done.returncode == 2
    assert '--dpi must be positive, got 0' in done.stderr
    assert not (tmp_path / 'new').exists()


def test_example_of_the_page_runs():
    """It prints what the page says it does."""
    (code,) = re.findall(r'```python\n(.*?)```', PAGE, re.DOTALL)
    done = run('-c', code)
    assert done.returncode == 0, done.stderr
    (promised,) = re.findall(r'prints `(.*?)`', PAGE)
    assert done.stdout.strip() == promised


def test_surface_drawn_is_the_fat_polygons_mesh():
    """Every triangle on the right is one of the boundary mesh that is turned to the eye."""
    mesh = fat_polygon.fat_polygon().boundary_mesh(fat_polygon.STEPS)
    camera = fat_polygon.CAMERA
    drawn = fat_polygon.draw().axes[1].collections[0].get_paths()
    triangles = camera.flat(mesh.vertices[mesh.triangles[camera.faces_eye(mesh)]])
    assert len(drawn) == len(triangles) > 1000
    corners = np.array([path.vertices[:3] for path in drawn])
    distances, _ = cKDTree(triangles.reshape(-1, 6)).query(corners.reshape(-1, 6))
    assert distances.max() < ROUNDING


def test_arcs_are_over_the_scaled_polygon_and_on_the_spheres():
    """Hyperbolic arcs stand upright over the sides of sigma(P), circular ones lie on spheres."""
    fat = fat_polygon.fat_polygon()
    steps = fat_polygon.STEPS
    mesh = fat.boundary_mesh(steps)
    n = len(fat.polygon.vertices)
    hyperbolic, _ = arcs(mesh, Patch.FACE, Patch.EDGE)
    assert len(hyperbolic) == 2 * n * steps
    corners = fat_polygon.scaled(fat)[:, :2]
    ends = np.roll(corners, -1, axis=0) - corners
    away = hyperbolic[:, :, None, :2] - corners
    lengths = np.linalg.norm(ends, axis=1)
    off = np.abs(away[..., 0] * ends[:, 1] - away[..., 1] * ends[:, 0]) / lengths
    assert (off.min(axis=2) < ROUNDING).all()
    circular, _ = arcs(mesh, Patch.EDGE, Patch.VERTEX)
    assert len(circular) == 2 * n * 4 * steps
    radii = fat.ball.radius * fat.ball.distribution.rho(fat.polygon.vertices)
    distances = np.linalg.norm(circular[:, :, None] - fat.polygon.vertices, axis=-1)
    assert (np.abs(distances - radii).min(axis=2) < ROUNDING).all()


def test_cover_contains_the_link_and_shrinks():
    """At instants of each piece each sample is in its ball; half the piece, half the radius."""
    moved = shrinking_cover.link()
    metric = least_distortion(moved.vertices)
    widest = []
    for level in shrinking_cover.LEVELS:
        covers = shrinking_cover.covers(moved, metric, level)
        assert len(covers) == 2**level
        for numerator, cover in enumerate(covers):
            whole = rational_motion(moved.workcell, moved.path, moved.body, 0, numerator, level)
            middle = whole.pose(0.5)
            R = max(metric.distance(point, middle) for point in whole.control_points)
            expected = R * metric.rho(moved.samples) + whole.error
            assert np.abs(cover.radii - expected).max() < ROUNDING
            fine = level + 3
            for k in range(8 * numerator, 8 * numerator + 8):
                piece = rational_motion(moved.workcell, moved.path, moved.body, 0, k, fine)
                pose = piece.pose(0.3)
                at = moved.samples @ pose[:, :3].T + pose[:, 3]
                off = np.linalg.norm(at - cover.centers, axis=1)
                assert (off <= cover.radii + piece.error + ROUNDING).all()
        widest.append(max(cover.radii.max() for cover in covers))
    ratios = np.array(widest[:-1]) / widest[1:]
    assert (ratios > 1.9).all()
    assert (ratios < 2.1).all()


def test_poses_drawn_as_true_are_true():
    """Their error is below a micrometre, a thousandth of a dot."""
    moved = shrinking_cover.link()
    level = shrinking_cover.TRUE_LEVEL
    for k in range(2**level):
        motion = rational_motion(moved.workcell, moved.path, moved.body, 0, k, level)
        assert motion.error < 1e-6
    assert len(shrinking_cover.true_poses(moved)) == 2**level + 1


def test_only_a_collision_has_coloured_squares():
    """Titles carry the sums of the tests; the page's percentages are theirs."""
    axes = [axis for part in squares.draw().subfigs for axis in part.axes]
    assert len(axes) == 9
    sums = {}
    for axis in axes:
        outcome, tests = axis.get_title().split(': ')
        sums.setdefault(outcome, []).append(int(re.sub(r'\D', '', tests)))
        colours = axis.collections[0].get_facecolor()[:, :3]
        coloured = colours[:, 0] > colours[:, 2] * 1.5
        assert to_rgb(OPEN)[0] > to_rgb(OPEN)[2] * 1.5
        assert coloured.any() == (outcome == 'collision')
        assert not coloured.all()
    for whole, individual, adapted in sums.values():
        assert 1.0 < individual / whole < 1.12
        assert 0.45 < adapted / individual < 0.55
