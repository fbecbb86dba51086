// Leaves of the cover: what is known about a span of a segment.
#pragma once

#include <cstdint>

namespace guard {

// Status; the values of `result.Status`. Zero is nobody's.
enum : int64_t { UNDECIDED, FREE, SUSPECT, COLLISION };

// Why a leaf is suspect.
enum : int64_t { BY_TOLERANCE, BY_DEPTH, BY_BUDGET, BY_STOP, BY_SCOPE };

// What is known about a pair on a piece [m].
struct Known {
  double lower, upper;      // bounds of its gap
  double place[3];          // the nearest obstacle point, or a common point
  double depth;             // of a common point at the centre, in both solids together
  double near;              // an upper bound of the gap at every instant
  double start[3], end[3];  // common points at both ends in the node frame: the moving witness
};

// The leaf [start, end] / 2^level of a segment; body and obstacle are -1 where no pair is named.
// The middle 2^-witness of the leaf provably collides, 0 if none does.
struct Leaf {
  int64_t segment, start, end, level, status, reason, body, obstacle, witness;
  Known known;
};

}  // namespace guard
