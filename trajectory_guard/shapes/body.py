"""
Convex bodies that contain what they stand for.

A body is conv(vertices) (+) disc (+) ball, (+) the Minkowski sum, so that boxes, cylinders and
spheres are exact and a mesh is its hull. Inside a body lies a second, smaller solid, an inscribed
polytope: the body proves that nothing is touched, the polytope that something is.
"""

from dataclasses import dataclass, field
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from trajectory_guard.shapes.surface import Surface

# Unit roundoff of float64.
U = 2.0**-53

# A length below this is rounding of the square root of an underflowed square, not a size [m].
UNDERFLOW = 2.0**-500

# No coordinate of a robot or a scene is larger, so that no square overflows [m].
LARGEST_COORDINATE = 1e9

# Rounding of x -> R x + t, in units of U (|x|_1 + |t|_1): entries of R are within 16 U of the
# exact rotation, the three products and three sums add 4 U, and a vector is at most sqrt(3) times
# its largest entry: sqrt(3) * 20 = 34.7; the rest covers the rounding of the bound itself.
TRANSFORM_ROUNDING = 64.0

# Rounding of a face's plane, in units of U (reach + |d|): an entry of R n errs by 16 sqrt(3) + 6
# and the normal by sqrt(3) times that, 58; making it a unit vector moves it as much again, 60;
# the offset's own sums add 8.
FACE_ROUNDING = 160.0

# The orthogonality a transform must have: what rounding can leave of an exact rotation, and a
# little; TRANSFORM_ROUNDING counts 16 U per entry, which is 3 * 2 * 16 U of R^T R.
RIGID_TOLERANCE = 128.0 * U

IDENTITY = np.eye(4)
IDENTITY.flags.writeable = False


def read_only(array: ArrayLike) -> np.ndarray:
    """Return a contiguous float64 copy that nobody can change."""
    copy = np.array(array, dtype=np.float64, order='C')
    copy.flags.writeable = False
    return copy


def rigid_defect(T: np.ndarray) -> float:
    """
    Return how far a matrix is from a rigid motion: 0 for an exact one, inf for nonsense.

    :param T: candidate, (4, 4).
    :returns: largest entry of |R^T R - I|; inf if T has another shape, another last row, a value
        that is not finite, or mirrors.
    """
    T = np.asarray(T, dtype=np.float64)
    if T.shape != (4, 4) or T[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        return math.inf
    # Written so that a NaN is nonsense, too, and no product overflows.
    if not np.abs(T).max() < 2.0**500:
        return math.inf
    defect = float(np.abs(T[:3, :3].T @ T[:3, :3] - IDENTITY[:3, :3]).max())
    (a, b, c, _), (d, e, f, _), (g, h, i, _), _ = T.tolist()
    # With a small defect the determinant is near 1 or -1.
    if not defect < 0.1:
        return math.inf
    mirrors = a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) < 0.0
    return math.inf if mirrors else defect


