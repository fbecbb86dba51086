r"""
Rounding margins, derived in one place.

Let u = 2^-53.  Every bound below is of the form ``constant * u * size`` where *size* is a bound on
the coordinates that enter, never an absolute number, so it scales from micrometres to kilometres.

**Control matrices** (``chain``).  Let ``kappa`` be the product over the moving joints of
``max_i (|c_i| + |s_i|) / w_i`` (c, s, w: Bernstein coefficients of 1-u^2, 2u, 1+u^2); the columns
of an exact control matrix, divided by its weight, have norm at most ``kappa``.  A step of the
chain is a product with a constant rigid transform (3 products and 3 sums per entry) followed by a
convolution with at most 7 coefficients per column, two products each.  The constant transform
itself is the rounded image of an exactly rigid one: origin, axis alignment, and the turn by the
piece's central angle, at most 16 u relative to its norm.  Relative to the norm of what it acts on
a step therefore adds at most (16 + 4 + 2*7 + 2) u * sqrt(3) * sqrt(3) < 128 u; the coefficients c,
s, w carry (products of three-term polynomials) at most 24 u more.  Errors of earlier steps are
transported by factors whose norm is already in kappa, so they add.  After ``depth`` steps and the
division by the weight the image of a point x differs from the exact one by at most

    CHAIN * (depth + 1) * u * kappa * reach,         CHAIN = 256,

where ``reach`` bounds the sum of the lengths of all offsets of the chain and |x|, and the ratios
are limited (``chain.LARGEST_RATIO``, ``SLIDE_GROWTH``), so that no weight is small against its
columns.

**Separating plane** (``separation``).  With |n| <= 1 + 4u, the products n.(C x) (two nested dot
products of length 3 and 4) and n.p (length 3), the disc term and the comparison add at most

    PLANE * u * (kappa * reach + |obstacle|),        PLANE = 64.

**Sphere against box** (``cover``).  A point is brought into the box's frame by 3 dot products and
its distance formed by 3 squares and a root: SPHERE * u * (reach + |obstacle|), SPHERE = 64.
"""

from trajectory_guard.kernels.jit import kernel

UNIT_ROUNDOFF = 2.0**-53
CHAIN = 256.0
PLANE = 64.0
SPHERE = 64.0
# Sums of at most a few dozen non-negative terms, each rounded: multiply by this to round upward.
UP = 1.0 + 2.0**-44


@kernel
def chain_margin(depth, kappa, reach):
    """
    Bound the rounding of a point of a link's control polygon.

    :param depth: number of joints between the root and the link.
    :param kappa: bound on the column norms of the control matrices, at least 1.
    :param reach: bound on the point's coordinates over all configurations [m].
    :returns: the bound [m], see the module's derivation.
    """
    return CHAIN * (depth + 1.0) * UNIT_ROUNDOFF * kappa * reach


@kernel
def plane_margin(kappa, reach, obstacle):
    """
    Bound the rounding of the separating inequality.

    :param kappa: as in :func:`chain_margin`.
    :param reach: bound on the link's coordinates [m].
    :param obstacle: bound on the obstacle's coordinates [m].
    :returns: the bound [m].
    """
    return PLANE * UNIT_ROUNDOFF * (kappa * reach + obstacle)


@kernel
def sphere_margin(reach, obstacle):
    """
    Bound the rounding of the distance between a point and an oriented box.

    :param reach: bound on the point's coordinates [m].
    :param obstacle: bound on the box's coordinates [m].
    :returns: the bound [m].
    """
    return SPHERE * UNIT_ROUNDOFF * (reach + obstacle)
