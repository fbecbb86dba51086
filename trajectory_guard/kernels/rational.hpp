// Rational motion of every link of a chain on one piece (trusted).
//
// With u = tan(angle / 2) a rotation about z is (1 / (1 + u^2)) [[1-u^2, -2u], [2u, 1-u^2]]: a
// rational curve. A chain of such rotations, constant rigid transforms and polynomial slides is a
// rational Bezier curve in the 12-dimensional space of affine displacements [Schroecker & Weber
// 2014, sec. 6] of degree 6 per moving revolute joint and 3 per moving prismatic one. All factors
// are kept in the *scaled* Bernstein basis b_i C(n, i), in which a product is a plain convolution
// and the binomials cancel in C_i / w_i. If every weight is positive the link's point x lies, at
// every instant of the piece, in the convex hull of the points C_i x / w_i.
//
// **Half-angle.** With x = phi / 2 and X = sum_{i>=1} |d_i| / 2 < 1 the rational rotation with
// u(tau) ~ tan(x) has the angle 2 atan(u), and because atan is 1-Lipschitz
//
//     |2 atan u - phi| <= 2 |u - tan x| <= 2 (|u - x - x^3/3| + r),
//     |r| <= (2/15) X^5 / (1 - 0.41 X^2).
//
// The Taylor coefficients of tan beyond x^3/3 are positive and their ratios increase to 4/pi^2 <
// 0.41, which gives r. The polynomial x + x^3/3 is economised to degree 3 from the top down: tau^k
// is replaced by tau^k - 2^(1-k) T_k(tau), an error of at most 2^(1-k) times its coefficient. The
// fit's own rounding is below 64 u X.
#pragma once

#include <vector>

#include "motion.hpp"

