// Search for a separating direction and for nearest points (untrusted: it only proposes).
//
// Gilbert, Johnson and Keerthi's iteration on the difference of two cores; a "link" is the convex
// hull of its images under several poses: one pose gives the distance at an instant, the control
// points of a motion a direction for the whole piece.
#pragma once

#include "separation.hpp"

namespace guard {

constexpr double RELATIVE = 0.02;  // far from what is wanted, a nearly best direction is as good
constexpr int ROUNDS = 40;         // enough for the distance of two polytopes; more is rounding

enum class Found { SEPARATED, OVERLAP, REACHED };

struct Search {
  double n[3];      // best direction, from the obstacle towards the link
  double best;      // its support difference [m]
  double distance;  // of the nearest points found [m]
  double place[3];  // the obstacle's nearest point [m]
  double off[3];    // from there to the link's one [m]
};

// A difference of two support points, and the obstacle's one.
struct Corner {
  double x[3], p[3];
};

// A support point of a link's images: its value, the gradient that it was found with.
struct Support {
  double value;
  double gradient[3];
  int control;
};

// The images under the control points of a motion.
struct Moving {
  const Controls& points;

  Support support(const double* n, const Solids& links, int64_t b, double enough) const {
    Gradients g;
    gradients(points, n, g);
    const double* c = links.at(b, CENTRE);
    double core = links.length(b, CORE);
    alignas(64) double below[CONTROL_ROW];
    for (int half = 0; half < CONTROL_ROW; half += LANES) {
      Lanes x = load(g.row[0] + half), y = load(g.row[1] + half), z = load(g.row[2] + half);
      store(below + half, x * c[0] + y * c[1] + z * c[2] + load(g.row[3] + half) -
                              root(x * x + y * y + z * z) * core);
    }
    int first = 0;
    for (int i = 1; i < CONTROLS; i++)
      if (below[i] < below[first]) first = i;
    Support s{below[first], {}, first};
    if (below[first] <= enough) {
      s.value = INFINITY;
      for (int k = -1; k < CONTROLS; k++) {
        int i = k < 0 ? first : k;
        if (k >= 0 && (below[i] >= s.value || i == first)) continue;
        double gradient[3] = {g.row[0][i], g.row[1][i], g.row[2][i]};
        double value = least_core(links, b, gradient) + g.row[3][i];
        if (value < s.value) {
          s.value = value;
          s.control = i;
        }
      }
    }
    for (int r = 0; r < 3; r++) s.gradient[r] = g.row[r][s.control];
    return s;
  }

  void image_of(int control, const double* x, double* out) const {
    for (int r = 0; r < 3; r++)
      out[r] = points.entry[r][control] * x[0] + points.entry[3 + r][control] * x[1] +
               points.entry[6 + r][control] * x[2] + points.entry[9 + r][control];
  }
};

// The image under one pose by columns.
struct Standing {
  const double* pose;

  Support support(const double* n, const Solids& links, int64_t b, double) const {
    Support s;
    s.control = 0;
    for (int c = 0; c < 3; c++)
      s.gradient[c] = n[0] * pose[4 * c] + n[1] * pose[4 * c + 1] + n[2] * pose[4 * c + 2];
    s.value =
        least_core(links, b, s.gradient) + n[0] * pose[12] + n[1] * pose[13] + n[2] * pose[14];
    return s;
  }

