// A fat moving polygon against a fixed one: Listing 2, and what it leaves out (trusted).
//
// **Apart.** The three tests of [Schroecker & Weber 2014, sec. 4] (fat vertex and face, fat edge and
// edge, fat face and vertex) prove that no features come within the thickness r of each other for
// any displacement of the ball, by the inequality of `quadratic`.
//
// **Disjoint.** Contact of features is not overlap: an edge may pierce a face far from everything
// else. So one *static* test joins them, on the images y_i of the moving corners as they were
// computed for g. Take any affine map that moves every point x of the polygon to within
// R rho(x) + r of g(x). The straight path to it, from the affine maps of the triangles that take
// their corners to the computed y_i, stays within that (r includes the rounding of the y_i), so all
// features stay apart on the way. The distance of two disjoint triangles is that of a vertex and a
// face or of two edges: it varies continuously and cannot reach zero, so what is disjoint at the
// y_i is disjoint for every map. Triangles that meet do so on a side of one of them: it is enough
// that every edge of each polygon misses every triangle of the other. What proves that is a plane
// between them; directions to try are those between nearest features.
#pragma once

#include <vector>

#include "ball.hpp"
#include "quadratic.hpp"

namespace guard {

// Which test left a place open; the values of `toleranced.collision.Kind`.
enum : int64_t { NOTHING = -1, VERTEX_FACE, EDGE_EDGE, FACE_VERTEX, EDGE_PIERCES, FACE_PIERCED };

// Two features that may meet: corners within their faces (-1, -1: the whole face) and a place [m].
struct Contact {
  int64_t kind;
  int64_t moving[2], fixed[2];
  double place[3];
};

// A face of a surface; corners are images for the moving one.
struct Face {
  const double* corner;
  const double* turned;  // q of the corners; none for the fixed one
  int64_t corners;
  const int64_t* edge;
  int64_t edges;
  const int64_t* triangle;
  int64_t triangles;
};

inline Face face_of(const Surface& surface, int64_t face) {
  int64_t corner = surface.corner_first[face], edge = surface.edge_first[face];
  int64_t triangle = surface.triangle_first[face];
  return {surface.corner + 3 * corner,
          nullptr,
          surface.corner_first[face + 1] - corner,
          surface.edge + 2 * edge,
          surface.edge_first[face + 1] - edge,
          surface.triangle + 3 * triangle,
          surface.triangle_first[face + 1] - triangle};
}

// How the tests take a ball and a thickness: k of `quadratic` best where rho is largest, and kept
// where (1 + 1/k) r^2 is r^2 as good as exactly.
inline Fatness fatness(const Rate& rate, double thickness) {
  double k = 0x1p40;
  if (rate.uncertain * k > thickness) k = thickness / rate.uncertain;
  double c = k > 0.0 ? (1.0 + 1.0 / k) * thickness * thickness * UP : INFINITY;
  return {(1.0 + k) * rate.radius * rate.radius * UP, rate.spread * UP, c};
}

class FatPolygon {
 public:
  FatPolygon(const Face& moving, const Face& fixed, Fatness fat, double rounding)
      : moving(moving), fixed(fixed), fat(fat), rounding(rounding) {}

  // True only if the polygons are disjoint, and farther apart than the thickness, for every
  // displacement of the ball.
  bool apart(Contact& contact) {
    return vertices(contact) && edges(contact) && faces(contact) && disjoint(contact);
  }

  // Guess whether the polygons cross where they stand (untrusted: no margin).
  bool cross() const {
    for (int64_t i = 0; i < moving.edges; i++)
      for (int64_t j = 0; j < fixed.triangles; j++)
        if (pierces(moving, moving.edge + 2 * i, fixed, fixed.triangle + 3 * j)) return true;
    for (int64_t i = 0; i < fixed.edges; i++)
      for (int64_t j = 0; j < moving.triangles; j++)
        if (pierces(fixed, fixed.edge + 2 * i, moving, moving.triangle + 3 * j)) return true;
    return false;
  }

 private:
  const Face &moving, &fixed;
  Fatness fat;
  double rounding;  // of a plane's inequality over the length of its normal [m]
  double nearest = INFINITY, direction[3] = {0.0, 0.0, 0.0};

  static void subtract(const double* a, const double* b, double* out) {
    for (int r = 0; r < 3; r++) out[r] = a[r] - b[r];
  }

