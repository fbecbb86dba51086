"""The rounding margins against 256-bit arithmetic: no error exceeds what is counted for it."""

from fractions import Fraction
from math import comb

from exact_chain import (
    arb_mat,
    ball,
    built_pose,
    fmpq,
    length,
    matrix,
    off,
    path_of,
    place,
    quaternion_rotation,
    random_chain,
    rational,
    true_pose,
    U,
)
import kernel_calls
from kernel_calls import CONTROLS
import numpy as np
import pytest
from random_robot import random_path, random_workcell
from scipy.spatial.transform import Rotation

from trajectory_guard.cell.pack import solids
from trajectory_guard.cell.robot import JointType
from trajectory_guard.kernels import layout
from trajectory_guard.motions.link_motion import Builder, rational_motion
from trajectory_guard.shapes.body import ConvexBody

SCALES = [1e-6, 1.0, 1e6]
TAUS = [fmpq(0), fmpq(-1), fmpq(1), fmpq(3, 7), fmpq(-5, 11)]
# Degree 12 of the control points with degree 2 of the plane.
TURN = 2


def within(part, ratios):
    """Check that no error over its bound reaches one, and say how near it came."""
    worst = float(max(ratios, default=0.0))
    assert worst < 1.0, f'{part}: error / bound = {worst:.3g}'


def coefficients(rng, chain, scale, turn, spread, degree=5):
    """Return (n, 6): centres up to `turn` [rad], motion of size `spread` [rad]; slides scaled."""
    n = len(chain.kinds)
    c = np.zeros((n, 6))
    c[:, 0] = rng.uniform(-turn, turn, n)
    c[:, 1 : degree + 1] = rng.normal(size=(n, degree)) * spread
    slides = chain.kinds == layout.PRISMATIC
    c[slides] *= scale
    # A thousand turns are no reason to slide a thousand times as far.
    c[slides, 0] /= max(turn, 1.0)
    c[slides, 1:] /= max(spread, 1.0)
    return c


def chain_ratios(chain, c, numerator, level, builder, alone):
    """
    Return error over bound for every place in a piece.

    :param alone: the bound is the chain's margin without the error of the fit.
    """
    path = path_of(c)
    body = len(chain.kinds) - 1
    built = kernel_calls.motion(chain.packed, path, 0, 0, numerator, level, builder)
    assert body == len(chain.kinds) - 1
    if not built.sound:
        return []
    bound = built.margin if alone else built.margin + built.fit
    ratios = [
        off(
            true_pose(chain, c, place(numerator, level, tau)),
            built_pose(built.matrices, built.weights, tau),
            chain.points,
        )
        / bound
        for tau in TAUS
    ]
    centre = arb_mat([[ball(x) for x in row] for row in built.centre.reshape(3, 4)])
    at_centre = off(true_pose(chain, c, place(numerator, level, fmpq(0))), centre, chain.points)
    assert at_centre <= built.fuzz
    return ratios


@pytest.mark.parametrize('builder', Builder)
@pytest.mark.parametrize('scale', SCALES)
@pytest.mark.parametrize('joints', [1, 2, 4, 7, 12])
@pytest.mark.parametrize('entry', [0.5, 8.0])
def test_a_chain_without_fit_error_stays_within_its_margin(joints, scale, builder, entry):
    """Joints that stand, or turn by next to nothing: the margin alone covers all rounding."""
    rng = np.random.default_rng(joints)
    ratios = []
    for spread in (0.0, 0.0, 1e-13, 1e-9, 1e-6):
        for slides in (0.0, 0.4):
            chain = random_chain(rng, joints, scale, entry, slides)
            # Linear motion, so that neither builder has anything to drop.
            c = coefficients(rng, chain, scale, 3.0, spread, degree=1)
            # At level 0 the shift of a centre is one addition; the turn's rounding is the path's.
            c[:, 0] *= spread == 0.0 or rng.random() < 0.5
            ratios += chain_ratios(chain, c, 0, 0, builder, alone=True)
    assert len(ratios) >= 40
    within('a standing chain', ratios)


