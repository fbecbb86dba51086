// Proofs of overlap (trusted for G3): a common point, at one instant or during a whole piece.
//
// **Standing.** A point y of the link at the centre lies inside the link by m and its place p
// inside the obstacle by t. The balls of these radii overlap as long as the link's point is nearer
// to p than m + t.
//
// **Moving.** With points y0, y1 deep in both at the two *ends* of the piece, y(s) = (1 - s) y0 +
// s y1 stays in the convex link, at least as deep as at the worse end. Its image under the motion
// with control points P_k of degree 12 has the control points
//
//     Q_k = (1 - k/13) P_k y0 + (k/13) P_{k-1} y1,        k = 0 ... 13.
//
// The piece overlaps at every instant if all Q_k lie inside the obstacle by more than the error, or
// if they stay nearer to the chord of the two places than the depths together.
//
// Depths are bounds from below on the distance to the outside of a convex solid, which is concave:
// those of a point between others are no smaller, whichever way each was found. A proof that is
// written down knows polytopes only; elsewhere spheres and cylinders are `round`, as they are.
//
// The true solids are the core, moved, plus a ball that turning does not change; so an overlap at
// the built pose is one at the true pose if the core is off by less than the depths. Only where
// the linear part is no rotation does the built motion move a point of the ball otherwise: eps
// times its radius.
#pragma once

#include "leaf.hpp"
#include "shallow.hpp"

namespace guard {

// Write the pose at an end of a piece, by columns.
inline void end_pose(const Controls& points, bool last, double* pose) {
  for (int c = 0; c < 4; c++)
    for (int r = 0; r < 3; r++) pose[4 * c + r] = points.entry[3 * c + r][last ? CONTROLS - 1 : 0];
  pose[3] = pose[7] = pose[11] = pose[15] = 0.0;
}

// Say whether the point that moves from y0 to y1 in the link (node frame) proves the overlap of the
// whole piece; `known` then tells of it.
//
// round: whether spheres and cylinders count as what they are. error: bound on the distance of the
// true motion to the built one; margin: on rounding [m].
inline bool moving_witness(const Solids& links, int64_t b, const Solids& obstacles, int64_t o,
                           bool round, const Node& node, double error, double margin,
                           const double* y0, const double* y1, Known& known) {
  const Controls& points = node.points;
  double pose[POSE], first[3], last[3];
  end_pose(points, false, pose);
  image(pose, y0, first);
  end_pose(points, true, pose);
  image(pose, y1, last);
  double mine = std::fmin(depth(links, b, round, y0), depth(links, b, round, y1));
  double theirs = std::fmin(depth(obstacles, o, round, first), depth(obstacles, o, round, last));
  if (!(mine > 0.0 && theirs > 0.0)) return false;
  // The point may lie off the core, within the ball: a linear part that is no rotation moves it.
  error += node.growth.eps * links.length(b, BALL);
  double shallow = INFINITY, stray = 0.0;
  for (int k = 0; k <= CONTROLS; k++) {
    double late = k / double(CONTROLS), early = 1.0 - late, place[3], square = 0.0;
    for (int r = 0; r < 3; r++) {
      auto at = [&](int i, const double* y) {
        return points.entry[r][i] * y[0] + points.entry[3 + r][i] * y[1] +
               points.entry[6 + r][i] * y[2] + points.entry[9 + r][i];
      };
      place[r] = (k < CONTROLS ? early * at(k, y0) : 0.0) + (k > 0 ? late * at(k - 1, y1) : 0.0);
      double off = place[r] - early * first[r] - late * last[r];
      square += off * off;
    }
    if (!(square < INFINITY)) return false;
    stray = std::fmax(stray, square);
    shallow = std::fmin(shallow, depth(obstacles, o, round, place));
  }
  if (!(shallow > error + 2.0 * margin || std::sqrt(stray) + error + 2.0 * margin < mine + theirs))
    return false;
  for (int r = 0; r < 3; r++) {
    known.place[r] = first[r];
    known.start[r] = y0[r];
    known.end[r] = y1[r];
  }
  known.depth = mine + theirs - error - 2.0 * margin;
  known.upper = -std::fmax(known.depth, 0.0);
  return true;
}

// Look for a common point at the centre: true if it proves the overlap of the whole piece.
//
// n: about the normal of the contact, of unit length. fuzz: bound on the error of the centre pose.
// known: upper, place, depth and the witness are written when the point is proved.
inline bool standing_witness(const Solids& links, int64_t b, const Solids& obstacles, int64_t o,
                             bool round, const double* n, const Node& node, double error,
                             double fuzz, double margin, std::vector<double>& moved,
                             Meeting& meeting, Common& found, Known& known) {
  if (!common_point(node.pose, links, b, obstacles, o, round, n, moved, meeting, found))
    return false;
  if (!(found.mine > fuzz + margin && found.theirs > margin)) return false;
  for (int r = 0; r < 3; r++) {
    known.place[r] = found.place[r];
    known.start[r] = known.end[r] = found.point[r];
  }
  known.depth = found.mine + found.theirs - fuzz - 2.0 * margin;
  known.upper = -known.depth;
  if (!node.sound) return false;
  error += node.growth.eps * links.length(b, BALL);
  double moves = farthest(found.point, found.place, node.points) + error + 2.0 * margin;
  return moves < found.mine + found.theirs;
}

}  // namespace guard
