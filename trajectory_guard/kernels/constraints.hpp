// The constraints of two moving convex polyhedra as Bernstein polynomials with errors (trusted).
//
// With the relative motion P, t, t', N, S of A and B (derived in ``relative.py`` of the core)
//
//     A:  n_A . (P^T p_B - t') - N d_A,      B:  n_B . (P p_A + t) - N d_B,
//     C:  e_B . (P (p_A x e_A) + S^T e_A) + (p_B x e_B) . P e_A,
//
// positive for a vertex above a plane, and for an edge that leaves a face on the inner side of an
// edge that bounds it counter-clockwise.
//
// **Error.** A value is sum_i a_i f_i with at most 7 terms; the a_i are rounded once, by u |a_i| or
// 2^-1075, the products and sums 7 times:
//
//     |error| <= sum_i |a_i| (e_i + 8 u |f_i|) (1 + u) + 2^-1074 (e_i + |f_i|).
#pragma once

#include <cstdint>

#include "spans.hpp"

namespace guard {

// A convex polyhedron; every number is the exact one, rounded once.
struct Polyhedron {
  int64_t vertices, faces, edges;
  const double* vertex;       // (V, 3), exact [m]
  const double* plane;        // (F, 4) outward normal and offset: n.x = d on the face
  const double* line;         // (E, 6) direction e and moment p x e
  const int64_t* edge;        // (E, 2) tail and head
  const int64_t* face_start;  // (F + 1,) into the next two
  const int64_t* face_edge;   // edges of each face
  const int64_t* face_way;    // 1 if the edge runs counter-clockwise, else -1
};

// A path: Bernstein coefficients, exact.
struct Course {
  int64_t position_degree, quaternion_degree;
  const double* positions;    // (n + 1, 3) [m]
  const double* quaternions;  // (m + 1, 4), scalar first
};

constexpr int BASIS_P = 0, BASIS_T = 9, BASIS_BACK = 12, BASIS_N = 15, BASIS_S = 16, BASIS = 25;

inline void column(const double* rows, int64_t degree, int width, int c, Polynomial& f) {
  f.degree = int(degree);
  for (int64_t i = 0; i <= degree; i++) f.c[i] = rows[i * width + c];
}

inline void cross(const Polynomial* a, const Polynomial* b, Polynomial* out) {
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    out[i] = sum(product(a[j], b[k]), product(a[k], b[j]), -1.0);
  }
}

inline Polynomial dot(const Polynomial* a, const Polynomial* b, int n) {
  Polynomial total = product(a[0], b[0]);
  for (int i = 1; i < n; i++) total = sum(total, product(a[i], b[i]));
  return total;
}

// Columns of the matrix of y -> Rot(y, Q), three polynomials each.
inline void rotation(const Polynomial* Q, Polynomial (*columns)[3]) {
  Polynomial square[4], two = constant(2.0);
  for (int i = 0; i < 4; i++) square[i] = product(Q[i], Q[i]);
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    const Polynomial &x = Q[1 + i], &y = Q[1 + j], &z = Q[1 + k], &w = Q[0];
    columns[i][i] = sum(sum(square[0], square[1 + i]), sum(square[1 + j], square[1 + k]), -1.0);
    columns[i][j] = product(two, sum(product(x, y), product(w, z)));
    columns[i][k] = product(two, sum(product(x, z), product(w, y), -1.0));
  }
}

// The relative motion, every part of the same degree; false if that is too high.
inline bool relative_basis(const Course& a, const Course& b, Polynomial* basis) {
  int64_t far = std::max(a.position_degree, b.position_degree);
  int64_t degree = far + 2 * (a.quaternion_degree + b.quaternion_degree);
  if (!(degree <= LARGEST_DEGREE)) return false;
  Polynomial Q[2][4], x[3], columns[2][3][3], relative[3][3], norm[2];
  const Course* course[2] = {&a, &b};
  for (int i = 0; i < 2; i++) {
    for (int c = 0; c < 4; c++)
      column(course[i]->quaternions, course[i]->quaternion_degree, 4, c, Q[i][c]);
    rotation(Q[i], columns[i]);
    norm[i] = dot(Q[i], Q[i], 4);
  }
  for (int c = 0; c < 3; c++) {
    Polynomial own, other;
    column(a.positions, a.position_degree, 3, c, own);
    column(b.positions, b.position_degree, 3, c, other);
    x[c] = sum(elevated(own, int(far)), elevated(other, int(far)), -1.0);
  }
  // conj(Q_B) Q_A.
  Polynomial R[4], turn[3];
  R[0] = dot(Q[1], Q[0], 4);
  cross(Q[0] + 1, Q[1] + 1, turn);
  for (int c = 0; c < 3; c++)
    R[1 + c] =
        sum(turn[c], sum(product(Q[1][0], Q[0][1 + c]), product(Q[0][0], Q[1][1 + c]), -1.0));
  rotation(R, relative);
  for (int r = 0; r < 3; r++) {
    Polynomial moved[3];
    cross(x, columns[1][r], moved);  // x x (column r of M_B)
    for (int c = 0; c < 3; c++) {
      basis[BASIS_P + 3 * r + c] = relative[c][r];
      basis[BASIS_S + 3 * c + r] = product(constant(-1.0), dot(columns[0][c], moved, 3));
    }
    basis[BASIS_T + r] = product(norm[0], dot(columns[1][r], x, 3));
    basis[BASIS_BACK + r] = product(norm[1], dot(columns[0][r], x, 3));
  }
  basis[BASIS_N] = product(norm[0], norm[1]);
  for (int i = 0; i < BASIS; i++) basis[i] = elevated(basis[i], int(degree));
  return true;
}

