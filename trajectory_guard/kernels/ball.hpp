// Pieces of a rational Bezier motion, and balls of displacements around them (trusted).
//
// The motion is a curve in the 12-dimensional space of affine displacements [Schroecker & Weber
// 2014, sec. 7.1]: sum_i b_i w_i P_i / sum_i b_i w_i with positive weights, so it lies in the convex
// hull of its control points. A ball round g = c(1/2) through the farthest control point contains
// it; any g would do, so g is what was computed, and only the radius is rounded.
//
// **Halving.** Numerators N_i = w_i P_i and weights are halved alike by de Casteljau's algorithm,
// means of neighbours: no division, and at most one rounding each in n steps, all of positive
// multiples of the given N_i and w_i. After l levels the numerators are within gamma_{nl} of convex
// combinations of the |N_i|, entry by entry, the weights within gamma_{nl} relatively. With M the
// largest |entry| of the P_i the curve's entries move by at most 2 gamma_{nl} M < 2.1 n l u M.
//
// **Radius.** P_i = N_i / w_i errs by u M, and M stays a bound up to (1 + 2.1 n l u). Then
// C b + t and C K are sums of at most four products: their errors are relative to themselves (`UP`)
// and, from the rounded P_i, at most u (3 M_C (|b| + ||K||_F) + 2 M_t), which
//
//     RADIUS * u * (M_C span + M_t),          RADIUS = 32,
//
// covers with what forming it costs. M_C and M_t are the largest entries of the linear parts and of
// the translations.
//
// **Extent.** With T the largest |C b + t| and W the largest ||C K||_F of the differences the
// distribution of sigma times the extent has R^2 <= T^2 + sigma^2 W^2, and on |q| <= f it moves no
// point by more than R rho <= sqrt((T^2 + sigma^2 W^2) (1 + f^2 / sigma^2)). That is least, T + W f,
// for sigma^2 = T f / W: a small distribution where the motion turns, a large one where it shifts.
// Any sigma is sound.
#pragma once

#include <vector>

#include "margin.hpp"
#include "surface.hpp"
#include "vector.hpp"

namespace guard {

constexpr double RADIUS = 32.0;
constexpr int ENTRIES = 12;  // of a displacement, rows of [C | t]

// The motion as Python gives it.
struct Curve {
  int64_t degree;
  const double* points;   // (degree + 1, 12)
  const double* weights;  // (degree + 1,) positive
};

// Radius of a ball in a distribution's metric, and the parts T and W of it.
struct Radius {
  double whole, shift, turn;
};

// The distribution of a face or cluster: radius of the ball in its metric, and rho^2 = 1 + |q|^2 *
// spread.
struct Rate {
  double radius, spread, uncertain;

  // far: bound on |q|. Sigma is 1, or the best one.
  Rate(const Radius& r, double far, bool adapted) : radius(r.whole), spread(1.0) {
    if (adapted) {
      double square = r.shift * far / r.turn;
      // Not only infinity and zero: a turn, or a shift, of nothing but rounding.
      square = square > SMALLEST ? (square < 1.0 / SMALLEST ? square : 1.0 / SMALLEST) : SMALLEST;
      spread = 1.0 / square;
      radius = std::sqrt(r.shift * r.shift + square * UP * r.turn * r.turn) * UP;
    }
    uncertain = radius * std::sqrt(1.0 + spread * far * far) * UP;
  }