  void image_of(int, const double* x, double* out) const {
    for (int r = 0; r < 3; r++)
      out[r] = pose[r] * x[0] + pose[4 + r] * x[1] + pose[8 + r] * x[2] + pose[12 + r];
  }
};

// Write the core point of a solid that lies farthest against g: a vertex plus a point of the rim.
inline void support_point(const Solids& solids, int64_t b, const double* g, double* x) {
  const double* vx = solids.vertices;
  const double* vy = vx + solids.vertex_stride;
  const double* vz = vy + solids.vertex_stride;
  Lanes best = all(INFINITY);
  Mask where = {};
  int64_t first = solids.range(b, FIRST), last = solids.range(b, LAST);
  Mask now = {first, first + 1, first + 2, first + 3, first + 4, first + 5, first + 6, first + 7};
  for (int64_t v = first; v < last; v += LANES, now += LANES) {
    Lanes value = g[0] * load(vx + v) + g[1] * load(vy + v) + g[2] * load(vz + v);
    where = value < best ? now : where;
    best = value < best ? value : best;
  }
  int lane = 0;
  for (int i = 1; i < LANES; i++)
    if (best[i] < best[lane]) lane = i;
  int64_t v = best[lane] < INFINITY ? where[lane] : first;
  x[0] = vx[v];
  x[1] = vy[v];
  x[2] = vz[v];
  double radius = solids.length(b, DISC);
  if (radius == 0.0) return;
  const double* a = solids.at(b, AXIS);
  double along = g[0] * a[0] + g[1] * a[1] + g[2] * a[2], rim[3], square = 0.0;
  for (int r = 0; r < 3; r++) {
    rim[r] = g[r] - along * a[r];
    square += rim[r] * rim[r];
  }
  if (square > 0.0)
    for (int r = 0; r < 3; r++) x[r] -= radius * rim[r] / std::sqrt(square);
}

inline double dot(const double* a, const double* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Write the barycentric weights of the point of an edge nearest to the origin.
inline void nearest_on_edge(const Corner* s, int i, int k, double* w) {
  double e[3];
  for (int r = 0; r < 3; r++) e[r] = s[k].x[r] - s[i].x[r];
  double square = dot(e, e), t = 0.0;
  if (square > 0.0) {
    t = -dot(s[i].x, e) / square;
    t = t < 0.0 ? 0.0 : (t > 1.0 ? 1.0 : t);
  }
  w[0] = w[1] = w[2] = w[3] = 0.0;
  w[i] = 1.0 - t;
  w[k] = t;
}

// Write the weights of the point of a triangle nearest to the origin (Voronoi regions).
inline void nearest_on_triangle(const Corner* s, int a, int b, int c, double* w) {
  double ab[3], ac[3];
  for (int r = 0; r < 3; r++) {
    ab[r] = s[b].x[r] - s[a].x[r];
    ac[r] = s[c].x[r] - s[a].x[r];
  }
  double d1 = -dot(ab, s[a].x), d2 = -dot(ac, s[a].x), d3 = -dot(ab, s[b].x);
  double d4 = -dot(ac, s[b].x), d5 = -dot(ab, s[c].x), d6 = -dot(ac, s[c].x);
  double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  double total = va + vb + vc;
  if (va > 0.0 && vb > 0.0 && vc > 0.0 && total > 0.0) {
    w[0] = w[1] = w[2] = w[3] = 0.0;
    w[a] = va / total;
    w[b] = vb / total;
    w[c] = vc / total;
    return;
  }
  double best = INFINITY;
  int best_i = a, best_k = b;
  for (int side = 0; side < 3; side++) {
    int i = side < 2 ? a : b, k = side == 0 ? b : c;
    nearest_on_edge(s, i, k, w);
    double x[3];
    for (int r = 0; r < 3; r++) x[r] = w[i] * s[i].x[r] + w[k] * s[k].x[r];
    if (dot(x, x) < best) {
      best = dot(x, x);
      best_i = i;
      best_k = k;
    }
  }
  nearest_on_edge(s, best_i, best_k, w);
}

// Say whether the origin is on the far side of face abc, seen from d (or the face is flat).
inline bool outside(const Corner* s, int a, int b, int c, int d) {
  double u[3], v[3], to[3];
  for (int r = 0; r < 3; r++) {
    u[r] = s[b].x[r] - s[a].x[r];
    v[r] = s[c].x[r] - s[a].x[r];
    to[r] = s[d].x[r] - s[a].x[r];
  }
  double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  return -dot(n, s[a].x) * dot(n, to) <= 0.0;
}

// Write the weights of the simplex point nearest to the origin; true if it contains the origin.
inline bool nearest(const Corner* s, int count, double* w) {
  if (count == 1) {
    w[0] = 1.0;
    w[1] = w[2] = w[3] = 0.0;
    return false;
  }
  if (count == 2) {
    nearest_on_edge(s, 0, 1, w);
    return false;
  }
  if (count == 3) {
    nearest_on_triangle(s, 0, 1, 2, w);
    return false;
  }
  static const int FACES[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
  double best = INFINITY;
  const int* best_face = nullptr;
  for (const int* f : FACES)
    if (outside(s, f[0], f[1], f[2], f[3])) {
      nearest_on_triangle(s, f[0], f[1], f[2], w);
      double square = 0.0;
      for (int r = 0; r < 3; r++) {
        double x = 0.0;
        for (int k = 0; k < 4; k++) x += w[k] * s[k].x[r];
        square += x * x;
      }
      if (square < best) {
        best = square;
        best_face = f;
      }
    }
  if (best_face == nullptr) return true;
  nearest_on_triangle(s, best_face[0], best_face[1], best_face[2], w);
  return false;
}

// Propose a direction that separates a link's images from an obstacle.
//
// n: first direction to try, of unit length. want: support difference that a direction should
// exceed [m]. stop: stop as soon as one does, or when none can; else find the distance. accuracy:
// stop when distance and bound differ by less than this [m] and a fraction of the distance to
// `want`. rounds: largest number of support points. Cores only: balls are the caller's.
template <class Images>
inline Found gjk(const double* first, const Images& images, const Solids& links, int64_t b,
                 const Solids& obstacles, int64_t o, double want, bool stop, double accuracy,
                 int rounds, Search& out) {
  Corner s[4];
  double w[4];
  int count = 0;
  double n[3] = {first[0], first[1], first[2]};
  out.best = -INFINITY;
  out.distance = INFINITY;
  for (int r = 0; r < 3; r++) {
    out.n[r] = n[r];
    out.place[r] = out.off[r] = 0.0;
  }
  for (int round = 0; round < rounds; round++) {
    double high = highest(obstacles, o, n);
    Support low = images.support(n, links, b, stop ? want + high : INFINITY);
    if (low.value - high > out.best) {
      out.best = low.value - high;
      for (int r = 0; r < 3; r++) out.n[r] = n[r];
      if (stop && out.best > want) return Found::REACHED;
    }
    if (count > 0 &&
        out.distance - out.best <= accuracy + RELATIVE * std::fabs(out.distance - want))
      return Found::SEPARATED;
    double x[3], back[3] = {-n[0], -n[1], -n[2]};
    support_point(links, b, low.gradient, x);
    images.image_of(low.control, x, s[count].x);
    support_point(obstacles, o, back, s[count].p);
    for (int r = 0; r < 3; r++) s[count].x[r] -= s[count].p[r];
    count++;
    if (nearest(s, count, w)) {
      out.distance = 0.0;
      for (int r = 0; r < 3; r++) {
        out.place[r] = 0.0;
        for (int k = 0; k < 4; k++) out.place[r] += 0.25 * s[k].p[r];
      }
      return Found::OVERLAP;
    }
    int kept = 0;
    double near[3] = {0.0, 0.0, 0.0}, place[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < count; k++)
      if (w[k] > 0.0) {
        for (int r = 0; r < 3; r++) {
          near[r] += w[k] * s[k].x[r];
          place[r] += w[k] * s[k].p[r];
        }
        s[kept++] = s[k];
      }
    count = kept;
    double length = std::sqrt(dot(near, near));
    // No progress: the nearest points are as good as rounding allows.
    if (!(length < out.distance)) return Found::SEPARATED;
    out.distance = length;
    for (int r = 0; r < 3; r++) {
      out.place[r] = place[r];
      out.off[r] = near[r];
    }
    if (count == 4 || length <= 1e-14 * (obstacles.length(o, FAR) + links.length(b, CORE)))
      return Found::OVERLAP;
    if (stop && length <= want) return Found::SEPARATED;  // no direction can do it
    for (int r = 0; r < 3; r++) n[r] = near[r] / length;
  }
  return Found::SEPARATED;
}

}  // namespace guard
