// Polynomial motion of every node of a chain, economised after every joint (trusted).
//
// The space of affine displacements is linear, so weights may be 1: keep the pose of a node as a
// polynomial of degree 5 in tau on [-1, 1] and push what is above degree 5 down after every
// product. Building the rational curve costs degree 6 per joint; this costs the same for every
// joint.
//
// **Economising** replaces c tau^k by c (tau^k - 2^(1-k) T_k), from the top down, an error of at
// most |c| 2^(1-k).
//
// **Angle.** phi = sum_{i>=1} d_i tau^i, |phi| <= Phi < 1.5. With y = phi^2 economised (error e_y),
// cosine and sine are their Taylor sums to phi^8 and phi^9 by Horner's rule in y; a product of a
// factor H with error e_H and y has the error |H| e_y + |y| e_H plus what is dropped, and the
// series end with at most Phi^10 / 10! and Phi^11 / 11!. So the joint's matrix differs from a
// rotation by at most delta = sqrt(e_cos^2 + e_sin^2) in the plane across its axis.
//
// **Chain.** Let G_j be the polynomial pose of node j as stored, rounding included, and q_j the
// point in node j's frame at the true positions of all joints beyond j. Comparing consecutive nodes
// *on the same true point* telescopes the error of the whole chain into
//
//     sum_j | G_j(q_j) - G_{j-1}(M_j R_j q_j) |
//       <= sum_j rho_j (delta_j (1 + eps_{j-1}) + trunc_j) + rounding_j,
//
// where rho_j bounds the distance of q_j to the axis (the error of the rotation and the dropped
// matrices, which have only the columns x and y, act on that distance), trunc_j = sum_k ||c_k||_F
// 2^(1-k) over the dropped coefficient matrices, and eps_j = eps_{j-1} + delta_j (1 + eps_{j-1}) +
// trunc_j bounds the deviation of the linear part from a rotation. Nothing is transported, because
// each difference is taken with the true remainder of the chain. A slide adds the z column times
// its polynomial: only trunc_j, with the norm of the dropped translations and rho_j = 1. The
// rounding is in `margin`.
#pragma once

#include "margin.hpp"
#include "values.hpp"

