// Rounding margins (trusted), derived in one place.
//
// Let u = 2^-53. Every bound is `constant * u * size`, where *size* bounds the coordinates that
// enter, never an absolute number, so it scales from micrometres to kilometres. Products and sums
// are never fused (-ffp-contract=off), so each operation errs by at most u relative to its result;
// n operations in a row by gamma_n = n u / (1 - n u) < 1.01 n u for the n here.
//
// **A node of the polynomial chain** (`economised`). The error of a chain is telescoped over its
// nodes on the true point, so each node's rounding counts once and is not transported. Let S be the
// sum over the powers of the Frobenius norms of the pose's linear part in the node above, and q the
// node's point, |q| <= reach, which also bounds all offsets.
//   - The constant transform T_j R(theta_c): its entries are the rounded image of an exactly rigid
//     one; origin, alignment, sine and cosine and one product are within 16 u. Acting on a pose it
//     takes 3 products and 3 sums: 6 u. Together 22 u S sqrt(3) reach < 40 u S reach.
//   - The turn: a coefficient of the degree-10 product is a sum of at most 12 products of entries
//     of the columns x and y with coefficients of cosine and sine, 12 roundings at most on each
//     term: 12 u (|cos|_1 + |sin|_1) S, the one-norms over the coefficients.
//   - Economising: the row sums of |tau^k - 2^(1-k) T_k| for k = 6 ... 10 compound to a matrix with
//     one-norm below 7, five steps of two operations each: 10 u * 7 < 70 u of the same size, and
//     the kept error bound of a dropped coefficient is that of its computed value plus as much.
//   - Bernstein coefficients: |tau^k| has coefficients in [-1, 1], 6 products and sums: 12 u S.
// With kappa = 8 (|cos|_1 + |sin|_1) S >= 8 S, where 8 > sqrt(3) sqrt(12) / ... covers the column
// count of both columns x and y acting on |q| (sqrt(2)) and the factor 7 of economising, these are
// below (40 / 8 + (12 * 1.5 + 12 + 22) ) u kappa reach < 128 u kappa reach a node.
//
// **A node of the rational chain** (`rational`). kappa is the product over the moving joints of
// max_i (|c_i| + |s_i|) / w_i (Bernstein coefficients of 1-u^2, 2u, 1+u^2): it bounds the columns of
// an exact control matrix over its weight. A step is the constant transform, (16 + 4) u, then a
// convolution with at most 7 coefficients a column, two products each, 14 u, and the products of
// the three-term polynomials in the coefficients, 24 u; sqrt(3) twice for the norms: below
// 3 * 62 u < 192 u. Errors of earlier steps are transported by factors that kappa contains, so they
// add; the division by the weight is one more rounding.
//
// Both are below
//
//     CHAIN * (depth + 1) * u * kappa * reach,         CHAIN = 256,
//
// depth counting every rounded transform, so the folding of fixed joints is inside.
//
// **Separating plane** (`separation`). With |n| <= 1 + 4u the gradient g = P^T n is 3 products and
// sums, g.x + offset 4 more, on numbers up to kappa reach; n.p is 5 on |obstacle|; the disc adds 8,
// the sphere that lets a control point be skipped 12, the comparison 1: at most 30 roundings:
//
//     PLANE * u * (kappa * reach + |obstacle|),        PLANE = 64.
//
// A turning plane n(tau) = n + tau m has |n +- m| <= 2, two such terms and a mean of two: the same
// with PLANE doubled.
//
// **Sphere against box** (`cull`). A point is brought into the box's frame by 3 dot products and its
// distance formed by 3 squares and a root, 18 roundings on numbers up to twice the coordinates:
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
