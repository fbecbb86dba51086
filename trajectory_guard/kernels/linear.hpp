// A vertex and a triangle, or two edges, whose four points move on straight lines (trusted).
//
// Let the points be polynomials of degree 1 in s. They lie in one plane where the cubic
//
//     vertex v, face a b c:  f = (v - a) . (b - a) x (c - a),
//     edges a b and c d:     f = (c - a) . (b - a) x (d - c)
//
// is zero. **Necessary for contact**, besides: for each axis k, in the projection along k,
//
//     v = l_a a + l_b b + l_c c, l >= 0, gives (b - v) x (c - v) = l_a A, ..., A = (b - a) x (c - a),
//
// so the three areas have the sign of A or vanish (all, if A does); and of two edges that meet in
// a + l (b - a) = c + m (d - c), with D = (b - a) x (d - c),
//
//     (b - a) x (c - a) = -m D,  (b - a) x (d - a) = (1 - m) D,
//     (d - c) x (a - c) =  l D,  (d - c) x (b - c) = (l - 1) D.
//
// Also, along no axis does one feature lie beyond the other. **Sufficient**: f has opposite certain
// signs at the ends of a span, in which for some axis A (or D) and all the others certainly have
// the strict signs: where f vanishes, the projection along the axis is one-to-one.
#pragma once

#include "constraints.hpp"

namespace guard {

enum : int64_t { APART, UNDECIDED, MEETING };
enum : int64_t { VERTEX_FACE, EDGE_EDGE };

class LinearQuery {
 public:
  // rows (8, 3): the four points at s = 0, then at s = 1, exact.
  int64_t run(int64_t kind, const double* rows) {
    stretches_.clear();
    for (int i = 0; i < 4; i++)
      for (int k = 0; k < 3; k++) {
        point_[i][k] = Polynomial(1);
        point_[i][k].c[0] = rows[3 * i + k];
        point_[i][k].c[1] = rows[3 * (4 + i) + k];
      }
    possible_.assign(1, {0.0, 1.0});
    int64_t split = kind == VERTEX_FACE ? 1 : 2;
    for (int k = 0; k < 3; k++)
      if (!beside(k, split)) return APART;
    Polynomial u[3], v[3], w[3], normal[3];
    vector(0, 1, u);
    vector(0, 2, v);
    vector(kind == VERTEX_FACE ? 0 : 2, 3, w);
    if (kind == VERTEX_FACE) {
      cross(v, w, normal);  // (a - v) . (b - v) x (c - v): f, up to its sign
      plane_ = signs_of(dot(u, normal, 3));
    } else {
      cross(u, w, normal);
      plane_ = signs_of(dot(v, normal, 3));
    }
    restrict_to(possible_, stretches_.data(), plane_, UNKNOWN, room_);
    if (possible_.empty()) return APART;
    bool meeting = false;
    for (int k = 0; k < 3; k++) {
      if (kind == VERTEX_FACE)
        areas(k, u, v, w);
      else
        sides(k, u, v, w, normal[k]);
      if (!project()) return APART;
      meeting = meeting || crosses();
    }
    return meeting ? MEETING : UNDECIDED;
  }

 private:
  Sign signs_of(const Polynomial& f) {
    Sign sign;
    sign.first = int32_t(stretches_.size());
    sign.met = Isolation(stretches_, CLOSED_FORM).run(f);
    sign.count = int32_t(stretches_.size()) - sign.first;
    return sign;
  }

  void vector(int from, int to, Polynomial* out) const {
    for (int k = 0; k < 3; k++) out[k] = sum(point_[to][k], point_[from][k], -1.0);
  }

  // Keep where the first `split` points are not certainly all beyond the others along an axis.
  bool beside(int k, int64_t split) {
    for (uint8_t beyond : {POSITIVE, NEGATIVE}) {
      Spans near;
      for (int i = 0; i < split; i++)
        for (int j = int(split); j < 4; j++) {
          set_ = possible_;
          Sign sign = signs_of(sum(point_[i][k], point_[j][k], -1.0));
          restrict_to(set_, stretches_.data(), sign, uint8_t(~beyond), room_);
          near.insert(near.end(), set_.begin(), set_.end());
        }
      unite(near);
      possible_.swap(near);
      if (possible_.empty()) return false;
    }
    return true;
  }

  // One component of a cross product.
  static Polynomial area(int k, const Polynomial* a, const Polynomial* b) {
    int i = (k + 1) % 3, j = (k + 2) % 3;
    return sum(product(a[i], b[j]), product(a[j], b[i]), -1.0);
  }

  // The signs that must agree with that of A: u, v, w lead from the vertex to the corners.
  void areas(int k, const Polynomial* u, const Polynomial* v, const Polynomial* w) {
    Polynomial parts[3] = {area(k, v, w), area(k, w, u), area(k, u, v)};
    whole_ = signs_of(sum(sum(parts[0], parts[1]), parts[2]));
    for (int i = 0; i < 3; i++) parts_[i] = signs_of(parts[i]);
    count_ = 3;
  }

  // The same for D: u = b - a, v = c - a, w = d - c.
  void sides(int k, const Polynomial* u, const Polynomial* v, const Polynomial* w,
             const Polynomial& D) {
    Polynomial minus = constant(-1.0);
    Polynomial first = product(minus, area(k, u, v));   // m D
    Polynomial second = product(minus, area(k, w, v));  // l D, as a - c = -v
    whole_ = signs_of(D);
    parts_[0] = signs_of(first);
    parts_[1] = signs_of(sum(D, first, -1.0));
    parts_[2] = signs_of(second);
    parts_[3] = signs_of(sum(D, second, -1.0));
    count_ = 4;
  }

  // Keep where the signs may agree.
  bool project() {
    Spans agree;
    for (uint8_t sense : {POSITIVE, NEGATIVE}) {
      set_ = possible_;
      restrict_to(set_, stretches_.data(), whole_, sense | UNKNOWN, room_);
      for (int i = 0; i < count_; i++)
        restrict_to(set_, stretches_.data(), parts_[i], sense | UNKNOWN, room_);
      agree.insert(agree.end(), set_.begin(), set_.end());
    }
    unite(agree);
    possible_.swap(agree);
    return !possible_.empty();
  }

  // Say whether f changes its sign where all signs certainly agree.
  bool crosses() {
    for (uint8_t sense : {POSITIVE, NEGATIVE}) {
      set_.assign(1, {0.0, 1.0});
      restrict_to(set_, stretches_.data(), whole_, sense, room_);
      for (int i = 0; i < count_; i++)
        restrict_to(set_, stretches_.data(), parts_[i], sense, room_);
      for (int32_t k = 1; k + 1 < plane_.count; k++) {
        const Stretch* here = stretches_.data() + plane_.first + k;
        if (here[0].state != UNKNOWN || (here[-1].state | here[1].state) != (NEGATIVE | POSITIVE))
          continue;
        for (const Span& span : set_)
          if (span.start <= here[0].start && here[0].end <= span.end) return true;
      }
    }
    return false;
  }

  Polynomial point_[4][3];
  std::vector<Stretch> stretches_;
  Sign plane_, whole_, parts_[4];
  int count_ = 0;
  Spans possible_, set_, room_;
};

}  // namespace guard