namespace guard {

constexpr double LARGEST_ANGLE = 1.5;
constexpr int CONTROLS = 13;  // control points: degree 5 raised to 12, which draws the hull tight
constexpr int CONTROL_ROW = 16;  // room for them in whole vectors; the last one is repeated
constexpr double MAJORANT = 8.0;
// Rounding of cosine and sine, in u: three economised products each and one more for the sine, on
// one-norms below 2.3, with their error bounds as much again, come to less than 700 at the largest
// angle.
constexpr double SERIES = 1024.0;
constexpr int POSE = 16;  // a pose by columns x, y, z, t of 4, the fourth entry unused
constexpr double LARGEST_ENTRY = 1e100;  // beyond it products might overflow: the piece is unsound

// The coefficients of a product of two polynomials of degree 5.
template <class T>
inline void product(const T* a, const T* b, T* p) {
  for (int k = 0; k < 2 * TERMS - 1; k++) p[k] = T{};
  for (int i = 0; i < TERMS; i++)
    for (int k = 0; k < TERMS; k++) p[i + k] += a[i] * b[k];
}

// Fold a polynomial of degree 10 into degree 5 in place; p[6] ... p[10] then hold what is dropped.
// The constants are those of tau^k - 2^(1-k) T_k, exact in binary.
template <class T>
inline void economise(T* p) {
  p[8] += 2.5 * p[10];
  p[6] -= 2.1875 * p[10];
  p[4] += 0.78125 * p[10];
  p[2] -= 0.09765625 * p[10];
  p[0] += 0.001953125 * p[10];
  p[7] += 2.25 * p[9];
  p[5] -= 1.6875 * p[9];
  p[3] += 0.46875 * p[9];
  p[1] -= 0.03515625 * p[9];
  p[6] += 2.0 * p[8];
  p[4] -= 1.25 * p[8];
  p[2] += 0.25 * p[8];
  p[0] -= 0.0078125 * p[8];
  p[5] += 1.75 * p[7];
  p[3] -= 0.875 * p[7];
  p[1] += 0.109375 * p[7];
  p[4] += 1.5 * p[6];
  p[2] -= 0.5625 * p[6];
  p[0] += 0.03125 * p[6];
}

inline double absolute(double x) {
  return std::fabs(x);
}

// The error of dropping p[6] ... p[10].
template <class T>
inline T dropped(const T* p) {
  return absolute(p[6]) / 32.0 + absolute(p[7]) / 64.0 + absolute(p[8]) / 128.0 +
         absolute(p[9]) / 256.0 + absolute(p[10]) / 512.0;
}

// h = a0 + y (a1 + y (a2 + y (a3 + y a4))) by Horner's rule; returns a bound on its error.
template <class T>
inline T series(const T* y, const double* a, T y_max, T y_error, T* h) {
  T p[2 * TERMS - 1];
  for (int k = 0; k < TERMS; k++) h[k] = a[4] * y[k];
  h[0] += a[3];
  // `size` bounds the exact factor, `error` its distance to the stored one.
  T error = std::fabs(a[4]) * y_error;
  T size = std::fabs(a[4]) * y_max + std::fabs(a[3]);
  for (int i = 2; i >= 0; i--) {
    product(h, y, p);
    economise(p);
    for (int k = 0; k < TERMS; k++) h[k] = p[k];
    h[0] += a[i];
    error = size * y_error + (y_max + y_error) * error + dropped(p);
    size = size * y_max + std::fabs(a[i]);
  }
  return error;
}

inline double root(double x) {
  return std::sqrt(x);
}

// Cosine and sine of a turn as polynomials of degree 5; returns delta.
//
// phi: TERMS coefficients, the first zero [rad]; span bounds |phi|, below LARGEST_ANGLE [rad].
template <class T>
inline T fit_rotation(const T* phi, T span, T* cosine, T* sine) {
  constexpr double FACTORIAL_10 = 3628800.0, FACTORIAL_11 = 39916800.0;
  static const double of_cosine[] = {1.0, -0.5, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0};
  static const double of_sine[] = {1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362880.0};
  T y[2 * TERMS - 1], h[TERMS], p[2 * TERMS - 1];
  product(phi, phi, y);
  economise(y);
  T y_error = dropped(y);
  T y_max = span * span;
  T cosine_error = series(y, of_cosine, y_max, y_error, cosine);
  T h_error = series(y, of_sine, y_max, y_error, h);
  product(h, phi, p);
  economise(p);
  for (int k = 0; k < TERMS; k++) sine[k] = p[k];
  T fifth = y_max * y_max * y_max * y_max * y_max;
  cosine_error += fifth / FACTORIAL_10;
  T sine_error = span * h_error + dropped(p) + fifth * span / FACTORIAL_11;
  T delta = root(cosine_error * cosine_error + sine_error * sine_error);
  return (delta + SERIES * UNIT_ROUNDOFF) * UP;
}

// The polynomial pose of a node: power k of tau is the pose at power[k].
struct Polynomial {
  alignas(64) double power[TERMS][POSE];
};

// What building a node adds up.
struct Growth {
  double fit;    // what the joint adds to a point's error per lever arm
  double eps;    // deviation of the linear part from a rotation
  double size;   // S, see `margin`
  double kappa;  // the largest majorant along the chain
};

inline Lanes twice_low(Lanes x) {
  return __builtin_shufflevector(x, x, 0, 1, 2, 3, 0, 1, 2, 3);
}
inline Lanes twice_high(Lanes x) {
  return __builtin_shufflevector(x, x, 4, 5, 6, 7, 4, 5, 6, 7);
}
inline Lanes pair(double low, double high) {
  return Lanes{low, low, low, low, high, high, high, high};
}

// out = pose times local, both by columns; `out` may be `pose`.
inline void compose(const double* pose, const double* local, double* out) {
  Lanes xy = load(pose), zt = load(pose + LANES);
  Lanes x = twice_low(xy), y = twice_high(xy), z = twice_low(zt);
  const double* l = local;
  Lanes t = __builtin_shufflevector(zt, all(0.0), 8, 8, 8, 8, 4, 5, 6, 7);
  store(out, x * pair(l[0], l[4]) + y * pair(l[1], l[5]) + z * pair(l[2], l[6]));
  store(out + LANES, (x * pair(l[8], l[12]) + y * pair(l[9], l[13]) + z * pair(l[10], l[14])) + t);
}

// Sum_k ||c_k||_F 2^(1-k) over the dropped powers 6 ... 10 of all lanes.
inline double loss(const Lanes* p) {
  double total = 0.0, scale = 1.0 / 32.0;
  for (int k = TERMS; k < 2 * TERMS - 1; k++, scale *= 0.5)
    total += std::sqrt(sum(p[k] * p[k])) * scale;
  return total;
}

// Turn the columns x and y of a polynomial pose in place; returns trunc.
inline double turn_columns(Polynomial& q, const double* cosine, const double* sine) {
  Lanes p[2 * TERMS - 1];
  for (int k = 0; k < 2 * TERMS - 1; k++) p[k] = all(0.0);
  for (int k = 0; k < TERMS; k++) {
    Lanes xy = load(q.power[k]);
    Lanes yx = __builtin_shufflevector(xy, -xy, 4, 5, 6, 7, 8, 9, 10, 11);
    for (int i = 0; i < TERMS; i++) p[i + k] += cosine[i] * xy + sine[i] * yx;
  }
  economise(p);
  for (int k = 0; k < TERMS; k++) store(q.power[k], p[k]);
  return loss(p);
}

// Add the z column times a polynomial to the translation in place; returns trunc.
inline double slide_column(Polynomial& q, const double* phi) {
  Lanes p[2 * TERMS - 1];
  for (int k = 0; k < 2 * TERMS - 1; k++) p[k] = all(0.0);
  for (int k = 0; k < TERMS; k++) {
    Lanes z = load(q.power[k] + LANES);
    z = __builtin_shufflevector(z, all(0.0), 8, 8, 8, 8, 0, 1, 2, 3);
    for (int i = 0; i < TERMS; i++) p[i + k] += phi[i] * z;
  }
  economise(p);
  for (int k = 0; k < TERMS; k++) store(q.power[k] + LANES, load(q.power[k] + LANES) + p[k]);
  return loss(p);
}

// Write the polynomial pose of a node from that of the node above (null: the root).
//
// local: pose in the parent's frame at the centre; span bounds the joint's motion about it (0: it
// stands), phi its polynomial; cosine, sine, delta: from fit_rotation where span is below
// LARGEST_ANGLE.
inline Growth extend(const Polynomial* above, const Growth* before, int64_t kind,
                     const double* local, double span, const double* phi, const double* cosine,
                     const double* sine, double delta, Polynomial& q) {
  Growth g{0.0, 0.0, 2.0, MAJORANT};
  if (above == nullptr) {
    std::memcpy(q.power[0], local, sizeof q.power[0]);
    std::memset(q.power[1], 0, (TERMS - 1) * sizeof q.power[0]);
  } else {
    for (int k = 0; k < TERMS; k++) compose(above->power[k], local, q.power[k]);
    g = *before;
    g.fit = 0.0;
  }
  double upper = g.size;
  if (span != 0.0) {
    if (kind != REVOLUTE) {
      g.kappa = std::fmax(g.kappa, MAJORANT * upper);
      g.fit = slide_column(q, phi) * UP;
    } else if (span < LARGEST_ANGLE) {
      double length = 0.0;
      for (int k = 0; k < TERMS; k++) length += std::fabs(cosine[k]) + std::fabs(sine[k]);
      g.kappa = std::fmax(g.kappa, MAJORANT * length * upper);
      g.fit = (delta * (1.0 + g.eps) + turn_columns(q, cosine, sine)) * UP;
      g.eps = (g.eps + g.fit) * UP;
    } else {
      // Too far for the series: the joint stands, and its turn is all error.
      g.fit = (span < 2.0 ? span : 2.0) * (1.0 + g.eps) * UP;
      if (!(g.fit >= 0.0)) g.fit = INFINITY;
      g.eps = (g.eps + g.fit) * UP;
    }
  }
  double total = 0.0;
  for (int k = 0; k < TERMS; k++) {
    Lanes xy = load(q.power[k]), zt = load(q.power[k] + LANES);
    zt = __builtin_shufflevector(zt, all(0.0), 0, 1, 2, 3, 8, 8, 8, 8);
    total += std::sqrt(sum(xy * xy + zt * zt));
  }
  g.size = total;
  g.kappa = std::fmax(g.kappa, MAJORANT * total);
  return g;
}

// The control points of a node: entry (row r, column c) of all of them is row 3 c + r.
struct Controls {
  alignas(64) double entry[12][CONTROL_ROW];
};

inline double binomial(int n, int k) {
  double c = k < 0 || k > n ? 0.0 : 1.0;
  for (int i = 0; i < k && c > 0.0; i++) c = c * (n - i) / (i + 1);
  return c;
}

// The Bernstein coefficients of tau^k, tau = 2 s - 1, at degree 12, by rows of k.
struct Basis {
  double row[TERMS][CONTROL_ROW];

