// What trajectory_guard is measured against: two ways to check a cubic spline of an arm against a
// scene with coal's distance and collision queries, links as convex hulls.
//
// Sampling looks at poses only. Conservative advancement (Schwarzer, Saha, Latombe: Adaptive
// Dynamic Collision Checking for Single and Multiple Articulated Robots in Complex Environments,
// 2005) bisects time until the distance at an interval's middle exceeds what the links can move.
//
// One thread. Units: m, rad, s.

#include <algorithm>
#include <cmath>
#include <deque>
#include <sstream>
#include <utility>
#include <vector>

#include "model.hpp"
#include "motion.hpp"

namespace {

// Work space of a bisection.
struct Middle {
  std::vector<double> q, left, right, lengths, drift;

  explicit Middle(int joints) : q(joints), left(joints), right(joints), lengths(joints) {}

  // Places the links at a span's middle, bounds how far they get in each half; returns its time.
  double look(Checker& checker, const Spline& spline, const Span& span) {
    const double middle = (span.begin + span.end) / 2;
    evaluate(spline, span.segment, middle, q.data());
    forward(checker, q.data());
    path_lengths(spline, span.segment, span.begin, middle, left.data());
    path_lengths(spline, span.segment, middle, span.end, right.data());
    for (std::size_t j = 0; j < q.size(); j++) lengths[j] = std::max(left[j], right[j]);
    drifts(checker, lengths.data(), drift);
    return middle;
  }
};

Span whole(const Checker& checker, const Spline& spline, int segment) {
  Span span{segment, 0.0, spline.length(segment), {}};
  for (std::size_t pair = 0; pair < checker.pairs.size(); pair++) span.pairs.push_back(pair);
  return span;
}

}  // namespace

extern "C" {

// Builds a checker from the text that bench/peers.py writes.
void* baseline_load(const char* text) {
  auto* checker = new Checker;
  std::istringstream in(text);
  std::vector<char> checked;
  read_links(*checker, in, checked);
  read_obstacles(*checker, in);
  for (std::size_t i = 0; i < checker->links.size(); i++) {
    if (!checked[i]) continue;
    for (std::size_t j = 0; j < checker->obstacles.size(); j++) checker->pairs.push_back({i, j});
  }
  checker->guesses.assign(checker->pairs.size(), Vector(1, 0, 0));
  return checker;
}

void baseline_free(void* handle) {
  delete static_cast<Checker*>(handle);
}

int baseline_pairs(void* handle) {
  return static_cast<Checker*>(handle)->pairs.size();
}

// Looks at poses no farther apart than a step of the fastest joint [rad], up to the first
// collision. Returns whether there is one; out: its time, and the number of poses.
int baseline_sample(void* handle, int segments, const double* knots, const double* coefficients,
                    double step, double* out) {
  Checker& checker = *static_cast<Checker*>(handle);
  const Spline spline{checker.joints, segments, knots, coefficients};
  std::vector<double> q(checker.joints), lengths(checker.joints);
  long poses = 0;
  for (int segment = 0; segment < segments; segment++) {
    const double duration = spline.length(segment);
    path_lengths(spline, segment, 0, duration, lengths.data());
    const double longest = *std::max_element(lengths.begin(), lengths.end());
    const int steps = std::max(1, static_cast<int>(std::ceil(longest / step)));
    for (int i = segment ? 1 : 0; i <= steps; i++) {
      const double u = duration * i / steps;
      evaluate(spline, segment, u, q.data());
      forward(checker, q.data());
      poses++;
      for (std::size_t pair = 0; pair < checker.pairs.size(); pair++) {
        if (box_distance(checker, pair) > 0 || !collide(checker, pair)) continue;
        out[0] = knots[segment] + u;
        out[1] = poses;
        return 1;
      }
    }
  }
  out[0] = -1;
  out[1] = poses;
  return 0;
}

// Advances breadth first. Returns 0: free, 1: contact found (distance <= margin), 2: undecided, a
// span became shorter than the smallest; out: time of the contact or of the first such span, and
// the number of distance queries.
int baseline_verdict(void* handle, int segments, const double* knots, const double* coefficients,
                     double margin, double smallest, double* out) {
  Checker& checker = *static_cast<Checker*>(handle);
  const Spline spline{checker.joints, segments, knots, coefficients};
  Middle middle(checker.joints);
  checker.queries = 0;
  bool undecided = false;
  out[0] = -1;
  std::deque<Span> spans;
  for (int s = 0; s < segments; s++) spans.push_back(whole(checker, spline, s));
  while (!spans.empty()) {
    const Span span = std::move(spans.front());
    spans.pop_front();
    const double u = middle.look(checker, spline, span);
    std::vector<int> rest;
    for (int pair : span.pairs) {
      const double needed = middle.drift[checker.pairs[pair].first] + margin;
      if (box_distance(checker, pair) > needed) continue;
      const double d = distance(checker, pair, false);
      if (d <= margin) {
        out[0] = knots[span.segment] + u;
        out[1] = checker.queries;
        return 1;
      }
      if (d <= needed) rest.push_back(pair);
    }
    if (rest.empty()) continue;
    if (span.end - span.begin < smallest) {
      if (!undecided) out[0] = knots[span.segment] + u;
      undecided = true;
      continue;
    }
    spans.push_back({span.segment, span.begin, u, rest});
    spans.push_back({span.segment, u, span.end, rest});
  }
  out[1] = checker.queries;
  return undecided ? 2 : 0;
}

// Advances in the order of time and returns the number of spans that are not free; out: begin,
// end, and 1 for contact throughout, 2 for undecided, of the first `room` of them.
int baseline_intervals(void* handle, int segments, const double* knots, const double* coefficients,
                       double margin, double smallest, double* out, int room) {
  Checker& checker = *static_cast<Checker*>(handle);
  const Spline spline{checker.joints, segments, knots, coefficients};
  Middle middle(checker.joints);
  checker.queries = 0;
  int count = 0;
  std::vector<Span> spans;
  for (int s = segments - 1; s >= 0; s--) spans.push_back(whole(checker, spline, s));
  while (!spans.empty()) {
    const Span span = std::move(spans.back());
    spans.pop_back();
    const double u = middle.look(checker, spline, span);
    std::vector<int> rest;
    bool contact = false;
    for (int pair : span.pairs) {
      const double needed = middle.drift[checker.pairs[pair].first] + margin;
      if (box_distance(checker, pair) > needed) continue;
      const double d = distance(checker, pair, true);
      if (-d > needed) {
        contact = true;
        break;
      }
      if (d <= needed) rest.push_back(pair);
    }
    if (!contact && rest.empty()) continue;
    if (contact || span.end - span.begin < smallest) {
      if (count < room) {
        out[3 * count] = knots[span.segment] + span.begin;
        out[3 * count + 1] = knots[span.segment] + span.end;
        out[3 * count + 2] = contact ? 1 : 2;
      }
      count++;
      continue;
    }
    spans.push_back({span.segment, u, span.end, rest});
    spans.push_back({span.segment, span.begin, u, rest});
  }
  return count;
}

}  // extern "C"
