// One pair on one piece, from cheap to dear: the swept set, the centre, a turning plane, a common
// point.
//
// Only these comparisons decide: `separation` above the limit and `turning` close the pair, and a
// common point or a crossing deeper than its motion proves an overlap. Everything else chooses what
// they are asked.
#pragma once

#include "contact.hpp"
#include "cull.hpp"
#include "gjk.hpp"
#include "proof.hpp"
#include "witness.hpp"

namespace guard {

constexpr int SWEPT_ROUNDS = 12;   // a direction for a whole piece comes soon, or it is too long
constexpr double ACCURACY = 0.02;  // of the tolerance, for distances at the centre

// What was found at one instant: nothing yet, apart, or a point deep in both (node frame).
struct Instant {
  enum : int64_t { UNKNOWN, APART, DEEP } state;
  double y[3];
};

// A pair that is not closed yet, and what its last piece taught: only hints for the search.
struct Live {
  int64_t body, obstacle;
  double n[3];  // the best direction so far, zero if there is none
  Instant start, centre, end;
  Meeting meeting;  // of the faces around the last common point

  // The same for a half of the piece.
  Live half(bool second) const {
    Live child = *this;
    (second ? child.start : child.end) = centre;
    child.centre.state = Instant::UNKNOWN;
    return child;
  }
};

enum class Outcome { CLOSED, OPEN, OVERLAPS };

struct Question {
  const Solids& obstacles;
  const Boxes& boxes;
  double tolerance, clearance;
  bool round;  // spheres and cylinders overlap as what they are, not only as polytopes
};

// Remember a direction if it proves more than the best one so far.
inline void keep(Live& live, const double* n, double lower, Known& known) {
  if (lower > known.lower) {
    known.lower = lower;
    for (int r = 0; r < 3; r++) live.n[r] = n[r];
  }
}

// About how far the two come near at every instant of the piece, from the nearest link point found
// at the centre; it decides only how fine a suspect piece is cut.
inline double near_bound(const Search& found, const Node& node, double balls, double error) {
  double off[3], x[3];
  for (int r = 0; r < 3; r++)
    off[r] = found.place[r] + found.n[r] * found.distance - node.pose[12 + r];
  for (int c = 0; c < 3; c++) x[c] = dot(node.pose + 4 * c, off);
  return farthest(x, found.place, node.points) - balls + error;
}

// Keep a common point for the pieces to come, if it lies inside both.
inline void remember(Instant& instant, const Common& found) {
  if (!(found.mine > 0.0 && found.theirs > 0.0)) return;
  instant.state = Instant::DEEP;
  for (int r = 0; r < 3; r++) instant.y[r] = found.point[r];
}

// The plane that turns as the link does about the centre: n(tau) = R(tau) R(0)^T n to second order.
inline Turn with_link(const Node& node, const double* n) {
  Turn turn{{n[0], n[1], n[2]}, {}, {}};
  double back[3];
  for (int c = 0; c < 3; c++) back[c] = dot(node.pose + 4 * c, n);
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) {
      turn.m[r] += node.polynomial.power[1][4 * c + r] * back[c];
      turn.k[r] += node.polynomial.power[2][4 * c + r] * back[c];
    }
  return turn;
}

