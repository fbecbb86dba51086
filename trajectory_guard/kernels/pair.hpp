// One pair on one piece, from cheap to dear: the swept set, the centre, a turning plane, a common
// point.
//
// Only three comparisons decide: `separation` above the limit and `turning` close the pair, and a
// common point deeper than its motion proves an overlap. Everything else chooses what they are asked.
#pragma once

#include "cull.hpp"
#include "gjk.hpp"
#include "proof.hpp"
#include "witness.hpp"

namespace guard {

constexpr int SWEPT_ROUNDS = 12;  // a direction for a whole piece comes soon, or it is too long
constexpr double ACCURACY = 0.02;  // of the tolerance, for distances at the centre

// A pair that is not closed yet, and what its last piece taught.
struct Live {
  int64_t body, obstacle;
  double n[3];      // the best direction so far, zero if there is none
  bool overlapped;  // it overlapped at the centre of the piece above
};

enum class Outcome { CLOSED, OPEN, OVERLAPS };

struct Question {
  const Solids& obstacles;
  const Boxes& boxes;
  double tolerance, clearance;
};

// Remember a direction if it proves more than the best one so far.
inline void keep(Live& live, const double* n, double lower, Known& known) {
  if (lower > known.lower) {
    known.lower = lower;
    for (int r = 0; r < 3; r++) live.n[r] = n[r];
  }
}

// The bound that the nearest link point at the centre gives for the whole piece.
inline double near_bound(const Search& found, const Node& node, double balls, double error) {
  double off[3], x[3];
  for (int r = 0; r < 3; r++)
    off[r] = found.place[r] + found.n[r] * found.distance - node.pose[12 + r];
  for (int c = 0; c < 3; c++) x[c] = dot(node.pose + 4 * c, off);
  return farthest(x, found.place, node.points) - balls + error;
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
  known = Known{};
  known.lower = -INFINITY;
  known.upper = known.near = INFINITY;

  auto separates = [&](const double* n) {
    double lower = separation(n, points, links, b, obstacles, o, doubt, limit);
    keep(live, n, lower, known);
    if (!(known.lower > limit)) return false;
    if (proof.wanted) {
      Entry entry{PLANE_BETWEEN, 0, b, o, {live.n[0], live.n[1], live.n[2]}, {}, 0.0};
      entry.offset = highest(obstacles, o, live.n) + obstacles.length(o, BALL) + ask.clearance +
                     0.5 * (known.lower - limit);
      proof.add(piece, examined, entry);
    }
    return true;
  };

  double n[3] = {live.n[0], live.n[1], live.n[2]};
  if (n[0] == 0.0 && n[1] == 0.0 && n[2] == 0.0) box_direction(body.place, obstacles, o, n);
  Search found;
  if (node.sound && !live.overlapped) {
    // Most pairs are closed here, and most of them by the first direction.
    gjk(n, Moving{points}, links, b, obstacles, o, want, true, accuracy, SWEPT_ROUNDS, found);
    if (separates(found.n)) return Outcome::CLOSED;
    for (int r = 0; r < 3; r++) n[r] = found.n[r];
  }
  Found state = gjk(n, Standing{node.pose}, links, b, obstacles, o, want, false, accuracy, ROUNDS,
                    found);
  known.upper = found.distance - balls + body.fuzz + margin;
  for (int r = 0; r < 3; r++) known.place[r] = found.place[r];
  if (node.sound && state != Found::OVERLAP) {
    known.near = near_bound(found, node, balls, doubt.error + margin);
    if (separates(found.n)) return Outcome::CLOSED;
    // The plane that turns as the link does at the centre: m = omega x n.
    double back[3], m[3];
    for (int c = 0; c < 3; c++) back[c] = dot(node.pose + 4 * c, found.n);
    const double* speed = node.polynomial.power[1];
    for (int r = 0; r < 3; r++)
      m[r] = speed[r] * back[0] + speed[4 + r] * back[1] + speed[8 + r] * back[2];
    if (turning(found.n, m, points, links, b, obstacles, o, doubt, limit)) {
      proof.add(piece, examined,
                {PLANE_TURNING, 0, b, o, {found.n[0], found.n[1], found.n[2]},
                 {m[0], m[1], m[2]}, 0.0});
      return Outcome::CLOSED;
    }
  }
  if (known.upper <= body.fuzz + margin) {
    double direction[3];
    if (overlaps(motion, b, obstacles, o, doubt.error, body.fuzz, margin, scratch, direction, known))
      return Outcome::OVERLAPS;
    if (node.sound && (direction[0] != 0.0 || direction[1] != 0.0 || direction[2] != 0.0))
      keep(live, direction,
           separation(direction, points, links, b, obstacles, o, doubt, limit), known);
  }
  return Outcome::OPEN;
}

}  // namespace guard
