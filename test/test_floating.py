"""A free body's motion in the kernels contains the exact one."""

from fractions import Fraction

import numpy as np
import pytest
from rational_curves import exact_image, random_rigid_motion

from trajectory_guard.cell.free_body import free_body
from trajectory_guard.cell.scene import Obstacle, Scene
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.kernels.cover import cover
from trajectory_guard.kernels.layout import KernelRefused
from trajectory_guard.motions.floating import floating, stretch
from trajectory_guard.motions.floating_path import floating_path
from trajectory_guard.motions.link_motion import Builder, rational_motion
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.free_path import FreePath
from trajectory_guard.request import motion_path
from trajectory_guard.shapes.primitive import Box

SECOND = 10**9


def cell(size: float = 1.0) -> Workcell:
    """Return a box and, far away, an obstacle."""
    far = Obstacle('far', (Box((size, size, size)).load().body,))
    return Workcell(
        free_body('part', Box((0.3 * size, 0.2 * size, 0.1 * size))), Scene((far,), '')
    )


def path(*motions: RationalMotion, turn: float = 0.0, shift: float = 0.0) -> FreePath:
    """Return motions of one second each."""
    n = len(motions)
    times = SECOND * np.arange(n + 1)
    return FreePath('part', times, motions, np.full(n, turn), np.full(n, shift), 'given')


def affine_motion(rng: np.random.Generator, degree: int, size: float) -> RationalMotion:
    """Return a motion that deforms what it moves."""
    points = rng.uniform(-1.0, 1.0, (degree + 1, 3, 4))
    points[:, :, 3] *= size
    return RationalMotion(points, rng.uniform(0.5, 2.0, degree + 1))


def motions() -> list:
    rng = np.random.default_rng(7)
    rows = []
    for size in (1e-6, 1.0, 1e6):
        rows += [(size, random_rigid_motion(rng, degree, size)) for degree in (0, 1, 2, 5)]
        rows += [(size, affine_motion(rng, degree, size)) for degree in (0, 1, 3, 12)]
    return rows


@pytest.mark.parametrize(('size', 'motion'), motions())
def test_the_polynomial_contains_the_exact_motion(size: float, motion: RationalMotion) -> None:
    """At every instant each corner is within the error of where the exact curve has it."""
    work = cell(size)
    whole = floating_path(work.robot, path(motion))
    rng = np.random.default_rng(1)
    tight = 0
    for level in (0, 1, 3, 6, 20):
        for _ in range(3):
            k = int(rng.integers(2**level))
            try:
                built = rational_motion(work, whole, 0, 0, k, level, builder=Builder.ECONOMISED)
            except RequestError:
                assert level < 6  # too long a piece for any bound
                continue
            tight += built.error < 1e-3 * size
            middle = Fraction(2 * k + 1, 2 ** (level + 1))
            for s in [0.0, 1.0, *rng.uniform(size=4)]:
                at = (k + Fraction(s)) / 2**level
                pose = built.pose(s)
                for x in work.robot.bodies('part')[0].vertices[::3]:
                    exact = exact_image(motion, at, x)
                    y = pose[:, :3] @ x + pose[:, 3]
                    off = np.array(
                        [float(Fraction(a) - b) for a, b in zip(y.tolist(), exact, strict=True)]
                    )
                    assert np.linalg.norm(off) <= built.error
                    centre = exact_image(motion, middle, x)
                    moved = [float(a - b) for a, b in zip(exact, centre, strict=True)]
                    assert np.linalg.norm(moved) <= built.sweep * (1.0 + 1e-9) + built.error
    assert tight > 3


def test_the_error_falls_with_the_sixth_power() -> None:
    """Halving a piece divides what economising loses by about 64."""
    work = cell()
    whole = floating_path(work.robot, path(random_rigid_motion(np.random.default_rng(3))))
    errors = [
        rational_motion(work, whole, 0, 0, 0, level, builder=Builder.ECONOMISED).error
        for level in (1, 2, 3, 4)
    ]
    ratios = np.divide(errors[:-1], errors[1:])
    assert (ratios > 30.0).all()


