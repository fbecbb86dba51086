// Cover the motion with pieces that are closed by proof (trusted bookkeeping).
//
// A time tree is walked, depth first in time order, or breadth first if only the verdict is asked
// for. A piece starts with the pairs its parent could not close (a whole segment with all of
// them); each pair is tried from cheap to dear, and what stays open goes to both halves. A pair
// proved on an interval is proved on all of its parts, so the enclosures of the halves may be
// fitted afresh. A piece ends as
//
// * FREE when no pair is open: every pair was closed on it or on a piece that contains it;
// * COLLISION when one pair provably overlaps at every instant of it;
// * SUSPECT when, at its centre, one pair is provably closer than clearance + tolerance and halving
//   would only cut finer what lies within the tolerance anyway, or when budget or depth are spent.
//
// A pair leaves the list of open pairs only after one of the inequalities of `cull` or `separation`
// held.
#pragma once

#include <algorithm>
#include <deque>
#include <vector>

#include "pair.hpp"

namespace guard {

constexpr int64_t DEEPEST_LEVEL = 48;  // times are exact dyadic numbers in a double up to here
constexpr int64_t FINEST_WITNESS = 12;

// A piece with more open pairs than this is halved before they are opened, while some body sweeps
// more than this part of its own size.
constexpr int64_t CROWD = 256;
constexpr double WIDE = 0.25;

// How much of the motion is asked about; the values of `settings.Scope`.
enum : int64_t { SCOPE_ALL, SCOPE_FIRST, SCOPE_VERDICT };

struct Request {
  double tolerance, clearance;  // [m]
  int64_t max_pieces;           // pieces to examine before the rest is given up as suspect
  int64_t scope;
  int64_t want_proof;
  const int64_t* bodies;  // bodies to check against every obstacle
  int64_t body_count;
};

// What stays within this part of the tolerance during a whole piece is not cut any finer; a gap
// between it and the tolerance is cheap to prove free and would be given away.
constexpr double CLOSE = 1.0 / 16.0;

// Say whether halving a piece would only cut finer what lies within the tolerance anyway.
inline bool settled(const Known& known, double limit, double sweep, double tolerance) {
  double close = CLOSE * tolerance;
  return known.upper <= limit + tolerance &&
         (known.lower >= limit - close || known.near <= limit + close || sweep <= tolerance);
}

// Return w such that the middle 2^-w of a piece provably collides, 0 if none is known.
//
// A point common to both solids at the centre by `depth` in all stays common until the link has
// moved by that much, and it moves at most linearly in the time from the centre.
inline int64_t witness_level(double depth, double linear) {
  if (!(depth > 0.0)) return 0;
  int64_t w = 1;
  double reach = 0.5 * linear * UP;
  while (w < FINEST_WITNESS && !(reach < depth)) {
    w++;
    reach *= 0.5;
  }
  return reach < depth ? w : 0;
}

// Everything that a request needs room for; kept by a thread from one request to the next.
struct Work {
  std::vector<Node> nodes;
  std::vector<Body> bodies;
  std::vector<double> rho, chord, span, fuzz, fit, scratch;
  std::vector<Live> live;
  std::vector<Leaf> leaves;
  Proof proof;
  int64_t pieces = 0;
};

// A piece to examine and its open pairs; a segment's own piece has all pairs and no list, and so
// have the halves of a crowded one.
struct Task {
  Piece piece;
  int64_t first, last;
  bool whole;
};

class Cover {
 public:
  Cover(const Chain& chain, const Solids& links, const Solids& obstacles, const Boxes& boxes,
        const Path& path, const Extents& extents, const Request& request, const int64_t* stop,
        Work& work)
      : path(path),
        request(request),
        stop(stop),
        work(work),
        ask{obstacles, boxes, request.tolerance, request.clearance},
        motion{chain,      links,       path,     (chain.nodes + LANES - 1) / LANES * LANES,
               work.nodes, work.bodies, work.rho, work.chord,
               work.span,  work.fuzz,   work.fit} {
    usable = motion.begin(extents, request.bodies, request.body_count);
    work.leaves.clear();
    work.live.clear();
    work.proof.clear(request.want_proof != 0);
    work.pieces = 0;
  }

