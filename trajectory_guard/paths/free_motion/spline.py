"""B-splines of quaternions and positions, of dual quaternions, and of displacements."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.motions.motion import RationalMotion
from trajectory_guard.paths.free_motion.bernstein import U
from trajectory_guard.paths.free_motion.quaternion_curve import (
    dual_quaternion_motion,
    Rigid,
    rigid_motion,
    unit_scale,
)
from trajectory_guard.paths.free_path import FreePath


class Piece(NamedTuple):
    """
    A polynomial piece of a spline.

    :param start_ns: its knot [ns].
    :param end_ns: the next knot [ns].
    :param control: (degree + 1, D) Bernstein coefficients.
    """

    start_ns: int
    end_ns: int
    control: np.ndarray


def bezier_pieces(knots_ns: Sequence[int], degree: int, control: np.ndarray) -> list[Piece]:
    """
    Cut a B-spline at its knots.

    The j-th Bernstein coefficient on [a, b] is the blossom at n - j times a and j times b. Each of
    its n steps is a convex combination whose share is a quotient of integers: 4 u a step, so a
    coefficient errs by at most 4 n u of the largest control value.

    :param knots_ns: K + degree + 1 knots that do not fall, the first and the last degree + 1 times
        [ns].
    :param degree: >= 1.
    :param control: (K, D) control values, K > degree.
    :raises RequestError: naming what does not fit.
    """
    control = np.array(control, float)
    knots = [int(t) for t in knots_ns]
    n = int(degree)
    if n < 1:
        raise _invalid(f'degree must be >= 1, got {degree}')
    if control.ndim != 2 or len(control) <= n or not np.isfinite(control).all():
        raise _invalid(
            f'control must be finite, of shape (K, D), K > {n}, got shape {control.shape}'
        )
    if len(knots) != len(control) + n + 1:
        raise _invalid(
            f'knots_ns must have {len(control) + n + 1} entries for {len(control)} control values '
            f'of degree {n}, got {len(knots)}'
        )
    falls = [i for i in range(1, len(knots)) if knots[i] < knots[i - 1]]
    if falls:
        i = falls[0]
        raise RequestError(
            Reason.UNSORTED_TIMES, f'knots_ns[{i}] is {knots[i]}, less than {knots[i - 1]}'
        )
    if knots[0] != knots[n] or knots[-1] != knots[-n - 1] or knots[0] == knots[-1]:
        raise _invalid(f'knots_ns must begin and end with {n + 1} equal knots, got {knots}')
    return [
        Piece(
            knots[i],
            knots[i + 1],
            np.array(
                [
                    _blossom(knots, n, control, i, [knots[i]] * (n - j) + [knots[i + 1]] * j)
                    for j in range(n + 1)
                ]
            ),
        )
        for i in range(n, len(control))
        if knots[i] < knots[i + 1]
    ]


def _blossom(
    knots: list[int], n: int, control: np.ndarray, i: int, places: list[int]
) -> np.ndarray:
    """Return the blossom of the piece on [knots[i], knots[i + 1]] by de Boor's scheme."""
    rows = control[i - n : i + 1]
    for r, t in enumerate(places, 1):
        low = [knots[i - n + r + k] for k in range(n + 1 - r)]
        high = [knots[i + 1 + k] for k in range(n + 1 - r)]
        share = np.array([(t - a) / (b - a) for a, b in zip(low, high, strict=True)])[:, None]
        rows = (1.0 - share) * rows[:-1] + share * rows[1:]
    return rows[0]


def rigid_spline(
    name: str,
    knots_ns: Sequence[int],
    degree: int,
    quaternions: np.ndarray,
    positions: np.ndarray,
) -> FreePath:
    """
    Return the motion of a B-spline of quaternions, divided by their lengths, and of positions.

    :param name: the floating joint, or the body.
    :param knots_ns: as in `bezier_pieces` [ns].
    :param degree: of both.
    :param quaternions: (K, 4) control quaternions (x, y, z, w), any length.
    :param positions: (K, 3) control points [m].
    :raises RequestError: naming what does not fit, or where a quaternion comes near zero.
    """
    q, p = np.array(quaternions, float), np.array(positions, float)
    if q.ndim != 2 or p.ndim != 2 or q.shape[1:] != (4,) or p.shape != (len(q), 3):
        raise _invalid(
            f'quaternions and positions must have shapes (K, 4) and (K, 3), got {q.shape} '
            f'and {p.shape}'
        )
    pieces = bezier_pieces(knots_ns, degree, np.column_stack((q, p)))
    rounding = 4.0 * degree * U
    shift = rounding * float(np.sqrt((p * p).sum(axis=1)).max())

    def motion(control: np.ndarray) -> Rigid:
        # Relative to the longest of all, which may be longer than those of the piece.
        own = float(np.sqrt((control[:, :4] ** 2).sum(axis=1)).max())
        direction = rounding * float(np.sqrt((q * q).sum(axis=1)).max()) / max(own, 1e-300)
        return rigid_motion(control[:, :4], control[:, 4:]).loosened(direction, shift)

    return _path(name, pieces, motion, f'B-spline of quaternions, degree {degree}')


