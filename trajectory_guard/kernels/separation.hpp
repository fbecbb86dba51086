// The inequality that certifies (trusted).
//
// Let P_i be the control points of a link's motion on a piece, all weights positive, and n a unit
// vector. The link's point x stays in conv{P_i x}; the link's solid is the convex hull of its
// vertices v plus a disc plus a ball of radius r, the obstacle likewise with vertices p and radius
// r'. If e bounds how far the true, toleranced motion can leave the polynomial one, then during the
// whole piece
//
//     distance >= min_{i,v} n.(P_i v) - e - r - (max_p n.p + r') - rounding,
//
// because a linear function on a convex hull is least at one of its generators. A disc of radius R
// and axis a adds -R |g - (g.a) a| with g = P_i^T n, its exact support. The direction may come from
// anywhere; only this number decides.
//
// **Turning plane.** n(tau) = n + tau m. The product with P(tau) has degree 13 and the control
// values f_k(v) = (1 - k/13) (n - m).(P_k v) + (k/13) (n + m).(P_{k-1} v), each affine in v; the
// obstacle's support is convex in tau, so it stays below the chord h_k = (1 - k/13) h_0 + (k/13)
// h_13 of its values at both ends. With N = max |n +- m| >= |n(tau)|, the pair keeps the distance L
// during the whole piece if f_k(v) - h_k >= N (L + e + r + r') + rounding for all k and v.
#pragma once

#include <cmath>

#include "economised.hpp"

