// Lower bounds of a quadratic function over a square or a triangle (trusted).
//
// The three basic tests of [Schroecker & Weber 2014, sec. 4] are one inequality. Let z(s, t) be the
// difference of a point of the fixed feature and the image g(x) of a point of the moving one, both
// affine in their parameters, and q(s, t) the point x in the coordinates in which its distortion
// rate is rho^2 = 1 + e |q|^2. The features keep the distance r for every displacement of the ball
// B_R(g) iff |z| > R rho + r everywhere. For every k > 0
//
//     (a + r)^2 <= (1 + k) a^2 + (1 + 1/k) r^2        (the difference is (k a - r)^2 / k >= 0),
//
// so with lambda >= (1 + k) R^2 and c >= (1 + 1/k) r^2 it is enough that
//
//     f(s, t) = |z|^2 - lambda (1 + e |q|^2) - c > 0
//
// on the domain. Where f is concave along some direction its least value is on the boundary: there
// the fat feature is no hyperboloid any more, and all cases of Remark 1 are covered.
//
// **Rounding.** `size` is 3 (|z0|^2 + |a|^2 + |b|^2) + lambda (1 + 3 e (|q0|^2 + ...)) + c,
// which bounds f, its gradient and its coefficients on the domain. Differences of points round by u
// of their length, a scalar product by 3 u of the lengths, lambda e times it and two sums by 4 u: all
// six coefficients together move f by less than 24 u size, and f of rounded coefficients is what is
// bounded from here on. A tangent plane or a vertex of a parabola is at most 40 roundings of
// numbers below `size`. A Hessian that passes for positive semidefinite lacks at most d <= 9 u tt
// of it: adding d t^2 makes it so, changes f by d and a tangent plane by 3 d, together less than
// 36 u size. Sum: 100 u size, less than
//
//     QUADRATIC * u * size,         QUADRATIC = 128.
#pragma once

#include <cmath>

#include "margin.hpp"

namespace guard {

constexpr double QUADRATIC = 128.0;

// Squares of lengths whose products would leave the range of doubles prove nothing.
constexpr double SMALLEST_PRODUCT = 0x1p-900;

// ss s^2 + 2 st s t + tt t^2 + 2 s s + 2 t t + one.
struct Quadratic {
  double ss, st, tt, s, t, one, size;
};

// Where the parameters run: [0, 1]^2, or s, t >= 0, s + t <= 1.
enum class Domain { SQUARE, TRIANGLE };

// An affine function of two parameters with values in space.
struct Plane {
  double at[3], s[3], t[3];
};

// A point of the domain.
struct Parameters {
  double s, t;
};

inline double product(const double* a, const double* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// How fat the moving feature is: lambda, e and c of f.
struct Fatness {
  double lambda, spread, c;
};

// |z|^2 - lambda (1 + e |q|^2) - c.
inline Quadratic longer(const Plane& z, const Plane& q, const Fatness& fat) {
  double lambda = fat.lambda, each = fat.lambda * fat.spread;
  double zz = product(z.at, z.at), qq = product(q.at, q.at);
  double aa = product(z.s, z.s), bb = product(z.t, z.t);
  double ss = product(q.s, q.s), tt = product(q.t, q.t);
  return {aa - each * ss,
          product(z.s, z.t) - each * product(q.s, q.t),
          bb - each * tt,
          product(z.at, z.s) - each * product(q.at, q.s),
          product(z.at, z.t) - each * product(q.at, q.t),
          zz - (lambda + each * qq) - fat.c,
          3.0 * (zz + aa + bb) + lambda + 3.0 * each * (qq + ss + tt) + fat.c};
}

inline double value(const Quadratic& f, Parameters p) {
  return f.one + p.s * (f.ss * p.s + 2.0 * (f.st * p.t + f.s)) + p.t * (f.tt * p.t + 2.0 * f.t);
}

// Half the gradient.
inline Parameters slope(const Quadratic& f, Parameters p) {
  return {f.ss * p.s + f.st * p.t + f.s, f.st * p.s + f.tt * p.t + f.t};
}

// The least value on the segment from p to p + d, and where it is.
inline double least_on_side(const Quadratic& f, Parameters p, Parameters d, Parameters& where) {
  Parameters half = slope(f, p);
  double bend = d.s * (f.ss * d.s + 2.0 * f.st * d.t) + d.t * f.tt * d.t;
  double rise = half.s * d.s + half.t * d.t;
  double x = 0.0, change = 0.0;
  if (bend > 0.0 && rise < 0.0 && -rise < bend) {
    x = -rise / bend;
    change = rise * x;
  } else if (2.0 * rise + bend < 0.0) {
    x = 1.0;
    change = 2.0 * rise + bend;
  }
  where = {p.s + x * d.s, p.t + x * d.t};
  return value(f, p) + change;
}

// The least value on the boundary of the domain, and where it is.
inline double least_on_sides(const Quadratic& f, Domain domain, Parameters& where) {
  static const Parameters SIDES[2][4][2] = {
      {{{0, 0}, {1, 0}}, {{0, 0}, {0, 1}}, {{0, 1}, {1, 0}}, {{1, 0}, {0, 1}}},
      {{{0, 0}, {1, 0}}, {{0, 0}, {0, 1}}, {{1, 0}, {-1, 1}}, {}}};
  bool triangle = domain == Domain::TRIANGLE;
  double low = INFINITY;
  for (int i = 0; i < (triangle ? 3 : 4); i++) {
    Parameters here;
    double on_side = least_on_side(f, SIDES[triangle][i][0], SIDES[triangle][i][1], here);
    if (!(on_side >= low)) {
      low = on_side;
      where = here;
    }
  }
  return low;
}

// The least value over the domain of the plane that touches a convex f at p.
inline double least_of_tangent(const Quadratic& f, Domain domain, Parameters p) {
  Parameters half = slope(f, p);
  double origin = value(f, p) - 2.0 * (half.s * p.s + half.t * p.t);
  double low = std::fmin(0.0, std::fmin(half.s, half.t));
  if (domain == Domain::SQUARE) low = std::fmin(0.0, half.s) + std::fmin(0.0, half.t);
  return origin + 2.0 * low;
}

// A lower bound of f on the domain, rounding included, and about where f is least; -infinity or NaN
// if none is known.
inline double lower_bound(const Quadratic& f, Domain domain, Parameters& where) {
  double margin = QUADRATIC * UNIT_ROUNDOFF * f.size;
  double sides = least_on_sides(f, domain, where);
  double both = f.ss * f.tt, square = f.st * f.st;
  // Concave along s or t, or indefinite: no interior point is least.
  if (!(f.ss > 0.0 && f.tt > 0.0)) return sides - margin;
  if (!(both > SMALLEST_PRODUCT)) return -INFINITY;
  if (square > both * (1.0 + 8.0 * UNIT_ROUNDOFF)) return sides - margin;
  double best = least_of_tangent(f, domain, where), determinant = both - square;
  if (!(determinant > 0.0)) return best - margin;
  Parameters inside{(f.st * f.t - f.tt * f.s) / determinant,
                    (f.st * f.s - f.ss * f.t) / determinant};
  bool belongs =
      inside.s >= 0.0 && inside.t >= 0.0 &&
      (domain == Domain::SQUARE ? inside.s <= 1.0 && inside.t <= 1.0 : inside.s + inside.t <= 1.0);
  if (belongs) {
    // Of a nearly singular system the solution may be far off; both planes are bounds.
    double other = least_of_tangent(f, domain, inside);
    if (other > best) {
      best = other;
      where = inside;
    }
  }
  return best - margin;
}

}  // namespace guard
