"""Whether a point lies inside a closed surface, told apart from rounding (trusted)."""

import numpy as np

from trajectory_guard.shapes.inscribed import HEIGHT_ROUNDING, WEIGHT_ROUNDING

# A ray fails only if it passes an edge within rounding.
RAYS = 16


def may_contain(
    points: np.ndarray, triangles: np.ndarray, wound: bool, place: np.ndarray, doubt: float
) -> bool:
    """
    Tell whether a point may lie inside a surface whose edges all have an even number of triangles.

    Inside is what a ray leaves through an odd number of triangles; if the triangles are wound
    alike, also what they wind round, so that shells may overlap. Each ray is turned to the z axis,
    its origin to 0. Let the weights of a triangle be the cross products x_a y_b - y_a x_b of its
    consecutive corners. The axis goes through the triangle if all have one sign, past it if two
    have different ones, and away from it if all corners lie behind. Where no sign tells, the ray
    is given up.

    If every corner and the point move by `doubt` together, a coordinate moves by no more and, with
    |x|, |y|, |z| <= s in the turned frame, a weight by 2 d (2 s + d) and the height sum of weight
    times z, up to three times 2 s^2 * s, by 3 (2 d (2 s + d) (s + d) + 2 s^2 d). Both are added to
    what rounding does; s = sqrt(3) times the triangle's largest coordinate.

    :param points: (n, 3) corners [m].
    :param triangles: (m, 3) indices.
    :param wound: whether each edge is run through equally often in both directions.
    :param place: (3,) [m].
    :param doubt: how far corners and place may be off, together [m].
    :returns: False only if the point is outside.
    """
    corners = points[triangles] - place
    size = np.abs(corners).max(axis=(1, 2))
    # The difference rounds once more.
    doubt += 2.0**-52 * (float(np.abs(points).max()) + float(np.abs(place).max()))
    if not np.isfinite(size.max() + doubt):
        return True
    s = 1.75 * size
    flat = WEIGHT_ROUNDING * size**2 + 2.0 * doubt * (2.0 * s + doubt)
    level = HEIGHT_ROUNDING * size**3 + 3.0 * (
        2.0 * doubt * (2.0 * s + doubt) * (s + doubt) + 2.0 * s**2 * doubt
    )
    behind = 16.0 * 2.0**-53 * s + doubt
    rng = np.random.default_rng(0)
    for _ in range(RAYS):
        basis = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        basis[:, 0] *= np.sign(np.linalg.det(basis))
        x, y, z = np.moveaxis(corners @ basis, -1, 0)
        a, b = [1, 2, 0], [2, 0, 1]
        weight = x[:, a] * y[:, b] - y[:, a] * x[:, b]
        up, down = weight > flat[:, None], weight < -flat[:, None]
        missed = (up.any(axis=1) & down.any(axis=1)) | (z.max(axis=1) < -behind)
        through = (up.all(axis=1) | down.all(axis=1)) & ~missed
        height = (weight[through] * z[through]).sum(axis=1)
        if not (missed | through).all() or (np.abs(height) <= level[through]).any():
            continue
        side = np.where(up[through, 0], 1, -1)
        met = side * height > 0.0
        return bool(met.sum() % 2 or (wound and side[met].sum()))
    return True