  // False if the path is not what kernels can take; nothing is said of it then.
  bool run() {
    if (!usable) return false;
    if (request.scope == SCOPE_VERDICT)
      breadth_first();
    else
      depth_first();
    if (!work.proof.wanted) condense();
    return true;
  }

 private:
  const Path& path;
  const Request& request;
  const int64_t* stop;
  Work& work;
  Question ask;
  Motion motion;
  bool usable;
  int64_t given_up = -1;
  bool crowded = false;  // the last piece had too many pairs to open

  void depth_first() {
    std::vector<Task> stack;
    for (int64_t segment = 0; segment < path.segments; segment++) {
      stack.push_back({{segment, 0, 0}, 0, 0, true});
      while (!stack.empty()) {
        Task task = stack.back();
        stack.pop_back();
        if (spent(task.piece)) continue;
        // What lies behind this task's pairs belongs to pieces that are done.
        work.live.resize(task.last);
        if (look(task)) {
          stack.push_back(half(task, true, task.last));
          stack.push_back(half(task, false, task.last));
        } else if (request.scope == SCOPE_FIRST && work.leaves.back().status != FREE) {
          return;
        }
      }
    }
  }

  void breadth_first() {
    std::deque<Task> queue;
    for (int64_t segment = 0; segment < path.segments; segment++)
      queue.push_back({{segment, 0, 0}, 0, 0, true});
    while (!queue.empty()) {
      Task task = queue.front();
      queue.pop_front();
      if (spent(task.piece)) continue;
      int64_t first = static_cast<int64_t>(work.live.size());
      if (look(task)) {
        queue.push_back(half(task, false, first));
        queue.push_back(half(task, true, first));
      } else {
        work.live.resize(first);
        if (work.leaves.back().status != FREE) given_up = BY_SCOPE;
      }
    }
    std::sort(work.leaves.begin(), work.leaves.end(), [](const Leaf& a, const Leaf& b) {
      if (a.segment != b.segment) return a.segment < b.segment;
      return std::ldexp(double(a.start), -int(a.level)) <
             std::ldexp(double(b.start), -int(b.level));
    });
  }

  // Keep of a run of leaves with one status and one reason what tells of the whole: both ends, the
  // smallest gaps, the widest witness.
  void condense() {
    std::vector<Leaf>& leaves = work.leaves;
    size_t kept = 0;
    for (size_t first = 0, last; first < leaves.size(); first = last) {
      size_t nearest = first, lowest = first, widest = first;
      auto witness = [&](size_t i) {
        return leaves[i].witness > 0 ? leaves[i].level + leaves[i].witness : INT64_MAX;
      };
      for (last = first; last < leaves.size() && leaves[last].status == leaves[first].status &&
                         leaves[last].reason == leaves[first].reason;
           last++) {
        bool named = leaves[last].body >= 0, before = leaves[nearest].body >= 0;
        if (named && (!before || leaves[last].known.upper < leaves[nearest].known.upper))
          nearest = last;
        if (named && (!before || leaves[last].known.lower < leaves[lowest].known.lower))
          lowest = last;
        if (witness(last) < witness(widest)) widest = last;
      }
      for (size_t i = first; i < last; i++)
        if (i == first || i + 1 == last || i == nearest || i == lowest || i == widest)
          leaves[kept++] = leaves[i];
    }
    leaves.resize(kept);
  }

  // A half of a piece, with the pairs that stayed open from `first` on; all pairs if it was
  // crowded.
  Task half(const Task& task, bool second, int64_t first) const {
    const Piece& p = task.piece;
    Piece piece{p.segment, 2 * p.numerator + second, p.level + 1};
    return {piece, first, int64_t(work.live.size()), crowded};
  }

