// Rounding margins (trusted), derived in one place.
//
// Let u = 2^-53. Every bound is `constant * u * size`, where *size* bounds the coordinates that
// enter, never an absolute number, so it scales from micrometres to kilometres. Products and sums
// are never fused (-ffp-contract=off), so each operation errs by at most u relative to its result;
// n operations in a row by gamma_n = n u / (1 - n u) < 1.01 n u for the n here.
//
// **A node of the polynomial chain** (`economised`). The error of a chain is telescoped over its
// nodes on the true point q of the node's frame, so each node's rounding counts once and is not
// transported. |q| <= reach, which also bounds the sum of all offsets. Let S be the sum over the
// powers of the Frobenius norms of the linear part of the pose above, c + s the sum of the
// absolute coefficients of cosine and sine (c >= 1), and kappa >= 8 (c + s) S; where no joint
// moves c + s = 1.
//   - The constant transform T_j R(theta_c) is the rounded image of an exactly rigid one: origin,
//     alignment, sine, cosine and one product leave 16 u an entry, 48 u as a matrix, and as much
//     on the offsets. Applying it takes 3 products and 3 sums an entry, 4 u sqrt(3). Together less
//     than (48 + 7 + 16) u S reach < 9 u kappa reach.
//   - The turn: a coefficient of the product of degree 10 is a sum of at most 6 terms of two
//     products each, 8 roundings at most on each: 8 u (c + s) S reach = u kappa reach.
//   - Economising: with all constants taken by their absolute values the five steps raise the
//     one-norm of the coefficients to at most 31 times (tau^10 alone; 12 times for the others), and
//     each coefficient passes at most 10 operations: 310 u (c + s) S reach < 39 u kappa reach. The
//     dropped coefficients are computed with the same error, and their bound weighs it by 1/32 or
//     less: 1 u more.
//   - Bernstein coefficients: |tau^k| <= 1 has coefficients in [-1, 1]; 6 products and sums, and
//     the rounded basis, on the linear part and on the translation: 16 u S reach = 2 u kappa
//     reach.
// These are 52 u kappa reach, less than 64 u.
//
// **A node of the rational chain** (`rational`). kappa is the product over the moving joints of
// max_i (|c_i| + |s_i|) / w_i (Bernstein coefficients of 1-u^2, 2u, 1+u^2): it bounds the columns
// of an exact control matrix over its weight. A step is the constant transform, (16 + 4) u, then a
// convolution with at most 7 coefficients a column, two products each, 14 u, and the products of
// the three-term polynomials in the coefficients, 24 u; sqrt(3) twice for the norms: below 3 * 62
// u < 192 u. Errors of earlier steps are transported by factors that kappa contains, so they add;
// the division by the weight is one more rounding.
//
// Both are below
//
//     CHAIN * (depth + 1) * u * kappa * reach,         CHAIN = 256,
//
// where kappa is the largest along the chain and depth counts every rounded transform, so the
// folding of fixed joints is inside.
//
// **Separating plane** (`separation`). With |n| <= 1 + 18u the gradient g = P^T n is 3 products
// and sums, g.x + offset 4 more, on numbers up to kappa reach; n.p is 5 on |obstacle|; the disc
// adds 8, the sphere that lets a control point be skipped 12, the comparison 1: at most 30
// roundings, and 18 for the length of n:
//
//     PLANE * u * (kappa * reach + |obstacle|),        PLANE = 64.
//
// A turning plane has directions of length up to 2 and means of three such terms with weights that
// add up to 1: less than twice the same, once more in its allowance.
//
// **Sphere against box** (`cull`). A point is brought into the box's frame by 3 dot products and
// its distance formed by 3 squares and a root, 18 roundings on numbers up to twice the
// coordinates:
//
//     SPHERE * u * (reach + |obstacle|),               SPHERE = 64.
#pragma once

namespace guard {

constexpr double UNIT_ROUNDOFF = 0x1p-53;
constexpr double CHAIN = 256.0;
constexpr double PLANE = 64.0;
constexpr double SPHERE = 64.0;
// Sums of at most a few dozen non-negative terms, each rounded: multiply by this to round upward.
constexpr double UP = 1.0 + 0x1p-44;

// Bound the rounding of a point of a link's control polygon [m].
inline double chain_margin(double depth, double kappa, double reach) {
  return CHAIN * (depth + 1.0) * UNIT_ROUNDOFF * kappa * reach;
}

// Bound the rounding of the separating inequality [m].
inline double plane_margin(double kappa, double reach, double obstacle) {
  return PLANE * UNIT_ROUNDOFF * (kappa * reach + obstacle);
}

// Bound the rounding of the distance between a point and an oriented box [m].
inline double sphere_margin(double reach, double obstacle) {
  return SPHERE * UNIT_ROUNDOFF * (reach + obstacle);
}

}  // namespace guard
