"""Clusters of faces: each contains its faces, both halves make the whole, leaves are triangles."""

from fractions import Fraction

from meshes import extruded, ring
from meshes import U as U_SHAPE
import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from trajectory_guard.kernels.layout import (
    BALL,
    BOX,
    BUILT,
    CENTRE,
    CHILD,
    CORE,
    FAR,
    FIRST,
    HALF,
    LAST,
    PARTS,
    TRIANGLE,
    UNBUILT,
)
from trajectory_guard.shapes import parts
from trajectory_guard.shapes.body import rigid_defect, RIGID_TOLERANCE, U
from trajectory_guard.shapes.mesh import mesh_body
from trajectory_guard.shapes.mesh_formats import Triangles
from trajectory_guard.shapes.parts import Clusters
from trajectory_guard.shapes.surface import Surface


def moved(mesh, seed=0):
    """Return a mesh's surface after a motion."""
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    T[:3, 3] = (0.3, -0.2, 5.0)
    return mesh_body(mesh).surface.moved(T)


def faces_of(clusters, surface, spans):
    """Return the corners of the faces of a span, from the tree's own order."""
    first, end = spans
    return surface.placed.points[surface.triangles[clusters._order[first:end]]]


@pytest.fixture(params=['U', 'ring', 'soup'])
def surface(request):
    """Return a small, a large and a senseless surface."""
    if request.param == 'soup':
        rng = np.random.default_rng(5)
        triangles = np.array([rng.choice(60, 3) for _ in range(200)])
        return moved(Triangles(rng.normal(size=(60, 3)), triangles))
    return moved(extruded(U_SHAPE) if request.param == 'U' else ring())


def test_every_cluster_contains_its_faces(surface):
    """In the vertices' hull, in the sphere, in the box; nothing is farther than FAR."""
    clusters = Clusters(surface)
    solids, spans = clusters.below(np.array([[0, len(surface.triangles)]]))
    for row, size, place, span in zip(
        solids.ranges, solids.size, solids.place, spans, strict=True
    ):
        corners = faces_of(clusters, surface, span).reshape(-1, 3)
        vertices = solids.vertices[:, row[FIRST] : row[LAST]].T
        assert (row[LAST] - row[FIRST]) % 8 == 0
        assert size[BALL] == surface.placed.ball
        assert (np.linalg.norm(vertices, axis=1) + size[BALL] <= size[FAR]).all()
        off = np.linalg.norm(corners - place[CENTRE : CENTRE + 3], axis=1)
        assert (off <= size[CORE]).all()
        pose = place[BOX:].reshape(3, 4)
        local = (corners - pose[:, 3]) @ pose[:, :3]
        assert (np.abs(local) <= place[HALF : HALF + 3]).all()
        if len({tuple(v) for v in vertices}) > 3 and len({tuple(c) for c in corners}) > 8:
            hull = ConvexHull(vertices, qhull_options='QJ Pp')
            height = corners @ hull.equations[:, :3].T + hull.equations[:, 3]
            assert height.max() < 1e-9


@pytest.mark.parametrize('sign', [-1.0, 1.0])
def test_a_box_contains_its_faces_however_square_its_axes_are(sign):
    """As far from a rotation as a pose may be, and that along the diagonal."""
    diagonal = np.full((3, 3), 1.0 / np.sqrt(3.0))
    frame = np.linalg.qr(diagonal + np.diag([0.0, 1.0, 2.0]))[0]
    T = np.eye(4)
    T[:3, :3] = frame + sign * 20.5 * U * np.ones((3, 3)) @ frame
    rng = np.random.default_rng(1)
    points = rng.uniform(-1e-9, 1e-9, (120, 3))
    T[:3, 3] = 1.0
    triangles = np.arange(120).reshape(-1, 3)
    assert rigid_defect(T) <= RIGID_TOLERANCE
    found = Surface(points, triangles).moved(T)
    clusters = Clusters(found)
    solids, spans = clusters.below(np.array([[0, len(triangles)]]))
    for place, row, span in zip(solids.place[:2], solids.ranges[:2], spans[:2], strict=True):
        vertices = solids.vertices[:, row[FIRST] : row[LAST]].T.tolist()
        corners = faces_of(clusters, found, span).reshape(-1, 3).tolist()
        for axis in place[BOX:].reshape(3, 4)[:, :3].T.tolist():
            heights = [height(axis, v) for v in vertices]
            for x in corners:
                assert min(heights) <= height(axis, x) <= max(heights)


def height(axis, x):
    """Return the exact product of two vectors."""
    return sum(Fraction(a) * Fraction(b) for a, b in zip(axis, x, strict=True))


def test_halves_make_the_whole_down_to_triangles(surface):
    """Each built cluster is its two children; each leaf is a triangle of the mesh, as it is."""
    count = len(surface.triangles)
    clusters = Clusters(surface)
    solids, spans = clusters.below(np.array([[0, count]]))
    assert spans[:2].ravel().tolist() == [0, count // 2, count // 2, count]
    leaves = []
    for (first, end), row in zip(spans.tolist(), solids.ranges, strict=True):
        if row[PARTS] == BUILT:
            (a, b), (c, d) = spans[row[CHILD] : row[CHILD] + 2].tolist()
            assert (a, b, d) == (first, c, end) and a < b < d
        elif row[PARTS] == TRIANGLE:
            assert end == first + 1
            leaves.append(first)
            vertices = solids.vertices[:, row[FIRST] : row[FIRST] + 3].T
            corners = faces_of(clusters, surface, (first, end))[0]
            assert {tuple(v) for v in vertices} == {tuple(c) for c in corners}
        else:
            assert row[PARTS] == UNBUILT and end > first + 1
    deep = solids.ranges[:, PARTS] == UNBUILT
    covered = len(leaves) + (spans[deep, 1] - spans[deep, 0]).sum()
    assert covered == count


def test_the_tree_does_not_depend_on_what_is_asked_for(surface, monkeypatch):
    """Level by level, or all at once, the clusters are the same to the bit."""
    whole = np.array([[0, len(surface.triangles)]])
    solids, spans = Clusters(surface).below(whole)
    at_once = {
        tuple(span): solids.vertices[:, row[FIRST] : row[LAST]].tobytes()
        for span, row in zip(spans, solids.ranges, strict=True)
    }
    monkeypatch.setattr(parts, 'LEVELS', 1)
    clusters = Clusters(surface)
    level, steps = whole, 0
    while len(level):
        some, spans = clusters.below(level[::-1])
        for span, row in zip(spans, some.ranges, strict=True):
            if tuple(span) in at_once:
                assert some.vertices[:, row[FIRST] : row[LAST]].tobytes() == at_once[tuple(span)]
                steps += 1
        level = spans[some.ranges[:, PARTS] == UNBUILT]
    assert steps == len(at_once)
