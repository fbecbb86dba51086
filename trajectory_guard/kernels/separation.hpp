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
// **Turning plane.** n(tau) = n + tau m + tau^2 k has the Bernstein vectors N_0 = n - m + k, N_1 =
// n - k, N_2 = n + m + k. The product with P(tau) has degree 14 and the control values
//
//     f_i(v) = sum_j a_ij N_j.(P_{i-j} v),        a_ij = C(12, i-j) C(2, j) / C(14, i),
//
// each affine in v; the obstacle's support is convex in n, so it stays below the polynomial with
// the Bernstein values max_p N_j.p, which degree 14 turns into sum_j a_ij max_p N_j.p. With N =
// max |N_j| >= |n(tau)|, the pair keeps the distance L during the whole piece if every f_i(v)
// minus that exceeds N (L + e + r + r') + rounding. A disc is bounded alike, as its support is
// convex in n, too.
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
    if (!(std::fabs(below[i]) < INFINITY)) return NAN;
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

// A direction that turns with the piece: n + tau m + tau^2 k.
struct Turn {
  double n[3], m[3], k[3];
};

constexpr int TURN = 2;  // its degree

// The shares a_ij.
struct Shares {
  double row[CONTROLS + TURN][TURN + 1];

  Shares() {
    constexpr int n = CONTROLS - 1;
    for (int i = 0; i <= n + TURN; i++)
      for (int j = 0; j <= TURN; j++)
        row[i][j] = binomial(n, i - j) * binomial(TURN, j) / binomial(n + TURN, i);
  }
};

inline const Shares SHARES;

// Say whether a plane that turns proves that a pair keeps a distance [m].
inline bool turning(const Turn& turn, const Controls& points, const Solids& links, int64_t b,
                    const Solids& obstacles, int64_t o, const Doubt& doubt, double distance) {
  double direction[TURN + 1][3], high[TURN + 1], square = 0.0;
  Gradients part[TURN + 1], g;
  for (int r = 0; r < 3; r++) {
    direction[0][r] = turn.n[r] - turn.m[r] + turn.k[r];
    direction[1][r] = turn.n[r] - turn.k[r];
    direction[2][r] = turn.n[r] + turn.m[r] + turn.k[r];
  }
  for (int j = 0; j <= TURN; j++) {
    const double* n = direction[j];
    double own = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    // Up to twice a unit vector `allowance` covers the rounding, taken twice.
    if (!(own < 4.0 && own > 0.01)) return false;
    if (own > square) square = own;
    high[j] = highest(obstacles, o, n);
    gradients(points, n, part[j]);
  }
  double need = std::sqrt(square) * (distance + allowance(links, b, obstacles, o, doubt)) * UP +
                2.0 * plane_margin(doubt.kappa, doubt.reach, obstacles.length(o, FAR));
  g.count = CONTROLS + TURN;
  for (int i = 0; i < CONTROL_ROW; i++) {
    int from = i < g.count ? i : g.count - 1;
    for (int c = 0; c < 4; c++) {
      g.row[c][i] = 0.0;
      for (int j = 0; j <= TURN; j++)
        if (from - j >= 0 && from - j < CONTROLS)
          g.row[c][i] += SHARES.row[from][j] * part[j].row[c][from - j];
    }
    for (int j = 0; j <= TURN; j++) g.row[3][i] -= SHARES.row[from][j] * high[j];
  }
  double low = lowest(g, links, b, need);
  return low > need && low < INFINITY;
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
