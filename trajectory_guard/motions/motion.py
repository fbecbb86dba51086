"""A rational motion as a value: control points and weights of a curve of displacements."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from trajectory_guard.errors import Reason, RequestError

_UNIT = 2.0**-53

# Weights beyond these would leave the range of doubles in products of their kind.
_SMALLEST_WEIGHT = 2.0**-400
_LARGEST_WEIGHT = 2.0**400
# Likewise for the entries of a control point.
_LARGEST_ENTRY = 2.0**400


@dataclass(frozen=True, slots=True, eq=False)
class RationalMotion:
    """
    A curve of affine displacements in rational Bernstein form, degree n = K - 1, s in [0, 1].

    At s a point x is at sum_i b_i w_i P_i [x; 1] / sum_i b_i w_i, b_i = C(n, i) s^i (1-s)^(n-i).
    The weights are positive, so this lies in the convex hull of the points P_i [x; 1] [Schroecker
    & Weber 2014, sec. 5 and 7].

    :param control_points: (K, 3, 4) displacements P_i, rows of [C | t] with t in [m].
    :param weights: (K,) positive Bernstein weights w_i, binomials not included.
    :param error: bound on the distance of the true motion from this one, for the points of the
        body it was made for; rounding included [m].
    :param inflation: what the body's tracking tolerance adds to it [m].
    :param sweep: bound on the displacement of the body's points from the middle [m].
    :raises RequestError: naming the field and the value, for another shape, numbers that are not
        finite or beyond 2^400, weights that are not positive, bounds that are negative or NaN.
    """

    control_points: np.ndarray
    weights: np.ndarray
    error: float = 0.0
    inflation: float = 0.0
    sweep: float = 0.0

    def __post_init__(self) -> None:
        """Validate, and make the arrays read-only."""
        for name, row in (('control_points', (3, 4)), ('weights', ())):
            array = _numbers(getattr(self, name), name)
            if array.ndim != 1 + len(row) or array.shape[1:] != row or not len(array):
                shape = ', '.join(['K', *map(str, row)])
                raise _invalid(f'{name} must have shape ({shape}), K >= 1, got {array.shape}')
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        points, weights = self.control_points, self.weights
        if len(points) != len(weights):
            raise _invalid(f'weights has {len(weights)} rows, control_points {len(points)}')
        wrong = ~(np.abs(points) <= _LARGEST_ENTRY)
        if wrong.any():
            place = tuple(np.argwhere(wrong)[0].tolist())
            raise _invalid(f'control_points{list(place)} is {points[place]}')
        wrong = ~((weights >= _SMALLEST_WEIGHT) & (weights <= _LARGEST_WEIGHT))
        if wrong.any():
            i = int(np.argmax(wrong))
            raise _invalid(f'weights[{i}] must be positive and finite, is {weights[i]}')
        for name in ('error', 'inflation', 'sweep'):
            if not getattr(self, name) >= 0.0:
                raise _invalid(f'{name} must be >= 0, got {getattr(self, name)!r}')

    @property
    def degree(self) -> int:
        """Degree of the curve, K - 1."""
        return len(self.weights) - 1

    @property
    def rounding(self) -> tuple[float, float]:
        """
        Bound what one elevation, subdivision or restriction does to the motion by rounding.

        Each makes numerators N'_j = sum_i l_ji w_i P_i and weights w'_j = sum_i l_ji w_i, l_ji >=
        0, in at most n steps of two products and a sum, each with a coefficient rounded at most
        twice; elevation takes one step. Every term of a sum so has a factor 1 + e, |e| <= 5 n u,
        besides that of w_i P_i, and dividing adds one: an entry of P'_j = N'_j / w'_j is off by
        at most (10 n + 2) u A, A the largest |entry| of all P_i, to first order. Weights off by
        5 n u each move the curve, an average of P'_j, by twice that times A more. Together
        (20 n + 2) u A; 32 (n + 1) u A covers the second order.

        :returns: bounds e_turn and e_shift [m]: no point x is moved by more than
            e_turn |x| + e_shift.
        """
        size = np.abs(self.control_points).max(axis=0)
        step = 32.0 * (self.degree + 1) * _UNIT
        # Products that leave the normal range lose 2^-1075 each; weights are at least 2^-400.
        turn, shift = (float(np.sqrt((a * a).sum())) for a in (size[:, :3], size[:, 3]))
        return step * turn + 2.0**-600, step * shift + 2.0**-600

    def pose(self, s: float) -> np.ndarray:
        """
        Evaluate the motion, to rounding.

        :param s: place in [0, 1].
        :returns: (3, 4) displacement.
        :raises RequestError: s lies outside.
        """
        _check_place('s', s)
        n = self.degree
        basis = np.array([math.comb(n, i) * s**i * (1.0 - s) ** (n - i) for i in range(n + 1)])
        basis *= self.weights / self.weights.max()
        pose: np.ndarray = np.einsum('i,irc->rc', basis / basis.sum(), self.control_points)
        return pose

    def elevated(self, times: int = 1) -> RationalMotion:
        """
        Return the same curve with a higher degree, to rounding: ``times`` times `rounding`.

        b_i of degree n is ((n + 1 - i) b_i + (i + 1) b_(i+1)) / (n + 1) of degree n + 1.

        :param times: by how much.
        :raises RequestError: a negative number.
        """
        if times < 0:
            raise _invalid(f'times must be >= 0, got {times}')
        rows = self._homogeneous()
        for _ in range(times):
            n = len(rows)
            share = np.arange(1, n)[:, None] / n
            inner = share * rows[:-1] + (1.0 - share) * rows[1:]
            rows = np.concatenate((rows[:1], inner, rows[-1:]))
        return self._of(rows)

    def subdivided(self, s: float = 0.5) -> tuple[RationalMotion, RationalMotion]:
        """
        Cut the curve in two by de Casteljau's algorithm; each part is on [0, 1] again.

        The parts have the error of the whole. They are exact but for `rounding`.

        :param s: where, in [0, 1].
        :raises RequestError: s lies outside.
        """
        _check_place('s', s)
        rounds = _de_casteljau(self._homogeneous(), s)
        left = np.array([rows[0] for rows in rounds])
        right = np.array([rows[-1] for rows in reversed(rounds)])
        return self._of(left), self._of(right)

    def restricted(self, a: float, b: float) -> RationalMotion:
        """
        Return the part of the curve on [a, b], on [0, 1] again; exact but for `rounding`.

        Its control point j is the blossom at n - j arguments a and j arguments b.

        :param a: where it begins.
        :param b: where it ends; 0 <= a < b <= 1.
        :raises RequestError: no such part.
        """
        _check_place('a', a)
        _check_place('b', b)
        if not a < b:
            raise _invalid(f'a must be less than b, got {a!r} and {b!r}')
        n = self.degree
        rounds = _de_casteljau(self._homogeneous(), a)
        rows = [_de_casteljau(rounds[n - j], b)[j][0] for j in range(n + 1)]
        return self._of(np.array(rows))

    def _homogeneous(self) -> np.ndarray:
        """Return (K, 13) rows [w P, w]."""
        flat = self.control_points.reshape(-1, 12)
        return np.column_stack((self.weights[:, None] * flat, self.weights))

    def _of(self, rows: np.ndarray) -> RationalMotion:
        """Return homogeneous rows as a motion with the bounds of this one."""
        points = (rows[:, :12] / rows[:, 12:]).reshape(-1, 3, 4)
        return RationalMotion(points, rows[:, 12], self.error, self.inflation, self.sweep)


def _de_casteljau(rows: np.ndarray, s: float) -> list[np.ndarray]:
    """Return the rows of every round, from the given K down to one."""
    rounds = [rows]
    for _ in range(len(rows) - 1):
        rows = (1.0 - s) * rows[:-1] + s * rows[1:]
        rounds.append(rows)
    return rounds


def _numbers(values: object, name: str) -> np.ndarray:
    """Return a float64 copy."""
    try:
        array = np.array(values)
    except ValueError as error:
        raise _invalid(f'{name}: {error}') from error
    if array.dtype.kind not in 'iuf':
        raise _invalid(f'{name}: not all are numbers')
    return np.ascontiguousarray(array, np.float64)


def _check_place(name: str, s: float) -> None:
    if not 0.0 <= s <= 1.0:
        raise _invalid(f'{name} must lie in [0, 1], got {s!r}')


def _invalid(message: str) -> RequestError:
    return RequestError(Reason.INVALID_PARAMETER, message)