// Try to close one pair on the piece.
inline Outcome examine(Motion& motion, const Question& ask, const Piece& piece, int64_t examined,
                       Live& live, std::vector<double>& scratch, Proof& proof, Known& known) {
  const Solids &links = motion.links, &obstacles = ask.obstacles;
  int64_t b = live.body, o = live.obstacle;
  Body& body = motion.bodies[b];
  int64_t at = links.range(b, NODE);
  const Controls& points = motion.controls(at);
  const Node& node = motion.nodes[at];
  Doubt doubt = motion.doubt(b);
  double balls = links.length(b, BALL) + obstacles.length(o, BALL);
  double limit = (ask.clearance + body.slack) * UP;
  double allowed = allowance(links, b, obstacles, o, doubt);
  double want = limit + allowed;
  double margin = chain_margin(doubt.depth, doubt.kappa, doubt.reach) +
                  sphere_margin(doubt.reach, obstacles.length(o, FAR));
  double accuracy = ACCURACY * ask.tolerance;
  // Depths are measured in the link; an image that is no congruent one has others.
  bool rigid = motion.rigid();
  double loose = 2.0 * motion.stretch() * (links.length(b, CORE) + links.length(b, BALL));
  known = Known{};
  known.lower = -INFINITY;
  known.upper = known.near = INFINITY;

  auto separates = [&](const double* n) {
    double lower = separation(n, points, links, b, obstacles, o, doubt, limit);
    keep(live, n, lower, known);
    if (!(known.lower > limit)) return false;
    if (proof.wanted) {
      Entry entry{PLANE_BETWEEN, 0, b, o, {{live.n[0], live.n[1], live.n[2]}, {}, {}}, 0.0};
      entry.offset = highest(obstacles, o, live.n) + obstacles.length(o, BALL) + ask.clearance +
                     0.5 * (known.lower - limit);
      proof.add(piece, examined, entry);
    }
    return true;
  };

  bool deep_start = live.start.state == Instant::DEEP, deep_end = live.end.state == Instant::DEEP;
  auto moving = [&] {
    return moving_witness(links, b, obstacles, o, ask.round, node, doubt.error + loose, margin,
                          live.start.y, live.end.y, known);
  };
  if (node.sound && deep_start && deep_end && moving()) return Outcome::OVERLAPS;
  bool maybe_free = node.sound && !deep_start && !deep_end;
  double n[3] = {live.n[0], live.n[1], live.n[2]};
  if (n[0] == 0.0 && n[1] == 0.0 && n[2] == 0.0) box_direction(body.place, obstacles, o, n);
  Search found;
  if (maybe_free) {
    // Most pairs are closed here, and most of them by the first direction.
    gjk(n, Moving{points}, links, b, obstacles, o, want, true, accuracy, SWEPT_ROUNDS, found);
    if (separates(found.n)) return Outcome::CLOSED;
    for (int r = 0; r < 3; r++) n[r] = found.n[r];
  }
  Common common{};
  bool deep = false;
  auto stands = [&] {
    if (!rigid) return false;
    bool whole = standing_witness(links, b, obstacles, o, ask.round, n, node, doubt.error + loose,
                                  body.fuzz + loose, margin, scratch, live.meeting, common, known);
    deep = known.depth > 0.0;
    return whole;
  };
  // What was deep at an end may be so at the centre; then its distance is of no interest.
  if ((deep_start || deep_end) && stands()) return Outcome::OVERLAPS;
  if (!deep) {
    Found state =
        gjk(n, Standing{node.pose}, links, b, obstacles, o, want, false, accuracy, ROUNDS, found);
    // The ball of an image that is not congruent may have shrunk to nothing.
    double shrunk = rigid ? loose : links.length(b, BALL);
    known.upper = found.distance - balls + shrunk + body.fuzz + margin;
    for (int r = 0; r < 3; r++) known.place[r] = found.place[r];
    if (state != Found::OVERLAP) {
      for (int r = 0; r < 3; r++) n[r] = found.n[r];
      if (found.best - balls > limit) live.centre.state = Instant::APART;
      if (node.sound) {
        known.near = near_bound(found, node, balls, doubt.error + margin);
        if (separates(found.n)) return Outcome::CLOSED;
      }
      Turn turn = with_link(node, found.n);
      if (maybe_free && turning(turn, points, links, b, obstacles, o, doubt, limit)) {
        proof.add(piece, examined, {PLANE_TURNING, 0, b, o, turn, 0.0});
        return Outcome::CLOSED;
      }
    }
    if (!(known.upper <= shrunk + body.fuzz + margin)) return Outcome::OPEN;
    if (links.range(b, PARTS) == TRIANGLE || obstacles.range(o, PARTS) == TRIANGLE)
      return rigid && contact_witness(links, b, obstacles, o, node, doubt.error + loose,
                                      body.fuzz + loose, margin, known)
                 ? Outcome::OVERLAPS
                 : Outcome::OPEN;
    // What is round is looked for along the direction, which is better known now.
    bool again = ask.round && (is_round(links, b) || is_round(obstacles, o));
    if ((again || !(deep_start || deep_end)) && stands()) return Outcome::OVERLAPS;
  }
  if (node.sound && deep) {
    remember(live.centre, common);
    // The ends are looked at only if both may be deep, too.
    for (bool last : {false, true}) {
      Instant& end = last ? live.end : live.start;
      const Instant& other = last ? live.start : live.end;
      if (end.state != Instant::UNKNOWN || other.state == Instant::APART) continue;
      double pose[POSE];
      Common at_end;
      end_pose(points, last, pose);
      end.state = Instant::APART;
      if (common_point(pose, links, b, obstacles, o, ask.round, n, scratch, live.meeting, at_end))
        remember(end, at_end);
    }
    if (!(deep_start && deep_end) && live.start.state == Instant::DEEP &&
        live.end.state == Instant::DEEP && moving())
      return Outcome::OVERLAPS;
  }
  const double* direction = common.direction;
  if (node.sound && (direction[0] != 0.0 || direction[1] != 0.0 || direction[2] != 0.0))
    keep(live, direction, separation(direction, points, links, b, obstacles, o, doubt, limit),
         known);
  return Outcome::OPEN;
}

}  // namespace guard