@dataclass(frozen=True, slots=True, eq=False)
class ConvexBody:
    """
    The closed solid conv(vertices) (+) disc (+) ball; it contains the real geometry.

    :param vertices: (n, 3), n >= 1 [m].
    :param ball: radius of the ball; rounding is counted in it [m].
    :param disc_radius: radius of the disc [m].
    :param disc_axis: unit normal of the disc, (3,); z if there is no disc.
    :param faces: rows (n, d), (m, 4): the polytope {x: n . x <= d} is bounded and lies inside the
        *real* geometry; |n| is 1 within 4 * 2^-53, d in m. No rows: nothing is known to be inside.
    :param inside: of a sphere (one vertex) or a cylinder (two and a disc): how far inside the real
        solid all of conv(vertices) + disc is, negative where rounding may have brought it out;
        minus infinity: the real solid is another [m].
    :param surface: the real geometry, if that is a mesh and the body is more.
    :raises ValueError: a value is not finite, negative, or larger than `LARGEST_COORDINATE`.
    """

    vertices: np.ndarray
    ball: float = 0.0
    disc_radius: float = 0.0
    disc_axis: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    faces: np.ndarray = field(default_factory=lambda: np.empty((0, 4)))
    inside: float = -math.inf
    surface: 'Surface | None' = field(default=None, repr=False)
    center: np.ndarray = field(init=False)
    radius: float = field(init=False)

    def __post_init__(self) -> None:
        """Check the values, make the arrays read-only and bound the solid by a sphere."""
        for name in ('vertices', 'disc_axis', 'faces'):
            object.__setattr__(self, name, read_only(getattr(self, name)))
        if self.vertices.ndim != 2 or self.vertices.shape[1] != 3 or not len(self.vertices):
            raise ValueError(f'vertices must have shape (n, 3), got {self.vertices.shape}')
        if self.faces.ndim != 2 or self.faces.shape[1] != 4 or not np.isfinite(self.faces).all():
            raise ValueError('faces must be finite and have shape (m, 4)')
        if self.disc_axis.shape != (3,) or not abs(self.disc_axis @ self.disc_axis - 1.0) < 1e-12:
            raise ValueError(f'disc_axis must be a unit vector, got {self.disc_axis}')
        # A NaN fails every comparison, so each is written to hold for the good value.
        if not np.abs(self.vertices).max() <= LARGEST_COORDINATE:
            raise ValueError(f'a vertex exceeds {LARGEST_COORDINATE:g} m or is not finite')
        for name in ('ball', 'disc_radius'):
            value = float(getattr(self, name))
            if not 0.0 <= value <= LARGEST_COORDINATE:
                raise ValueError(f'{name} must be in [0, {LARGEST_COORDINATE:g}] m, got {value}')
            object.__setattr__(self, name, value)
        if not -math.inf <= self.inside <= self.ball:
            raise ValueError(f'inside must be at most the ball {self.ball} m, got {self.inside}')
        if self.inside > -math.inf and len(self.vertices) != (2 if self.disc_radius else 1):
            raise ValueError('inside is known of spheres and cylinders only')
        center = near_center(self.vertices)
        object.__setattr__(self, 'center', read_only(center))
        object.__setattr__(self, 'radius', self._radius_about(center))

    def moved(self, T: np.ndarray) -> 'ConvexBody':
        """
        Return a body that contains the exact image of this one under a rigid motion.

        The exact motion is the one T rounds; what rounding T and applying it can do is added to
        the ball and taken from the faces.

        :param T: rigid transform, (4, 4), entries of the rotation within 16 * 2^-53 of exact [m].
        :raises ValueError: T is not rigid.
        """
        T = np.asarray(T, dtype=np.float64)
        if T.shape == (4, 4) and (T == IDENTITY).all():
            return self
        if not rigid_defect(T) <= RIGID_TOLERANCE:
            raise ValueError(f'not a rigid transform: {T.tolist()}')
        R, t = T[:3, :3], T[:3, 3]
        reach = np.abs(self.vertices).sum(axis=1).max() + np.abs(t).sum()
        rounding = TRANSFORM_ROUNDING * U * (reach + self.disc_radius)
        disc_axis = R @ self.disc_axis if self.disc_radius else self.disc_axis
        return ConvexBody(
            vertices=self.vertices @ R.T + t,
            ball=(self.ball + rounding) * (1.0 + 4.0 * U),
            disc_radius=self.disc_radius,
            disc_axis=disc_axis / np.linalg.norm(disc_axis),
            faces=self._faces_moved(R, t),
            inside=self.inside - rounding - 4.0 * U * abs(self.inside),
            surface=self.surface and self.surface.moved(read_only(T)),
        )

    def _faces_moved(self, R: np.ndarray, t: np.ndarray) -> np.ndarray:
        if not len(self.faces):
            return self.faces
        normals = self.faces[:, :3] @ R.T
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        offsets = self.faces[:, 3] + normals @ t
        # The polytope lies in the bounding sphere, so an error of a normal acts on that reach.
        reach = np.abs(t).sum() + np.abs(self.center).sum() + self.radius
        inward = FACE_ROUNDING * U * (reach + np.abs(self.faces[:, 3]))
        return np.column_stack((normals, offsets - inward))

    def _radius_about(self, center: np.ndarray) -> float:
        """
        Return the radius of a sphere about a point that contains the solid, rounded up.

        The farthest disc point from a vertex at height h along the axis and distance r off it is
        at sqrt(h^2 + (r + disc_radius)^2).
        """
        offset = self.vertices - center
        squares = np.einsum('ni,ni->n', offset, offset)
        if self.disc_radius:
            height = offset @ self.disc_axis
            # Not from the squares: their difference would lose half of the digits.
            across = np.linalg.norm(offset - np.outer(height, self.disc_axis), axis=1)
            squares = height**2 + (across + self.disc_radius) ** 2
        reach = math.sqrt(squares.max())
        # offset is within U * (|vertex| + |center|) per entry, each further step within a few U.
        scale = np.abs(self.vertices).max() + np.abs(center).max()
        rounding = 16.0 * U * (reach + scale) + UNDERFLOW
        return float((reach + self.ball + rounding) * (1.0 + 4.0 * U))


def near_center(points: np.ndarray, steps: int = 64) -> np.ndarray:
    """
    Return a point near the centre of the smallest ball that contains the points.

    Starts in the middle of the axis-aligned box and steps towards the farthest point by 1/2, 1/3,
    ... of the way, which approaches the centre like 1/steps [Badoiu, Clarkson 2003]; the best
    point seen wins. The result is a proposal, its radius is measured by the caller.

    :param points: (n, 3) [m].
    :param steps: number of steps; none are made for a box's eight corners or less.
    """
    best = center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    if len(points) <= 8:
        return best
    smallest = np.inf
    for step in range(steps):
        squares = ((points - center) ** 2).sum(axis=1)
        farthest = squares.argmax()
        if squares[farthest] < smallest:
            best, smallest = center, squares[farthest]
        center = center + (points[farthest] - center) / (step + 2)
    return best