@pytest.mark.parametrize('builder', Builder)
@pytest.mark.parametrize('scale', SCALES)
@pytest.mark.parametrize(
    ('joints', 'turn', 'spread', 'level'),
    [
        (1, 3.0, 0.3, 0),
        (1, 6283.0, 6283.0, 14),
        (3, 3.0, 1.0, 2),
        (3, 6283.0, 0.1, 0),
        (7, 3.0, 0.01, 0),
        (7, 3.0, 0.3, 1),
        (7, 6283.0, 6283.0, 20),
        (7, 3.0, 100.0, 0),
        (12, 3.0, 0.3, 3),
        (12, 3.0, 1e-3, 40),
        (12, 6283.0, 50.0, 48),
    ],
)
def test_a_moving_chain_stays_within_fit_and_margin(joints, turn, spread, level, scale, builder):
    """Small and huge pieces, a thousand turns, slides: the true pose is within the error."""
    rng = np.random.default_rng(joints + level)
    ratios = []
    for body, reach in ((0.1, 0.3), (1.0, 0.01), (1e-3, 3.0)):
        chain = random_chain(rng, joints, scale, 0.5, 0.25, body, reach)
        c = coefficients(rng, chain, scale, turn, spread)
        numerator = int(rng.integers(2**level))
        ratios += chain_ratios(chain, c, numerator, level, builder, alone=False)
    if spread < 10.0 or level > 10:
        assert ratios
    within('a moving chain', ratios)


def exactly_rigid(T):
    """Return the rotation nearest to a rounded one, and its origin, in balls (Newton's polar)."""
    R = matrix(T[:3, :3])
    eye = arb_mat(3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1])
    for _ in range(5):
        R = R * (eye * 3 - R.transpose() * R) * ball(0.5)
        R = arb_mat([[R[r, c].mid() for c in range(3)] for r in range(3)])
    return R, matrix(T[:3, 3:4])


