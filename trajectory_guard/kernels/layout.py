"""The structures of ``values.hpp``, ``leaf.hpp`` and ``proof.hpp`` as Python sees them."""

import ctypes
from typing import Any, NamedTuple

import numpy as np

# Kinds of joints.
REVOLUTE = 0
PRISMATIC = 1
TRANSLATION = 2
ROTATION = 3

TERMS = 6  # coefficients of a quintic
LANES = 8

# Columns of `Solids.ranges`.
FIRST, LAST, FACE_FIRST, FACE_LAST, NODE, WHOLE, PARTS, CHILD = range(8)
# What PARTS says: nothing finer is known; two finer solids from CHILD on contain the surface;
# there are such two, but nobody has built them; a triangle of the real surface.
NO_PARTS, BUILT, UNBUILT, TRIANGLE = range(4)
# Columns of `Solids.size` [m]: ball, disc, sphere around vertices and disc, farthest point; how
# far inside the real solid a sphere's centre or a cylinder's axis and disc is.
BALL, DISC, CORE, FAR, INSIDE = range(5)
# Columns of `Floating.bounds`.
TURN_ERROR, SHIFT_ERROR, STRETCH, RIGID = range(4)
# Columns of `Solids.place`: disc normal, sphere centre, box half sides, pose of the box (12).
AXIS, CENTRE, HALF, BOX = 0, 3, 6, 9

# Sums of at most a few dozen non-negative terms, each rounded: multiply by this to round upward.
UP = 1.0 + 2.0**-44

# How a motion is built.
ECONOMISED = 0  # polynomials of degree 5 in the space of affine displacements: fast
RATIONAL = 1  # exact rational curves: audits, free bodies

# Status of a leaf; the values of `result.Status`.
FREE, SUSPECT, COLLISION = 1, 2, 3
# Why a leaf is suspect.
BY_TOLERANCE, BY_DEPTH, BY_BUDGET, BY_STOP, BY_SCOPE, BY_HULL, BY_ENCLOSURE = range(7)
# Kinds of proof entries.
BALLS_APART, PLANE_BETWEEN, PLANE_TURNING = range(3)

# The leaf [start, end] / 2^level of a segment, see ``leaf.hpp``; lengths in m.
LEAF = np.dtype(
    [(name, np.int64) for name in ('segment', 'start', 'end', 'level', 'status', 'reason')]
    + [(name, np.int64) for name in ('body', 'obstacle', 'witness')]
    + [('lower', float), ('upper', float), ('place', float, 3), ('depth', float), ('near', float)]
    + [('y0', float, 3), ('y1', float, 3)]
)
PIECE = np.dtype([('segment', np.int64), ('numerator', np.int64), ('level', np.int64)])
ENTRY = np.dtype(
    [(name, np.int64) for name in ('kind', 'piece', 'body', 'obstacle')]
    + [('n', float, 3), ('m', float, 3), ('k', float, 3), ('offset', float)]
)
# A pair of wholes that was replaced by pairs of parts on a piece.
OPENED = np.dtype(
    [(name, np.int64) for name in ('segment', 'numerator', 'level', 'body', 'obstacle')]
)
# A solid whose parts somebody should build; side 0: the links, 1: the obstacles.
WANTED = np.dtype([('side', np.int64), ('solid', np.int64)])


class Chain(NamedTuple):
    """
    The movable joints of a robot.

    :param parent: (n,) int64 node above, -1 for the root; parents come before children.
    :param kind: (n,) int64, REVOLUTE, PRISMATIC, TRANSLATION or ROTATION; a floating joint is a
        translation and below it a rotation.
    :param transform: (n, 12) rows of [R | t]: constant pose of the node, before its own motion, in
        its parent node's frame [m].
    :param depth: (n,) int64 number of rounded transforms from the root down to this node.
    """

    parent: np.ndarray
    kind: np.ndarray
    transform: np.ndarray
    depth: np.ndarray


