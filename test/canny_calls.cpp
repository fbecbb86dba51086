// Kernels of the algebraic collision test that only kernels call, opened to the tests.
#include "constraints.hpp"

using namespace guard;

namespace {

Polynomial read(const double* c, int64_t degree, double error = 0.0) {
  Polynomial f{int(degree)};
  f.error = error;
  for (int64_t k = 0; k <= degree; k++) f.c[k] = c[k];
  return f;
}

double write(const Polynomial& f, double* c) {
  for (int k = 0; k <= f.degree; k++) c[k] = f.c[k];
  return f.error;
}

}  // namespace

extern "C" {

// Coefficients of a product and of a sum go to `out`; the bound on their error is returned.
double canny_product(const double* f, int64_t m, const double* g, int64_t n, double error,
                     double* out) {
  return write(product(read(f, m, error), read(g, n, error)), out);
}

double canny_sum(const double* f, const double* g, int64_t n, double error, double* out) {
  return write(sum(read(f, n, error), read(g, n, error), -1.0), out);
}

// a_i f_i added up; f (count, n + 1).
double canny_combination(const double* a, int64_t count, const double* f, int64_t n, double error,
                         double* out) {
  Combination total{int(n)};
  for (int64_t i = 0; i < count; i++) {
    Polynomial one = read(f + i * (n + 1), n);
    total.add(a[i], one.c, error, one.size());
  }
  return write(total.done(), out);
}

// The value at s goes to `out`.
double canny_value(const double* f, int64_t n, double s, double error, double* out) {
  *out = value(read(f, n), s);
  return value_error(read(f, n, error));
}

// The parts left and right of t, one after the other.
double canny_split(const double* f, int64_t n, double t, double error, double* out) {
  Polynomial left, right;
  split(read(f, n, error), t, left, right);
  write(left, out);
  return write(right, out + n + 1);
}

// The stretches (n, 3) of a polynomial; returns n, at most `room`.
int64_t canny_stretches(const double* c, int64_t degree, double error, int64_t method, int64_t room,
                        double* out) {
  Polynomial f = read(c, degree, error);
  std::vector<Stretch> stretches;
  Isolation(stretches, method).run(f);
  for (size_t i = 0; i < stretches.size() && int64_t(i) < room; i++) {
    *out++ = stretches[i].start;
    *out++ = stretches[i].end;
    *out++ = stretches[i].state;
  }
  return int64_t(stretches.size());
}

// The relative motion (BASIS, degree + 1) and its errors; returns the degree.
int64_t canny_basis(const Course* a, const Course* b, double* c, double* error) {
  Polynomial basis[BASIS];
  if (!relative_basis(*a, *b, basis)) return -1;
  for (int i = 0; i < BASIS; i++) {
    for (int k = 0; k <= basis[i].degree; k++) *c++ = basis[i].c[k];
    error[i] = basis[i].error;
  }
  return basis[0].degree;
}

// One constraint: coefficients (degree + 1) and error. kind 0: vertex i of A, face j of B; 1:
// vertex i of B, face j of A; 2: edges i of A and j of B.
double canny_constraint(const Polyhedron* a, const Course* course_a, const Polyhedron* b,
                        const Course* course_b, int64_t kind, int64_t i, int64_t j, double* c) {
  Polynomial basis[BASIS];
  relative_basis(*course_a, *course_b, basis);
  Constraints constraints(*a, *b, basis);
  Rows rows, other;
  Polynomial f;
  if (kind == 2) {
    constraints.place_edges(rows);
    f = constraints.passing(rows, i, b->line + 6 * j);
  } else {
    constraints.place_vertices(rows, other);
    f = kind ? constraints.height(other, i, a->plane + 4 * j)
             : constraints.height(rows, i, b->plane + 4 * j);
  }
  return write(f, c);
}
}
