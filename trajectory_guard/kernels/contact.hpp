// Proofs that a real surface is touched (trusted for G3): by another surface, or by a solid.
//
// A part that is a TRIANGLE stands for a triangle of the real surface whose corners are within its
// ball of the vertices. A surface has no inside of its own: it collides where it is crossed.
//
// **Crossing.** An edge pq pierces a triangle T at the centre of a piece, p and q keep more than
// `rim` from T, and the edge keeps more than `rim` from the three sides of T. Let every corner
// move, along straight lines, until they are where they are at another instant, the link's by at
// most a and the obstacle's by at most b. Points of an edge or a triangle move no farther than its
// corners. If a + b <= rim, the ends of the edge never meet the triangle on the way, nor the edge
// its sides, so the number of crossings modulo 2 stays 1: they still intersect. The distances are
// bounded from below by those of lines and planes,
//
//     |d x v . w| / |d x v|  between p + s d and c + t v, w = c - p,      |n . w| / |n|  to a plane,
//
// and pq pierces T if the three products d x v_k . (c_k - p) have one sign and p and q lie on
// different sides. A triple product of differences errs by less than 32 u |d| |v| |w|, a cross
// product by less than 32 u |d| |v|; that of the differences is inside the margin of a pose.
//
// **Point in a solid.** A point of the triangle lies in the polytope inside the other solid by t:
// the link may move by t before it no longer does.
#pragma once

#include "deepest.hpp"
#include "leaf.hpp"