  // Bound a pair of features; remember the direction between them if they are the nearest so far.
  bool longer_than_fat(const Plane& z, const Plane& q, Domain domain, Parameters& where) {
    Quadratic f = longer(z, q, fat);
    if (!(lower_bound(f, domain, where) > 0.0)) return false;
    double at[3];
    for (int r = 0; r < 3; r++) at[r] = z.at[r] + where.s * z.s[r] + where.t * z.t[r];
    if (product(at, at) < nearest) {
      nearest = product(at, at);
      for (int r = 0; r < 3; r++) direction[r] = at[r];
    }
    return true;
  }

  // A triangle of the fixed face as seen from a point.
  Plane from_point(int64_t triangle, const double* y) const {
    const int64_t* at = fixed.triangle + 3 * triangle;
    Plane z;
    subtract(fixed.corner + 3 * at[0], y, z.at);
    subtract(fixed.corner + 3 * at[1], fixed.corner + 3 * at[0], z.s);
    subtract(fixed.corner + 3 * at[2], fixed.corner + 3 * at[0], z.t);
    return z;
  }

  // A point as seen from a triangle of the moving face.
  Plane to_point(int64_t triangle, const double* p) const {
    const int64_t* at = moving.triangle + 3 * triangle;
    Plane z;
    subtract(p, moving.corner + 3 * at[0], z.at);
    subtract(moving.corner + 3 * at[0], moving.corner + 3 * at[1], z.s);
    subtract(moving.corner + 3 * at[0], moving.corner + 3 * at[2], z.t);
    return z;
  }

  // A segment of fixed corners (parameter s) as seen from one of moving corners (t).
  Plane between(const int64_t* f, const int64_t* m) const {
    Plane z;
    subtract(fixed.corner + 3 * f[0], moving.corner + 3 * m[0], z.at);
    subtract(fixed.corner + 3 * f[1], fixed.corner + 3 * f[0], z.s);
    subtract(moving.corner + 3 * m[0], moving.corner + 3 * m[1], z.t);
    return z;
  }

  bool vertices(Contact& contact) {
    for (int64_t i = 0; i < moving.corners; i++) {
      Plane q{};
      for (int r = 0; r < 3; r++) q.at[r] = moving.turned[3 * i + r];
      const double* y = moving.corner + 3 * i;
      for (int64_t j = 0; j < fixed.triangles; j++) {
        Parameters where{0.0, 0.0};
        if (longer_than_fat(from_point(j, y), q, Domain::TRIANGLE, where)) continue;
        contact = {VERTEX_FACE, {i, -1}, {-1, -1}, {y[0], y[1], y[2]}};
        return false;
      }
    }
    return true;
  }

  bool edges(Contact& contact) {
    for (int64_t i = 0; i < moving.edges; i++) {
      const int64_t* m = moving.edge + 2 * i;
      Plane q{};
      for (int r = 0; r < 3; r++) {
        q.at[r] = moving.turned[3 * m[0] + r];
        q.t[r] = moving.turned[3 * m[1] + r] - q.at[r];
      }
      for (int64_t j = 0; j < fixed.edges; j++) {
        const int64_t* f = fixed.edge + 2 * j;
        Plane z = between(f, m);
        Parameters where{0.0, 0.0};
        if (longer_than_fat(z, q, Domain::SQUARE, where)) continue;
        contact = {EDGE_EDGE, {m[0], m[1]}, {f[0], f[1]}, {}};
        for (int r = 0; r < 3; r++)
          contact.place[r] = fixed.corner[3 * f[0] + r] + where.s * z.s[r];
        return false;
      }
    }
    return true;
  }

  bool faces(Contact& contact) {
    for (int64_t i = 0; i < moving.triangles; i++) {
      const int64_t* at = moving.triangle + 3 * i;
      Plane q;
      for (int r = 0; r < 3; r++) {
        q.at[r] = moving.turned[3 * at[0] + r];
        q.s[r] = moving.turned[3 * at[1] + r] - q.at[r];
        q.t[r] = moving.turned[3 * at[2] + r] - q.at[r];
      }
      for (int64_t j = 0; j < fixed.corners; j++) {
        const double* p = fixed.corner + 3 * j;
        Parameters where{0.0, 0.0};
        if (longer_than_fat(to_point(i, p), q, Domain::TRIANGLE, where)) continue;
        contact = {FACE_VERTEX, {-1, -1}, {j, -1}, {p[0], p[1], p[2]}};
        return false;
      }
    }
    return true;
  }

