// Polynomials on [0, 1] by Bernstein coefficients, each with a bound on its error (trusted).
//
// The exact coefficients lie within `error` of the stored ones, so the exact polynomial lies within
// `error` of the stored one on [0, 1]. With u = 2^-53, |f| = the largest stored coefficient, every
// operation errs by at most u relative to its result or, if that is tiny, by 2^-1074; all bounds
// are rounded up by UP, which pays for the computation of a bound from a few dozen terms.
//
//   - A product has the coefficients h_k = sum w f_i g_j, i + j = k, with w = C(m, i) C(n, j) /
//     C(m + n, k): non-negative, of sum 1. A w errs by 3 u (two exact binomials, as C(40, 20) <
//     2^53, their product and quotient), each term by 2 u more, the sum of at most m + n + 1 terms
//     by m + n: together (m + n + 5) u |f| |g|, and what f and g err adds
//     |f| e_g + |g| e_f + e_f e_g.
//   - A step of de Casteljau's scheme at s, (1 - s) a + s b, errs by 3 u |f|: 1 - s, the products,
//     the sum; by 2 u |f| if 1 - s is exact. It is a mean, which passes on no more error than it
//     got, so a value errs by 3 n u |f|.
#pragma once

#include <cmath>

#include "margin.hpp"

namespace guard {

constexpr int LARGEST_DEGREE = 40;
// Pays for all underflows of an operation; far above their number times 2^-1074.
constexpr double UNDERFLOW_PAID = 0x1p-1000;

struct Polynomial {
  int degree;
  double error = 0.0;
  double c[LARGEST_DEGREE + 1];

  explicit Polynomial(int n = 0) : degree(n) {
    for (int k = 0; k <= n; k++) c[k] = 0.0;
  }

  double size() const {
    double most = 0.0;
    for (int k = 0; k <= degree; k++) most = std::fabs(c[k]) > most ? std::fabs(c[k]) : most;
    return most;
  }
};

// C(n, k) for n <= LARGEST_DEGREE, exact.
struct Binomials {
  double row[LARGEST_DEGREE + 1][LARGEST_DEGREE + 1] = {};

  Binomials() {
    for (int n = 0; n <= LARGEST_DEGREE; n++) {
      row[n][0] = 1.0;
      for (int k = 1; k <= n; k++) row[n][k] = row[n - 1][k - 1] + (k < n ? row[n - 1][k] : 0.0);
    }
  }
};

inline const Binomials BINOMIALS;

inline Polynomial product(const Polynomial& f, const Polynomial& g) {
  int m = f.degree, n = g.degree;
  Polynomial h(m + n);
  for (int i = 0; i <= m; i++)
    for (int j = 0; j <= n; j++) {
      double w = BINOMIALS.row[m][i] * BINOMIALS.row[n][j] / BINOMIALS.row[m + n][i + j];
      h.c[i + j] += w * (f.c[i] * g.c[j]);
    }
  double a = f.size(), b = g.size();
  double rounding = (m + n + 5) * UNIT_ROUNDOFF * a * b;
  h.error = (a * g.error + b * f.error + f.error * g.error + rounding + UNDERFLOW_PAID) * UP;
  return h;
}

// f + sign g; degrees are equal.
inline Polynomial sum(const Polynomial& f, const Polynomial& g, double sign = 1.0) {
  Polynomial h;
  h.degree = f.degree;
  for (int k = 0; k <= f.degree; k++) h.c[k] = f.c[k] + sign * g.c[k];
  h.error = (f.error + g.error + UNIT_ROUNDOFF * h.size()) * UP;
  return h;
}

inline Polynomial constant(double x) {
  Polynomial f;
  f.c[0] = x;
  return f;
}

// The same polynomial, of a higher degree: times 1.
inline Polynomial elevated(const Polynomial& f, int degree) {
  if (f.degree == degree) return f;
  Polynomial one;
  one.degree = degree - f.degree;
  for (int k = 0; k <= one.degree; k++) one.c[k] = 1.0;
  return product(f, one);
}

// f at s in [0, 1], and what bounds its error.
inline double value(const Polynomial& f, double s) {
  double r = 1.0 - s;
  if (f.degree == 3) {  // the same without loops: cubics are asked for most
    double x = r * f.c[0] + s * f.c[1], y = r * f.c[1] + s * f.c[2], z = r * f.c[2] + s * f.c[3];
    return r * (r * x + s * y) + s * (r * y + s * z);
  }
  double b[LARGEST_DEGREE + 1];
  for (int k = 0; k <= f.degree; k++) b[k] = f.c[k];
  for (int top = f.degree; top > 0; top--)
    for (int k = 0; k < top; k++) b[k] = r * b[k] + s * b[k + 1];
  return b[0];
}

inline double value_error(const Polynomial& f) {
  return (f.error + 3.0 * f.degree * UNIT_ROUNDOFF * f.size() + UNDERFLOW_PAID) * UP;
}

// The parts of a polynomial left and right of t, each on [0, 1]; t is a small multiple of 2^-4.
inline void split(const Polynomial& f, double t, Polynomial& left, Polynomial& right) {
  int n = f.degree;
  double r = 1.0 - t;
  right.degree = left.degree = n;
  for (int k = 0; k <= n; k++) right.c[k] = f.c[k];
  left.c[0] = f.c[0];
  for (int k = 1; k <= n; k++) {
    for (int i = 0; i <= n - k; i++) right.c[i] = r * right.c[i] + t * right.c[i + 1];
    left.c[k] = right.c[0];
  }
  double rounding = 2 * n * UNIT_ROUNDOFF * f.size();
  left.error = right.error = (f.error + rounding + UNDERFLOW_PAID) * UP;
}

}  // namespace guard