namespace guard {

constexpr double PRODUCT = 32.0 * UNIT_ROUNDOFF;

inline double norm(const double* x) {
  return std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
}

inline void cross(const double* x, const double* y, double* out) {
  for (int r = 0; r < 3; r++)
    out[r] = x[(r + 1) % 3] * y[(r + 2) % 3] - x[(r + 2) % 3] * y[(r + 1) % 3];
}

// A lower bound of |(x × y) . w| / |x × y|, with the sign of the product; 0 if it is not clear.
inline double clear_height(const double* x, const double* y, const double* w) {
  double n[3];
  cross(x, y, n);
  double product = n[0] * w[0] + n[1] * w[1] + n[2] * w[2];
  double area = norm(x) * norm(y), doubt = PRODUCT * area * norm(w);
  double height = (std::fabs(product) - doubt) / (norm(n) + PRODUCT * area) / UP;
  if (!(height > 0.0 && height < INFINITY)) return 0.0;
  return product > 0.0 ? height : -height;
}

struct Triangle {
  double corner[3][3];
};

inline Triangle triangle_of(const Solids& solids, int64_t b) {
  Triangle t;
  const double* x = solids.vertices + solids.range(b, FIRST);
  for (int k = 0; k < 3; k++)
    for (int r = 0; r < 3; r++) t.corner[k][r] = x[r * solids.vertex_stride + k];
  return t;
}

// How far edge pq may move against a triangle that it pierces and still pierce it [m]; 0 if it does
// not.
inline double pierced(const double* p, const double* q, const Triangle& t, double* place) {
  double d[3], w[3], sides[3][3];
  for (int r = 0; r < 3; r++) {
    d[r] = q[r] - p[r];
    for (int k = 0; k < 3; k++) sides[k][r] = t.corner[(k + 1) % 3][r] - t.corner[k][r];
  }
  double rim = INFINITY, sign = 0.0;
  for (int k = 0; k < 3; k++) {
    for (int r = 0; r < 3; r++) w[r] = t.corner[k][r] - p[r];
    double height = clear_height(d, sides[k], w);
    if (!(height * sign > 0.0 || (k == 0 && height != 0.0))) return 0.0;
    sign = height;
    rim = std::fmin(rim, std::fabs(height));
  }
  for (int r = 0; r < 3; r++) w[r] = p[r] - t.corner[0][r];
  double before = clear_height(sides[0], sides[1], w);
  for (int r = 0; r < 3; r++) w[r] = q[r] - t.corner[0][r];
  double after = clear_height(sides[0], sides[1], w);
  if (!(before * after < 0.0)) return 0.0;
  double share = before / (before - after);
  for (int r = 0; r < 3; r++) place[r] = p[r] + share * d[r];
  return std::fmin(rim, std::fmin(std::fabs(before), std::fabs(after)));
}

// The same for two triangles: the edge of either that goes through the other most surely.
inline double crossing(const Triangle& mine, const Triangle& theirs, double* place) {
  double best = 0.0, at[3] = {};
  for (int k = 0; k < 6; k++) {
    const Triangle &from = k < 3 ? mine : theirs, &through = k < 3 ? theirs : mine;
    double rim = pierced(from.corner[k % 3], from.corner[(k + 1) % 3], through, at);
    if (rim > best) {
      best = rim;
      for (int r = 0; r < 3; r++) place[r] = at[r];
    }
  }
  return best;
}

// Propose a point of a triangle inside a polytope: the mean corner of what its faces leave of it.
inline bool point_inside(const Triangle& t, const Faces& faces, double* y) {
  constexpr int MOST = 16;
  double polygon[2][MOST][3];
  int count = 3;
  std::memcpy(polygon[0], t.corner, sizeof t.corner);
  for (int64_t f = 0; f < faces.count; f++) {
    double above[MOST];
    bool cuts = false;
    for (int k = 0; k < count; k++) {
      const double* x = polygon[0][k];
      above[k] = faces.x[f] * x[0] + faces.y[f] * x[1] + faces.z[f] * x[2] - faces.d[f];
      cuts = cuts || above[k] > 0.0;
    }
    if (!cuts) continue;
    int kept = 0;
    for (int k = 0; k < count && kept + 2 <= MOST; k++) {
      int next = k + 1 < count ? k + 1 : 0;
      const double *a = polygon[0][k], *b = polygon[0][next];
      if (above[k] <= 0.0) std::memcpy(polygon[1][kept++], a, sizeof polygon[0][0]);
      if ((above[k] <= 0.0) == (above[next] <= 0.0)) continue;
      double share = above[k] / (above[k] - above[next]);
      for (int r = 0; r < 3; r++) polygon[1][kept][r] = a[r] + share * (b[r] - a[r]);
      kept++;
    }
    if (kept == 0) return false;
    count = kept;
    std::memcpy(polygon[0], polygon[1], sizeof polygon[0]);
  }
  for (int r = 0; r < 3; r++) {
    y[r] = 0.0;
    for (int k = 0; k < count; k++) y[r] += polygon[0][k][r] / count;
  }
  return faces.count > 0;
}

// Write the node's coordinates of a point in the root frame.
inline void back(const double* pose, const double* place, double* y) {
  for (int c = 0; c < 3; c++) {
    y[c] = 0.0;
    for (int r = 0; r < 3; r++) y[c] += pose[4 * c + r] * (place[r] - pose[12 + r]);
  }
}

// How far a contact at the centre may be moved before it is lost [m], not positive if none is
// known; the link's point (node frame) and its place.
inline double contact(const Solids& links, int64_t b, const Solids& obstacles, int64_t o,
                      const double* pose, double* y, double* place) {
  bool mine = links.range(b, PARTS) == TRIANGLE, theirs = obstacles.range(o, PARTS) == TRIANGLE;
  double balls = 0.0;
  if (mine) balls += links.length(b, BALL);
  if (theirs) balls += obstacles.length(o, BALL);
  if (mine && theirs) {
    Triangle own = triangle_of(links, b), moved;
    for (int k = 0; k < 3; k++) image(pose, own.corner[k], moved.corner[k]);
    double rim = crossing(moved, triangle_of(obstacles, o), place);
    back(pose, place, y);
    return rim - balls;
  }
  if (mine) {
    Triangle moved, own = triangle_of(links, b);
    for (int k = 0; k < 3; k++) image(pose, own.corner[k], moved.corner[k]);
    Faces faces = faces_of(obstacles, o);
    if (!point_inside(moved, faces, place)) return -INFINITY;
    back(pose, place, y);
    return depth(faces, place) - balls;
  }
  if (theirs) {
    Triangle there = triangle_of(obstacles, o), moved;
    for (int k = 0; k < 3; k++) back(pose, there.corner[k], moved.corner[k]);
    Faces faces = faces_of(links, b);
    if (!point_inside(moved, faces, y)) return -INFINITY;
    image(pose, y, place);
    return depth(faces, y) - balls;
  }
  return -INFINITY;
}

// Bound how far the built motion takes any point of a triangle from where the centre pose has it
// [m].
inline double strays(const Solids& solids, int64_t b, const Node& node) {
  Triangle t = triangle_of(solids, b);
  double most = 0.0;
  for (int k = 0; k < 3; k++) {
    double place[3];
    image(node.pose, t.corner[k], place);
    double far = farthest(t.corner[k], place, node.points);
    if (!(far <= most)) most = far;
  }
  return most;
}

// Look for a contact of a surface at the centre: true if it lasts for the whole piece.
//
// error: bound on the distance of the true motion to the built one; fuzz: on the error of the
// centre pose; margin: on rounding [m]. known: upper, place, depth and the witness are written when
// the contact is proved at the centre.
inline bool contact_witness(const Solids& links, int64_t b, const Solids& obstacles, int64_t o,
                            const Node& node, double error, double fuzz, double margin,
                            Known& known) {
  double y[3], place[3];
  double slack = contact(links, b, obstacles, o, node.pose, y, place) - 2.0 * margin;
  if (!(slack > fuzz)) return false;
  known.depth = slack - fuzz;
  known.upper = 0.0;
  for (int r = 0; r < 3; r++) {
    known.place[r] = place[r];
    known.start[r] = known.end[r] = y[r];
  }
  if (!node.sound) return false;
  // The real corners lie off the vertices, within the ball: a linear part that is no rotation moves
  // them otherwise.
  error += node.growth.eps * links.length(b, BALL);
  bool both = links.range(b, PARTS) == TRIANGLE && obstacles.range(o, PARTS) == TRIANGLE;
  return (both ? strays(links, b, node) : farthest(y, place, node.points)) + error < slack;
}

}  // namespace guard
