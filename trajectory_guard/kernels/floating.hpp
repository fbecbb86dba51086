// The rational motion of a floating joint on one piece (trusted).
//
// A segment of the motion is a rational Bezier curve X(s) = sum_i B_i(s) w_i C_i / sum_i B_i(s) w_i
// of affine displacements with positive weights [Schroecker & Weber 2014, sec. 5 and 7]. The chain
// wants a polynomial of degree 5 in tau (s = m + h tau) and bounds on what is lost.
//
// **Taylor.** De Casteljau's scheme at m leaves after n - k levels k + 1 points; their k-th
// difference times C(n, k) h^k is the coefficient of tau^k, of the numerator N and of the weight w
// alike. A level errs by 2 u of the largest control value B (per entry), the products w_i C_i by u,
// a k-th difference multiplies by 2^k and adds k u, the factor three more; sum_k C(n, k) (2 h)^k =
// (1 + 2 h)^n, so all coefficients together err by at most
//
//     k_n B,      k_n = (4 n + 8) u (1 + 2 h)^n.
//
// **Division.** q_0 ... q_10 are the quotient's first coefficients, found by long division, and
// r = N - q w is what they leave, of degree 10 + n. However the q_k were rounded, with W the
// largest weight and w_min the least, at every instant of the piece
//
//     |X - q| <= (sum_k |r_k| + k_n (B + W sum_k |q_k|)) / w_min.
//
// A residual r_k is a sum of at most 12 products: 16 u (|N_k| + sum_j |w_j| |q_(k-j)|) bounds its
// rounding. Then q is economised to degree 5 as in `economised`; what is dropped and 320 u sum_k
// |q_k| for the rounding (see `margin`) are added.
//
// **Spread.** X(tau) - q_0 = (N - q_0 w) / w, so |X(tau) - X(0)| is at most |tau| sum_{k>0} |N_k -
// q_0 w_k| / w_min, up to what q_0 itself is off, which is bounded as above with k = 0 alone.
#pragma once

#include "economised.hpp"

namespace guard {

constexpr int64_t HIGHEST_DEGREE = 64;
constexpr double LEAST_WEIGHT = 1e-9;
constexpr int QUOTIENT = 2 * TERMS - 1;  // coefficients of the quotient, what `economise` folds

// Bounds for the linear part (Frobenius norm) and for the translation [m].
struct Parts {
  double turn = 0.0, shift = 0.0;
};

// A matrix of displacements by columns, as two vectors.
struct Columns {
  Lanes xy{}, zt{};

