// What the core hands to the kernels: plain structures of read-only arrays, checked by the core.
#pragma once

#include <cmath>
#include <cstdint>

#include "vector.hpp"

namespace guard {

// Kinds of joints. A floating joint is a translation and below it a rotation.
constexpr int64_t REVOLUTE = 0, PRISMATIC = 1, TRANSLATION = 2, ROTATION = 3;

// Columns of Solids::ranges. Vertices and faces are padded to whole vectors with copies.
enum { FIRST, LAST, FACE_FIRST, FACE_LAST, NODE, WHOLE, PARTS, CHILD, RANGES };
// What PARTS says: nothing finer is known; two finer solids contain all of the surface, the first
// at CHILD; there are such two, but nobody has built them; a triangle of the real surface.
enum : int64_t { NO_PARTS, BUILT, UNBUILT, TRIANGLE };
// Columns of Solids::size [m]: ball, disc, sphere around vertices and disc, farthest point; how far
// inside the real solid all of a sphere's centre or a cylinder's axis and disc is, minus infinity
// for other solids.
enum { BALL, DISC, CORE, FAR, INSIDE, SIZES };
// Columns of Solids::place: disc normal, sphere centre, box half sides, pose of the box (12).
enum { AXIS = 0, CENTRE = 3, HALF = 6, BOX = 9, PLACES = 21 };

constexpr int TERMS = 6;  // coefficients of a quintic

// The movable joints of a robot. A node's frame moves with its joint and has the axis as z.
struct Chain {
  int64_t nodes;
  const int64_t* parent;    // (n,) node above, -1 for the root; parents come first
  const int64_t* kind;      // (n,) see above
  const double* transform;  // (n, 12) rows of [R | t]: the node before its motion, in its parent
  const int64_t* depth;     // (n,) rounded transforms between the root and the node
};

// Convex solids conv(vertices) + disc + ball, end to end; links in node frames, obstacles in the
// root frame. The `wholes` come first. Parts follow: each moves with the solid WHOLE and contains
// some of its real surface, in what of conv(vertices) lies in the sphere. That surface and the
// sphere's centre do not reach farther than the whole; a vertex may, up to FAR.
struct Solids {
  int64_t count, wholes;
  const int64_t* ranges;   // (B, RANGES)
  const double* size;      // (B, SIZES)
  const double* place;     // (B, PLACES)
  const double* vertices;  // (3, V) [m]
  int64_t vertex_stride;
  const double* faces;  // (4, F) rows n, d: halfspaces n.x <= d of an inscribed polytope
  int64_t face_stride;

  int64_t range(int64_t b, int column) const { return ranges[b * RANGES + column]; }
  double length(int64_t b, int column) const { return size[b * SIZES + column]; }
  const double* at(int64_t b, int column) const { return place + b * PLACES + column; }
  bool has_parts(int64_t b) const { return range(b, PARTS) == BUILT || range(b, PARTS) == UNBUILT; }
};

// Lanes of a block of Boxes: the rotation by columns, the centre, the half sides, the ball and
// the farthest point of the obstacle.
enum { BOX_AXES = 0, BOX_CENTRE = 9, BOX_HALF = 12, BOX_BALL = 15, BOX_FAR = 16, BOX_ROWS = 17 };

// The oriented boxes of the obstacles in blocks of eight, and a tree of bounds over the blocks.
struct Boxes {
  int64_t blocks;
  const double* box;        // (blocks, BOX_ROWS, 8)
  const int64_t* obstacle;  // (blocks, 8), -1 where there is none
  int64_t nodes;
  const double* bounds;   // (nodes, 6) least and largest corner of all below, balls included [m]
  const int64_t* branch;  // (nodes, 2) two nodes, or -1 and a block
  double far;             // the largest BOX_FAR
};

// The motion of the floating joint: a rational Bezier curve of displacements for each segment.
struct Floating {
  const int64_t* first;   // (S + 1,) first control point of each segment, and the end
  const double* control;  // (P, 16) displacements by columns of 4, the fourth entries zero
  const double* weight;   // (P,) positive
  // (S, FLOATING_BOUNDS): |truth(x) - curve(x)| <= shift + turn |x|; the curve's linear part has
  // norm at most 1 + stretch; rigid: it is a rotation within stretch, else any matrix.
  const double* bounds;
};
enum { TURN_ERROR, SHIFT_ERROR, STRETCH, RIGID, FLOATING_BOUNDS };

// The joint path of a request, joints in node order.
struct Path {
  int64_t segments;
  const double* coefficients;  // (S, n, TERMS) powers of s on [0, 1] [rad or m]
  const double* rounding;      // (S, n) bound on the error of the coefficients together
  const double* slack;         // (n,) tracking tolerance [rad or m]
  const Floating* floating;    // null if no joint floats
};

// No coordinate is larger, so that no product overflows [rad or m].
constexpr double LARGEST = 1e9;

// Bound |q| of a joint over the path; NaN if the path is not what kernels can take.
inline double size_of(const Path& path, int64_t nodes, int64_t j) {
  double most = 0.0;
  for (int64_t segment = 0; segment < path.segments; segment++) {
    int64_t row = segment * nodes + j;
    double size = path.rounding[row];
    if (!(size >= 0.0)) return NAN;
    for (int k = 0; k < TERMS; k++) size += std::fabs(path.coefficients[row * TERMS + k]);
    if (!(size <= LARGEST)) return NAN;
    if (size > most) most = size;
  }
  return path.slack[j] >= 0.0 && path.slack[j] <= LARGEST ? most : NAN;
}

// How far each body reaches.
struct Extents {
  const double* extent;         // (B,) largest distance from the node's origin [m]
  const double* perpendicular;  // (B,) the same from the node's axis [m]
  const double* offsets;        // (B,) sum of the lengths of all joint origins down to the body [m]
};

}  // namespace guard