  // Say whether a plane with normal n has moving corners strictly below and fixed ones above.
  bool plane_between(const double* n, const int64_t* below, int64_t below_count,
                     const int64_t* above, int64_t above_count) const {
    double high = -INFINITY, low = INFINITY;
    for (int64_t i = 0; i < below_count; i++) {
      double on = product(n, moving.corner + 3 * (below ? below[i] : i));
      if (!(on <= high)) high = on;
    }
    for (int64_t i = 0; i < above_count; i++) {
      double on = product(n, fixed.corner + 3 * (above ? above[i] : i));
      if (!(on >= low)) low = on;
    }
    double length = std::fabs(n[0]) + std::fabs(n[1]) + std::fabs(n[2]);
    return low - high > length * rounding;
  }

  // Try the direction between the nearest points of two features, one of each simplex.
  bool parted(const Plane& z, Domain domain, const int64_t* m, int64_t m_count, const int64_t* f,
              int64_t f_count) const {
    Parameters where{0.0, 0.0};
    lower_bound(longer(z, Plane{}, {0.0, 0.0, 0.0}), domain, where);
    double n[3];
    for (int r = 0; r < 3; r++) n[r] = z.at[r] + where.s * z.s[r] + where.t * z.t[r];
    return plane_between(n, m, m_count, f, f_count);
  }

  bool moving_edge_misses(const int64_t* m, int64_t triangle) const {
    const int64_t* f = fixed.triangle + 3 * triangle;
    for (int end = 0; end < 2; end++) {
      Plane z = from_point(triangle, moving.corner + 3 * m[end]);
      if (parted(z, Domain::TRIANGLE, m, 2, f, 3)) return true;
    }
    for (int side = 0; side < 3; side++) {
      int64_t edge[2] = {f[side], f[(side + 1) % 3]};
      if (parted(between(edge, m), Domain::SQUARE, m, 2, f, 3)) return true;
    }
    return false;
  }

  bool fixed_edge_misses(const int64_t* f, int64_t triangle) const {
    const int64_t* m = moving.triangle + 3 * triangle;
    for (int end = 0; end < 2; end++) {
      Plane z = to_point(triangle, fixed.corner + 3 * f[end]);
      if (parted(z, Domain::TRIANGLE, m, 3, f, 2)) return true;
    }
    for (int side = 0; side < 3; side++) {
      int64_t edge[2] = {m[side], m[(side + 1) % 3]};
      if (parted(between(f, edge), Domain::SQUARE, m, 3, f, 2)) return true;
    }
    return false;
  }

  bool disjoint(Contact& contact) {
    if (plane_between(direction, nullptr, moving.corners, nullptr, fixed.corners)) return true;
    for (int64_t i = 0; i < moving.edges; i++)
      for (int64_t j = 0; j < fixed.triangles; j++) {
        const int64_t* m = moving.edge + 2 * i;
        if (moving_edge_misses(m, j)) continue;
        contact = {EDGE_PIERCES, {m[0], m[1]}, {-1, -1}, {}};
        middle(moving, m, contact.place);
        return false;
      }
    for (int64_t i = 0; i < fixed.edges; i++)
      for (int64_t j = 0; j < moving.triangles; j++) {
        const int64_t* f = fixed.edge + 2 * i;
        if (fixed_edge_misses(f, j)) continue;
        contact = {FACE_PIERCED, {-1, -1}, {f[0], f[1]}, {}};
        middle(fixed, f, contact.place);
        return false;
      }
    return true;
  }

  static bool pierces(const Face& one, const int64_t* edge, const Face& other,
                      const int64_t* triangle) {
    double a[3][3], along[3], volume[3];
    const double *p = one.corner + 3 * edge[0], *q = one.corner + 3 * edge[1];
    for (int i = 0; i < 3; i++) subtract(other.corner + 3 * triangle[i], p, a[i]);
    subtract(q, p, along);
    for (int i = 0; i < 3; i++) volume[i] = determinant(along, a[i], a[(i + 1) % 3]);
    bool through = volume[0] * volume[1] > 0.0 && volume[1] * volume[2] > 0.0;
    if (!through) return false;
    // Of p, and what q adds.
    double at_p = determinant(a[0], a[1], a[2]), change = volume[0] + volume[1] + volume[2];
    return at_p * (at_p - change) < 0.0;
  }

  static double determinant(const double* a, const double* b, const double* c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }

  static void middle(const Face& face, const int64_t* edge, double* place) {
    for (int r = 0; r < 3; r++)
      place[r] = 0.5 * (face.corner[3 * edge[0] + r] + face.corner[3 * edge[1] + r]);
  }
};

}  // namespace guard
