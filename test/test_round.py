"""Spheres and cylinders overlap as what they are: depths lie inside, and contacts are pinned."""

from decimal import Decimal, getcontext
from fractions import Fraction

from exact_contact import exact, pose
import kernel_calls
import numpy as np
import pytest
from rational_curves import random_rigid_motion
from test_free_certify import cell as free_cell
from test_free_certify import path as free_path

from trajectory_guard.cell.pack import solids
from trajectory_guard.certify import certify
from trajectory_guard.result import NANOSECONDS, Status
from trajectory_guard.settings import Settings
from trajectory_guard.shapes.body import ConvexBody
from trajectory_guard.shapes.primitive import Box, Cylinder, Sphere

getcontext().prec = 60

ROUND = [Sphere(0.2), Cylinder(0.15, 0.3), Cylinder(1e-3, 2.0), Cylinder(2.0, 1e-3)]


def rotation(rng):
    """Return a rotation in rational numbers."""
    a, b, c, d = (Fraction(int(k)) for k in rng.integers(-50, 51, 4))
    n = a * a + b * b + c * c + d * d or Fraction(1)
    rows = [
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]
    if n == 1 and not any((a, b, c, d)):
        return exact(np.eye(3))
    return np.array(rows) / n


def real_depth(shape, x):
    """Return how deep a point lies in a shape in its own frame, exactly; negative outside."""
    x = [Decimal(v.numerator) / Decimal(v.denominator) for v in x]
    if isinstance(shape, Sphere):
        return Decimal(shape.radius) - sum(v * v for v in x).sqrt()
    side = Decimal(shape.radius) - (x[0] ** 2 + x[1] ** 2).sqrt()
    return min(side, Decimal(shape.length) / 2 - abs(x[2]))


@pytest.mark.parametrize('shape', ROUND, ids=repr)
@pytest.mark.parametrize('scale', [1e-3, 1.0, 1e3])
def test_depths_are_those_of_the_real_solid_or_less(shape, scale):
    """After two exact motions, each rounded: never deeper than the exact depth, and nearly so."""
    rng = np.random.default_rng(7)
    most = 0.0
    for _ in range(15):
        body, images = shape.load().body, lambda x: x
        for _ in range(2):
            R, t = rotation(rng), exact(rng.normal(size=3) * scale)
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = R.astype(float), t.astype(float)
            body = body.moved(T)

            def images(x, R=R, t=t, before=images):
                return before(R.T @ (x - t))

        packed = solids([body], [-1])
        middle = body.vertices.mean(axis=0)
        size = np.linalg.norm(body.vertices - middle, axis=1).max() + body.disc_radius + 0.2
        for _ in range(10):
            x = middle + rng.normal(size=3) * size * 10.0 ** rng.uniform(-4, 0)
            found = kernel_calls.depth(packed, x)
            real = real_depth(shape, images(exact(x)))
            assert found <= 0.0 or Decimal(found) <= real
            if real > 0.0:
                most = max(most, float(real) - found)
    assert most < 1e-12 * (1.0 + scale)


def test_other_solids_have_polytopes_only():
    """A hull with a ball, or with a disc that nobody vouches for, is not the real solid."""
    box = Box((0.2, 0.2, 0.2)).load().body
    assert box.inside == -np.inf
    thick = ConvexBody(box.vertices, ball=0.1, faces=box.faces)
    assert kernel_calls.depth(solids([thick], [0]), [0.05, 0.0, 0.0]) == pytest.approx(0.05)
    ends = np.array([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]])
    bare = ConvexBody(ends, disc_radius=0.5)
    assert kernel_calls.depth(solids([bare], [0]), [0.0, 0.0, 0.0]) == -np.inf


@pytest.mark.parametrize(
    ('how', 'words'),
    [
        ({'inside': 0.2, 'ball': 0.1}, 'inside'),
        ({'inside': np.nan, 'ball': 0.1}, 'inside'),
        ({'inside': 0.0, 'disc_radius': 0.1}, 'spheres and cylinders'),
    ],
)
def test_nonsense_is_refused(how, words):
    with pytest.raises(ValueError, match=words):
        ConvexBody(np.zeros((1, 3)), **how)


