// Leaves of the cover: what is known about a span of a segment.
#pragma once

#include <cstdint>

namespace guard {

// Status; the values of `result.Status`. Zero is nobody's.
enum : int64_t { UNDECIDED, FREE, SUSPECT, COLLISION };

// Why a leaf is suspect.
// BY_HULL: parts would tell more, but nobody has built them. BY_ENCLOSURE: the core's, the surfaces
// keep apart, but one solid may lie inside the other.
enum : int64_t { BY_TOLERANCE, BY_DEPTH, BY_BUDGET, BY_STOP, BY_SCOPE, BY_HULL, BY_ENCLOSURE };

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

// A pair of wholes that was replaced by pairs of parts on a piece.
struct Opened {
  int64_t segment, numerator, level, body, obstacle;
};

// A solid whose parts somebody should build; side 0: the links, 1: the obstacles.
struct Wanted {
  int64_t side, solid;
};

}  // namespace guard