  // Write a leaf for a piece that nobody will look at any more.
  bool spent(const Piece& piece) {
    if (given_up < 0 && work.pieces >= request.max_pieces) given_up = BY_BUDGET;
    if (given_up < 0 && __atomic_load_n(stop, __ATOMIC_RELAXED) != 0) given_up = BY_STOP;
    if (given_up < 0) return false;
    Known nothing{};
    nothing.lower = -INFINITY;
    nothing.upper = INFINITY;
    write(piece, SUSPECT, given_up, -1, -1, 0, nothing);
    return true;
  }

  void write(const Piece& p, int64_t status, int64_t reason, int64_t body, int64_t obstacle,
             int64_t witness, const Known& known) {
    work.leaves.push_back({p.segment, p.numerator, p.numerator + 1, p.level, status, reason, body,
                           obstacle, witness, known});
  }

  // Examine a piece: true if it must be halved, its open pairs then lie behind all others; else a
  // leaf was written.
  bool look(const Task& task) {
    const Piece& piece = task.piece;
    int64_t examined = ++work.pieces;
    int64_t first = static_cast<int64_t>(work.live.size());
    crowded = task.whole && !open_all(piece, examined);
    if (crowded) return true;
    if (!task.whole) open_some(task, examined);
    int64_t last = static_cast<int64_t>(work.live.size());
    Known worst{};
    if (last == first) {
      write(piece, FREE, BY_TOLERANCE, -1, -1, 0, worst);
      return false;
    }
    motion.need_none();
    for (int64_t i = first; i < last; i++) motion.need(work.live[i].body);
    motion.build();
    bool deep = piece.level >= DEEPEST_LEVEL;
    if (hopeless(first, last) && !deep) return true;
    return !try_pairs(piece, examined, first, deep);
  }

  // Open the pairs that the swept spheres do not close; false, and none is open, if they are many
  // and fewer would be in each half.
  bool open_all(const Piece& piece, int64_t examined) {
    motion.need_none();
    for (int64_t i = 0; i < request.body_count; i++) motion.need(request.bodies[i]);
    motion.centre(piece);
    int64_t first = static_cast<int64_t>(work.live.size());
    bool wide = false;
    for (int64_t i = 0; i < request.body_count; i++) {
      int64_t b = request.bodies[i];
      Body& body = motion.stand(b, examined);
      scan(motion.links, b, ask.boxes, request.clearance, body,
           [&](int64_t o) { work.live.push_back({b, o, {}, {}, {}, {}, {}}); });
      wide =
          wide || body.sweep > WIDE * (motion.links.length(b, CORE) + motion.links.length(b, BALL));
      if (wide && int64_t(work.live.size()) - first > CROWD && piece.level < DEEPEST_LEVEL) {
        work.live.resize(first);
        return false;
      }
    }
    if (work.proof.wanted) note_closed(piece, examined, first);
    return true;
  }

  // Write proof entries for the pairs that a scan closed.
  void note_closed(const Piece& piece, int64_t examined, int64_t first) {
    std::vector<char> open(ask.obstacles.count);
    size_t i = first;
    for (int64_t k = 0; k < request.body_count; k++) {
      int64_t b = request.bodies[k];
      std::fill(open.begin(), open.end(), 0);
      for (; i < work.live.size() && work.live[i].body == b; i++) open[work.live[i].obstacle] = 1;
      for (int64_t o = 0; o < ask.obstacles.count; o++)
        if (!open[o]) work.proof.add(piece, examined, {BALLS_APART, 0, b, o, {}, 0.0});
    }
  }

