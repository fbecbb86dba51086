// One joint on one piece of time, and the poses at its centre (trusted).
//
// On a piece [k, k+1] / 2^n of a segment, s = m + h tau with tau in [-1, 1]; m and h are dyadic and
// exact. The joint moves as q = d_0 + phi(tau), phi = sum_{i>=1} d_i tau^i.
//
// **Rounding of the angle.** The Taylor shift of a polynomial of degree 5 to m in [0, 1] is 15
// multiply-adds and one scaling; relative to sum |c_k| all coefficients together err by less than
// 32 u: the shifted polynomial is scaled by h^k, and h + m <= 1 keeps the sum of h^k times the
// shifted majorant below that sum. Central angle, sine and cosine add 4 u.
#pragma once

#include <cmath>

#include "economised.hpp"

namespace guard {

constexpr double SHIFT = 32.0;

struct Piece {
  int64_t segment, numerator;
  int64_t level;

  double half() const { return std::ldexp(1.0, -static_cast<int>(level) - 1); }
  double centre() const { return (2.0 * static_cast<double>(numerator) + 1.0) * half(); }
};

// Write the polynomial of a joint in tau; returns bounds on |q - d_0| and on the rounding of q.
struct Restricted {
  double span, fuzz;
};

inline Restricted restrict_to(const double* coefficients, double m, double h, double* d) {
  double size = 0.0;
  for (int k = 0; k < TERMS; k++) {
    d[k] = coefficients[k];
    size += std::fabs(d[k]);
  }
  for (int i = 0; i < TERMS - 1; i++)
    for (int k = TERMS - 2; k >= i; k--) d[k] += m * d[k + 1];
  double scale = 1.0, span = 0.0;
  for (int k = 1; k < TERMS; k++) {
    scale *= h;
    d[k] *= scale;
    span += std::fabs(d[k]);
  }
  return {span * UP, SHIFT * UNIT_ROUNDOFF * size + 4.0 * UNIT_ROUNDOFF};
}

// Write the pose of a node in its parent's frame at one joint value, by columns.
inline void turn(const Chain& chain, int64_t j, double value, double* local) {
  const double* fixed = chain.transform + 12 * j;
  double c = 1.0, s = 0.0, slide = 0.0;
  if (chain.kind[j] == REVOLUTE) {
    c = std::cos(value);
    s = std::sin(value);
  } else {
    slide = value;
  }
  for (int r = 0; r < 3; r++) {
    double x = fixed[4 * r], y = fixed[4 * r + 1], z = fixed[4 * r + 2];
    local[r] = c * x + s * y;
    local[4 + r] = c * y - s * x;
    local[8 + r] = z;
    local[12 + r] = fixed[4 * r + 3] + slide * z;
  }
  local[3] = local[7] = local[11] = local[15] = 0.0;
}

// The image of a point under a pose by columns.
inline void image(const double* pose, const double* x, double* out) {
  for (int r = 0; r < 3; r++)
    out[r] = pose[r] * x[0] + pose[4 + r] * x[1] + pose[8 + r] * x[2] + pose[12 + r];
}

}  // namespace guard