namespace guard {

constexpr int FIT = 3;                       // degree of u
constexpr int POWERS = 3 * (TERMS - 1) + 1;  // coefficients of x^3
constexpr double LARGEST_HALF_ANGLE = 0.9;   // beyond it the joint is frozen, its turn all error
constexpr double SLIDE_GROWTH =
    2.0;  // bounds 25/16: a cubic's Bernstein coefficients over its size
// A weight much smaller than its columns would carry a relative error that no margin counts.
constexpr double LARGEST_RATIO = 4.0;
constexpr int ROW = 13;  // a control matrix, rows of [C | t], and its weight

// Reduce a polynomial of degree `top` on [-1, 1] to degree 3; returns a bound on the change.
inline double economise_to_cubic(double* p, int top) {
  double gone = 0.0;
  for (int k = top; k > FIT; k--) {
    double c = p[k];
    if (c == 0.0) continue;
    // tau^k - 2^(1-k) T_k, coefficients by the recurrence of T_k from the top; exact in double.
    double t = 1.0;
    for (int i = k - 2, m = 1; i >= 0; i -= 2, m++) {
      t = -t * double((i + 2) * (i + 1)) / double(4 * m * (k - m));
      p[i] -= c * t;
    }
    gone += std::fabs(c) * std::ldexp(1.0, 1 - k);
  }
  return gone * UP;
}

// The scaled Bernstein coefficients of a cubic on [-1, 1].
inline void scaled_bernstein(const double* p, double* out) {
  out[0] = p[0] - p[1] + p[2] - p[3];
  out[1] = 3.0 * p[0] - p[1] - p[2] + 3.0 * p[3];
  out[2] = 3.0 * p[0] + p[1] - p[2] - 3.0 * p[3];
  out[3] = p[0] + p[1] + p[2] + p[3];
}

// Fit u ~ tan(phi / 2) by a cubic; returns a bound on |2 atan(u) - phi| (frozen: on |phi|) [rad].
inline double fit_half_angle(const double* d, double span, double* u) {
  double x_max = 0.5 * span;
  if (!(x_max < LARGEST_HALF_ANGLE)) {
    u[0] = u[1] = u[2] = u[3] = 0.0;
    return span;
  }
  double p[POWERS] = {};
  int top = TERMS - 1;
  while (top > 1 && d[top] == 0.0) top--;
  for (int a = 1; a <= top; a++) {
    double xa = 0.5 * d[a];
    p[a] += xa;
    for (int b = 1; b <= top; b++) {
      double xab = xa * 0.5 * d[b] / 3.0;
      for (int c = 1; c <= top; c++) p[a + b + c] += xab * 0.5 * d[c];
    }
  }
  double gone = economise_to_cubic(p, 3 * top);
  scaled_bernstein(p, u);
  double square = x_max * x_max;
  double rest = (2.0 / 15.0) * square * square * x_max / (1.0 - 0.41 * square);
  return (2.0 * (gone + rest) + 64.0 * UNIT_ROUNDOFF * x_max) * UP;
}

// Reduce the polynomial of a slide to a cubic about its centre; returns a bound on the change [m].
inline double fit_slide(const double* d, double* u) {
  double p[TERMS] = {0.0, d[1], d[2], d[3], d[4], d[5]}, size = 0.0;
  for (int i = 1; i < TERMS; i++) size += std::fabs(d[i]);
  double gone = economise_to_cubic(p, TERMS - 1);
  scaled_bernstein(p, u);
  return (gone + 64.0 * UNIT_ROUNDOFF * size) * UP;
}

// A joint's rational motion, scaled Bernstein coefficients of 1 - u^2, 2u, 1 + u^2.
struct Factors {
  double cosine[7], sine[7], weight[7];
  int degree;
  double kappa;  // max (|cosine| + |sine|) / weight; infinite if a weight is not positive
};

inline Factors factors(int64_t kind, const double* u) {
  if (kind != REVOLUTE) return {{}, {}, {1.0, 3.0, 3.0, 1.0}, FIT, SLIDE_GROWTH};
  static const double ONES[7] = {1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0};
  Factors f{{}, {}, {}, 6, 1.0};
  for (int i = 0; i < 4; i++) {
    for (int k = 0; k < 4; k++) f.weight[i + k] += u[i] * u[k];
    f.sine[i] += 2.0 * u[i];
    f.sine[i + 1] += 6.0 * u[i];
    f.sine[i + 2] += 6.0 * u[i];
    f.sine[i + 3] += 2.0 * u[i];
  }
  for (int i = 0; i < 7; i++) {
    double square = f.weight[i];
    f.cosine[i] = ONES[i] - square;
    f.weight[i] = ONES[i] + square;
    double ratio = (std::fabs(f.cosine[i]) + std::fabs(f.sine[i])) / f.weight[i];
    if (!(f.weight[i] > 0.0 && ratio < LARGEST_RATIO)) f.kappa = INFINITY;
    f.kappa = std::fmax(f.kappa, ratio);
  }
  return f;
}

// A link's motion on a piece: control matrices over their weights, rows of [C | t].
struct RationalLink {
  std::vector<double> matrices, weights;
  double error;  // without tracking [m]
  double kappa;
  bool sound;
};

// Build the rational motion of a body's node; the nodes above are needed and centred.
inline RationalLink rational_link(const Motion& motion, int64_t b) {
  std::vector<int64_t> way;
  for (int64_t j = motion.links.range(b, NODE); j >= 0; j = motion.chain.parent[j])
    way.insert(way.begin(), j);
  std::vector<double> now(ROW, 0.0);
  now[0] = now[5] = now[10] = now[12] = 1.0;
  RationalLink link{{}, {}, 0.0, 1.0, true};
  for (int64_t j : way) {
    const Node& node = motion.nodes[j];
    // A floating joint is a rational curve already, but of one degree per segment.
    if (motion.chain.kind[j] > PRISMATIC) link.sound = false;
    size_t count = now.size() / ROW;
    std::vector<double> placed(now.size());
    for (size_t i = 0; i < count; i++) {
      const double* from = &now[i * ROW];
      double* to = &placed[i * ROW];
      for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 4; c++)
          to[4 * r + c] = from[4 * r] * node.local[4 * c] +
                          from[4 * r + 1] * node.local[4 * c + 1] +
                          from[4 * r + 2] * node.local[4 * c + 2];
        to[4 * r + 3] += from[4 * r + 3];
      }
      to[12] = from[12];
    }
    double fit = 0.0, u[FIT + 1];
    if (motion.span[j] == 0.0) {
      now = placed;
    } else {
      bool turns = motion.chain.kind[j] == REVOLUTE;
      fit = turns ? std::fmin(fit_half_angle(node.d, motion.span[j], u), FROZEN)
                  : fit_slide(node.d, u);
      Factors f = factors(motion.chain.kind[j], u);
      link.kappa *= f.kappa;
      now.assign((count + f.degree) * ROW, 0.0);
      for (size_t i = 0; i < count; i++)
        for (int k = 0; k <= f.degree; k++) {
          const double* from = &placed[i * ROW];
          double* to = &now[(i + k) * ROW];
          for (int r = 0; r < 12; r += 4) {
            if (turns) {
              to[r] += f.cosine[k] * from[r] + f.sine[k] * from[r + 1];
              to[r + 1] += f.cosine[k] * from[r + 1] - f.sine[k] * from[r];
            } else {
              to[r] += f.weight[k] * from[r];
              to[r + 1] += f.weight[k] * from[r + 1];
            }
            to[r + 2] += f.weight[k] * from[r + 2];
            to[r + 3] += f.weight[k] * from[r + 3] + (turns ? 0.0 : u[k] * from[r + 2]);
          }
          to[12] += f.weight[k] * from[12];
        }
    }
    link.error += (fit + motion.fuzz[j]) * motion.arms(b)[j];
  }
  link.error *= UP;
  double total = 0.0;
  for (size_t i = 0; i < now.size(); i += ROW) {
    double w = now[i + 12];
    if (!(w > 0.0 && w < INFINITY)) link.sound = false;
    link.weights.push_back(w);
    for (int e = 0; e < 12; e++) {
      link.matrices.push_back(now[i + e] / w);
      total += std::fabs(now[i + e] / w);
    }
  }
  link.sound = link.sound && total < INFINITY && link.kappa < INFINITY;
  return link;
}

}  // namespace guard