def gap(a, b, motion, time_ns):
    """Return the exact distance of two round solids, one of which is a sphere, less its radius."""
    displacement = pose(motion, Fraction(time_ns, NANOSECONDS))
    R, t = displacement[:, :3], displacement[:, 3]
    # The motion is rigid to rounding only.
    if isinstance(a, Sphere):
        a, b, centre = b, a, t
    else:
        centre = -(R.T @ t)
    x = [Decimal(v.numerator) / Decimal(v.denominator) for v in centre]
    if isinstance(a, Sphere):
        return sum(v * v for v in x).sqrt() - Decimal(a.radius) - Decimal(b.radius)
    if isinstance(a, Box):
        off = [
            max(abs(v) - Decimal(half) / 2, Decimal(0)) for v, half in zip(x, a.size, strict=True)
        ]
    else:
        side = (x[0] ** 2 + x[1] ** 2).sqrt() - Decimal(a.radius)
        off = [max(side, Decimal(0)), max(abs(x[2]) - Decimal(a.length) / 2, Decimal(0))]
    return sum(v * v for v in off).sqrt() - Decimal(b.radius)


@pytest.mark.parametrize(
    ('moving', 'standing'),
    [
        (Sphere(0.2), Sphere(0.3)),
        (Sphere(0.2), Box((0.3, 0.2, 0.4))),
        (Box((0.3, 0.2, 0.4)), Sphere(0.2)),
        (Sphere(0.2), Cylinder(0.15, 0.3)),
        (Cylinder(0.15, 0.3), Sphere(0.2)),
    ],
    ids=repr,
)
def test_contacts_with_spheres_are_pinned_and_true(moving, standing):
    """Ends of free intervals are apart and ends of collisions overlap; what is open is short."""
    rng = np.random.default_rng(3)
    widths = []
    for _ in range(30):
        motion = random_rigid_motion(rng)
        result = certify(free_cell(moving, standing), free_path(motion))
        for row in result.intervals:
            if row.status is Status.SUSPECT:
                widths.append(row.end_ns - row.start_ns)
                continue
            for time_ns in (row.start_ns, row.end_ns):
                distance = gap(moving, standing, motion, time_ns)
                if row.status is Status.FREE:
                    assert distance > -1e-14
                else:
                    assert distance < 1e-14
    assert len(widths) > 15
    assert np.median(widths) <= 50
    assert max(widths) <= 1_000


@pytest.mark.parametrize('standing', [Box((0.3, 0.2, 0.4)), Cylinder(0.2, 0.3)], ids=repr)
def test_rims_are_pinned(standing):
    rng = np.random.default_rng(4)
    widths, pieces, before = [], 0, 0
    for _ in range(30):
        motion = free_path(random_rigid_motion(rng))
        workcell = free_cell(Cylinder(0.15, 0.3), standing)
        fine, rough = (
            certify(workcell, motion, Settings(refine=refine)) for refine in (True, False)
        )
        pieces, before = pieces + fine.pieces, before + rough.pieces
        widths += [row.end_ns - row.start_ns for row in fine.intervals if row.status == 2]
    assert len(widths) > 20
    assert np.median(widths) <= 50
    assert max(widths) <= 50_000
    assert pieces < 4 * before


def test_deep_spheres_are_found_at_once():
    """One instant's depth proves a long piece: no piece is halved down to the tolerance."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        motion = free_path(random_rigid_motion(rng))
        result = certify(free_cell(Sphere(0.2), Sphere(0.3)), motion, Settings(refine=False))
        assert result.pieces < 150


@pytest.mark.parametrize('overlap', [1e-8, 1e-5, 1e-2])
def test_a_common_point_along_a_normal(overlap):
    """It lies in both, about as deep as half of the overlap allows."""
    cylinder = Cylinder(0.15, 0.3).load().body
    box = Box((0.5, 0.5, 0.5)).load().body
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    lowest = 0.15 * s + 0.15 * c
    matrix = np.column_stack((turn, [0.01, 0.02, 0.25 + lowest - overlap]))
    found, y, place, mine, theirs = kernel_calls.shallow(
        matrix, solids([cylinder], [0]), solids([box], [-1]), [0.0, 0.0, 1.0]
    )
    assert found and min(mine, theirs) > 0.2 * overlap
    np.testing.assert_allclose(turn @ y + matrix[:, 3], place, atol=1e-15)
    away = matrix.copy()
    away[2, 3] += 2.1 * overlap
    assert not kernel_calls.shallow(
        away, solids([cylinder], [0]), solids([box], [-1]), [0.0, 0.0, 1.0]
    )[0]