  Columns operator+(const Columns& o) const { return {xy + o.xy, zt + o.zt}; }
  Columns operator-(const Columns& o) const { return {xy - o.xy, zt - o.zt}; }
  Columns operator*(double f) const { return {f * xy, f * zt}; }
};

inline Parts norms(const Columns& c) {
  Lanes square = c.zt * c.zt;
  double turn = sum(c.xy * c.xy) + ((square[0] + square[1]) + (square[2] + square[3]));
  double shift = (square[4] + square[5]) + (square[6] + square[7]);
  return {std::sqrt(turn) * UP, std::sqrt(shift) * UP};
}

// Bound the linear parts' norm and the translations [m]; NaN if the motion is not what kernels take.
inline Parts size_of(const Floating& f, int64_t segments) {
  Parts most{1.0, 0.0};
  for (int64_t segment = 0; segment < segments; segment++) {
    const double* bounds = f.bounds + FLOATING_BOUNDS * segment;
    int64_t first = f.first[segment], last = f.first[segment + 1];
    if (!(first < last && last - first <= HIGHEST_DEGREE + 1)) return {NAN, NAN};
    for (int k = 0; k < FLOATING_BOUNDS; k++)
      if (!(bounds[k] >= 0.0 && bounds[k] <= LARGEST)) return {NAN, NAN};
    most.turn = std::fmax(most.turn, 1.0 + bounds[STRETCH]);
    for (int64_t i = first; i < last; i++) {
      Parts size = norms({load(f.control + POSE * i), load(f.control + POSE * i + LANES)});
      if (!(size.turn <= LARGEST && size.shift <= LARGEST)) return {NAN, NAN};
      if (!(f.weight[i] >= LEAST_WEIGHT && f.weight[i] <= LARGEST)) return {NAN, NAN};
      most.shift = std::fmax(most.shift, size.shift + bounds[SHIFT_ERROR]);
    }
  }
  return most;
}

// Bound the spectral norm of a linear part.
//
// Jacobi's rotations turn M^T M almost diagonal; by Gershgorin its largest eigenvalue is at most the
// largest diagonal entry plus what is left beside it. The nine rotations and the product err by less
// than 1000 u times the trace.
inline double spectral_norm(const Columns& c) {
  double m[3][3] = {
      {c.xy[0], c.xy[1], c.xy[2]}, {c.xy[4], c.xy[5], c.xy[6]}, {c.zt[0], c.zt[1], c.zt[2]}};
  double a[3][3], trace = 0.0;
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++) a[i][k] = m[i][0] * m[k][0] + m[i][1] * m[k][1] + m[i][2] * m[k][2];
    trace += a[i][i];
  }
  for (int round = 0; round < 9; round++) {
    int p = round % 3, q = (p + 1) % 3, r = 3 - p - q;
    if (a[p][q] == 0.0) continue;
    double half = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
    double t = std::copysign(1.0, half) / (std::fabs(half) + std::sqrt(half * half + 1.0));
    double cosine = 1.0 / std::sqrt(t * t + 1.0), sine = t * cosine;
    a[p][p] -= t * a[p][q];
    a[q][q] += t * a[p][q];
    a[p][q] = a[q][p] = 0.0;
    double x = a[p][r], y = a[q][r];
    a[p][r] = a[r][p] = cosine * x - sine * y;
    a[q][r] = a[r][q] = sine * x + cosine * y;
  }
  double most = 0.0;
  for (int i = 0; i < 3; i++) {
    double row = a[i][i] + std::fabs(a[i][(i + 1) % 3]) + std::fabs(a[i][(i + 2) % 3]);
    if (row != row) return NAN;
    if (row > most) most = row;
  }
  return std::sqrt(most + 1000.0 * UNIT_ROUNDOFF * trace) * UP;
}

struct FloatingPiece {
  Columns centre;        // power 0 of the quotient
  Columns power[TERMS];  // of tau
  Parts fit;             // distance of the truth to the polynomial
  Parts span;            // how far the truth goes from the centre, linear in tau
  Parts fuzz;            // error of the centre
  Parts size;            // sum of the norms of the quotient's coefficients
};

// The coefficients of numerator and weight in tau.
struct Homogeneous {
  Columns matrix[HIGHEST_DEGREE + 1];
  double weight[HIGHEST_DEGREE + 1];
};

inline void taylor(const Floating& f, int64_t first, int64_t n, double m, double h,
                   Homogeneous& out) {
  Columns a[HIGHEST_DEGREE + 1], d[HIGHEST_DEGREE + 1];
  double w[HIGHEST_DEGREE + 1], v[HIGHEST_DEGREE + 1];
  for (int64_t i = 0; i <= n; i++) {
    w[i] = f.weight[first + i];
    const double* c = f.control + POSE * (first + i);
    a[i] = Columns{load(c), load(c + LANES)} * w[i];
  }
  for (int64_t k = n; k >= 0; k--) {
    // After n - k levels: points 0 ... k.
    for (int64_t i = 0; i <= k; i++) {
      d[i] = a[i];
      v[i] = w[i];
    }
    for (int64_t j = 0; j < k; j++)
      for (int64_t i = 0; i < k - j; i++) {
        d[i] = d[i + 1] - d[i];
        v[i] = v[i + 1] - v[i];
      }
    double scale = binomial(int(n), int(k)) * std::pow(h, double(k));
    out.matrix[k] = d[0] * scale;
    out.weight[k] = v[0] * scale;
    for (int64_t i = 0; i < k; i++) {
      a[i] = a[i] * (1.0 - m) + a[i + 1] * m;
      w[i] = (1.0 - m) * w[i] + m * w[i + 1];
    }
  }
}