def test_errors_of_the_path_are_inside() -> None:
    """What the path says it may be off is in the motion's error."""
    work = cell()
    motion = random_rigid_motion(np.random.default_rng(3))

    def error(**given: float) -> float:
        whole = floating_path(work.robot, path(motion, **given))
        return rational_motion(work, whole, 0, 0, 0, 8, builder=Builder.ECONOMISED).error

    corner = float(np.linalg.norm([0.15, 0.1, 0.05]))
    assert error(shift=0.01) - error() == pytest.approx(0.01)
    assert error(turn=0.1) - error() == pytest.approx(0.1 * corner)


@pytest.mark.parametrize('degree', [0, 1, 3, 8])
def test_rigid_motions_do_not_stretch(degree: int) -> None:
    rng = np.random.default_rng(degree)
    stretched, rigid = stretch(random_rigid_motion(rng, degree))
    assert rigid == 1.0
    assert 0.0 < stretched < 1e-12


def test_affine_motions_stretch_by_their_largest_singular_value() -> None:
    rng = np.random.default_rng(5)
    for degree in (0, 2, 7):
        motion = affine_motion(rng, degree, 1.0)
        stretched, rigid = stretch(motion)
        assert rigid == 0.0
        for s in np.linspace(0.0, 1.0, 33):
            assert np.linalg.norm(motion.pose(s)[:, :3], 2) <= 1.0 + stretched


def test_a_shrinking_motion_is_not_rigid() -> None:
    points = np.zeros((2, 3, 4))
    points[0, :, :3] = np.eye(3)
    points[1, :, :3] = 0.5 * np.eye(3)
    stretched, rigid = stretch(RationalMotion(points, np.ones(2)))
    assert (rigid, stretched) == (0.0, pytest.approx(0.0, abs=1e-9))


def still(scale: float = 1.0, **changes: float) -> RationalMotion:
    points = np.zeros((2, 3, 4))
    points[:, :, :3] = scale * np.eye(3)
    points[1, 0, 3] = changes.get('x', 0.0)
    return RationalMotion(points, np.array([1.0, changes.get('weight', 1.0)]))


@pytest.mark.parametrize(
    ('make', 'reason', 'named'),
    [
        (lambda: path(still(weight=1e-9)), Reason.INVALID_PARAMETER, 'motions[0] has weights'),
        (lambda: path(still(x=1e9)), Reason.TOO_LARGE, 'motions[0] has a control point'),
        (
            lambda: path(still(), still().elevated(64)),
            Reason.TOO_LARGE,
            'motions[1] has degree 65',
        ),
        (lambda: path(still(), shift=1e10), Reason.TOO_LARGE, 'shift_error reaches'),
    ],
)
def test_what_kernels_cannot_take_is_refused_by_name(make, reason: Reason, named: str) -> None:
    with pytest.raises(RequestError) as caught:
        floating(make())
    assert caught.value.reason is reason
    assert named in str(caught.value)


@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_no_number_of_a_motion_may_be_lost(bad: float) -> None:
    """Whatever entry is no number, nothing is said of the motion."""
    work = cell()
    whole = floating_path(work.robot, path(random_rigid_motion(np.random.default_rng(3), 1)))
    good = motion_path(work, whole, np.zeros(2))
    bodies = work.pairs(whole.in_path).moving
    stop = np.zeros(1, np.int64)
    assert len(cover(work.packed, good, bodies, 1e-4, 0.0, 100, 0, False, stop).leaves)
    for name in ('control', 'weight', 'bounds'):
        clean = getattr(good.floating, name)
        for i in np.ndindex(clean.shape):
            spoilt = clean.copy()
            spoilt[i] = bad
            curves = good.floating._replace(**{name: spoilt})
            with pytest.raises(KernelRefused):
                cover(
                    work.packed,
                    good._replace(floating=curves),
                    bodies,
                    1e-4,
                    0.0,
                    100,
                    0,
                    False,
                    stop,
                )
