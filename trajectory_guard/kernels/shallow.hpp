// A point common to two solids that overlap by little, where one is round (search).
//
// Polytopes inside of spheres and cylinders overlap only some time after the solids do. Moved apart
// along a direction, the cores have nearest points; moved back, these mark the overlap, and its
// middle is in both solids where that direction is about the contact's normal.
#pragma once

#include <cstring>

#include "deepest.hpp"
#include "gjk.hpp"

namespace guard {

constexpr double APART = 1e-3;        // of the overlap, by which cores are moved apart beyond it
constexpr double LEAST_APART = 1e-9;  // of the sizes, likewise
constexpr double NEAREST = 1e-3;      // of the overlap, to which the nearest points are found

constexpr double INWARD = 0.05;  // of the overlap, by which the middle is moved inward

inline bool is_round(const Solids& solids, int64_t b) {
  return solids.length(b, INSIDE) > -INFINITY;
}

// Move a point towards another one by a length.
inline void pull(const double* towards, double length, double* x) {
  double step[3];
  for (int r = 0; r < 3; r++) step[r] = towards[r] - x[r];
  double far = std::sqrt(dot(step, step));
  if (far > length)
    for (int r = 0; r < 3; r++) x[r] += length / far * step[r];
}

// Propose a common point at one pose; true if it is inside both.
//
// n: from the obstacle towards the link, about the normal of the contact; of unit length.
inline bool shallow(const double* pose, const Solids& links, int64_t b, const Solids& obstacles,
                    int64_t o, const double* n, Common& out) {
  double apart = Standing{pose}.support(n, links, b, INFINITY).value - highest(obstacles, o, n);
  double own = links.length(b, BALL), other = obstacles.length(o, BALL);
  double shift = 0.0, size = links.length(b, CORE) + own + obstacles.length(o, CORE) + other;
  if (!(apart > LEAST_APART * size)) shift = LEAST_APART * size - (1.0 + APART) * apart;
  double away[POSE];
  std::memcpy(away, pose, sizeof away);
  for (int r = 0; r < 3; r++) away[12 + r] += shift * n[r];
  Search found;
  double accuracy = NEAREST * std::fabs(apart - own - other);
  if (gjk(n, Standing{away}, links, b, obstacles, o, own + other, false, accuracy, ROUNDS, found) ==
      Found::OVERLAP)
    return false;
  double off[3], centre[3];
  for (int r = 0; r < 3; r++) {
    double normal = found.off[r] / found.distance;
    double mine = found.place[r] + found.off[r] - own * normal - shift * n[r];
    double theirs = found.place[r] + other * normal;
    off[r] = 0.5 * (mine + theirs);
  }
  // The middle may lie in a face next to the one that is touched.
  double inward = INWARD * (own + other + shift - found.distance);
  image(pose, links.at(b, CENTRE), centre);
  pull(centre, inward, off);
  pull(obstacles.at(o, CENTRE), inward, off);
  for (int r = 0; r < 3; r++) off[r] -= pose[12 + r];
  for (int c = 0; c < 3; c++) out.point[c] = dot(pose + 4 * c, off);
  image(pose, out.point, out.place);
  out.mine = depth(links, b, true, out.point);
  out.theirs = depth(obstacles, o, true, out.place);
  return out.mine > 0.0 && out.theirs > 0.0;
}

// Propose a point deep inside both solids at one pose, see `deepest` and `shallow`.
inline bool common_point(const double* pose, const Solids& links, int64_t b,
                         const Solids& obstacles, int64_t o, bool round, const double* n,
                         std::vector<double>& moved, Meeting& meeting, Common& out) {
  bool found = deepest(pose, links, b, obstacles, o, round, moved, meeting, out);
  if (!(round && (is_round(links, b) || is_round(obstacles, o)))) return found;
  // Among many faces the search may end early.
  Common other{};
  if (!shallow(pose, links, b, obstacles, o, n, other)) return found;
  if (found && std::fmin(out.mine, out.theirs) > std::fmin(other.mine, other.theirs)) return true;
  for (int r = 0; r < 3; r++) other.direction[r] = out.direction[r];
  out = other;
  return true;
}

}  // namespace guard
