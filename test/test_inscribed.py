"""The inscribed polytope lies inside the solid, and there is none where that is not proved."""

import numpy as np
import pytest
import trimesh

from trajectory_guard.shapes.hull import convex_hull
from trajectory_guard.shapes.inscribed import inscribed_polytope, is_closed, winding_number

TURN = trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.6, 0.9]))


def faces_of(mesh: trimesh.Trimesh, rounding: float = 0.0) -> np.ndarray:
    points, inverse = np.unique(mesh.vertices, axis=0, return_inverse=True)
    triangles = inverse.reshape(-1)[mesh.faces]
    return inscribed_polytope(points, triangles, convex_hull(points), rounding)


def turned(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return mesh.copy().apply_transform(TURN)


BOX = trimesh.creation.box((1.0, 0.5, 0.1))
CONVEX = {
    'box': BOX,
    'turned box': turned(BOX),
    'far box': turned(BOX).apply_translation((100.0, -50.0, 3.0)),
    'cylinder': turned(trimesh.creation.cylinder(radius=0.1, height=0.4, sections=64)),
    'icosphere': trimesh.creation.icosphere(subdivisions=3),
    'uv sphere': turned(trimesh.creation.uv_sphere(count=(16, 16))),
    'cone': turned(trimesh.creation.cone(radius=1.0, height=1.0)),
    'plate': turned(trimesh.creation.box((1.0, 1.0, 0.001))),
    'cloud': trimesh.convex.convex_hull(np.random.default_rng(1).normal(size=(200, 3))),
    'subdivided box': turned(BOX).subdivide().subdivide(),
}


@pytest.mark.parametrize('mesh', CONVEX.values(), ids=CONVEX.keys())
def test_the_polytope_is_inside_a_convex_solid_and_fills_it(mesh: trimesh.Trimesh) -> None:
    faces = faces_of(mesh)
    normals, offsets = faces[:, :3], faces[:, 3]
    assert np.abs(np.linalg.norm(normals, axis=1) - 1.0).max() < 4.5e-16
    size = np.abs(mesh.vertices).max()
    # All corners are outside or on it, and it reaches all faces.
    heights = mesh.vertices @ normals.T - offsets
    assert (heights.max(axis=1) > 0.0).all()
    assert np.abs(heights.max(axis=0)).max() < 1e-9 * size
    low, high = mesh.bounds
    x = np.random.default_rng(2).uniform(low, high, size=(2000, 3))
    inside = (x @ normals.T < offsets).all(axis=1)
    n, origin = mesh.face_normals, mesh.triangles[:, 0]
    truth = ((x @ n.T - (n * origin).sum(axis=1)) < 0.0).all(axis=1)
    assert not (inside & ~truth).any()
    assert (inside == truth).mean() > 0.999


def test_coplanar_triangles_share_a_face() -> None:
    assert len(faces_of(CONVEX['box'])) == 6
    assert len(faces_of(CONVEX['subdivided box'])) == 6


def test_the_winding_may_be_either_way_round() -> None:
    inverted = turned(BOX)
    inverted.invert()
    assert np.array_equal(faces_of(inverted), faces_of(turned(BOX)))
    mirrored = BOX.copy().apply_transform(np.diag([1.0, -1.0, 1.0, 1.0]))
    assert len(faces_of(mirrored)) == 6


def test_rounding_is_taken_from_every_face() -> None:
    exact, rounded = faces_of(BOX), faces_of(BOX, rounding=1e-3)
    assert np.allclose(exact[:, 3] - rounded[:, 3], 2e-3, atol=1e-12)
    assert not len(faces_of(BOX, rounding=0.05))


def without_a_triangle(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[1:], process=False)


def one_turned_over(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    faces = mesh.faces.copy()
    faces[0] = faces[0, ::-1]
    return trimesh.Trimesh(mesh.vertices, faces, process=False)


def together(*meshes: trimesh.Trimesh) -> trimesh.Trimesh:
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    return trimesh.Trimesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([m.faces + k for m, k in zip(meshes, offsets, strict=False)]),
        process=False,
    )


def hollow(mesh: trimesh.Trimesh, inner: float) -> trimesh.Trimesh:
    cavity = mesh.copy().apply_scale(inner)
    cavity.invert()
    return together(mesh, cavity)


BALL = trimesh.creation.icosphere(subdivisions=2)
L_SHAPE = together(
    trimesh.creation.box((1.0, 0.1, 0.1)),
    trimesh.creation.box((0.1, 1.0, 0.1)).apply_translation((0.45, 0.55, 0.0)),
)


@pytest.mark.parametrize(
    'mesh',
    [
        without_a_triangle(BOX),
        without_a_triangle(BALL),
        one_turned_over(BALL),
        hollow(BALL, 0.3),
        hollow(BALL, 0.9),
        hollow(BOX, 0.99),
        L_SHAPE,
        trimesh.creation.torus(major_radius=1.0, minor_radius=0.2),
        trimesh.creation.annulus(r_min=0.1, r_max=1.0, height=1.0),
        trimesh.Trimesh(BOX.vertices, [[0, 1, 2], [2, 1, 0]], process=False),
        trimesh.Trimesh(BOX.vertices * [1.0, 1.0, 0.0], BOX.faces, process=False),
    ],
)
def test_no_faces_for_what_is_no_convex_solid(mesh: trimesh.Trimesh) -> None:
    assert faces_of(mesh).shape == (0, 4)


def solid_angles(mesh: trimesh.Trimesh, x: np.ndarray) -> np.ndarray:
    """Return the solid angle under which each point sees the surface: 4 pi inside, 0 outside."""
    a, b, c = np.moveaxis(mesh.triangles[None] - x[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=-1)
    ab, bc, ca = ((u * v).sum(axis=-1) for u, v in ((a, b), (b, c), (c, a)))
    return 2.0 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb).sum(axis=-1)


def test_a_dent_pushes_the_polytope_inwards() -> None:
    dented = BALL.copy()
    vertices = dented.vertices.copy()
    vertices[0] *= 0.97
    dented.vertices = vertices
    faces = faces_of(dented)
    x = np.random.default_rng(3).uniform(-1.0, 1.0, size=(3000, 3))
    inside = (x @ faces[:, :3].T < faces[:, 3]).all(axis=1)
    assert 0.3 < inside.mean() / 0.52 < 1.0
    assert np.abs(solid_angles(dented, x[inside]) - 4.0 * np.pi).max() < 1e-6


def test_a_tiny_dent_is_no_reason_to_say_nothing() -> None:
    noisy = BALL.vertices * (1.0 + 1e-6 * np.random.default_rng(4).normal(size=(162, 1)))
    mesh = trimesh.Trimesh(noisy, BALL.faces, process=False)
    faces = faces_of(mesh)
    assert len(faces)
    assert faces[:, 3].min() > 0.9


def test_closed_means_every_edge_in_both_directions() -> None:
    assert is_closed(BOX.faces, len(BOX.vertices))
    assert is_closed(np.concatenate((BOX.faces, BOX.faces)), len(BOX.vertices))
    assert not is_closed(BOX.faces[1:], len(BOX.vertices))
    assert not is_closed(one_turned_over(BOX).faces, len(BOX.vertices))


@pytest.mark.parametrize(
    ('mesh', 'number'),
    [
        (BALL, 1),
        (turned(BOX), 1),
        (BALL.copy().apply_translation((1.5, 0.2, 0.1)), 0),
        (hollow(BALL, 0.5), 0),
        (together(BALL, turned(BALL).apply_scale(0.5)), 2),
        (trimesh.creation.torus(major_radius=1.0, minor_radius=0.2), 0),
        (
            trimesh.creation.torus(major_radius=1.0, minor_radius=0.2).apply_translation(
                (1.01, 0.02, 0.03)
            ),
            1,
        ),
    ],
)
def test_winding_numbers(mesh: trimesh.Trimesh, number: int) -> None:
    assert winding_number(mesh.triangles) == number
    assert winding_number(mesh.triangles[:, ::-1]) == -number


@pytest.mark.parametrize('place', ['corner', 'edge', 'face'])
def test_a_winding_number_on_the_surface_is_not_told(place: str) -> None:
    triangle = BALL.triangles[5]
    point = {'corner': triangle[0], 'edge': triangle[:2].mean(axis=0), 'face': triangle.mean(0)}
    assert winding_number(BALL.triangles - point[place]) == 0
