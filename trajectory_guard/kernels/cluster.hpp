// Clusters of faces kept apart by a plane (trusted): the nodes of a tree against each other.
//
// For a direction n the function n.g(x) - R rho(x) is concave in x, so over a box it is least at a
// corner, and at least n.g(c) - sum_j |n.C_j| h_j - |n| R max rho with the box's centre c and half
// sides h, C_j the columns of the linear part of g. Against a fixed box (p, f) the plane proves that
// all points stay farther apart than r, for every displacement of the ball, if
//
//     |n.(g(c) - p)| > sum_j |n.C_j| h_j + sum_i |n_i| f_i + |n| (R max rho + r).
//
// Any n is sound; tried are the fifteen axes that decide for two boxes (Gottschalk et al. 1996):
// three normals of each and nine products. They are the same for all clusters of a piece.
//
// **Rounding.** n is exact as it stands. n.C_j is 5 roundings, the three sums 4, 5 and 5 each, the
// length 5, their sum 3: at most 32 u |n| (|g(c)| + |C| |h| + |p| + |f|), which is in the
// thickness (`ball_cover`), as is the rounding of g(c).
#pragma once

#include "ball.hpp"

namespace guard {

constexpr int AXES = 16;  // fifteen, the last one twice

struct Axes {
  alignas(64) double n[3][AXES], along[3][AXES], across[3][AXES], length[AXES];

  explicit Axes(const double* centre) {
    for (int i = 0; i < 3; i++) {
      double column[3] = {centre[i], centre[4 + i], centre[8 + i]};
      for (int r = 0; r < 3; r++) {
        n[r][i] = r == i;
        n[r][3 + i] = column[r];
        for (int k = 0; k < 3; k++)
          n[r][6 + 3 * k + i] = r == k             ? 0.0
                                : r == (k + 1) % 3 ? -column[(k + 2) % 3]
                                                   : column[(k + 1) % 3];
      }
    }
    for (int r = 0; r < 3; r++) n[r][AXES - 1] = n[r][AXES - 2];
    for (int i = 0; i < AXES; i++) {
      double square = 0.0;
      for (int j = 0; j < 3; j++) {
        along[j][i] =
            std::fabs(n[0][i] * centre[j] + n[1][i] * centre[4 + j] + n[2][i] * centre[8 + j]);
        across[j][i] = std::fabs(n[j][i]);
        square += n[j][i] * n[j][i];
      }
      length[i] = std::sqrt(square) * UP;
    }
  }

  // True only if some axis proves it; place: image of the moving box's centre.
  bool apart(const double* place, const double* half, const double* fixed, double fat) const {
    double d[3] = {place[0] - fixed[0], place[1] - fixed[1], place[2] - fixed[2]};
    Mask proved{};
    for (int i = 0; i < AXES; i += LANES) {
      Lanes gap = absolute(load(n[0] + i) * d[0] + load(n[1] + i) * d[1] + load(n[2] + i) * d[2]);
      Lanes wide = load(along[0] + i) * half[0] + load(along[1] + i) * half[1] +
                   load(along[2] + i) * half[2];
      wide += load(across[0] + i) * fixed[3] + load(across[1] + i) * fixed[4] +
              load(across[2] + i) * fixed[5];
      proved |= gap > wide + load(length + i) * fat;
    }
    return any(proved);
  }
};

}  // namespace guard
