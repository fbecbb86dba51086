"""Boxes, cylinders and spheres as exact bodies with inscribed polytopes."""

from dataclasses import dataclass
from functools import cache
from itertools import combinations, product
import math

import numpy as np

from trajectory_guard.cell.robot import Loaded
from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.shapes.body import ConvexBody, LARGEST_COORDINATE, read_only, U

# Sides of the prism inside a cylinder; its flats are at 99.1 % of the radius.
PRISM_SIDES = 24

# Subdivisions of the icosahedron whose directions bound the polytope inside a sphere: 162 faces,
# at 98.3 % of the radius.
SPHERE_SUBDIVISIONS = 2

# Relative shrinking of the curved inscribed polytopes: far above the rounding of their normals.
INWARD = 1e-12

# Of the box from -1 to 1.
BOX_CORNERS = read_only(list(product((-1.0, 1.0), repeat=3)))
BOX_NORMALS = read_only(np.concatenate((np.eye(3), -np.eye(3))))


@dataclass(frozen=True, slots=True)
class Box:
    """A box centred in its frame; `size` is its extent along x, y, z [m]."""

    size: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Refuse sizes that are no lengths."""
        for value in self.size:
            _check_length('box size', value)

    def load(self) -> Loaded:
        """Return the eight corners; the faces are exact."""
        half = np.array(self.size) * 0.5
        faces = np.column_stack((BOX_NORMALS, np.tile(half, 2)))
        return Loaded(ConvexBody(BOX_CORNERS * half, faces=faces), '')


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder about z, centred in its frame [m]."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        """Refuse sizes that are no lengths."""
        _check_length('cylinder radius', self.radius)
        _check_length('cylinder length', self.length)

    def load(self) -> Loaded:
        """Return axis plus disc; the faces are those of an inscribed prism."""
        half = 0.5 * self.length
        angle = 2.0 * math.pi / PRISM_SIDES * np.arange(PRISM_SIDES)
        faces = np.zeros((PRISM_SIDES + 2, 4))
        faces[:-2, 0], faces[:-2, 1] = np.cos(angle), np.sin(angle)
        faces[:-2, 3] = self.radius * math.cos(math.pi / PRISM_SIDES) * (1.0 - INWARD)
        faces[-2:, 2], faces[-2:, 3] = (1.0, -1.0), half
        ends = np.array([[0.0, 0.0, -half], [0.0, 0.0, half]])
        return Loaded(ConvexBody(ends, disc_radius=self.radius, faces=faces, inside=0.0), '')


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere centred in its frame [m]."""

    radius: float

    def __post_init__(self) -> None:
        """Refuse sizes that are no lengths."""
        _check_length('sphere radius', self.radius)

    def load(self) -> Loaded:
        """Return point plus ball; the faces are those of an inscribed polytope."""
        directions, inradius = sphere_directions()
        faces = np.column_stack((directions, np.full(len(directions), self.radius * inradius)))
        body = ConvexBody(np.zeros((1, 3)), ball=self.radius, faces=faces, inside=self.radius)
        return Loaded(body, '')


@cache
def sphere_directions() -> tuple[np.ndarray, float]:
    """
    Return unit normals of a polytope inside the unit ball, and the distance of its faces.

    With directions n_i whose convex hull contains a ball of radius r, every unit x has some
    n_i . x >= r. So {x: n_i . x <= r for all i} lies inside the unit ball. The triangles between
    the directions enclose the middle, and the nearest of their planes has a distance of r.

    :returns: normals (m, 3) and r, rounded down.
    """
    golden = 0.5 + math.sqrt(1.25)
    corners = [(0.0, a, b * golden) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    points = np.array([np.roll(corner, k) for corner in corners for k in range(3)])
    # Neighbours on the icosahedron are 2 apart, others at least twice the golden ratio.
    near = np.linalg.norm(points[:, None] - points, axis=2) < 2.5
    triangles = np.array(
        [t for t in combinations(range(12), 3) if all(near[i, j] for i, j in combinations(t, 2))]
    )
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    for _ in range(SPHERE_SUBDIVISIONS):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
        edges, middle = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        middles = points[edges].sum(axis=1)
        middles /= np.linalg.norm(middles, axis=1, keepdims=True)
        a, b, c = triangles.T
        ab, bc, ca = middle.reshape(-1, 3).T + len(points)
        triangles = np.concatenate(
            [np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
        points = np.concatenate((points, middles))
    p, q, r = np.moveaxis(points[triangles], 1, 0)
    normals = np.cross(q - p, r - p)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    inradius = np.abs(np.einsum('ni,ni->n', normals, p)).min()
    return read_only(points), float(inradius * (1.0 - INWARD))


def _check_length(name: str, value: float) -> None:
    if not U < value <= LARGEST_COORDINATE:
        raise RobotError(
            Reason.ROBOT_INVALID,
            f'{name} must lie in ({U:.1g}, {LARGEST_COORDINATE:g}] m, got {value!r}',
        )
