// What a certificate says of the pairs that were closed: which inequality, on which piece.
#pragma once

#include <vector>

#include "piece.hpp"
#include "separation.hpp"

namespace guard {

// Kinds of entries.
enum : int64_t { BALLS_APART, PLANE_BETWEEN, PLANE_TURNING };

// The pair is apart on the piece; the direction of the plane as in `separation`, and its offset if
// it stands: n.x = offset.
struct Entry {
  int64_t kind, piece, body, obstacle;
  Turn turn;
  double offset;
};

// Entries and the pieces they speak of; nothing is kept if nobody asked.
struct Proof {
  bool wanted = false;
  std::vector<Piece> pieces;
  std::vector<Entry> entries;
  int64_t number = -1;  // of the piece at hand among those examined

  void clear(bool want) {
    wanted = want;
    pieces.clear();
    entries.clear();
    number = -1;
  }

  void add(const Piece& piece, int64_t examined, Entry entry) {
    if (!wanted) return;
    if (number != examined) {
      number = examined;
      pieces.push_back(piece);
    }
    entry.piece = static_cast<int64_t>(pieces.size()) - 1;
    entries.push_back(entry);
  }
};

}  // namespace guard
