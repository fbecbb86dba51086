"""
The relative motion of two bodies as polynomials that every constraint is a linear function of.

Let A and B have the configurations (x_A, Q_A), (x_B, Q_B), M = the matrix of Rot, |Q|^2 = Q.Q and
x = x_A - x_B. As M_A^T M_B is the matrix of the quaternion conj(Q_A) Q_B, and M M^T = |Q|^4 I,

    P = M_B^T M_A = matrix of conj(Q_B) Q_A,            N = |Q_A|^2 |Q_B|^2,
    t = |Q_A|^2 M_B^T x,    t' = |Q_B|^2 M_A^T x,       S = -M_A^T [x] M_B,

are polynomials of degree at most n + 2 m_A + 2 m_B for x of degree n and Q of degree m. A point p
of A is (P p + t) / N in the frame of B, a point p of B is (P^T p - t') / N in the frame of A. The
generalised constraints [Canny 1984, (15)-(17)] divided by what is positive become

    A:  n_A . (P^T p_B - t') - N d_A             = (15)
    B:  n_B . (P p_A + t) - N d_B                = (16)
    C:  e_B . P (p_A x e_A) + (p_B x e_B) . P e_A + e_A . S e_B          = (17)

because M_A a . M_B b = b . P a, and (M_A a x M_B b) . x = M_A a . (M_B b x x) =
-a . M_A^T [x] M_B b = a . S b. With B at the origin, Q_B = 1, they are (6), (7) and (4).

**Correction to the print.** (17) has a minus before p_B x e_B there; but -(e_A x e_B) . p_B =
-e_A . (e_B x p_B) = e_A . (p_B x e_B).
"""

from collections.abc import Sequence

from flint import fmpz_poly

from trajectory_guard.canny.integers import exponent, scaled
from trajectory_guard.canny.motion import Motion
from trajectory_guard.canny.polynomial import cross_product, dot_product, from_bernstein, rotation

# Where the parts begin in a basis: P and S by rows.
P, T, T_BACK, N, S, TERMS = 0, 9, 12, 15, 16, 25


def degree(a: Motion, b: Motion) -> int:
    """Return a bound on the degree of all constraints: 3 for one straight line, 5 for two."""
    positions = max(len(a.positions), len(b.positions)) - 1
    return positions + 2 * (len(a.quaternions) - 1) + 2 * (len(b.quaternions) - 1)


def relative_basis(a: Motion, b: Motion, k: int) -> list[fmpz_poly]:
    """
    Return P, t, t', N, S times a positive number, exactly.

    :param a: motion of A.
    :param b: motion of B.
    :param k: lengths are multiplied by 2^k, which makes all positions integers.
    :returns: TERMS polynomials in s.
    """
    Q_a, Q_b = (_columns(scaled(m.quaternions, exponent(m.quaternions))) for m in (a, b))
    x_a, x_b = (_columns(scaled(m.positions, k)) for m in (a, b))
    x = [p - q for p, q in zip(x_a, x_b, strict=True)]
    M_a, M_b = rotation(Q_a), rotation(Q_b)
    a_columns, b_columns = (list(zip(*M, strict=True)) for M in (M_a, M_b))
    N_a, N_b = dot_product(Q_a, Q_a), dot_product(Q_b, Q_b)
    return [
        *(dot_product(row, column) for row in b_columns for column in a_columns),
        *(N_a * dot_product(column, x) for column in b_columns),
        *(N_b * dot_product(column, x) for column in a_columns),
        N_a * N_b,
        *(-dot_product(i, cross_product(x, j)) for i in a_columns for j in b_columns),
    ]


def _columns(rows: Sequence[Sequence[int]]) -> list[fmpz_poly]:
    return [from_bernstein(column) for column in zip(*rows, strict=True)]