  // Copy the pairs that the swept spheres do not close behind all others.
  void open_some(const Task& task, int64_t examined) {
    motion.need_none();
    for (int64_t i = task.first; i < task.last; i++) motion.need(work.live[i].body);
    motion.centre(task.piece);
    for (int64_t i = task.first; i < task.last; i++) {
      Live live = work.live[i].half(task.piece.numerator % 2 != 0);
      Body& body = motion.stand(live.body, examined);
      if (swept_clear(motion.links, live.body, ask.obstacles, live.obstacle, request.clearance,
                      body))
        work.proof.add(task.piece, examined, {BALLS_APART, 0, live.body, live.obstacle, {}, 0.0});
      else
        work.live.push_back(live);
    }
  }

  // Say whether some open pair cannot be closed because the enclosure is wider than the gap.
  bool hopeless(int64_t first, int64_t last) {
    bool found = false;
    for (int64_t i = first; i < last; i++) {
      int64_t b = work.live[i].body;
      Body& body = motion.bodies[b];
      if (body.error >= 0.0) continue;
      body.error = motion.fit_error(b);
      double worth =
          body.nearest + WORTH * (motion.links.length(b, CORE) + motion.links.length(b, BALL));
      if (body.sweep > request.tolerance && !(body.error <= worth)) found = true;
    }
    return found;
  }

  // Examine the open pairs from `first` on: false if the piece must be halved, the pairs that stay
  // open are then the last ones; else a leaf was written.
  bool try_pairs(const Piece& piece, int64_t examined, int64_t first, bool deep) {
    Known known, worst{};
    // Of all pairs that stay open, so that it holds for whichever is named, tracking included.
    double lowest = INFINITY;
    int64_t status = UNDECIDED, named_body = -1, named_obstacle = -1, named_witness = 0;
    int64_t kept = first, last = static_cast<int64_t>(work.live.size());
    for (int64_t i = first; i < last; i++) {
      Live live = work.live[i];
      Body& body = motion.bodies[live.body];
      if (moving_clear(motion, live.body, ask.obstacles, live.obstacle, request.clearance, body)) {
        work.proof.add(piece, examined, {BALLS_APART, 0, live.body, live.obstacle, {}, 0.0});
        continue;
      }
      Outcome outcome =
          examine(motion, ask, piece, examined, live, work.scratch, work.proof, known);
      if (outcome == Outcome::CLOSED) continue;
      double lower = known.lower - body.slack;
      lower -= 4.0 * UNIT_ROUNDOFF * (std::fabs(known.lower) + body.slack);
      if (!(lower >= lowest)) lowest = lower;
      double limit = (request.clearance + body.slack) * UP;
      // The common point may lie off the core, within the ball, and turns with it.
      int64_t witness =
          witness_level(known.depth, body.linear + motion.turned(live.body) *
                                                       motion.links.length(live.body, BALL));
      // A body that stands in this piece stands in both halves.
      bool ends = deep || body.sweep == 0.0 ||
                  settled(known, limit, body.sweep, request.tolerance) ||
                  (request.scope == SCOPE_VERDICT && witness > 0);
      bool collides = outcome == Outcome::OVERLAPS;
      if (collides || (ends && (status != SUSPECT || known.upper < worst.upper))) {
        status = collides ? COLLISION : SUSPECT;
        named_body = live.body;
        named_obstacle = live.obstacle;
        named_witness = collides ? 0 : witness;
        worst = known;
      }
      if (collides) break;
      work.live[kept] = live;
      // What overlaps at the centre is likely to overlap in a half: let it be tried first.
      if (known.upper < 0.0) std::swap(work.live[first], work.live[kept]);
      kept++;
    }
    if (status == UNDECIDED && kept > first) {
      work.live.resize(kept);
      return false;
    }
    int64_t reason = BY_TOLERANCE;
    if (status == UNDECIDED) {
      status = FREE;
    } else if (status == SUSPECT) {
      double limit = (request.clearance + motion.bodies[named_body].slack) * UP;
      if (!(worst.upper <= limit + request.tolerance)) reason = BY_DEPTH;
    }
    if (status != FREE) worst.lower = lowest;
    write(piece, status, reason, named_body, named_obstacle, named_witness, worst);
    return true;
  }
};

}  // namespace guard
