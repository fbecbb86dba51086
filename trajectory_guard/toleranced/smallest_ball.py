"""The smallest ball that contains given points, in any dimension: a proposal."""

import numpy as np

# Steps per point. A walk ends after a few steps per dimension; rounding can make it turn in
# circles, and then where it stands is as good a proposal as any.
STEPS = 16

# How far off the flat of the support the centre may be and count as on it, by the size.
ON_FLAT = 2.0**-40


def smallest_ball(points: np.ndarray) -> np.ndarray:
    """
    Return weights of total 1 whose mean of the points is about the centre of the smallest ball.

    The centre walks towards the nearest point of the flat of its support, the points at the
    greatest distance, until another point becomes as far; on the flat, a support point with a
    negative weight is dropped. The ball shrinks all the time and contains all points; when all
    weights are positive the centre lies in the hull of the support and no ball is smaller
    [Fischer, Gaertner, Kutz 2003]. Whoever uses the centre measures the radius.

    :param points: (n, d).
    :returns: (n,), zero off the support.
    """
    # A common offset costs no digits.
    points = points - points[0]
    center = points[0]
    support = [int(((points - center) ** 2).sum(axis=1).argmax())]
    size = float(np.linalg.norm(points[support[0]] - center))
    for _ in range(STEPS * (len(points) + 1)):
        share, foot = _on_flat(points[support], center)
        step = foot - center
        if np.linalg.norm(step) <= ON_FLAT * size:
            if share.min() >= -ON_FLAT:
                break
            del support[int(share.argmin())]
            continue
        fraction, met = _free_way(points, support, center, step)
        center = center + fraction * step
        if met is not None:
            support.append(met)
    weights = np.zeros(len(points))
    weights[support] = _on_flat(points[support], center)[0]
    return weights


def _on_flat(support: np.ndarray, center: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the affine weights of the flat's point nearest to the centre, and that point."""
    sides = (support[1:] - support[0]).T
    share, *_ = np.linalg.lstsq(sides, center - support[0], rcond=None)
    return np.concatenate(([1.0 - share.sum()], share)), support[0] + sides @ share


def _free_way(
    points: np.ndarray, support: list[int], center: np.ndarray, step: np.ndarray
) -> tuple[float, int | None]:
    """
    Return how much of a step can be made, at most all of it, and the point that ends it.

    Along the step f d all support points t stay equally far, as d is normal to their flat; p is as
    far as t when f = (|t - c|^2 - |p - c|^2) / (2 d . (t - p)).
    """
    away = points - center
    squares = (away**2).sum(axis=1)
    heights = away @ step
    closing = 2.0 * (heights[support[0]] - heights)
    closing[support] = 0.0
    with np.errstate(divide='ignore', invalid='ignore'):
        f = np.where(closing > 0.0, (squares[support[0]] - squares) / closing, np.inf)
    first = int(f.argmin())
    return (max(0.0, float(f[first])), first) if f[first] < 1.0 else (1.0, None)