class Solids(NamedTuple):
    """
    Convex solids conv(vertices) + disc + ball, each in its own frame (links: node frame).

    Vertices and faces of a solid are padded to whole vectors of eight with copies.

    Parts come behind all wholes. A part contains some of the surface of its whole, in as much of
    its vertices' hull as lies in its sphere, and moves with it.

    :param ranges: (B, 8) int64: FIRST:LAST vertices, FACE_FIRST:FACE_LAST faces, NODE that
        carries the solid (-1: the root), WHOLE that it is a part of (itself if of none), PARTS
        what is known of its parts, CHILD the first of two if they are BUILT.
    :param size: (B, 5): BALL radius, DISC radius, CORE radius of the sphere around vertices and
        disc, FAR the largest distance of the solid from the frame's origin, INSIDE how far inside
        the real solid each point of conv(vertices) + disc is if that is a sphere's centre or a
        cylinder (negative: rounding may have brought it outside), minus infinity if not [m].
    :param place: (B, 21): AXIS unit normal of the disc, CENTRE of the CORE sphere, HALF sides and
        pose BOX of an oriented box that contains vertices and disc [m].
    :param vertices: (3, V) [m].
    :param faces: (4, F) rows n, d: halfspaces n.x <= d of an inscribed polytope.
    """

    ranges: np.ndarray
    size: np.ndarray
    place: np.ndarray
    vertices: np.ndarray
    faces: np.ndarray


class Boxes(NamedTuple):
    """
    The oriented boxes of the obstacles in blocks of eight, and a tree of bounds over the blocks.

    :param box: (K, 17, 8) per lane: axes by columns (9), centre, half sides, ball, farthest [m].
    :param obstacle: (K, 8) int64 obstacle of each lane, -1 where there is none.
    :param bounds: (N, 6) least and largest corner of all solids below a node of the tree [m].
    :param branch: (N, 2) int64: two nodes, or -1 and a block; the root is node 0.
    """

    box: np.ndarray
    obstacle: np.ndarray
    bounds: np.ndarray
    branch: np.ndarray


class Extents(NamedTuple):
    """
    How far each body that is no part reaches; its parts do not reach farther.

    :param extent: (B,) largest distance of a body from its node's origin [m].
    :param perpendicular: (B,) the same from its node's axis [m].
    :param offsets: (B,) sum of the lengths of all joint origins down to the body [m].
    """

    extent: np.ndarray
    perpendicular: np.ndarray
    offsets: np.ndarray


class Floating(NamedTuple):
    """
    The motion of the floating joint, one rational Bezier curve of displacements per segment.

    :param first: (S + 1,) int64 first control point of each segment, and the end.
    :param control: (P, 16) displacements by columns of 4, the fourth entries zero [m].
    :param weight: (P,) positive.
    :param bounds: (S, 4): the truth is off the curve at a point x by at most SHIFT_ERROR +
        TURN_ERROR |x| [m]; the norm of the linear part is at most 1 + STRETCH; RIGID, 1 or 0: it
        is a rotation within STRETCH.
    """

    first: np.ndarray
    control: np.ndarray
    weight: np.ndarray
    bounds: np.ndarray


class Path(NamedTuple):
    """
    The joint path of a request, joints in node order.

    :param coefficients: (S, n, 6) powers of s on [0, 1] of each segment [rad or m].
    :param rounding: (S, n) bound on the error of the coefficients together [rad or m].
    :param slack: (n,) tracking tolerance [rad or m].
    :param floating: motion of the floating joint, if the robot has one.
    """

    coefficients: np.ndarray
    rounding: np.ndarray
    slack: np.ndarray
    floating: Floating | None = None


_P = ctypes.c_void_p
_I = ctypes.c_int64
_D = ctypes.c_double


def _structure(name: str, **fields: Any) -> type[ctypes.Structure]:
    return type(name, (ctypes.Structure,), {'_fields_': list(fields.items())})