namespace guard {

// A normalised double vector is this close to unit length; `plane_margin` pays for it.
constexpr double UNIT_SLACK = 4e-15;

// R |g - (g.a) a| of a solid's disc.
inline double disc_support(const Solids& solids, int64_t b, const double* g) {
  double radius = solids.length(b, DISC);
  if (radius == 0.0) return 0.0;
  const double* a = solids.at(b, AXIS);
  double along = g[0] * a[0] + g[1] * a[1] + g[2] * a[2];
  double x = g[0] - along * a[0], y = g[1] - along * a[1], z = g[2] - along * a[2];
  return radius * std::sqrt(x * x + y * y + z * z);
}

// The least g.v over the vertices of a solid, NaN if any term is NaN.
inline double least_vertex(const Solids& solids, int64_t b, const double* g) {
  const double* x = solids.vertices;
  const double* y = x + solids.vertex_stride;
  const double* z = y + solids.vertex_stride;
  Lanes best = all(INFINITY);
  Mask lost = {};
  for (int64_t v = solids.range(b, FIRST); v < solids.range(b, LAST); v += LANES) {
    Lanes value = g[0] * load(x + v) + g[1] * load(y + v) + g[2] * load(z + v);
    lost |= value != value;
    best = value < best ? value : best;
  }
  return any(lost) ? NAN : least(best);
}

// The least g.x over the core of a solid: vertices and disc.
inline double least_core(const Solids& solids, int64_t b, const double* g) {
  return least_vertex(solids, b, g) - disc_support(solids, b, g);
}

// The largest n.x over the core of an obstacle, NaN if a term is NaN.
inline double highest(const Solids& obstacles, int64_t o, const double* n) {
  double back[3] = {-n[0], -n[1], -n[2]};
  return -least_core(obstacles, o, back);
}

// Gradients of n.(P_i x) in x and its constants, for all control points of a motion.
struct Gradients {
  alignas(64) double row[4][CONTROL_ROW];
  int count;
};

inline void gradients(const Controls& points, const double* n, Gradients& g) {
  for (int c = 0; c < 4; c++)
    for (int half = 0; half < CONTROL_ROW; half += LANES)
      store(g.row[c] + half, n[0] * load(points.entry[3 * c] + half) +
                                 n[1] * load(points.entry[3 * c + 1] + half) +
                                 n[2] * load(points.entry[3 * c + 2] + half));
  g.count = CONTROLS;
}

// The least g_i.x + constant_i over control points and a link's core [m], NaN if a term is NaN.
//
// A control point is skipped only if its sphere around the core cannot go lower; the one whose
// sphere goes lowest is tried first. If all spheres stay above `enough`, the vertices are not
// asked: the spheres' bound is returned.
inline double lowest(const Gradients& g, const Solids& links, int64_t b, double enough) {
  const double* c = links.at(b, CENTRE);
  double core = links.length(b, CORE);
  alignas(64) double below[CONTROL_ROW];
  for (int half = 0; half < CONTROL_ROW; half += LANES) {
    Lanes x = load(g.row[0] + half), y = load(g.row[1] + half), z = load(g.row[2] + half);
    Lanes slope = root(x * x + y * y + z * z) * UP;
    store(below + half, x * c[0] + y * c[1] + z * c[2] + load(g.row[3] + half) - slope * core);
  }
  int first = 0;
  double bottom = INFINITY;
  for (int i = 0; i < g.count; i++) {
    if (below[i] != below[i]) return NAN;
    if (below[i] < bottom) {
      bottom = below[i];
      first = i;
    }
  }
  if (bottom > enough) return bottom;
  double best = INFINITY;
  for (int k = -1; k < g.count; k++) {
    int i = k < 0 ? first : k;
    if (k >= 0 && (below[i] >= best || i == first)) continue;
    double gradient[3] = {g.row[0][i], g.row[1][i], g.row[2][i]};
    double value = least_core(links, b, gradient) + g.row[3][i];
    if (!(value >= best)) best = value;
    if (best != best) break;
  }
  return best;
}

// What bounds the truth around the built motion of a body on a piece.
struct Doubt {
  double error;  // between the true motion and the built one, without tracking [m]
  double depth;  // rounded transforms between the root and the body
  double kappa;  // column bound of the control points
  double reach;  // bound on the body's coordinates [m]
};

// What a support difference must exceed for a positive distance: balls, error and rounding [m].
inline double allowance(const Solids& links, int64_t b, const Solids& obstacles, int64_t o,
                        const Doubt& doubt) {
  double rounding = chain_margin(doubt.depth, doubt.kappa, doubt.reach) +
                    plane_margin(doubt.kappa, doubt.reach, obstacles.length(o, FAR));
  return (links.length(b, BALL) + obstacles.length(o, BALL) + doubt.error + rounding) * UP;
}

// A proved lower bound of the distance between a moving link and an obstacle during a whole piece
// [m]; minus infinity for a direction that is not of unit length, and for NaN.
inline double separation(const double* n, const Controls& points, const Solids& links, int64_t b,
                         const Solids& obstacles, int64_t o, const Doubt& doubt, double wanted) {
  double square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
  if (!(std::fabs(square - 1.0) < UNIT_SLACK)) return -INFINITY;
  double taken = highest(obstacles, o, n) + allowance(links, b, obstacles, o, doubt);
  Gradients g;
  gradients(points, n, g);
  double gap = lowest(g, links, b, taken + wanted) - taken;
  return gap < INFINITY ? gap : -INFINITY;
}

// Say whether the plane that turns as n + tau m proves that a pair keeps a distance [m].
inline bool turning(const double* n, const double* m, const Controls& points, const Solids& links,
                    int64_t b, const Solids& obstacles, int64_t o, const Doubt& doubt,
                    double distance) {
  double start[3], end[3], square_start = 0.0, square_end = 0.0;
  for (int r = 0; r < 3; r++) {
    start[r] = n[r] - m[r];
    end[r] = n[r] + m[r];
    square_start += start[r] * start[r];
    square_end += end[r] * end[r];
  }
  double square = square_start > square_end ? square_start : square_end;
  // Between a tenth and twice a unit vector `allowance` covers the rounding, taken twice.
  if (!(square < 4.0 && square > 0.01)) return false;
  double need = std::sqrt(square) * (distance + allowance(links, b, obstacles, o, doubt)) * UP +
                2.0 * plane_margin(doubt.kappa, doubt.reach, obstacles.length(o, FAR));
  double high_start = highest(obstacles, o, start), high_end = highest(obstacles, o, end);
  Gradients at_start, at_end, g;
  gradients(points, start, at_start);
  gradients(points, end, at_end);
  for (int k = 0; k <= CONTROLS; k++) {
    double late = k / double(CONTROLS), early = 1.0 - late;
    for (int c = 0; c < 4; c++)
      g.row[c][k] = (k < CONTROLS ? early * at_start.row[c][k] : 0.0) +
                    (k > 0 ? late * at_end.row[c][k - 1] : 0.0);
    g.row[3][k] -= early * high_start + late * high_end;
  }
  for (int c = 0; c < 4; c++)
    for (int k = CONTROLS + 1; k < CONTROL_ROW; k++) g.row[c][k] = g.row[c][CONTROLS];
  g.count = CONTROLS + 1;
  return lowest(g, links, b, need) > need;
}

// The distance of a point in the root frame to the oriented box of a solid, zero inside [m];
// rounding not included.
inline double box_distance(const double* x, const Solids& solids, int64_t o) {
  const double* box = solids.at(o, BOX);
  const double* half = solids.at(o, HALF);
  double d[3] = {x[0] - box[3], x[1] - box[7], x[2] - box[11]};
  double total = 0.0;
  for (int k = 0; k < 3; k++) {
    double along = std::fabs(d[0] * box[k] + d[1] * box[4 + k] + d[2] * box[8 + k]);
    double outside = along - half[k];
    if (outside > 0.0) total += outside * outside;
    if (outside != outside) return NAN;
  }
  return std::sqrt(total);
}

// Propose the direction from the oriented box of a solid to a point: from the nearest point of the
// box, or from its centre if the point is inside.
inline void box_direction(const double* x, const Solids& solids, int64_t o, double* n) {
  const double* box = solids.at(o, BOX);
  const double* half = solids.at(o, HALF);
  double d[3] = {x[0] - box[3], x[1] - box[7], x[2] - box[11]};
  n[0] = n[1] = n[2] = 0.0;
  for (int k = 0; k < 3; k++) {
    double along = d[0] * box[k] + d[1] * box[4 + k] + d[2] * box[8 + k];
    double outside = along > half[k] ? along - half[k] : (along < -half[k] ? along + half[k] : 0.0);
    for (int r = 0; r < 3; r++) n[r] += outside * box[4 * r + k];
  }
  if (n[0] == 0.0 && n[1] == 0.0 && n[2] == 0.0)
    for (int r = 0; r < 3; r++) n[r] = d[r];
  double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  if (length > 0.0) {
    for (int r = 0; r < 3; r++) n[r] /= length;
  } else {
    n[0] = n[1] = 0.0;
    n[2] = 1.0;
  }
}

}  // namespace guard
