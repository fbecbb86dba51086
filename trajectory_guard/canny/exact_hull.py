"""The convex hull of points, exact: gift wrapping over the integers."""

from trajectory_guard.canny.integers import cross, dot, minus

Point = list[int]


def exact_hull(points: list[Point]) -> list[list[int]]:
    """
    Return the faces of the hull, each with its corners counter-clockwise from outside.

    A plane that rests on the points is turned about an edge of the hull until it meets another
    point; all points that it then holds make one face, so coplanar points need no special case.
    Points inside faces and edges are no corners of any face.

    :param points: (n, 3), no two equal.
    :returns: no faces if the points lie in one plane.
    """
    faces: list[list[int]] = []
    waiting: list[tuple[int, int]] = []
    seen: set[tuple[int, int]] = set()
    face = _first_face(points)
    while face is not None:
        faces.append(face)
        edges = list(zip(face, face[1:] + face[:1], strict=True))
        seen.update(edges)
        waiting.extend((b, a) for a, b in edges)
        face = None
        while waiting and face is None:
            a, b = waiting.pop()
            if (a, b) not in seen:
                face = _face(points, *_pivot(points, points[a], points[b]))
    return faces if len(faces) > 3 else []


def _first_face(points: list[Point]) -> list[int] | None:
    """
    Return a face at the first point in lexicographic order.

    All points lie on one side of the plane through it normal to x, and those in the plane on one
    side of the line through it along z: that line can be turned about.
    """
    start = min(points)
    normal, on = _pivot(points, start, [start[0], start[1], start[2] + 1])
    face = _face(points, normal, on)
    if face is None and on:
        farthest = max((points[i] for i in on), key=lambda p: (p != start, p))
        face = _face(points, *_pivot(points, start, farthest))
    return face


def _pivot(points: list[Point], a: Point, b: Point) -> tuple[Point, list[int]]:
    """
    Turn a plane about a line that touches the hull.

    :returns: outward normal of the plane that all points lie below or on, and the points on it.
    """
    along = minus(b, a)
    normal = [0, 0, 0]
    for p in points:
        towards = minus(p, a)
        if not any(normal) or dot(normal, towards) > 0:
            normal = cross(along, towards)
    return normal, [i for i, p in enumerate(points) if dot(normal, minus(p, a)) == 0]


def _face(points: list[Point], normal: Point, on: list[int]) -> list[int] | None:
    """Return the hull of the points of a plane, counter-clockwise; None if they are collinear."""
    drop = max(range(3), key=lambda k: abs(normal[k]))
    x, y = (drop + 1) % 3, (drop + 2) % 3
    if normal[drop] < 0:
        x, y = y, x
    order = sorted(on, key=lambda i: (points[i][x], points[i][y]))
    chains = [_chain(points, row, x, y) for row in (order, order[::-1])]
    corners = chains[0][:-1] + chains[1][:-1]
    return corners if any(normal) and len(corners) > 2 else None


def _chain(points: list[Point], order: list[int], x: int, y: int) -> list[int]:
    """Return the points of a sorted row at which a path along its right side turns left."""
    chain: list[int] = []
    for i in order:
        p = points[i]
        while len(chain) > 1:
            a, b = points[chain[-2]], points[chain[-1]]
            if (b[x] - a[x]) * (p[y] - a[y]) - (b[y] - a[y]) * (p[x] - a[x]) > 0:
                break
            chain.pop()
        chain.append(i)
    return chain
