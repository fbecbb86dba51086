"""
The example of [Canny 1984, figure 2]: an L moves and turns uniformly among obstacles.

The paper draws the scene without coordinates; this is one of its kind.
"""

from trajectory_guard.canny import (
    Configuration,
    ConvexPolyhedron,
    Motion,
    Overlap,
    overlaps,
    straight,
)

PAPER_SECONDS = 10.0  # on a Symbolics Lisp Machine


def l_shape() -> tuple[ConvexPolyhedron, ...]:
    """Return the moving body: two boxes."""
    return (
        ConvexPolyhedron.box([-0.5, -0.5, -0.5], [2.5, 0.5, 0.5]),
        ConvexPolyhedron.box([-0.5, 0.5, -0.5], [0.5, 2.5, 0.5]),
    )


def obstacles() -> tuple[ConvexPolyhedron, ...]:
    """Return a table, a post, a wedge and a pyramid."""
    return (
        ConvexPolyhedron.box([-2.0, -3.0, -2.5], [10.0, 3.5, -2.0]),
        ConvexPolyhedron.box([1.5, 1.75, -2.0], [2.25, 2.5, 2.0]),
        ConvexPolyhedron.hull(
            [[4, -3, -2], [7, -3, -2], [4, 0, -2], [7, 0, -2], [4, -3, 0], [4, 0, 0]]
        ),
        ConvexPolyhedron.hull([[6, 1, -2], [9, 1, -2], [6, 3, -2], [9, 3, -2], [7.5, 2, 1]]),
    )


def path() -> Motion:
    """Return the straight line in (x, q): from one side to the other, by about 130 degrees."""
    return straight(
        Configuration((-2.0, 0.0, -1.25), (1.0, 0.0, 0.0, 0.0)),
        Configuration((9.5, 0.5, 0.5), (1.0, 0.5, -0.25, 2.0)),
    )


def contacts() -> tuple[Overlap, ...]:
    """Return when the L overlaps anything."""
    return overlaps(l_shape(), path(), obstacles())
