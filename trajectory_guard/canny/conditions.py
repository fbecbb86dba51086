"""
When two convex polyhedra overlap, from the signs of their constraints [Canny 1984, sec. 4].

Bodies are closed: touching is overlap. Two convex polyhedra meet if and only if one of these
holds:

    (i)   a vertex of B lies in A                                   (8)
    (ii)  a vertex of A lies in B                                   (9)
    (iii) an edge of A meets a face of B                            (12)
    (iv)  an edge of B meets a face of A                            (13)

because a vertex of the polytope A n B is the meet of three face planes: of three of A and none of
B it is a vertex of A in B, of two and one it lies on an edge of A and a face of B, and so on.

**Closed signs.** An edge whose ends lie weakly on either side of a face's plane, but not both in
it, meets the plane in one point, and the weak signs of its type-C values say whether that point
lies in the closed face. With both ends in the plane all those values are 0 and say nothing, so
that case is left out (the paper does not speak of it). Nothing is lost: an edge i of A in the
plane of a face j that meets j has an end in it, which is (ii), or meets an edge k of j. The other
face j' at k then has a plane that i crosses in that point, unless i lies in that plane, too; but
then i and k are parallel and overlap, and an end of one lies in the other, which is (i) or (ii).
(Faces j' in the plane of j are passed over to the next edge.)

**Planning.** On a path that starts free, the first contact is a vertex of one in a face of the
other or a crossing of two edges. Each is in (iii) or (iv), if an edge that ends in the vertex is
taken; and (i) + (iii) suffice, because a vertex of B in a face of A is (i), and the two other
cases are edges of A that meet faces of B; likewise (ii) + (iv). Deep inside of a containment a
pair may be false, so it is no test for overlap.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from trajectory_guard.canny.polyhedron import ConvexPolyhedron
from trajectory_guard.canny.signs import Signs
from trajectory_guard.canny.transitions import all_of, any_of, both, either, Transitions


@dataclass(frozen=True, slots=True, eq=False)
class Constraints:
    """
    The signs of all constraints of a pair along a path.

    :param body_a: A.
    :param body_b: B.
    :param a: (F_A, V_B), positive where the vertex lies outside of the face.
    :param b: (V_A, F_B), the same.
    :param c: (E_A, E_B).
    """

    body_a: ConvexPolyhedron
    body_b: ConvexPolyhedron
    a: list[list[Signs]]
    b: list[list[Signs]]
    c: list[list[Signs]]

    def swapped(self) -> 'Constraints':
        """Return the same with A and B in each other's place."""
        b, a, c = (list(map(list, zip(*rows, strict=True))) for rows in (self.a, self.b, self.c))
        return Constraints(self.body_b, self.body_a, a, b, c)


def vertex_of_b_in_a(signs: Constraints) -> Transitions:
    """Return where (i) holds: (8), the union over vertices of B."""
    return any_of(
        all_of(row.not_above() for row in column) for column in zip(*signs.a, strict=True)
    )


def vertex_of_a_in_b(signs: Constraints) -> Transitions:
    """Return where (ii) holds: (9), the union over vertices of A."""
    return any_of(all_of(one.not_above() for one in row) for row in signs.b)


def edge_of_a_meets_b(signs: Constraints) -> Transitions:
    """Return where (iii) holds: (12), the union over edges of A and faces of B."""
    return any_of(
        edge_meets_face(signs, i, j)
        for i in range(len(signs.body_a.edges))
        for j in range(len(signs.body_b.faces))
    )


def edge_of_b_meets_a(signs: Constraints) -> Transitions:
    """Return where (iv) holds: (13), the union over edges of B and faces of A."""
    return edge_of_a_meets_b(signs.swapped())


def overlap(signs: Constraints) -> Transitions:
    """Return where the bodies have a point in common."""
    return any_of((blocked_a(signs), blocked_b(signs)))


def boundaries_meet(signs: Constraints) -> Transitions:
    """Return where (iii) or (iv) holds: overlap, but not one wholly inside of the other."""
    return either(edge_of_a_meets_b(signs), edge_of_b_meets_a(signs))


def blocked_a(signs: Constraints) -> Transitions:
    """Return where (i) or (iii) holds; it is entered on every way from free to overlap."""
    return either(vertex_of_b_in_a(signs), edge_of_a_meets_b(signs))


def blocked_b(signs: Constraints) -> Transitions:
    """Return where (ii) or (iv) holds; it is entered on every way from free to overlap."""
    return either(vertex_of_a_in_b(signs), edge_of_b_meets_a(signs))


def edge_meets_face(signs: Constraints, i: int, j: int) -> Transitions:
    """Return where edge i of A meets the closed face j of B, unless it lies in its plane."""
    tail, head = (signs.b[v][j] for v in signs.body_a.edges[i].tolist())
    return either(
        all_of(_through(tail, head, _bounding(signs, i, j))),
        all_of(_through(head, tail, (one.flipped() for one in _bounding(signs, i, j)))),
    )


def _bounding(signs: Constraints, i: int, j: int) -> Iterator[Signs]:
    """Yield the type-C signs of edge i of A with the edges of face j, counter-clockwise."""
    for k, way in signs.body_b.face_edges[j]:
        yield signs.c[i][k] if way > 0 else signs.c[i][k].flipped()


def _through(below: Signs, above: Signs, sides: Iterator[Signs]) -> Iterator[Transitions]:
    """Yield the sets whose conjunction is (10): one end below, one above, all sides inside."""
    yield both(below.not_above(), above.not_below())
    yield either(below.nonzero(), above.nonzero())
    for side in sides:
        yield side.not_below()