// Write the polynomial of a segment on [m - h, m + h] and its bounds; what cannot be bounded is
// infinite or NaN, and no comparison with it closes a pair.
inline void fit_floating(const Floating& f, int64_t segment, double m, double h,
                         FloatingPiece& out) {
  int64_t first = f.first[segment], n = f.first[segment + 1] - first - 1;
  Homogeneous exact;
  taylor(f, first, n, m, h, exact);
  double least = INFINITY, most = 0.0;
  Columns largest;
  for (int64_t i = first; i <= first + n; i++) {
    double w = f.weight[i];
    least = w < least ? w : least;
    most = w > most ? w : most;
    Columns c = Columns{load(f.control + POSE * i), load(f.control + POSE * i + LANES)} * w;
    Lanes xy = absolute(c.xy), zt = absolute(c.zt);
    largest.xy = xy > largest.xy ? xy : largest.xy;
    largest.zt = zt > largest.zt ? zt : largest.zt;
  }
  double rounding = (4.0 * double(n) + 8.0) * UNIT_ROUNDOFF * std::pow(1.0 + 2.0 * h, double(n)) *
                    (1.0 + 0x1p-40);
  Parts control = norms(largest), own[QUOTIENT];
  // Long division; power k of the quotient times the weight's power j is taken from power k + j.
  Columns q[QUOTIENT];
  out.fit = out.span = out.size = Parts{};
  for (int64_t k = 0; k < QUOTIENT + n; k++) {
    Columns left{};
    Parts bulk{};
    if (k <= n) {
      left = exact.matrix[k];
      bulk = norms(left);
    }
    for (int64_t j = k < QUOTIENT ? 1 : k - QUOTIENT + 1; j <= n && j <= k; j++) {
      left = left - q[k - j] * exact.weight[j];
      bulk.turn += std::fabs(exact.weight[j]) * own[k - j].turn;
      bulk.shift += std::fabs(exact.weight[j]) * own[k - j].shift;
    }
    if (k < QUOTIENT) {
      q[k] = left * (1.0 / exact.weight[0]);
      own[k] = norms(q[k]);
      left = left - q[k] * exact.weight[0];
      bulk.turn += std::fabs(exact.weight[0]) * own[k].turn;
      bulk.shift += std::fabs(exact.weight[0]) * own[k].shift;
      out.size.turn += own[k].turn;
      out.size.shift += own[k].shift;
    }
    Parts rest = norms(left);
    out.fit.turn += rest.turn + 16.0 * UNIT_ROUNDOFF * bulk.turn;
    out.fit.shift += rest.shift + 16.0 * UNIT_ROUNDOFF * bulk.shift;
    if (k == 0) {
      out.fuzz.turn = (out.fit.turn + rounding * (control.turn + most * own[0].turn)) / least * UP;
      out.fuzz.shift =
          (out.fit.shift + rounding * (control.shift + most * own[0].shift)) / least * UP;
    } else if (k <= n) {
      Parts off = norms(exact.matrix[k] - q[0] * exact.weight[k]);
      double w = std::fabs(exact.weight[k]);
      out.span.turn +=
          off.turn + 4.0 * UNIT_ROUNDOFF * (norms(exact.matrix[k]).turn + w * own[0].turn);
      out.span.shift +=
          off.shift + 4.0 * UNIT_ROUNDOFF * (norms(exact.matrix[k]).shift + w * own[0].shift);
    }
  }
  out.span.turn *= UP / least;
  out.span.shift *= UP / least;
  out.fit.turn += rounding * (control.turn + most * out.size.turn);
  out.fit.shift += rounding * (control.shift + most * out.size.shift);
  out.centre = q[0];
  Lanes xy[QUOTIENT], zt[QUOTIENT];
  for (int k = 0; k < QUOTIENT; k++) {
    xy[k] = q[k].xy;
    zt[k] = q[k].zt;
  }
  economise(xy);
  economise(zt);
  Parts gone{};
  double scale = 1.0 / 32.0;
  for (int k = 0; k < QUOTIENT; k++) {
    if (k < TERMS) {
      out.power[k] = {xy[k], zt[k]};
      continue;
    }
    Parts drop = norms({xy[k], zt[k]});
    gone.turn += drop.turn * scale;
    gone.shift += drop.shift * scale;
    scale *= 0.5;
  }
  out.fit.turn = (out.fit.turn / least + gone.turn + 320.0 * UNIT_ROUNDOFF * out.size.turn) * UP;
  out.fit.shift =
      (out.fit.shift / least + gone.shift + 320.0 * UNIT_ROUNDOFF * out.size.shift) * UP;
}

}  // namespace guard
