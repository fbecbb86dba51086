// When two convex polyhedra overlap: the conditions of [Canny 1984, sec. 4] over certain and over
// possible signs (trusted).
//
// *Possible* spans contain every instant at which the closed bodies have a point in common: each
// weak condition is replaced by "not certainly violated". *Certain* spans contain only such
// instants: each is replaced by "certainly holds, strictly". The conditions are derived in
// ``conditions.py`` of the core.
//
// The bodies are apart where all vertices of one are certainly above a face of the other, so first
// the instants are taken at which that is true of no face; there often are none, and the rest need
// not be asked.
#pragma once

#include "constraints.hpp"

namespace guard {

class Meeting {
 public:
  // Find the possible and the certain spans of a pair.
  void run(const Polyhedron& a, const Polyhedron& b, const Polynomial* basis, int64_t method) {
    a_ = &a;
    b_ = &b;
    Constraints constraints(a, b, basis);
    constraints_ = &constraints;
    polynomials = 0;
    method_ = method;
    stretches_.clear();
    possible.assign(1, {0.0, 1.0});
    certain.clear();
    constraints.place_vertices(vertices_a_, vertices_b_);
    heights(vertices_a_, a.vertices, b, signs_b_);
    if (!near(signs_b_, a.vertices, b.faces)) return;
    heights(vertices_b_, b.vertices, a, signs_a_);
    if (!near(signs_a_, b.vertices, a.faces)) return;
    constraints.place_edges(edges_);
    signs_c_.assign(a.edges * b.edges, Sign{});
    rest_ = possible;
    possible.clear();
    take([&](uint8_t also) { inside(signs_b_, a.vertices, b.faces, also); });
    take([&](uint8_t also) { inside(signs_a_, b.vertices, a.faces, also); });
    take([&](uint8_t also) { pierced(a, b, signs_b_, false, also); });
    take([&](uint8_t also) { pierced(b, a, signs_a_, true, also); });
    possible.insert(possible.end(), certain.begin(), certain.end());
    unite(certain);
    unite(possible);
  }

  Spans possible, certain;
  int64_t polynomials = 0;  // built

 private:
  Sign signs_of(const Polynomial& f) {
    Sign sign;
    polynomials++;
    sign.first = int32_t(stretches_.size());
    sign.met = Isolation(stretches_, method_).run(f);
    sign.count = int32_t(stretches_.size()) - sign.first;
    return sign;
  }

  // Signs (vertices, faces) of the heights of one body's vertices above the other's faces.
  void heights(const Rows& vertices, int64_t count, const Polyhedron& other,
               std::vector<Sign>& signs) {
    signs.clear();
    for (int64_t v = 0; v < count; v++)
      for (int64_t f = 0; f < other.faces; f++)
        signs.push_back(signs_of(constraints_->height(vertices, v, other.plane + 4 * f)));
  }

  // Keep of `possible` where no face has all vertices certainly above it; false if nothing is.
  bool near(const std::vector<Sign>& signs, int64_t vertices, int64_t faces) {
    for (int64_t f = 0; f < faces; f++) {
      bool all = false;
      below_.clear();
      for (int64_t v = 0; v < vertices && !all; v++) {
        const Sign& sign = signs[v * faces + f];
        all = !(sign.met & POSITIVE);
        for (int32_t k = 0; k < sign.count && !all; k++) {
          const Stretch& part = stretches_[sign.first + k];
          if (part.state != POSITIVE) below_.push_back({part.start, part.end});
        }
      }
      if (all) continue;
      unite(below_);
      intersect(possible, below_, room_);
      if (possible.empty()) return false;
    }
    return true;
  }

  // Take one of (8), (9), (12), (13) where nothing certain is known yet. `also` are the states
  // that count as fulfilled besides the strict ones.
  template <class Condition>
  void take(const Condition& condition) {
    if (rest_.empty()) return;
    found_.clear();
    condition(UNKNOWN);
    possible.insert(possible.end(), found_.begin(), found_.end());
    if (found_.empty()) return;
    found_.clear();
    condition(0);
    certain.insert(certain.end(), found_.begin(), found_.end());
    unite(found_);
    subtract(rest_, found_, room_);
  }

  void keep() { found_.insert(found_.end(), set_.begin(), set_.end()); }

  // Vertices of one body in the other.
  void inside(const std::vector<Sign>& signs, int64_t vertices, int64_t faces, uint8_t also) {
    for (int64_t v = 0; v < vertices; v++) {
      set_ = rest_;
      for (int64_t f = 0; f < faces && !set_.empty(); f++)
        restrict_to(set_, stretches_.data(), signs[v * faces + f], NEGATIVE | also, room_);
      keep();
    }
  }

  // Edges of one body through faces of another.
  void pierced(const Polyhedron& own, const Polyhedron& other, const std::vector<Sign>& signs,
               bool swapped, uint8_t also) {
    for (int64_t i = 0; i < own.edges; i++)
      for (int64_t f = 0; f < other.faces; f++) {
        const Sign& tail = signs[own.edge[2 * i] * other.faces + f];
        const Sign& head = signs[own.edge[2 * i + 1] * other.faces + f];
        through(other, i, f, tail, head, 1, swapped, also);
        through(other, i, f, head, tail, -1, swapped, also);
      }
  }

  // (10): one end below, the other above, and all sides inside; (11): the other way around.
  void through(const Polyhedron& other, int64_t i, int64_t f, const Sign& below, const Sign& above,
               int64_t way, bool swapped, uint8_t also) {
    if (!(below.met & (NEGATIVE | also)) || !(above.met & (POSITIVE | also))) return;
    set_ = rest_;
    restrict_to(set_, stretches_.data(), below, NEGATIVE | also, room_);
    restrict_to(set_, stretches_.data(), above, POSITIVE | also, room_);
    for (int64_t n = other.face_start[f]; n < other.face_start[f + 1] && !set_.empty(); n++) {
      int64_t k = other.face_edge[n];
      const Sign& side = swapped ? passing(k, i) : passing(i, k);
      uint8_t inner = way * other.face_way[n] > 0 ? POSITIVE : NEGATIVE;
      restrict_to(set_, stretches_.data(), side, inner | also, room_);
    }
    keep();
  }

  const Sign& passing(int64_t i, int64_t k) {
    Sign& sign = signs_c_[i * b_->edges + k];
    if (!sign.met) sign = signs_of(constraints_->passing(edges_, i, b_->line + 6 * k));
    return sign;
  }

  const Polyhedron *a_ = nullptr, *b_ = nullptr;
  const Constraints* constraints_ = nullptr;
  int64_t method_ = CLOSED_FORM;
  std::vector<Stretch> stretches_;
  std::vector<Sign> signs_a_, signs_b_, signs_c_;
  Rows vertices_a_, vertices_b_, edges_;
  Spans rest_, set_, room_, below_, found_;
};

}  // namespace guard