  // tau^k 1^(n-k) = (s - v)^k (s + v)^(n-k) with v = 1 - s, exact in integers, over the binomials.
  Basis() {
    constexpr int n = CONTROLS - 1;
    for (int k = 0; k < TERMS; k++) {
      double c[CONTROLS] = {1.0};
      for (int step = 0; step < n; step++)
        for (int i = step + 1; i >= 0; i--)
          c[i] = (i > 0 ? c[i - 1] : 0.0) + (step < k ? -1.0 : 1.0) * (i <= step ? c[i] : 0.0);
      for (int i = 0; i < CONTROL_ROW; i++) row[k][i] = i <= n ? c[i] / binomial(n, i) : row[k][n];
    }
  }
};

inline const Basis BASIS;

// Write the control points of a polynomial pose; false if an entry is not finite and moderate.
inline bool control_points(const Polynomial& q, Controls& points) {
  Lanes total = all(0.0);
  for (int c = 0; c < 4; c++)
    for (int r = 0; r < 3; r++) {
      int e = 4 * c + r;
      Lanes low = all(q.power[0][e]), high = low;
      for (int k = 1; k < TERMS; k++) {
        low += q.power[k][e] * load(BASIS.row[k]);
        high += q.power[k][e] * load(BASIS.row[k] + LANES);
      }
      store(points.entry[3 * c + r], low);
      store(points.entry[3 * c + r] + LANES, high);
      total += absolute(low) + absolute(high);
    }
  return sum(total) < LARGEST_ENTRY;  // NaN fails
}

}  // namespace guard
