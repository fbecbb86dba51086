// Closed subsets of [0, 1] as sorted rows of disjoint closed spans (trusted).
#pragma once

#include <algorithm>

#include "signs.hpp"

namespace guard {

struct Span {
  double start, end;
};

using Spans = std::vector<Span>;

// The stretches of a polynomial among those of all.
struct Sign {
  uint8_t met = 0;  // states that occur; 0: not computed yet
  int32_t first = 0, count = 0;
};

// Keep of `set` what lies in stretches with a wanted state.
inline void restrict_to(Spans& set, const Stretch* stretch, const Sign& sign, uint8_t wanted,
                        Spans& room) {
  if (!(sign.met & ~wanted)) return;
  room.clear();
  if (sign.met & wanted) {
    size_t i = 0;
    int32_t k = 0;
    while (i < set.size() && k < sign.count) {
      const Stretch& part = stretch[sign.first + k];
      double start = std::max(set[i].start, part.start), end = std::min(set[i].end, part.end);
      if ((part.state & wanted) && start <= end) {
        if (!room.empty() && start <= room.back().end)
          room.back().end = end;
        else
          room.push_back({start, end});
      }
      if (part.end <= set[i].end)
        k++;
      else
        i++;
    }
  }
  set.swap(room);
}

// Sort spans and join those that meet: the union of all sets that they come from.
inline void unite(Spans& spans) {
  std::sort(spans.begin(), spans.end(),
            [](const Span& a, const Span& b) { return a.start < b.start; });
  size_t kept = 0;
  for (const Span& span : spans) {
    if (kept && span.start <= spans[kept - 1].end)
      spans[kept - 1].end = std::max(spans[kept - 1].end, span.end);
    else
      spans[kept++] = span;
  }
  spans.resize(kept);
}

// Keep of `set` what lies in another one, too.
inline void intersect(Spans& set, const Spans& other, Spans& room) {
  room.clear();
  for (size_t i = 0, j = 0; i < set.size() && j < other.size();) {
    double start = std::max(set[i].start, other[j].start);
    double end = std::min(set[i].end, other[j].end);
    if (start <= end) room.push_back({start, end});
    if (set[i].end < other[j].end)
      i++;
    else
      j++;
  }
  set.swap(room);
}

// Take the inside of another set out of `set`.
inline void subtract(Spans& set, const Spans& other, Spans& room) {
  room.clear();
  for (Span span : set) {
    bool cut = false;
    for (size_t k = 0; k < other.size(); k++) {
      if (other[k].end < span.start || other[k].start > span.end) continue;
      if (other[k].start > span.start) room.push_back({span.start, other[k].start});
      span.start = std::max(span.start, other[k].end);
      cut = true;
    }
    if (!cut || span.start < span.end) room.push_back(span);
  }
  set.swap(room);
}

}  // namespace guard
