// The real roots of a cubic in closed form (untrusted: a proposal, which sign checks certify).
#pragma once

#include <algorithm>

#include "bernstein.hpp"

namespace guard {

// Roots in (0, 1) of a cubic given by Bernstein coefficients, ascending; returns their number. Of a
// complex pair the real part is proposed, where a curve that hardly touches comes nearest.
inline int cubic_roots(const double* b, double* roots) {
  double a0 = b[0], a1 = 3.0 * (b[1] - b[0]), a2 = 3.0 * (b[0] - 2.0 * b[1] + b[2]);
  double a3 = b[3] - b[0] + 3.0 * (b[1] - b[2]);
  double found[3];
  int count = 0;
  double size = std::fabs(a0) + std::fabs(a1) + std::fabs(a2);
  if (std::fabs(a3) > 1e-9 * size) {
    // s = t - h: t^3 + 3 p t + 2 q = 0.
    double h = a2 / (3.0 * a3), p = a1 / (3.0 * a3) - h * h;
    double q = h * h * h + 0.5 * (a0 - a1 * h) / a3;
    double d = q * q + p * p * p;
    if (d >= 0.0) {
      double w = std::cbrt(std::fabs(q) + std::sqrt(d));
      double t = w == 0.0 ? 0.0 : (q < 0.0 ? w - p / w : p / w - w);
      found[count++] = t - h;
      found[count++] = -0.5 * t - h;
    } else {
      double r = 2.0 * std::sqrt(-p);
      double x = std::min(1.0, std::max(-1.0, -q / std::sqrt(-p * p * p)));
      double third = std::acos(x) / 3.0;
      for (int i = -1; i <= 1; i++)
        found[count++] = r * std::cos(third + i * 2.0943951023931953) - h;
    }
  } else if (std::fabs(a2) > 1e-9 * (std::fabs(a0) + std::fabs(a1))) {
    double d = a1 * a1 - 4.0 * a2 * a0;
    double w = -0.5 * (a1 + std::copysign(std::sqrt(std::max(d, 0.0)), a1));
    found[count++] = w / a2;
    if (w != 0.0) found[count++] = a0 / w;
  } else if (a1 != 0.0) {
    found[count++] = -a0 / a1;
  }
  int kept = 0;
  for (int i = 0; i < count; i++) {
    double s = found[i];
    for (int step = 0; step < 2; step++) {  // Newton, for the digits that the form cancels
      double slope = a1 + s * (2.0 * a2 + s * 3.0 * a3);
      double next = s - (a0 + s * (a1 + s * (a2 + s * a3))) / slope;
      if (std::fabs(next - s) < 1e-3) s = next;
    }
    if (s > 0.0 && s < 1.0) roots[kept++] = s;
  }
  std::sort(roots, roots + kept);
  return kept;
}

}  // namespace guard
