// Proofs of overlap (trusted for G3): a common point, at one instant or during a whole piece.
//
// **Standing.** A point y of the link at the centre lies inside the link by m and its place p inside
// the obstacle by t. The balls of these radii overlap as long as the link's point is nearer to p
// than m + t.
//
// **Moving.** With points y0, y1 deep in both at the two *ends* of the piece, y(s) = (1 - s) y0 +
// s y1 stays in the convex link, at least as deep as at the worse end. Its image under the motion
// with control points P_k of degree 12 has the control points
//
//     Q_k = (1 - k/13) P_k y0 + (k/13) P_{k-1} y1,        k = 0 ... 13.
//
// The piece overlaps at every instant if all Q_k lie inside the obstacle by more than the error, or
// if they stay nearer to the chord of the two places than the depths together.
#pragma once

#include "deepest.hpp"
#include "leaf.hpp"

namespace guard {

// Say whether a point that moves through the link proves the overlap of the whole piece.
inline bool moving_witness(const Solids& links, int64_t b, const Solids& obstacles, int64_t o,
                           const Controls& points, double error, double margin,
                           std::vector<double>& moved, Known& known) {
  Common first, last;
  double pose[POSE] = {};
  for (int side = 0; side < 2; side++) {
    for (int c = 0; c < 4; c++)
      for (int r = 0; r < 3; r++)
        pose[4 * c + r] = points.entry[3 * c + r][side ? CONTROLS - 1 : 0];
    if (!deepest(pose, links, b, obstacles, o, moved, side ? last : first)) return false;
  }
  double mine = std::fmin(first.mine, last.mine), theirs = std::fmin(first.theirs, last.theirs);
  if (!(mine > 0.0 && theirs > 0.0)) return false;
  Faces faces = faces_of(obstacles, o);
  double shallow = INFINITY, stray = 0.0;
  for (int k = 0; k <= CONTROLS; k++) {
    double late = k / double(CONTROLS), early = 1.0 - late, place[3], square = 0.0;
    for (int r = 0; r < 3; r++) {
      auto at = [&](int i, const double* y) {
        return points.entry[r][i] * y[0] + points.entry[3 + r][i] * y[1] +
               points.entry[6 + r][i] * y[2] + points.entry[9 + r][i];
      };
      place[r] = (k < CONTROLS ? early * at(k, first.point) : 0.0) +
                 (k > 0 ? late * at(k - 1, last.point) : 0.0);
      double off = place[r] - early * first.place[r] - late * last.place[r];
      square += off * off;
    }
    if (!(square < INFINITY)) return false;
    stray = std::fmax(stray, square);
    shallow = std::fmin(shallow, depth(faces, place));
  }
  if (!(shallow > error + 2.0 * margin ||
        std::sqrt(stray) + error + 2.0 * margin < mine + theirs))
    return false;
  for (int r = 0; r < 3; r++) {
    known.start[r] = first.point[r];
    known.end[r] = last.point[r];
  }
  return true;
}

// Look for a common point at the centre and prove an overlap of the whole piece.
//
// error: bound on the distance of the true motion to the built one; fuzz: on the error of the centre
// pose; margin: on rounding [m]. known: upper, place, depth and the witness are written when the
// point is proved. direction: out, which separates them soonest, or zeros.
inline bool overlaps(Motion& motion, int64_t b, const Solids& obstacles, int64_t o, double error,
                     double fuzz, double margin, std::vector<double>& moved, double* direction,
                     Known& known) {
  const Solids& links = motion.links;
  const Node& node = motion.nodes[links.range(b, NODE)];
  Common found;
  bool common = deepest(node.pose, links, b, obstacles, o, moved, found);
  for (int r = 0; r < 3; r++) direction[r] = found.direction[r];
  if (!common || !(found.mine > fuzz + margin && found.theirs > margin)) return false;
  for (int r = 0; r < 3; r++) {
    known.place[r] = found.place[r];
    known.start[r] = known.end[r] = found.point[r];
  }
  known.depth = found.mine + found.theirs - fuzz - 2.0 * margin;
  known.upper = -known.depth;
  if (!node.sound) return false;
  // The point may lie off the core, within the ball: a linear part that is no rotation moves it.
  error += node.growth.eps * links.length(b, BALL);
  double moves = farthest(found.point, found.place, node.points);
  if (moves + error + 2.0 * margin < found.mine + found.theirs) return true;
  return moving_witness(links, b, obstacles, o, node.points, error, margin, moved, known);
}

}  // namespace guard
