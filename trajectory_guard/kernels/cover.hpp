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
// What is suspect only because of the tolerance is looked at again with the smallest one that
// rounding allows: contacts then begin and end within nanoseconds or so (`sharpen`).
//
// A pair leaves the list of open pairs only after one of the inequalities of `cull` or `separation`
// held, or when the pairs of one side's parts take its place: their surfaces are then kept apart,
// and whether one solid lies inside the other is for the core to exclude (`opened` says of which
// pairs and pieces). Where parts are not built, the piece ends as suspect and they are asked for
// (`wanted`).
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

// A pair whose hulls meet at the centre is replaced by pairs of parts once the body sweeps less
// than this part of the size of the one that is taken apart.
constexpr double FINE = 0.5;

// Pairs of parts looked at after one has turned out to meet at the centre: its piece cannot become
// free, but another one may prove a collision.
constexpr int64_t MORE_TRIES = 32;

// So many pairs of parts count as one piece of the budget.
constexpr int64_t PART_PAIRS = 16;

// How much of the motion is asked about; the values of `settings.Scope`.
enum : int64_t { SCOPE_ALL, SCOPE_FIRST, SCOPE_VERDICT };

struct Request {
  double tolerance, clearance;  // [m]
  int64_t max_pieces;           // pieces to examine before the rest is given up as suspect
  int64_t scope;
  int64_t want_proof;
  int64_t sharpen;        // look closer at suspect leaves, if no proof is wanted
  const int64_t* bodies;  // bodies to check against every obstacle
  int64_t body_count;
};

// A closer look at a leaf ends after so many pieces, and the leaf stays as it was. Where two convex
// polyhedra begin or cease to meet, 25 pieces are usual, and none of 305 such leaves took over 61.
constexpr int64_t CLOSER_PIECES = 96;

// The smallest tolerance is so many times the error of the centre pose, and so many times the
// distance at which rounding turns a direction by as much as matters.
constexpr double ABOVE_POSE = 64.0;
constexpr double ABOVE_DIRECTION = 4.0;

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
  std::vector<Live> live, parts, extra;
  std::vector<Leaf> leaves, coarse;
  std::vector<Opened> opened;
  std::vector<Wanted> wanted;
  Proof proof;
  int64_t pieces = 0;
  int64_t stamps = 0;      // pieces that this thread ever examined
  int64_t part_pairs = 0;  // pairs of parts examined
};

// What the pairs of a piece leave to be said of it.
struct Ending {
  int64_t status = UNDECIDED, body = -1, obstacle = -1, witness = 0;
  Known worst{};
  double lowest = INFINITY;  // gap of all pairs that stay open, tracking included
  bool coarse = false;       // parts that nobody has built were wanted
  bool cut = false;          // time or budget were spent among the parts
  bool meets = false;        // some pair of parts meets at the centre
  bool urgent = false;       // the last pair should be the first one to be tried in a half
  int64_t tries = MORE_TRIES;
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
        ask{obstacles, boxes, request.tolerance, request.clearance, request.want_proof == 0},
        budget(request.max_pieces),
        motion{chain,      links,       path,     (chain.nodes + LANES - 1) / LANES * LANES,
               work.nodes, work.bodies, work.rho, work.chord,
               work.span,  work.fuzz,   work.fit} {
    usable = motion.begin(extents, request.bodies, request.body_count);
    work.leaves.clear();
    work.live.clear();
    work.opened.clear();
    work.wanted.clear();
    work.proof.clear(request.want_proof != 0);
    work.pieces = work.part_pairs = 0;
  }

  // False if the path is not what kernels can take; nothing is said of it then.
  bool run() {
    if (!usable) return false;
    if (request.scope == SCOPE_VERDICT)
      breadth_first();
    else
      depth_first();
    if (request.scope == SCOPE_ALL) sharpen();
    if (!work.proof.wanted) condense();
    return true;
  }

