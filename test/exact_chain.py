"""
A chain of joints in 256-bit arithmetic, and the kernels' arrays for the same chain.

The constant transforms are exactly rigid: rotations by integer quaternions, so rational. What the
kernels get is their rounding to doubles, off by as much as is asked for.
"""

from typing import NamedTuple

from flint import arb, arb_mat, ctx, fmpq, fmpq_mat
import numpy as np

from trajectory_guard.cell.pack import boxes, perpendicular, solids
from trajectory_guard.kernels import layout
from trajectory_guard.shapes.body import ConvexBody

U = 2.0**-53
ctx.prec = 256


def rational(x):
    """Return a double as a rational; a rational is one already."""
    if isinstance(x, fmpq):
        return x
    numerator, denominator = float(x).as_integer_ratio()
    return fmpq(numerator, denominator)


def ball(x):
    """Return a rational or a double as an arb ball."""
    x = rational(x)
    return arb(x.p) / arb(x.q)


def matrix(rows):
    """Return doubles as an exact matrix of balls."""
    return arb_mat([[ball(x) for x in row] for row in rows])


def length(column):
    """Return an upper bound on the length of a column."""
    square = sum((column[r, 0] * column[r, 0] for r in range(column.nrows())), arb(0))
    return square.abs_upper().sqrt().upper()


def quaternion_rotation(a, b, c, d):
    """Return the exact rotation of an integer quaternion."""
    n = a * a + b * b + c * c + d * d
    rows = [
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]
    return fmpq_mat(3, 3, [fmpq(int(x), int(n)) for row in rows for x in row])


class Chain(NamedTuple):
    """
    A chain, exactly and as the kernels take it.

    :param kinds: REVOLUTE or PRISMATIC of every node.
    :param rotations: exact rotations before each node's motion.
    :param origins: (n, 3) exact origins [m].
    :param packed: the kernels' arrays; body 0 hangs on the last node.
    :param points: (P, 3) vertices of that body [m].
    """

    kinds: np.ndarray
    rotations: list
    origins: np.ndarray
    packed: layout.Packed
    points: np.ndarray


def random_chain(rng, joints, scale, off=0.5, slides=0.25, body=0.1, length=0.3):
    """
    Return a random chain.

    :param joints: nodes.
    :param scale: of all lengths [m].
    :param off: how far the entries of the kernels' rotations may be from the exact ones, in units
        of 2^-53; 0.5 is plain rounding.
    :param slides: probability of a slide.
    :param body: size of the body over the scale.
    :param length: size of an origin over the scale.
    """
    kinds = np.where(rng.random(joints) < slides, layout.PRISMATIC, layout.REVOLUTE)
    rotations, transform = [], np.empty((joints, 12))
    origins = rng.normal(size=(joints, 3)) * length * scale
    for j in range(joints):
        R = quaternion_rotation(*(int(x) for x in rng.integers(-1000, 1001, size=4)))
        rounded = np.array([[float(ball(R[r, c])) for c in range(3)] for r in range(3)])
        if off > 0.5:
            rounded += (off - 0.5) * U * rng.choice([-1.0, 1.0], size=(3, 3))
        rotations.append(R)
        transform[j] = np.column_stack([rounded, origins[j]]).ravel()
    solid = ConvexBody(rng.normal(size=(5, 3)) * body * scale)
    far = ConvexBody(np.full((1, 3), 1e9))
    links, obstacles = solids([solid], [joints - 1]), solids([far], [-1])
    chain = layout.Chain(
        np.arange(-1, joints - 1), kinds.astype(np.int64), transform, np.arange(1, joints + 1)
    )
    extents = layout.Extents(
        np.maximum(links.size[:, layout.FAR], np.linalg.norm(solid.center)),
        np.array([perpendicular(solid)]),
        np.array([np.linalg.norm(origins, axis=1).sum() * (1.0 + 1e-15)]),
    )
    packed = layout.Packed(chain, links, obstacles, boxes(obstacles), extents)
    return Chain(kinds, rotations, origins, packed, solid.vertices)


def path_of(coefficients):
    """Return coefficients (n, 6), taken as exact, as a path of one segment."""
    n = len(coefficients)
    return layout.Path(np.ascontiguousarray(coefficients[None]), np.zeros((1, n)), np.zeros(n))


def place(numerator, level, tau):
    """Return s of a rational tau in [-1, 1] on a piece, exactly."""
    return (fmpq(2 * numerator + 1) + tau) / fmpq(2) ** (level + 1)


def true_pose(chain, coefficients, s):
    """Return rotation (3, 3) and origin (3, 1) of the last node at s, in balls."""
    R, t = arb_mat(3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1]), arb_mat(3, 1)
    for kind, fixed, origin, row in zip(
        chain.kinds, chain.rotations, chain.origins, coefficients, strict=True
    ):
        q = fmpq(0)
        for c in row[::-1]:
            q = q * s + rational(c)
        t = t + R * matrix(origin[:, None])
        R = R * arb_mat(fixed)
        if kind == layout.REVOLUTE:
            c, si = ball(q).cos(), ball(q).sin()
            R = R * arb_mat([[c, -si, 0], [si, c, 0], [0, 0, 1]])
        else:
            t = t + R * arb_mat([[0], [0], [ball(q)]])
    return R, t


def built_pose(matrices, weights, tau):
    """Return a motion's pose at a rational tau, (3, 4), in balls; weights with binomials."""
    degree = len(weights) - 1
    s = (fmpq(1) + tau) / 2
    basis = [rational(w) * s**i * (1 - s) ** (degree - i) for i, w in enumerate(weights)]
    total = sum(basis, fmpq(0))
    rows = [
        sum((b * rational(m[e]) for b, m in zip(basis, matrices, strict=True)), fmpq(0)) / total
        for e in range(12)
    ]
    return arb_mat([[ball(x) for x in rows[4 * r : 4 * r + 4]] for r in range(3)])


def off(true, built, points):
    """Return an upper bound on how far apart two poses put a point [m]."""
    R, t = true
    linear = arb_mat([[built[r, c] for c in range(3)] for r in range(3)]) - R
    shift = arb_mat([[built[r, 3]] for r in range(3)]) - t
    return max(float(length(linear * matrix(x[:, None]) + shift)) for x in points)