_Chain = _structure('Chain', nodes=_I, parent=_P, kind=_P, transform=_P, depth=_P)
_Solids = _structure(
    'Solids',
    count=_I,
    wholes=_I,
    ranges=_P,
    size=_P,
    place=_P,
    vertices=_P,
    vertex_stride=_I,
    faces=_P,
    face_stride=_I,
)
_Boxes = _structure(
    'Boxes', blocks=_I, box=_P, obstacle=_P, nodes=_I, bounds=_P, branch=_P, far=_D
)
_Floating = _structure('Floating', first=_P, control=_P, weight=_P, bounds=_P)
PathStructure = _structure(
    'Path',
    segments=_I,
    coefficients=_P,
    rounding=_P,
    slack=_P,
    floating=ctypes.POINTER(_Floating),
)
_Extents = _structure('Extents', extent=_P, perpendicular=_P, offsets=_P)
Request = _structure(
    'Request',
    tolerance=_D,
    clearance=_D,
    max_pieces=_I,
    scope=_I,
    want_proof=_I,
    sharpen=_I,
    bodies=_P,
    body_count=_I,
)
Answer = _structure(
    'Answer',
    leaf_count=_I,
    entry_count=_I,
    piece_count=_I,
    opened_count=_I,
    wanted_count=_I,
    pieces=_I,
    seconds=_D,
    leaves=_P,
    entries=_P,
    proved_on=_P,
    opened=_P,
    wanted=_P,
)
Piece = _structure('Piece', segment=_I, numerator=_I, level=_I)


def address(array: np.ndarray) -> int:
    """Return where the first entry of a contiguous array lies; the array must outlive its use."""
    return array.__array_interface__['data'][0]


def _checked(array: np.ndarray, dtype: type) -> int:
    if array.dtype != dtype or not array.flags.c_contiguous:
        raise TypeError(f'expected a contiguous array of {dtype}, got {array.dtype}')
    return address(array)


class Packed:
    """
    Robot and scene as the kernels take them; holds the arrays that the structures point to.

    :param chain: joints.
    :param links: bodies of the robot.
    :param obstacles: bodies of the scene.
    :param boxes: their boxes.
    :param extents: how far the links reach, parts excluded.
    :raises TypeError: an array is not contiguous or has another type.
    """

    def __init__(
        self, chain: Chain, links: Solids, obstacles: Solids, boxes: Boxes, extents: Extents
    ) -> None:
        self._held = chain, links, obstacles, boxes, extents
        ints = np.int64
        self.chain = _Chain(
            len(chain.parent),
            _checked(chain.parent, ints),
            _checked(chain.kind, ints),
            _checked(chain.transform, float),
            _checked(chain.depth, ints),
        )
        self.links = _solids(links)
        self.obstacles = _solids(obstacles)
        self.boxes = _Boxes(
            len(boxes.box),
            _checked(boxes.box, float),
            _checked(boxes.obstacle, ints),
            len(boxes.bounds),
            _checked(boxes.bounds, float),
            _checked(boxes.branch, ints),
            float(obstacles.size[: self.obstacles.wholes, FAR].max()),
        )
        self.extents = _Extents(*(_checked(array, float) for array in extents))


def _solids(solids: Solids) -> ctypes.Structure:
    return _Solids(
        len(solids.ranges),
        int((solids.ranges[:, WHOLE] == np.arange(len(solids.ranges))).sum()),
        _checked(solids.ranges, np.int64),
        _checked(solids.size, float),
        _checked(solids.place, float),
        _checked(solids.vertices, float),
        solids.vertices.shape[1],
        _checked(solids.faces, float),
        solids.faces.shape[1],
    )


class KernelRefused(ValueError):
    """A path has a number that kernels cannot take; who made it can say which."""

    def __init__(self) -> None:
        super().__init__('a path is not finite, negative where it must not be, or too large')


def check(status: int) -> None:
    """
    Raise what a kernel's status says.

    :param status: 0: it did what was asked.
    :raises MemoryError: there is not enough.
    :raises KernelRefused: a path is out of range.
    """
    if status == 2:
        raise KernelRefused
    if status:
        raise MemoryError('not enough memory for the kernels')


def path_structure(path: Path) -> ctypes.Structure:
    """Return a path as the kernels take it; its arrays must outlive the structure."""
    return PathStructure(
        len(path.coefficients),
        _checked(path.coefficients, float),
        _checked(path.rounding, float),
        _checked(path.slack, float),
        None if path.floating is None else ctypes.pointer(_floating(path.floating)),
    )


def _floating(floating: Floating) -> ctypes.Structure:
    return _Floating(
        _checked(floating.first, np.int64),
        _checked(floating.control, float),
        _checked(floating.weight, float),
        _checked(floating.bounds, float),
    )