 private:
  const Path& path;
  const Request& request;
  const int64_t* stop;
  Work& work;
  Question ask;
  int64_t budget;  // pieces, with those already examined
  Motion motion;
  bool usable;
  int64_t given_up = -1;
  bool crowded = false;  // the last piece had too many pairs to open
  bool closer = false;   // leaves are looked at again

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
        } else if (request.scope == SCOPE_FIRST && decided()) {
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
        if (decided()) given_up = BY_SCOPE;
      }
    }
    std::sort(work.leaves.begin(), work.leaves.end(), [](const Leaf& a, const Leaf& b) {
      if (a.segment != b.segment) return a.segment < b.segment;
      return std::ldexp(double(a.start), -int(a.level)) <
             std::ldexp(double(b.start), -int(b.level));
    });
  }

  // Look closer at all suspect leaves; after one that is not worth it, those that follow are left as
  // they are up to the next one that is not suspect.
  void sharpen() {
    work.coarse.swap(work.leaves);
    work.leaves.clear();
    bool worth = true;
    for (const Leaf& leaf : work.coarse) {
      worth = worth || leaf.status != SUSPECT;
      if (worth && suits(leaf))
        worth = sharpened(leaf);
      else
        work.leaves.push_back(leaf);
    }
  }

  // Say whether a leaf is known not to become free when looked at closer, which is then done.
  bool decided() {
    const Leaf leaf = work.leaves.back();
    if (leaf.status == FREE || leaf.reason == BY_HULL) return false;
    if (!suits(leaf) || (request.scope == SCOPE_VERDICT && leaf.witness > 0)) return true;
    work.leaves.pop_back();
    size_t first = work.leaves.size();
    sharpened(leaf);
    return std::any_of(work.leaves.begin() + first, work.leaves.end(),
                       [](const Leaf& part) { return part.status != FREE; });
  }

  // Say whether a leaf may be looked at closer: not where a proof is wanted, whose pieces are those
  // of the tree; and what asks for parts is covered once more in any case.
  bool suits(const Leaf& leaf) const {
    return request.sharpen && !work.proof.wanted && work.wanted.empty() && given_up < 0 &&
           leaf.status == SUSPECT && leaf.reason == BY_TOLERANCE;
  }

  // Write what a closer look at a leaf finds; false, and the leaf itself is written, if its share of
  // pieces, time or budget do not suffice, or rounding allows no smaller tolerance.
  bool sharpened(const Leaf& leaf) {
    size_t leaves = work.leaves.size(), opened = work.opened.size();
    closer = true;
    ask.tolerance = smallest_tolerance(leaf);
    budget = std::min(budget, work.pieces + work.part_pairs / PART_PAIRS + CLOSER_PIECES);
    bool done = 2.0 * ask.tolerance < request.tolerance && cover_again(leaf);
    closer = false;
    ask.tolerance = request.tolerance;
    budget = request.max_pieces;
    if (done) return true;
    work.leaves.resize(leaves);
    work.opened.resize(opened);
    work.leaves.push_back(leaf);
    // The leaf's share may be spent without the request's.
    given_up = -1;
    exhausted(work.pieces);
    return false;
  }

  // Cover the span of a leaf from the start: false if not all of it is decided.
  bool cover_again(const Leaf& leaf) {
    int64_t first = static_cast<int64_t>(work.live.size());
    std::vector<Task> stack{{{leaf.segment, leaf.start, leaf.level}, first, first, true}};
    while (!stack.empty() && !exhausted(work.pieces)) {
      Task task = stack.back();
      stack.pop_back();
      work.live.resize(task.last);
      if (look(task)) {
        stack.push_back(half(task, true, task.last));
        stack.push_back(half(task, false, task.last));
      }
    }
    work.live.resize(first);
    return given_up < 0;
  }

  // The smallest distance at which the pair of a leaf can be told apart [m].
  //
  // The error of the pose is one bound. Directions are another: at a distance d, nearest points
  // give one that is off by about u times their coordinates over d, so that the link leaves its
  // plane by that times the link's size; this must stay below d.
  double smallest_tolerance(const Leaf& leaf) {
    motion.need_none();
    motion.need(leaf.body);
    motion.centre({leaf.segment, leaf.start, leaf.level});
    const Body& body = stand(leaf.body, ++work.stamps);
    double far = body.reach + ask.obstacles.length(leaf.obstacle, FAR);
    double size = motion.links.length(leaf.body, CORE) + motion.links.length(leaf.body, BALL);
    return std::fmax(ABOVE_DIRECTION * std::sqrt(UNIT_ROUNDOFF * far * size),
                     ABOVE_POSE * body.fuzz);
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

  // Say whether time or budget are spent, with so many pieces examined before.
  bool exhausted(int64_t pieces) {
    if (pieces + work.part_pairs / PART_PAIRS >= budget)
      given_up = BY_BUDGET;
    else if (__atomic_load_n(stop, __ATOMIC_RELAXED) != 0)
      given_up = BY_STOP;
    return given_up >= 0;
  }

  // Write a leaf for a piece that nobody will look at any more.
  bool spent(const Piece& piece) {
    if (given_up < 0 && !exhausted(work.pieces)) return false;
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
    work.pieces++;
    int64_t examined = ++work.stamps;
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
    std::vector<char> open(ask.obstacles.wholes);
    size_t i = first;
    for (int64_t k = 0; k < request.body_count; k++) {
      int64_t b = request.bodies[k];
      std::fill(open.begin(), open.end(), 0);
      for (; i < work.live.size() && work.live[i].body == b; i++) open[work.live[i].obstacle] = 1;
      for (int64_t o = 0; o < ask.obstacles.wholes; o++)
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
      Body& body = stand(live.body, examined);
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
      double worth = std::fmax(body.nearest, 0.0) +
                     WORTH * (motion.links.length(b, CORE) + motion.links.length(b, BALL));
      if (body.sweep > ask.tolerance && !(body.error <= worth)) found = true;
    }
    return found;
  }

  // Examine the open pairs from `first` on: false if the piece must be halved, the pairs that stay
  // open are then the last ones; else a leaf was written.
  bool try_pairs(const Piece& piece, int64_t examined, int64_t first, bool deep) {
    Ending end;
    int64_t kept = first, last = static_cast<int64_t>(work.live.size());
    work.extra.clear();
    for (int64_t i = first; i < last && end.status != COLLISION; i++) {
      // A pair that is taken apart leaves pairs of parts, which come before all others.
      work.parts.clear();
      Live live = work.live[i];
      for (;;) {
        if (stays_open(piece, examined, live, deep, end)) {
          bool fits = kept <= i;
          if (fits)
            work.live[kept++] = live;
          else
            work.extra.push_back(live);
          if (end.urgent)
            std::swap(work.live[first], fits ? work.live[kept - 1] : work.extra.back());
        }
        if (work.parts.empty() || end.status == COLLISION) break;
        live = work.parts.back();
        work.parts.pop_back();
      }
    }
    if (end.status == UNDECIDED && !end.coarse && !end.cut && kept > first) {
      work.live.resize(kept);
      work.live.insert(work.live.end(), work.extra.begin(), work.extra.end());
      return false;
    }
    finish(piece, end);
    return true;
  }

  // Try one pair: true if it stays open; what it says of the piece is added to `end`.
  bool stays_open(const Piece& piece, int64_t examined, Live& live, bool deep, Ending& end) {
    Body& body = motion.bodies[live.body];
    bool part = is_part(motion.links, live.body) || is_part(ask.obstacles, live.obstacle);
    end.urgent = false;
    if (part) {
      // A piece may have any number of them; its own one is not counted yet.
      end.cut = end.cut || exhausted(work.pieces - 1);
      if (end.cut || (end.meets && --end.tries < 0)) {
        end.lowest = -INFINITY;
        return true;
      }
    }
    if (moving_clear(motion, live.body, ask.obstacles, live.obstacle, request.clearance, body)) {
      work.proof.add(piece, examined, {BALLS_APART, 0, live.body, live.obstacle, {}, 0.0});
      return false;
    }
    if (part) work.part_pairs++;
    Known known;
    Outcome outcome = examine(motion, ask, piece, examined, live, work.scratch, work.proof, known);
    if (outcome == Outcome::CLOSED) return false;
    double limit = (request.clearance + body.slack) * UP;
    // The common point may lie off the core, within the ball, and turns with it.
    int64_t witness = witness_level(
        known.depth, body.linear + motion.turned(live.body) * motion.links.length(live.body, BALL));
    bool collides = outcome == Outcome::OVERLAPS;
    // A body that stands in this piece stands in both halves.
    bool ends = deep || body.sweep == 0.0 || settles(known, limit, body.sweep);
    // Where a common point is known, no part can show that there is none.
    if (!(known.depth > 0.0) && take_apart(piece, examined, live, known, limit, ends, end))
      return false;
    double lower = known.lower - body.slack;
    lower -= 4.0 * UNIT_ROUNDOFF * (std::fabs(known.lower) + body.slack);
    if (!(lower >= end.lowest)) end.lowest = lower;
    ends = ends || (request.scope == SCOPE_VERDICT && witness > 0);
    if (collides || (ends && (end.status != SUSPECT || known.upper < end.worst.upper))) {
      end.status = collides ? COLLISION : SUSPECT;
      name(live, known, end);
      end.witness = collides ? 0 : witness;
    }
    // What overlaps at the centre is likely to overlap in a half: let it be tried first.
    bool meets = part && known.upper <= limit;
    end.urgent = known.upper < 0.0 || known.depth > 0.0 || (meets && !end.meets);
    end.meets = end.meets || meets;
    return true;
  }

  // Say whether a suspect piece is not cut any finer. At a closer look it also matters when the
  // bodies themselves meet, not only when they come too near.
  bool settles(const Known& known, double limit, double sweep) const {
    if (!closer) return settled(known, limit, sweep, ask.tolerance);
    return sweep <= CLOSE * ask.tolerance ||
           (settled(known, limit, sweep, ask.tolerance) &&
            (known.lower >= 0.0 || settled(known, 0.0, sweep, ask.tolerance)));
  }

  Body& stand(int64_t b, int64_t examined) {
    return is_part(motion.links, b) ? motion.stand_part(b, examined) : motion.stand(b, examined);
  }

  static bool is_part(const Solids& solids, int64_t b) { return solids.range(b, WHOLE) != b; }

  static void name(const Live& live, const Known& known, Ending& end) {
    end.body = live.body;
    end.obstacle = live.obstacle;
    end.worst = known;
  }

  // Replace a pair by those of the larger solid's parts if they could tell more: true if so, or if
  // they are asked for. Kept out of the way of what every pair runs.
  __attribute__((noinline)) bool take_apart(const Piece& piece, int64_t examined, const Live& live,
                                            const Known& known, double limit, bool ends,
                                            Ending& end) {
    if (request.want_proof) return false;
    const Solids &links = motion.links, &obstacles = ask.obstacles;
    int64_t b = live.body, o = live.obstacle;
    double mine = links.has_parts(b) ? links.length(b, CORE) : -1.0;
    double theirs = obstacles.has_parts(o) ? obstacles.length(o, CORE) : -1.0;
    bool own = mine >= theirs;
    double size = own ? mine : theirs;
    if (size < 0.0) return false;
    bool near = known.upper <= limit + ask.tolerance;
    if (!ends && !(near && motion.bodies[b].sweep <= FINE * size)) return false;
    const Solids& of = own ? links : obstacles;
    int64_t whole = own ? b : o;
    if (of.range(whole, PARTS) == UNBUILT) {
      work.wanted.push_back({own ? 0 : 1, whole});
      if (!end.coarse && end.status != SUSPECT) name(live, known, end);
      end.coarse = true;
      end.lowest = -INFINITY;
      return true;
    }
    if (!is_part(links, b) && !is_part(obstacles, o))
      work.opened.push_back({piece.segment, piece.numerator, piece.level, b, o});
    size_t before = work.parts.size();
    double distance[2] = {};
    for (int64_t k = 0; k < 2; k++) {
      int64_t part = of.range(whole, CHILD) + k;
      Live pair{own ? part : b, own ? o : part, {}, {}, {}, {}, {}};
      Body& body = stand(pair.body, examined);
      if (swept_clear(links, pair.body, obstacles, pair.obstacle, request.clearance, body))
        continue;
      if (body.error < 0.0) body.error = motion.fit_error(pair.body);
      distance[k] = distance_of(body.place, obstacles.at(pair.obstacle, CENTRE));
      work.parts.push_back(pair);
    }
    // The nearer one is the next to be tried.
    if (work.parts.size() == before + 2 && distance[0] < distance[1])
      std::swap(work.parts[before], work.parts[before + 1]);
    return true;
  }

  static double distance_of(const double* x, const double* y) {
    double d[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
    return norm(d);
  }

  // Write the leaf of a piece that is not halved.
  void finish(const Piece& piece, Ending& end) {
    int64_t reason = BY_TOLERANCE;
    if (end.cut && end.status != COLLISION) {
      end.status = SUSPECT;
      reason = given_up;
      if (end.body < 0) end.worst.upper = INFINITY;
    } else if (end.coarse) {
      end.status = SUSPECT;
      reason = BY_HULL;
    } else if (end.status == UNDECIDED) {
      end.status = FREE;
    } else if (end.status == SUSPECT) {
      double limit = (request.clearance + motion.bodies[end.body].slack) * UP;
      if (!(end.worst.upper <= limit + request.tolerance)) reason = BY_DEPTH;
    }
    if (end.status != FREE) end.worst.lower = end.lowest;
    write(piece, end.status, reason, end.body, end.obstacle, end.witness, end.worst);
  }
};

}  // namespace guard
