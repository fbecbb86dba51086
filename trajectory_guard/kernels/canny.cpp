// What Python calls of the algebraic collision test. Each function returns 0, 1 if memory ran out,
// or 2 if the degree is too high.
#include <new>

#include "linear.hpp"
#include "meeting.hpp"

using namespace guard;

extern "C" {

// Possible and certain spans of a pair; they stay valid until the thread's next call.
struct Overlaps {
  int64_t possible_count, certain_count, polynomials;
  const Span *possible, *certain;
};

int guard_overlap(const Polyhedron* a, const Course* course_a, const Polyhedron* b,
                  const Course* course_b, int64_t method, int64_t times, Overlaps* out) try {
  static thread_local Meeting meeting;
  Polynomial basis[BASIS];
  for (int64_t i = 0; i < times; i++) {
    if (!relative_basis(*course_a, *course_b, basis)) return 2;
    meeting.run(*a, *b, basis, method);
  }
  *out = {int64_t(meeting.possible.size()), int64_t(meeting.certain.size()), meeting.polynomials,
          meeting.possible.data(), meeting.certain.data()};
  return 0;
} catch (const std::bad_alloc&) {
  return 1;
}

// Answer queries of four points on straight lines each: rows (count, 8, 3), answers (count,).
int guard_linear(int64_t count, int64_t kind, const double* rows, int64_t* answers) try {
  static thread_local LinearQuery query;
  for (int64_t i = 0; i < count; i++) answers[i] = query.run(kind, rows + 24 * i);
  return 0;
} catch (const std::bad_alloc&) {
  return 1;
}
}
