"""Affine maps of a few parameters in doubles, with a bound on their rounding."""

from dataclasses import dataclass
import math

import numpy as np

from trajectory_guard.shapes.body import read_only, U


@dataclass(frozen=True, slots=True, eq=False)
class Affine:
    """
    The map x -> origin + directions @ x of [0, 1]^d, near the map it stands for.

    :param origin: (k,).
    :param directions: (k, d).
    :param error: bound on the distance of the two maps' values at every x of [0, 1]^d.
    """

    origin: np.ndarray
    directions: np.ndarray
    error: float = 0.0

    @classmethod
    def of_corners(cls, corners: np.ndarray) -> 'Affine':
        """
        Return the map onto a simplex, each difference of its corners rounded once.

        :param corners: (d + 1, k), images of 0 and of the unit vectors [m].
        """
        directions = (corners[1:] - corners[0]).T
        return cls(corners[0], directions, 2.0 * U * float(np.abs(directions).sum()))

    def __sub__(self, other: 'Affine') -> 'Affine':
        """Return (x, y) -> self(x) - other(y), a map of both maps' parameters."""
        origin = self.origin - other.origin
        rounding = 2.0 * U * float(np.abs(origin).sum())
        directions = np.concatenate((self.directions, -other.directions), axis=1)
        return Affine(origin, directions, (self.error + other.error + rounding) * (1.0 + 4.0 * U))

    def behind(self, parameters: int) -> 'Affine':
        """Return the map of more parameters that ignores the new ones, which come first."""
        blind = np.zeros((len(self.origin), parameters))
        return Affine(self.origin, np.concatenate((blind, self.directions), axis=1), self.error)

    def widened(self, factor: float, entry: float) -> 'Affine':
        """Return x -> (factor * self(x), entry), the products rounded once."""
        origin = np.append(factor * self.origin, entry)
        directions = np.vstack((factor * self.directions, np.zeros(self.directions.shape[1])))
        rounding = 2.0 * U * float(np.abs(origin).sum() + np.abs(directions).sum())
        return Affine(origin, directions, (factor * self.error + rounding) * (1.0 + 4.0 * U))

    def at(self, x: np.ndarray) -> np.ndarray:
        """Return the value at x, (k,), to rounding."""
        value: np.ndarray = self.origin + self.directions @ x
        return value

    @property
    def size(self) -> float:
        """A bound on the length of what is between origin and any value, and of both together."""
        lengths = np.sqrt((self.directions**2).sum(axis=0)).sum()
        return float((math.sqrt(self.origin @ self.origin) + lengths) * (1.0 + 32.0 * U))


def at_rest(array: np.ndarray) -> Affine:
    """Return the map of no parameters onto a point."""
    return Affine(read_only(array), np.empty((len(array), 0)))
