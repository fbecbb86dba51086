// Where a polynomial is certainly positive, certainly negative, or neither is known (trusted).
//
// The exact polynomial f lies within `error` of the stored one.
//
// **Convex hull.** f lies between its least and greatest Bernstein coefficient, so it has one sign
// if all stored coefficients exceed the error with it.
//
// **Count.** By Descartes' rule f has at most as many roots in (0, 1) as its coefficients change
// sign; a coefficient within the error may have any sign, so the *most* changes are counted that
// any choice gives. If f has certain signs at some points, it has a root between neighbours of
// opposite signs. If these are as many as the count allows (or as the degree), there is no further
// root, also no double one: between neighbours of equal signs f has no root and keeps the sign.
// Where the points come from does not matter; for cubics they are put on either side of the roots
// in closed form, else around a root found by secants.
//
// What the count does not decide is halved. What stays undecided is neither: in the brackets
// around roots, and where f hardly leaves 0.
#pragma once

#include <cstdint>
#include <vector>

#include "cubic.hpp"

namespace guard {

enum : uint8_t { NEGATIVE = 1, POSITIVE = 2, UNKNOWN = 4 };

constexpr int DEEPEST = 48;  // spans are cut at multiples of 2^-48
constexpr double SKEW = 7.0 / 16.0;
constexpr int SKEW_BITS = 4;
constexpr int MOST_POINTS = 2 * 3 + 2;  // a bracket around each root of a cubic, and the ends

// One state on the closed span [start, end] of s.
struct Stretch {
  double start, end;
  uint8_t state;
};

// How roots are proposed.
enum : int64_t { CLOSED_FORM, HALVING };

class Isolation {
 public:
  explicit Isolation(std::vector<Stretch>& out, int64_t method) : out_(out), method_(method) {}

  // Append the stretches of a polynomial, which cover [0, 1] in order; returns the states met.
  uint8_t run(const Polynomial& f) {
    first_ = out_.size();
    met_ = 0;
    whole_ = &f;
    slack_ = value_error(f);
    search(f, 0.0, 1.0, 0);
    return met_;
  }

 private:
  void put(double start, double end, uint8_t state) {
    met_ |= state;
    if (out_.size() > first_ && out_.back().state == state)
      out_.back().end = end;
    else
      out_.push_back({start, end, state});
  }

  static int certain(double x, double error) { return x > error ? 1 : x < -error ? -1 : 0; }

  // The most sign changes, every uncertain coefficient at its worst.
  static int most_changes(const Polynomial& f) {
    // Changes so far if the last sign chosen is + or -; -1: cannot be.
    int plus = -1, minus = -1;
    for (int k = 0; k <= f.degree; k++) {
      int sign = certain(f.c[k], f.error);
      int to_plus = k == 0 ? 0 : std::max(plus, minus < 0 ? -1 : minus + 1);
      int to_minus = k == 0 ? 0 : std::max(minus, plus < 0 ? -1 : plus + 1);
      plus = sign >= 0 ? to_plus : -1;
      minus = sign <= 0 ? to_minus : -1;
    }
    return std::max(plus, minus);
  }

  // f is the whole polynomial on [a, b], multiples of 2^-bits.
  void search(const Polynomial& f, double a, double b, int bits) {
    double low = f.c[0], high = f.c[0];
    bool number = true;
    for (int k = 0; k <= f.degree; k++) {
      low = f.c[k] < low ? f.c[k] : low;
      high = f.c[k] > high ? f.c[k] : high;
      number = number && std::fabs(f.c[k]) < INFINITY;
    }
    if (!number || !(f.error < INFINITY) || (low >= -f.error && high <= f.error)) {
      put(a, b, UNKNOWN);
    } else if (low > f.error) {
      put(a, b, POSITIVE);
    } else if (high < -f.error) {
      put(a, b, NEGATIVE);
    } else if (!count(f, a, b)) {
      halve(f, a, b, bits);
    }
  }