def true_link_pose(robot, link, q):
    """Return a link's pose by Rodrigues' formula in balls; q are rationals by joint name."""
    way = []
    while link != robot.root:
        joint = next(j for j in robot.joints if j.child == link)
        way.append(joint)
        link = joint.parent
    R, t = arb_mat(3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1]), arb_mat(3, 1)
    for joint in reversed(way):
        fixed, origin = exactly_rigid(joint.T_parent_joint)
        t = t + R * origin
        R = R * fixed
        if joint.type is JointType.FIXED:
            continue
        norm = sum((ball(x) ** 2 for x in joint.axis), ball(0.0)).sqrt()
        axis = arb_mat([[ball(x) / norm] for x in joint.axis])
        if joint.type is JointType.PRISMATIC:
            t = t + R * axis * ball(q[joint.name])
            continue
        x, y, z = (axis[r, 0] for r in range(3))
        cross = arb_mat([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        angle = ball(q[joint.name])
        eye = arb_mat(3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1])
        R = R * (eye + cross * angle.sin() + cross * cross * (1 - angle.cos()))
    return R, t


@pytest.mark.parametrize('builder', Builder)
@pytest.mark.parametrize('seed', range(8))
def test_any_robot_stays_within_its_error(seed, builder):
    """Fixed joints folded, axes aligned, bodies moved: the whole way from the URDF's numbers."""
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.integers(-4, 5)
    cell = random_workcell(rng, joints=int(rng.integers(1, 13)), scale=scale)
    ratios = []
    for spread in (0.0, 1e-6, 0.1, 1.0):
        path = random_path(rng, cell.robot, spread=max(spread, 1.0))
        c = path.coefficients.copy()
        c[:, :, 1:] *= spread
        slides = cell.tree.chain.kind == layout.PRISMATIC
        c[:, slides] *= scale
        path = type(path)(
            path.joint_names,
            path.in_path,
            path.knots_ns,
            c,
            path.coefficient_error,
            path.unknown_until_ns,
            path.limits_checked,
        )
        body = int(rng.choice(np.flatnonzero(cell.link_nodes >= 0)))
        link = cell.link_names[body]
        given = cell.robot.bodies(link)[0]
        motion = rational_motion(cell, path, body, 0, 1, 2, builder=builder)
        scaled = [rational(w) * comb(motion.degree, i) for i, w in enumerate(motion.weights)]
        L = matrix(cell.tree.link_pose[link][:3])
        # What moving the body to its node's frame may have cost is in its ball.
        allowed = motion.error + cell.links.size[body, layout.BALL] - given.ball
        for tau in TAUS:
            s = place(1, 2, tau)
            q = {}
            for name, row in zip(path.joint_names, c[0], strict=True):
                value = fmpq(0)
                for x in row[::-1]:
                    value = value * s + rational(x)
                q[name] = value
            R, t = true_link_pose(cell.robot, link, q)
            P = built_pose(motion.control_points.reshape(-1, 12), scaled, tau)
            for v in given.vertices:
                x = matrix(v[:, None])
                homogeneous = arb_mat([[x[0, 0]], [x[1, 0]], [x[2, 0]], [1]])
                local = L * homogeneous
                image = P * arb_mat([[local[0, 0]], [local[1, 0]], [local[2, 0]], [1]])
                ratios.append(float(length(image - (R * x + t))) / allowed)
    within('a robot', ratios)


# The separating inequality on given control points, in rational arithmetic.


def near_poses(rng, count, scale, offset, spread):
    """Return (count, 12) poses near one another, `offset` from the origin."""
    base, t0 = rng.normal(size=3), rng.normal(size=3)
    t0 *= offset / np.linalg.norm(t0)
    rows = []
    for _ in range(count):
        R = Rotation.from_rotvec(base + spread * rng.normal(size=3)).as_matrix()
        rows.append(np.column_stack([R, t0 + spread * scale * rng.normal(size=3)]).ravel())
    return np.array(rows)


def supports(rng, scale, offset, spread, count, gap):
    """
    Return packed link and obstacle, control points, kappa, reach: `gap` apart along a direction.

    The obstacle's vertices are moved to leave about that gap, so that the difference cancels.
    """
    body = ConvexBody(rng.normal(size=(9, 3)) * scale * 0.2)
    points = near_poses(rng, count, scale, offset, spread)
    n = rng.normal(size=3)
    n /= np.linalg.norm(n)
    matrices = points.reshape(-1, 3, 4)
    images = np.concatenate([body.vertices @ P[:, :3].T + P[:, 3] for P in matrices])
    other = rng.normal(size=(9, 3)) * scale * 0.2 + images.mean(axis=0)
    other -= n * ((other @ n).max() - (images @ n).min() + gap)
    obstacle = ConvexBody(other)
    links, obstacles = solids([body], [0]), solids([obstacle], [-1])
    kappa = float(np.sqrt((matrices[:, :, :3] ** 2).sum(axis=(1, 2))).max())
    reach = float(
        np.linalg.norm(body.vertices, axis=1).max()
        + np.linalg.norm(matrices[:, :, 3], axis=1).max()
    )
    return links, obstacles, body, obstacle, points, n, kappa, reach


def dot(a, b):
    """Return an exact product."""
    return sum((rational(x) * rational(y) for x, y in zip(a, b, strict=True)), fmpq(0))


def lowest_image(n, row, vertices):
    """Return min n.(P v), exactly; n are rationals."""
    g = [sum((n[r] * rational(row[4 * r + c]) for r in range(3)), fmpq(0)) for c in range(4)]
    return min(sum((g[c] * rational(v[c]) for c in range(3)), fmpq(0)) for v in vertices) + g[3]


def highest_point(n, vertices):
    """Return max n.p, exactly; n are rationals."""
    return max(sum((n[c] * rational(p[c]) for c in range(3)), fmpq(0)) for p in vertices)


CASES = [
    (scale, offset)
    for scale in SCALES
    for offset in (0.0, 1.0, 1e3, 1e6)
    if scale * offset < 1e9  # nothing may lie farther out
]


@pytest.mark.parametrize(('scale', 'offset'), CASES)
@pytest.mark.parametrize('gap', [0.0, 1e-9, 1.0])
def test_the_separating_plane_stays_within_its_margin(scale, offset, gap):
    """Cancelling supports far from the origin: the gap without its margins is off by less."""
    rng = np.random.default_rng(1)
    ratios = []
    for _ in range(25):
        links, obstacles, body, obstacle, points, n, kappa, reach = supports(
            rng, scale, offset * scale, 10.0 ** rng.uniform(-9, 0), 7, gap * scale
        )
        computed = kernel_calls.separation(
            n, points, links, 0, obstacles, 0, 0.0, kappa, reach, depth=3.0
        )
        rows = [rational(x) for x in n]
        exact = min(lowest_image(rows, row, body.vertices) for row in points)
        exact -= highest_point(rows, obstacle.vertices)
        distance = ball(exact) / ball(dot(n, n)).sqrt()
        margin = kernel_calls.plane_margin(kappa, reach, obstacles.size[0, layout.FAR])
        chain = kernel_calls.chain_margin(3.0, kappa, reach)
        taken = ball(computed) + ball(margin) + ball(chain)
        ratios.append(float((taken - distance).abs_upper()) / margin)
        assert ball(computed) + ball(chain) < distance
    within('a plane', ratios)


@pytest.mark.parametrize(('scale', 'offset'), CASES)
def test_a_sphere_against_a_box_stays_within_its_margin(scale, offset):
    """The distance to a box, as computed and to every point of the solid inside, in 256 bits."""
    rng = np.random.default_rng(2)
    ratios, true_ratios = [], []
    for _ in range(40):
        R = Rotation.random(random_state=rng).as_matrix()
        t = rng.normal(size=3)
        t *= offset * scale / np.linalg.norm(t)
        half = rng.uniform(0.01, 1.0, 3) * scale
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
        body = ConvexBody(corners @ R.T + t)
        packed = solids([body], [-1])
        # A place off a face, an edge or a corner, near or far: the nearest point is known.
        inside = rng.uniform(-1.0, 1.0, 3) * half
        on = rng.random(3) < 0.6
        on[rng.integers(3)] = True
        side = rng.choice([-1.0, 1.0], 3)
        local = np.where(on, side * half, inside)
        normal = np.where(on, side * rng.random(3), 0.0)
        away = scale * 10.0 ** rng.uniform(-12, 2)
        x = R @ (local + away * normal / np.linalg.norm(normal)) + t
        computed = kernel_calls.box_distance(x, packed)
        reach = float(np.linalg.norm(x))
        margin = kernel_calls.sphere_margin(reach, packed.size[0, layout.FAR])
        frame = packed.place[0, layout.BOX :].reshape(3, 4)
        d = [rational(a) - rational(b) for a, b in zip(x, frame[:, 3], strict=True)]
        square = fmpq(0)
        for k in range(3):
            along = abs(sum((d[r] * rational(frame[r, k]) for r in range(3)), fmpq(0)))
            outside = along - rational(packed.place[0, layout.HALF + k])
            square += outside * outside if outside > 0 else fmpq(0)
        exact = ball(square).sqrt()
        ratios.append(float((ball(computed) - exact).abs_upper()) / margin)
        # Any point of the solid is an upper bound: the weights of the corners at `local`.
        share = 0.5 * (1.0 + local / half)
        weights = np.prod(np.where(corners > 0.0, share, 1.0 - share), axis=1)
        total = sum((rational(w) for w in weights), fmpq(0))
        apart = fmpq(0)
        for r in range(3):
            p = sum(
                (
                    rational(w) * rational(v[r])
                    for w, v in zip(weights, body.vertices, strict=True)
                ),
                fmpq(0),
            )
            apart += (rational(x[r]) - p / total) ** 2
        true_ratios.append(float((ball(computed) - ball(apart).sqrt()).mid()) / margin)
    within('a box', ratios)
    within('a solid in a box', true_ratios)


# The turning plane.


def bernstein_of_turn(turn):
    """Return the Bernstein vectors of n + tau m + tau^2 k, exactly."""
    n, m, k = ([rational(x) for x in row] for row in turn)
    return [
        [a - b + c for a, b, c in zip(n, m, k, strict=True)],
        [a - c for a, c in zip(n, k, strict=True)],
        [a + b + c for a, b, c in zip(n, m, k, strict=True)],
    ]


def choose(n, k):
    """Return a binomial, zero outside of its row."""
    value = Fraction(1)
    for i in range(k):
        value = value * (n - i) / (i + 1)
    return fmpq(value.numerator, value.denominator) if 0 <= k <= n else fmpq(0)


def exact_turning(turn, points, vertices, others):
    """Return the least control value of link minus obstacle, exactly."""
    directions = bernstein_of_turn(turn)
    high = [highest_point(n, others) for n in directions]
    low = None
    for i in range(CONTROLS + TURN):
        g, constant = [fmpq(0)] * 4, fmpq(0)
        for j, n in enumerate(directions):
            if not 0 <= i - j < CONTROLS:
                continue
            share = choose(CONTROLS - 1, i - j) * choose(TURN, j) / choose(CONTROLS - 1 + TURN, i)
            row = points[i - j]
            for c in range(4):
                g[c] += share * sum((n[r] * rational(row[4 * r + c]) for r in range(3)), fmpq(0))
            constant += share * high[j]
        value = min(sum((g[c] * rational(v[c]) for c in range(3)), fmpq(0)) for v in vertices)
        value += g[3] - constant
        low = value if low is None else min(low, value)
    return low


def largest_distance(turn, points, links, obstacles, kappa, reach, size):
    """Return the largest distance [m] that a turning plane proves, by bisection; None if none."""

    def holds(distance):
        return kernel_calls.turning(
            *turn, points, links, 0, obstacles, 0, 0.0, kappa, reach, distance, depth=3.0
        )

    low, high = -4.0 * size, 4.0 * size
    if not holds(low):
        return None
    assert not holds(high)
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return low
        low, high = (middle, high) if holds(middle) else (low, middle)


@pytest.mark.parametrize(('scale', 'offset'), CASES)
def test_the_turning_plane_stays_within_its_margin(scale, offset):
    """The distance that it proves is below the exact one, and off by less than what it pays."""
    rng = np.random.default_rng(3)
    ratios = []
    for _ in range(8):
        links, obstacles, body, obstacle, points, n, kappa, reach = supports(
            rng, scale, offset * scale, 10.0 ** rng.uniform(-6, -1), CONTROLS, 1e-6 * scale
        )
        turn = np.array([n, 0.1 * rng.normal(size=3), 0.02 * rng.normal(size=3)])
        turn *= 10.0 ** rng.uniform(-0.3, 0.1)
        size = 20.0 * (scale + offset * scale)
        proved = largest_distance(turn, points, links, obstacles, kappa, reach, size)
        if proved is None:
            continue
        exact = exact_turning(turn, points, body.vertices, obstacle.vertices)
        norm = max(
            (ball(sum((x * x for x in v), fmpq(0))).sqrt() for v in bernstein_of_turn(turn)),
            key=float,
        )
        # A negative distance is stretched by the longest direction as well: all is one number.
        plane = kernel_calls.plane_margin(kappa, reach, obstacles.size[0, layout.FAR])
        chain = kernel_calls.chain_margin(3.0, kappa, reach)
        taken = norm * (ball(proved) + ball(chain) + ball(plane)) + 2 * ball(plane)
        pays = 2.0 * plane + float(norm) * plane
        up = abs(proved) * 2.0**-43 * float(norm)
        ratios.append(max(0.0, float((taken - ball(exact)).abs_upper()) - up) / pays)
        assert norm * (ball(proved) + ball(chain)) < ball(exact) + ball(up)
    assert len(ratios) >= 4
    within('a turning plane', ratios)


def test_a_turning_plane_holds_at_every_instant():
    """What is proved is below the gap along the plane's own normal at dense instants."""
    rng = np.random.default_rng(4)
    proved_some = 0
    for _ in range(20):
        links, obstacles, body, obstacle, points, n, kappa, reach = supports(
            rng, 1.0, 1.0, 0.1, CONTROLS, 0.05
        )
        turn = np.array([n, 0.2 * rng.normal(size=3), 0.05 * rng.normal(size=3)])
        proved = largest_distance(turn, points, links, obstacles, kappa, reach, 20.0)
        if proved is None or proved < 0.0:
            continue
        proved_some += 1
        weights = np.array([float(ball(choose(CONTROLS - 1, i))) for i in range(CONTROLS)])
        for k in range(-20, 21):
            tau = fmpq(k, 20)
            P = built_pose(points, weights, tau)
            normal = arb_mat(
                [
                    [
                        ball(
                            rational(turn[0, r])
                            + tau * rational(turn[1, r])
                            + tau * tau * rational(turn[2, r])
                        )
                        for r in range(3)
                    ]
                ]
            )
            low = min(
                (
                    (normal * (P * arb_mat([[ball(x)] for x in (*v, 1.0)])))[0, 0]
                    for v in body.vertices
                ),
                key=float,
            )
            high = max(((normal * matrix(p[:, None]))[0, 0] for p in obstacle.vertices), key=float)
            square = sum((normal[0, r] ** 2 for r in range(3)), ball(0.0))
            assert (low - high) / square.sqrt() > ball(proved)
    assert proved_some >= 5


def test_the_unit_is_the_format_s():
    """Half of the gap between one and the next double."""
    assert float(np.finfo(float).eps) == 2.0 * U
    assert kernel_calls.chain_margin(0.0, 1.0, 1.0) == 256.0 * U
    assert quaternion_rotation(1, 0, 0, 0)[0, 0] == 1
