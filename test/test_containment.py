"""A point is called outside only if it is."""

from meshes import box, extruded, joined, L, ring, U
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajectory_guard.shapes.containment import may_contain
from trajectory_guard.shapes.mesh_formats import Triangles


def winding(mesh, place):
    """Return how often a closed surface winds round a point, by solid angles."""
    a, b, c = np.moveaxis(mesh.points[mesh.triangles] - place, 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    up = np.einsum('ni,ni->n', a, np.cross(b, c))
    dot = [np.einsum('ni,ni->n', x, y) for x, y in ((a, b), (b, c), (c, a))]
    down = la * lb * lc + dot[0] * lc + dot[1] * la + dot[2] * lb
    return round(2 * np.arctan2(up, down).sum() / (4 * np.pi))


def contains(mesh, place, doubt=0.0, wound=True):
    """Ask."""
    return may_contain(mesh.points, mesh.triangles, wound, np.asarray(place, float), doubt)


SHELL = joined(box((-1,) * 3, (1,) * 3), box((-0.5,) * 3, (0.5,) * 3, inward=True))
TWO = joined(box((-1,) * 3, (1,) * 3), box((0, 0, 0), (2, 2, 2)))
MESHES = {'U': extruded(U, scale=1), 'L': extruded(L, scale=1), 'ring': ring(), 'shell': SHELL}


@pytest.mark.parametrize('scale', [1e-6, 1.0, 1e6])
@pytest.mark.parametrize('name', [*MESHES, 'two'])
def test_inside_and_outside_are_told_apart(name, scale):
    """Random points, judged by solid angles, at any size and any turn."""
    mesh = {**MESHES, 'two': TWO}[name]
    turn = Rotation.random(random_state=3).as_matrix()
    mesh = Triangles(mesh.points @ turn.T * scale, mesh.triangles)
    rng = np.random.default_rng(0)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    answers = []
    for place in rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), (200, 3)):
        inside = contains(mesh, place)
        assert inside == (winding(mesh, place) != 0)
        answers.append(inside)
    assert 10 < sum(answers) < 190


def test_the_winding_counts_where_shells_overlap():
    """In the middle of two boxes a ray leaves two surfaces; it is inside nevertheless."""
    assert contains(TWO, (0.3, 0.4, 0.5))
    assert not contains(TWO, (0.3, 0.4, 0.5), wound=False)
    assert not contains(SHELL, (0.1, 0.2, 0.3))
    assert contains(SHELL, (0.1, 0.2, 0.7))


def test_what_cannot_be_told_is_inside():
    """On the surface, within the doubt of it, and where numbers are none."""
    cube = box((-1,) * 3, (1,) * 3)
    for place in ((1, 0.2, 0.3), (1, 1, 0.3), (1, 1, 1), (np.nan, 0, 0), (np.inf, 0, 0)):
        assert contains(cube, place)
    assert not contains(cube, (1.01, 0.2, 0.3))
    assert contains(cube, (1.01, 0.2, 0.3), doubt=0.02)
    assert contains(cube, (1.01, 0.2, 0.3), doubt=np.inf)
    assert contains(cube, (1.01, 0.2, 0.3), doubt=np.nan)


@pytest.mark.parametrize('name', MESHES)
def test_no_move_within_the_doubt_changes_an_outside(name):
    """Corners and place shifted by the doubt together: what was outside still is."""
    mesh = MESHES[name]
    rng = np.random.default_rng(1)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    doubt = 0.003 * (high - low).max()
    outside = 0
    for place in rng.uniform(low, high, (300, 3)):
        if contains(mesh, place, doubt):
            continue
        outside += 1
        for _ in range(5):
            shift = rng.normal(size=mesh.points.shape)
            shift *= 0.5 * doubt / np.linalg.norm(shift, axis=1, keepdims=True)
            own = rng.normal(size=3)
            own *= 0.5 * doubt / np.linalg.norm(own)
            assert winding(Triangles(mesh.points + shift, mesh.triangles), place + own) == 0
    assert outside > 20