constexpr double COMBINED = 8.0;
constexpr double TINIEST = 0x1p-1074;

// Polynomials of one degree, end to end, with errors and sizes.
class Rows {
 public:
  void reset(int degree) {
    degree_ = degree;
    c.clear();
    error.clear();
    size.clear();
  }

  void push(const Polynomial& f) {
    c.insert(c.end(), f.c, f.c + degree_ + 1);
    error.push_back(f.error);
    size.push_back(f.size());
  }

  const double* at(size_t i) const { return c.data() + i * (degree_ + 1); }

  std::vector<double> c, error, size;

 private:
  int degree_ = 0;
};

// Adds up a_i f_i and what bounds its error.
class Combination {
 public:
  explicit Combination(int degree) {
    f.degree = degree;
    for (int k = 0; k <= degree; k++) f.c[k] = 0.0;
  }

  void add(double a, const double* c, double error, double size) {
    for (int k = 0; k <= f.degree; k++) f.c[k] += a * c[k];
    f.error += std::fabs(a) * (error + COMBINED * UNIT_ROUNDOFF * size) + TINIEST * (error + size);
  }

  void add(double a, const Rows& rows, size_t i) {
    add(a, rows.at(i), rows.error[i], rows.size[i]);
  }

  const Polynomial& done() {
    f.error = (f.error + UNDERFLOW_PAID) * UP;
    return f;
  }

  Polynomial f;
};

// The constraints of a pair, built on demand.
struct Constraints {
  Constraints(const Polyhedron& a, const Polyhedron& b, const Polynomial* basis)
      : degree(basis[0].degree), basis_(basis), a_(a), b_(b) {}

  // P p + t of the vertices of A, P^T p - t' of those of B.
  void place_vertices(Rows& rows_a, Rows& rows_b) const {
    rows_a.reset(degree);
    rows_b.reset(degree);
    for (int64_t v = 0; v < a_.vertices; v++)
      for (int r = 0; r < 3; r++)
        rows_a.push(three(a_.vertex + 3 * v, BASIS_P + 3 * r, 1, BASIS_T + r, 1.0));
    for (int64_t v = 0; v < b_.vertices; v++)
      for (int r = 0; r < 3; r++)
        rows_b.push(three(b_.vertex + 3 * v, BASIS_P + r, 3, BASIS_BACK + r, -1.0));
  }

  // P (p x e) + S^T e, then P e, of the edges of A.
  void place_edges(Rows& rows) const {
    rows.reset(degree);
    for (int64_t i = 0; i < a_.edges; i++) {
      const double *e = a_.line + 6 * i, *m = e + 3;
      for (int r = 0; r < 3; r++) {
        Combination total(degree);
        for (int c = 0; c < 3; c++) add(total, m[c], BASIS_P + 3 * r + c);
        for (int c = 0; c < 3; c++) add(total, e[c], BASIS_S + 3 * c + r);
        rows.push(total.done());
      }
      for (int r = 0; r < 3; r++) {
        Combination total(degree);
        for (int c = 0; c < 3; c++) add(total, e[c], BASIS_P + 3 * r + c);
        rows.push(total.done());
      }
    }
  }

  // Type A or B: the height of a placed vertex above a plane.
  Polynomial height(const Rows& vertices, int64_t v, const double* plane) const {
    Combination total(degree);
    for (int r = 0; r < 3; r++) total.add(plane[r], vertices, 3 * v + r);
    add(total, -plane[3], BASIS_N);
    return total.done();
  }

  // Type C.
  Polynomial passing(const Rows& edges, int64_t i, const double* line) const {
    Combination total(degree);
    for (int r = 0; r < 6; r++) total.add(line[r], edges, 6 * i + r);
    return total.done();
  }

  int degree;

 private:
  void add(Combination& total, double a, int i) const {
    total.add(a, basis_[i].c, basis_[i].error, size(i));
  }

  double size(int i) const {
    if (sizes_[i] < 0.0) sizes_[i] = basis_[i].size();
    return sizes_[i];
  }

  Polynomial three(const double* p, int first, int step, int rest, double sign) const {
    Combination total(degree);
    for (int c = 0; c < 3; c++) add(total, p[c], first + step * c);
    add(total, sign, rest);
    return total.done();
  }

  const Polynomial* basis_;
  const Polyhedron &a_, &b_;
  mutable double sizes_[BASIS] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1,
                                  -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
};

}  // namespace guard