def dual_quaternion_spline(
    name: str, knots_ns: Sequence[int], degree: int, dual_quaternions: np.ndarray
) -> FreePath:
    """
    Return the motion of a B-spline of dual quaternions.

    With q and d off by r Q and r D, r from `bezier_pieces`, Q and D their largest lengths, and l
    the least length of q, the translation 2 d q* / |q|^2 is off by at most 2 r D / l + 2 D r Q /
    l^2, twice that with the second order.

    :param name: the floating joint, or the body.
    :param knots_ns: as in `bezier_pieces` [ns].
    :param degree: of the spline.
    :param dual_quaternions: (K, 8), as in `dual_quaternion_motion`.
    :raises RequestError: as for `rigid_spline`.
    """
    pieces = bezier_pieces(knots_ns, degree, dual_quaternions)
    rounding = 4.0 * degree * U
    both = np.array(dual_quaternions, float)
    Q, D = (float(np.sqrt((part**2).sum(axis=1)).max()) for part in (both[:, :4], both[:, 4:]))

    def motion(control: np.ndarray) -> Rigid:
        rigid = dual_quaternion_motion(control)
        scale = unit_scale(control[:, :4])
        least = float(np.sqrt(rigid.motion.weights.min())) / scale
        shift = 4.0 * rounding * D * (1.0 / least + Q / least**2)
        return rigid.loosened(rounding * Q * scale, shift)

    return _path(name, pieces, motion, f'B-spline of dual quaternions, degree {degree}')


def displacement_spline(
    name: str,
    knots_ns: Sequence[int],
    degree: int,
    displacements: np.ndarray,
    weights: np.ndarray | None = None,
) -> FreePath:
    """
    Return the motion of a rational B-spline in the space of affine displacements.

    :param name: the floating joint, or the body.
    :param knots_ns: as in `bezier_pieces` [ns].
    :param degree: of the spline.
    :param displacements: (K, 3, 4) control displacements [m].
    :param weights: (K,) positive; ones if None.
    :raises RequestError: as for `rigid_spline`.
    """
    points = np.array(displacements, float)
    w = np.ones(len(points)) if weights is None else np.array(weights, float)
    if points.ndim != 3 or points.shape[1:] != (3, 4) or w.shape != (len(points),):
        raise _invalid(
            f'displacements and weights must have shapes (K, 3, 4) and (K,), got {points.shape} '
            f'and {w.shape}'
        )
    if not (w > 0.0).all():
        raise _invalid(f'weights must be positive, got {w.tolist()}')
    rows = np.column_stack((w[:, None] * points.reshape(-1, 12), w))
    # Convex combinations of quotients: a step rounds numerator and weight, 4 u each of the largest
    # product, over the least weight; the product and the quotient once more.
    ratio = float(w.max() / w.min())
    rounding = (8.0 * degree + 4.0) * U * ratio
    size = np.abs(points).max(axis=0)
    turn, shift = (float(np.sqrt((a * a).sum())) for a in (size[:, :3], size[:, 3]))

    def motion(control: np.ndarray) -> Rigid:
        weight = control[:, 12]
        displaced = (control[:, :12] / weight[:, None]).reshape(-1, 3, 4)
        return Rigid(RationalMotion(displaced, weight), rounding * turn, rounding * shift)

    pieces = bezier_pieces(knots_ns, degree, rows)
    return _path(name, pieces, motion, f'B-spline of displacements, degree {degree}')


def _path(
    name: str, pieces: list[Piece], motion: Callable[[np.ndarray], Rigid], rule: str
) -> FreePath:
    curves = [motion(piece.control) for piece in pieces]
    return FreePath(
        joint_name=name,
        knots_ns=np.array([pieces[0].start_ns, *(piece.end_ns for piece in pieces)], np.int64),
        motions=tuple(curve.motion for curve in curves),
        turn_error=np.array([curve.turn_error for curve in curves]),
        shift_error=np.array([curve.shift_error for curve in curves]),
        interpolation=rule,
        unknown_until_ns=pieces[0].start_ns,
    )


def _invalid(message: str) -> RequestError:
    return RequestError(Reason.INVALID_PARAMETER, message)
