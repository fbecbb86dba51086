"""An independent exact judge of overlap: rational poses, separating axes in integers."""

from fractions import Fraction
import itertools
import math

from trajectory_guard.canny import Configuration, ConvexPolyhedron, Motion, recentred


def cross(a, b):
    """Return a x b."""
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def dot(a, b):
    """Return a . b."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def minus(a, b):
    """Return a - b."""
    return [x - y for x, y in zip(a, b, strict=True)]


def bezier(coefficients, s):
    """Return a curve's point at s, exactly."""
    rows = [[Fraction(x) for x in row] for row in coefficients.tolist()]
    while len(rows) > 1:
        rows = [
            [(1 - s) * x + s * y for x, y in zip(a, b, strict=True)]
            for a, b in itertools.pairwise(rows)
        ]
    return rows[0]


def rotated(y, Q):
    """Return R y = ((q0^2 - q.q) y + 2 (q.y) q + 2 q0 q x y) / |Q|^2."""
    q0, q = Q[0], Q[1:]
    turn = cross(q, y)
    return [
        ((q0 * q0 - dot(q, q)) * y[i] + 2 * dot(q, y) * q[i] + 2 * q0 * turn[i]) / dot(Q, Q)
        for i in range(3)
    ]


def placed(body, motion, s):
    """Return the vertices at s, exactly."""
    s = Fraction(s)
    x, Q = bezier(motion.positions, s), bezier(motion.quaternions, s)
    points = [[Fraction(c) for c in p] for p in body.vertices.tolist()]
    return [[a + b for a, b in zip(rotated(p, Q), x, strict=True)] for p in points]


def integers(*clouds):
    """Return points times one number that makes all of them integers."""
    factor = math.lcm(*(x.denominator for points in clouds for p in points for x in p))
    return [[[int(x * factor) for x in p] for p in points] for points in clouds]


def axes(body, points):
    """Return the normals of faces and the directions of edges."""
    normals = [
        cross(minus(points[f[1]], points[f[0]]), minus(points[f[2]], points[f[0]]))
        for f in body.faces
    ]
    return normals, [minus(points[b], points[a]) for a, b in body.edges.tolist()]


def apart(a, motion_a, b, motion_b, s):
    """Say whether two closed polyhedra have no point in common at s, by separating axes."""
    p, q = integers(placed(a, motion_a, s), placed(b, motion_b, s))
    (n_a, e_a), (n_b, e_b) = axes(a, p), axes(b, q)
    for n in itertools.chain(n_a, n_b, (cross(x, y) for x in e_a for y in e_b)):
        of_p, of_q = [dot(n, x) for x in p], [dot(n, x) for x in q]
        if max(of_p) < min(of_q) or max(of_q) < min(of_p):
            return True
    return False


def configuration(rng, spread=1.5):
    """Return a random configuration."""
    return Configuration(rng.normal(size=3) * spread, rng.normal(size=4))


def random_motion(rng, spread=1.5):
    """Return a random line."""
    return recentred(configuration(rng, spread), configuration(rng, spread))


def random_curve(rng, degree_x, degree_q):
    """Return a random motion of higher degree that stays near the identity."""
    quaternions = rng.normal(size=(degree_q + 1, 4)) * 0.4 + [1.0, 0.0, 0.0, 0.0]
    return Motion(rng.normal(size=(degree_x + 1, 3)) * 1.5, quaternions)


def random_body(rng, kind):
    """Return a random box, tetrahedron or hull."""
    if kind == 'box':
        return ConvexPolyhedron.box(-rng.uniform(0.2, 1.0, 3), rng.uniform(0.2, 1.0, 3))
    return ConvexPolyhedron.hull(rng.normal(size=(4 if kind == 'tetrahedron' else 9, 3)) * 0.7)


def scaled(body, factor):
    """Return a body of other size."""
    return ConvexPolyhedron(body.vertices * factor, body.faces)


def moved_scaled(motion, factor):
    """Return the same motion in a world of other size."""
    return Motion(motion.positions * factor, motion.quaternions)


def inside(overlaps, s):
    """Say whether s lies in one of exact overlaps; None if that lies within their enclosures."""
    s = Fraction(s)
    for one in overlaps:
        if one.start.upper <= s <= one.end.lower:
            return True
        if one.start.lower < s < one.start.upper or one.end.lower < s < one.end.upper:
            return None
    return False
