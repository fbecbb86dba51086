// Close the pairs that a body's bounding sphere already keeps apart (trusted).
//
// Two inequalities, both against the obstacle's oriented box: the sphere at the piece's centre
// swept by the largest displacement, and the sphere along the control points of its centre. The
// boxes stand in a tree; a branch is left out if the sphere keeps clear of the bounds around all
// of its obstacles, which is the same inequality for a larger box.
#pragma once

#include "motion.hpp"

namespace guard {

// An enclosure wider than the gap and this part of the body is not worth building.
constexpr double WORTH = 0.05;

// What a sphere's distance to a box must exceed, without the motion itself [m].
inline double taken(const Solids& links, int64_t b, const Solids& obstacles, int64_t o,
                    double clearance, const Body& body) {
  return links.length(b, CORE) + links.length(b, BALL) + body.grown + obstacles.length(o, BALL) +
         body.slack + clearance + sphere_margin(body.reach, obstacles.length(o, FAR));
}

// Say whether the sphere at the centre keeps clear while the body sweeps.
inline bool swept_clear(const Solids& links, int64_t b, const Solids& obstacles, int64_t o,
                        double clearance, Body& body) {
  double distance = box_distance(body.place, obstacles, o);
  if (distance > (taken(links, b, obstacles, o, clearance, body) + body.sweep + body.fuzz) * UP &&
      distance < INFINITY)
    return true;
  double gap = distance - obstacles.length(o, BALL);
  if (gap < body.nearest) body.nearest = gap;
  return false;
}

// Say whether the sphere along the motion keeps clear.
//
// The control points of the sphere's centre lie within `radius` of its place at the piece's centre,
// so the centre does during the whole piece, up to the error of the motion.
inline bool moving_clear(Motion& motion, int64_t b, const Solids& obstacles, int64_t o,
                         double clearance, Body& body) {
  int64_t node = motion.links.range(b, NODE);
  if (body.radius < 0.0) {
    const Controls& points = motion.controls(node);
    body.radius = motion.nodes[node].sound
                      ? farthest(motion.links.at(b, CENTRE), body.place, points)
                      : INFINITY;
  }
  double needed =
      taken(motion.links, b, obstacles, o, clearance, body) + body.radius + body.error +
      chain_margin(motion.chain.depth[node], motion.nodes[node].growth.kappa, body.reach);
  double distance = box_distance(body.place, obstacles, o);
  return distance > needed * UP && distance < INFINITY;
}

// Call `open(o)` for every obstacle that the swept sphere does not keep clear of.
template <class Open>
inline void scan(const Solids& links, int64_t b, const Boxes& boxes, double clearance, Body& body,
                 Open open) {
  double base = links.length(b, CORE) + links.length(b, BALL) + body.grown + body.slack +
                clearance + body.sweep + body.fuzz;
  double whole = (base + sphere_margin(body.reach, boxes.far)) * UP;
  double square = whole * whole * UP;
  int64_t stack[64];
  int height = 0;
  stack[height++] = 0;
  while (height > 0) {
    int64_t node = stack[--height];
    const double* bounds = boxes.bounds + 6 * node;
    double apart = 0.0;
    for (int r = 0; r < 3; r++) {
      double below = bounds[r] - body.place[r], above = body.place[r] - bounds[3 + r];
      double outside = below > above ? below : above;
      if (outside > 0.0) apart += outside * outside;
    }
    if (apart > square && apart < INFINITY) continue;
    const int64_t* branch = boxes.branch + 2 * node;
    if (branch[0] >= 0) {
      stack[height++] = branch[1];
      stack[height++] = branch[0];
      continue;
    }
    const double* box = boxes.box + branch[1] * BOX_ROWS * LANES;
    auto row = [box](int k) { return load(box + k * LANES); };
    Lanes x = body.place[0] - row(BOX_CENTRE), y = body.place[1] - row(BOX_CENTRE + 1),
          z = body.place[2] - row(BOX_CENTRE + 2), total{};
    for (int k = 0; k < 3; k++) {
      Lanes along = absolute(x * row(3 * k) + y * row(3 * k + 1) + z * row(3 * k + 2));
      Lanes outside = along - row(BOX_HALF + k);
      outside = outside > 0.0 ? outside : Lanes{};
      total += outside * outside;
    }
    Lanes needed =
        (base + row(BOX_BALL) + SPHERE * UNIT_ROUNDOFF * (body.reach + row(BOX_FAR))) * UP;
    Mask clear = (total > needed * needed * UP) & (total < INFINITY);
    const int64_t* obstacle = boxes.obstacle + branch[1] * LANES;
    for (int i = 0; i < LANES; i++)
      if (obstacle[i] >= 0 && !clear[i]) {
        double gap = std::sqrt(total[i]) - box[BOX_BALL * LANES + i];
        if (!(gap >= body.nearest)) body.nearest = gap;
        open(obstacle[i]);
      }
  }
}

}  // namespace guard
