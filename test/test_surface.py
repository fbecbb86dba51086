"""Surfaces of meshes: closed or open, in pieces, and where their motions bring them."""

from fractions import Fraction

from meshes import box, extruded, joined, L, ring, U, without
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajectory_guard.shapes.mesh import mesh_body
from trajectory_guard.shapes.mesh_formats import Triangles
from trajectory_guard.shapes.surface import Surface


def surface(mesh):
    """Return the surface of a mesh."""
    return mesh_body(mesh).surface


@pytest.mark.parametrize('mesh', [extruded(U), extruded(L), ring()], ids=['U', 'L', 'ring'])
def test_a_solid_that_is_not_convex_knows_its_surface(mesh):
    """Closed and wound alike, in one piece."""
    found = surface(mesh)
    assert len(found.triangles) == len(mesh.triangles)
    assert [shell.wound for shell in found.shells] == [True]
    assert len(found.pieces) == 1


def test_a_convex_solid_is_its_hull():
    """Nothing finer is known of a box; of a box with a hole there is."""
    assert surface(box((0, 0, 0), (1, 2, 3))) is None
    opened = surface(without(box((0, 0, 0), (1, 2, 3)), 4))
    assert not opened.is_watertight and not opened.shells


def test_one_triangle_cannot_be_halved():
    """A mesh of one face has no parts."""
    assert surface(Triangles(np.eye(3), np.array([[0, 1, 2]]))) is None


def test_edges_are_counted_whatever_the_winding():
    """A face turned over leaves the surface watertight, but not wound alike."""
    mesh = extruded(U)
    turned = mesh.triangles.copy()
    turned[3] = turned[3][::-1]
    found = surface(Triangles(mesh.points, turned))
    assert found.is_watertight and [shell.wound for shell in found.shells] == [False]


def repeated(mesh, faces, back):
    """Return a mesh with some of its triangles drawn again, or their backs."""
    more = mesh.triangles[faces]
    return Triangles(mesh.points, np.vstack([mesh.triangles, more[:, ::-1] if back else more]))


@pytest.mark.parametrize('back', [False, True])
@pytest.mark.parametrize('faces', [slice(None), slice(3), slice(1)], ids=['all', 'three', 'one'])
def test_what_is_drawn_twice_has_the_inside_of_what_is_drawn_once(faces, back):
    """Seen from both sides, or by mistake: each triangle counts once."""
    mesh = extruded(U)
    found = surface(repeated(mesh, faces, back))
    assert found.is_watertight
    for shell in found.shells:
        if len(shell.triangles) == len(mesh.triangles):
            assert shell.wound
            break
    else:
        pytest.fail('no shell has each triangle once')
    assert not surface(repeated(without(mesh, 5), faces, back)).is_watertight


def test_a_wall_between_two_cells_may_be_drawn_twice():
    """Once it would open the edges around it."""
    found = surface(
        joined(box((0, 0, 0), (1, 1, 1)), box((1, 0, 0), (2, 1, 1)), box((0, 1, 0), (1, 2, 1)))
    )
    assert [len(shell.triangles) for shell in found.shells] == [36]


def test_a_triangle_without_area_between_two_equal_corners_is_no_edge():
    """It neither opens nor closes anything."""
    mesh = extruded(U)
    more = np.vstack([mesh.triangles, [[0, 0, 5]]])
    assert surface(Triangles(mesh.points, more)).is_watertight
    assert not surface(without(Triangles(mesh.points, more), 2)).is_watertight


def test_pieces_that_do_not_hang_together():
    """One corner of each; shells inside of each other are pieces, too."""
    mesh = joined(box((-1, -1, -1), (1, 1, 1)), box((-0.5,) * 3, (0.5,) * 3, inward=True), ring())
    found = surface(mesh)
    assert [shell.wound for shell in found.shells] == [True]
    assert len(found.pieces) == 3
    assert len({tuple(np.abs(found.points[i]).round(1)) for i in found.pieces}) == 3


def test_motions_add_up_within_the_ball():
    """Exact images of the corners lie within the ball of the points."""
    rng = np.random.default_rng(0)
    found = surface(ring())
    exact = [[Fraction(float(x)) for x in row] for row in found.points[:20]]
    for turn in Rotation.random(4, random_state=1).as_matrix():
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = turn, rng.normal(size=3)
        R = [[Fraction(float(x)) for x in row] for row in T[:3]]
        exact = [[sum(r[c] * x[c] for c in range(3)) + r[3] for r in R] for x in exact]
        found = found.moved(T)
    points, ball, turn = found.placed
    for x, p in zip(exact, points, strict=False):
        assert sum((a - Fraction(float(b))) ** 2 for a, b in zip(x, p, strict=True)) <= ball**2
    assert 0.0 < ball < 1e-12
    assert np.abs(turn @ turn.T - np.eye(3)).max() < 1e-15
    assert found.placed is found.placed


def test_scaling_and_the_reader_count():
    """What the file may be off is in the ball of the surface."""
    mesh = Triangles(extruded(U).points, extruded(U).triangles, rounding=1e-6)
    assert surface(mesh).ball >= 1e-6
    assert mesh_body(mesh, (1000.0, 1.0, 1.0)).surface.ball >= 1e-3
    assert isinstance(surface(mesh), Surface)