  void halve(const Polynomial& f, double a, double b, int bits) {
    if (bits + SKEW_BITS > DEEPEST || f.degree == 0) return put(a, b, UNKNOWN);
    // A root in the very middle would stay at an end of both halves.
    bool clear = certain(value(f, 0.5), f.error) != 0;
    double t = clear ? 0.5 : SKEW, middle = a + t * (b - a);  // exact: multiples of 2^-DEEPEST
    bits += clear ? 1 : SKEW_BITS;
    Polynomial left, right;
    split(f, t, left, right);
    search(left, a, middle, bits);
    search(right, middle, b, bits);
  }

  // Decide [a, b] by points around the roots, if the count of the changes lets it.
  bool count(const Polynomial& f, double a, double b) {
    int changes = most_changes(f);
    bool closed = f.degree == 3 && method_ == CLOSED_FORM;
    if (changes > (closed ? 3 : 1)) return false;
    int first = certain(f.c[0], f.error), last = certain(f.c[f.degree], f.error);
    if (first == 0 || last == 0) return false;
    double points[MOST_POINTS];
    int signs[MOST_POINTS], n = 0;
    points[n] = a;
    signs[n++] = first;
    double roots[3];
    int proposed = closed ? cubic_roots(f.c, roots) : 1;
    if (!closed) roots[0] = secant(f);
    for (int i = 0; i < proposed; i++) {
      double until = i + 1 < proposed ? 0.5 * (roots[i] + roots[i + 1]) : 1.0;
      bracket(a + (b - a) * roots[i], a + (b - a) * until, points, signs, n);
    }
    points[n] = b;
    signs[n++] = last;
    int found = 0;
    for (int i = 1; i < n; i++) found += signs[i] != signs[i - 1];
    if (found != changes && found != f.degree) return false;
    for (int i = 1; i < n; i++)
      put(points[i - 1], points[i],
          signs[i] != signs[i - 1] ? UNKNOWN
          : signs[i] > 0           ? POSITIVE
                                   : NEGATIVE);
    return true;
  }

  // Add points with certain and opposite signs on either side of s, below `until`, if there are.
  void bracket(double s, double until, double* points, int* signs, int& n) const {
    double floor = points[n - 1];
    for (double width = first_width(s); width < 0x1p-3; width *= 16.0) {
      double low = s - width, high = s + width;
      if (!(low > floor && high < until)) return;
      int below = certain(value(*whole_, low), slack_);
      if (below == 0) continue;
      if (below != signs[n - 1]) return;
      int above = certain(value(*whole_, high), slack_);
      if (above == 0) continue;
      if (above == below) return;
      points[n] = low;
      signs[n++] = below;
      points[n] = high;
      signs[n++] = above;
      return;
    }
  }

  // How far from a root the sign is likely to be certain.
  double first_width(double s) const {
    double step = 0x1p-20;
    double slope = (value(*whole_, s + step) - value(*whole_, s - step)) / (2.0 * step);
    double width = 4.0 * slack_ / std::fabs(slope);
    return width < 0x1p-4 ? width + 0x1p-51 * s : 0x1p-4;
  }

  // The root in [0, 1] of a polynomial with opposite signs at the ends (Illinois).
  static double secant(const Polynomial& f) {
    double a = 0.0, b = 1.0, fa = f.c[0], fb = f.c[f.degree], s = 0.5;
    int side = 0;
    for (int step = 0; step < 64; step++) {
      double next = (a * fb - b * fa) / (fb - fa);
      if (!(next > a && next < b) || std::fabs(next - s) <= 0x1p-52 * next) return next;
      s = next;
      double fs = value(f, s);
      if (fs == 0.0) return s;
      if ((fs > 0.0) == (fb > 0.0)) {
        b = s;
        fb = fs;
        if (side > 0) fa *= 0.5;
        side = 1;
      } else {
        a = s;
        fa = fs;
        if (side < 0) fb *= 0.5;
        side = -1;
      }
    }
    return s;
  }

  std::vector<Stretch>& out_;
  int64_t method_;
  size_t first_ = 0;
  uint8_t met_ = 0;
  const Polynomial* whole_ = nullptr;
  double slack_ = 0.0;
};

}  // namespace guard