  static constexpr double SMALLEST = 0x1p-40;
};

// Homogeneous control points of a piece: rows of 12 numerators and a weight.
using Homogeneous = std::vector<double>;
constexpr int HOMOGENEOUS = ENTRIES + 1;

// Largest absolute entries of a curve's control points.
struct Size {
  double linear, shift;
};

inline Size size_of(const Curve& curve) {
  Size size{0.0, 0.0};
  for (int64_t i = 0; i < (curve.degree + 1) * ENTRIES; i++) {
    double& most = i % 4 == 3 ? size.shift : size.linear;
    double entry = std::fabs(curve.points[i]);
    if (!(entry <= most)) most = entry;
  }
  return size;
}

inline Homogeneous homogeneous(const Curve& curve) {
  Homogeneous controls((curve.degree + 1) * HOMOGENEOUS);
  for (int64_t i = 0; i <= curve.degree; i++) {
    for (int e = 0; e < ENTRIES; e++)
      controls[i * HOMOGENEOUS + e] = curve.weights[i] * curve.points[i * ENTRIES + e];
    controls[i * HOMOGENEOUS + ENTRIES] = curve.weights[i];
  }
  return controls;
}

struct Halves {
  Homogeneous left, right;
};

// Write the halves of a piece; the last row of the left one is the first of the right one.
inline void halve(const Homogeneous& whole, Halves& out) {
  Homogeneous &left = out.left, &right = out.right;
  size_t rows = whole.size() / HOMOGENEOUS;
  left.resize(whole.size());
  right = whole;
  for (size_t k = 0; k < rows; k++) {
    for (int e = 0; e < HOMOGENEOUS; e++) left[k * HOMOGENEOUS + e] = right[e];
    for (size_t i = 0; i + 1 < rows - k; i++)
      for (int e = 0; e < HOMOGENEOUS; e++) {
        double* at = &right[i * HOMOGENEOUS + e];
        at[0] = 0.5 * (at[0] + at[HOMOGENEOUS]);
      }
  }
}

// A ball's centre, and the differences of the control points from it.
struct Ball {
  double centre[ENTRIES];
  std::vector<double> difference;  // (12, control points padded to whole vectors by copies)
  size_t lanes;
  Size size;

  // The middle of a piece is the end of its left half.
  void enclose(const Homogeneous& piece, const Homogeneous& left) {
    size_t rows = piece.size() / HOMOGENEOUS;
    const double* middle = &left[(rows - 1) * HOMOGENEOUS];
    for (int e = 0; e < ENTRIES; e++) centre[e] = middle[e] / middle[ENTRIES];
    lanes = (rows + LANES - 1) / LANES * LANES;
    difference.resize(ENTRIES * lanes);
    for (size_t i = 0; i < lanes; i++) {
      const double* row = &piece[(i < rows ? i : rows - 1) * HOMOGENEOUS];
      for (int e = 0; e < ENTRIES; e++)
        difference[e * lanes + i] = row[e] / row[ENTRIES] - centre[e];
    }
  }

  // The radius in a distribution's metric; infinite if it is not a number.
  Radius radius(const Metric& metric, int64_t which) const {
    const double* b = metric.frame + FRAME_SIZE * which + FRAME_CENTRE;
    const double* k = metric.frame + FRAME_SIZE * which + FRAME_AXES;
    double most = 0.0, most_shift = 0.0, most_turn = 0.0, total = 0.0;
    for (size_t i = 0; i < lanes; i += LANES) {
      Lanes shift = all(0.0), turn = all(0.0);
      for (int r = 0; r < ENTRIES; r += 4) {
        const double* row = &difference[r * lanes + i];
        Lanes x = load(row), y = load(row + lanes), z = load(row + 2 * lanes);
        Lanes moved = x * b[0] + y * b[1] + z * b[2] + load(row + 3 * lanes);
        shift += moved * moved;
        for (int c = 0; c < 3; c++) {
          Lanes turned = x * k[c] + y * k[3 + c] + z * k[6 + c];
          turn += turned * turned;
        }
      }
      Lanes square = shift + turn;
      for (int lane = 0; lane < LANES; lane++) {
        most = square[lane] > most ? square[lane] : most;
        most_shift = shift[lane] > most_shift ? shift[lane] : most_shift;
        most_turn = turn[lane] > most_turn ? turn[lane] : most_turn;
      }
      total += sum(square);
    }
    if (!(total < INFINITY)) return {INFINITY, INFINITY, INFINITY};
    double rounding = RADIUS * UNIT_ROUNDOFF * (size.linear * metric.span[which] + size.shift);
    auto up = [&](double square) { return (std::sqrt(square) + rounding) * UP; };
    return {up(most), up(most_shift), up(most_turn)};
  }

  void image(const double* x, double* y) const {
    for (int r = 0; r < 3; r++) {
      const double* row = centre + 4 * r;
      y[r] = row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3];
    }
  }
};

}  // namespace guard
