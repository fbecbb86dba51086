// Polyhedral surfaces, the trees over their faces, and the metric of the moving one, as Python
// gives them.
//
// A face is the union of its triangles; the sides of the triangles are its edges, so that the face
// and everything said of it are exact although its corners may not lie in one plane to the last
// bit.
#pragma once

#include <cstdint>

namespace guard {

// All (first) arrays have one entry more than there are faces.
struct Surface {
  int64_t faces;
  const int64_t* corner_first;
  const double* corner;   // (corners, 3) [m]
  const int64_t* vertex;  // (corners,) its number in the polyhedron
  const int64_t* edge_first;
  const int64_t* edge;  // (edges, 2) corners within the face
  const int64_t* triangle_first;
  const int64_t* triangle;  // (triangles, 3) corners within the face
  const int64_t* branch;    // (nodes, 3) left, right, -1; or -1, -1 and a face
  const double* box;        // (nodes, 6) centre and half sides of a box around the node's faces [m]
  int64_t nodes;
  double reach;  // no corner of a face or a box is farther from the origin [m]
};

// Columns of `Metric.frame`.
enum { FRAME_CENTRE = 0, FRAME_AXES = 3, FRAME_SIZE = 12 };

// Mass distributions of the moving surface, each of mass 1.
//
// A distribution is its barycentre b and any 3 x 3 matrix K; its inertia is K K^T. A point x with
// q = K^-1 (x - b) has the distortion rate rho^2 = 1 + |q|^2, and D x = (C b + t) + (C K) q for a
// difference D = [C | t] of displacements, so that by Cauchy and Schwarz |D x| <= |D| rho with
// |D|^2 = |C b + t|^2 + ||C K||_F^2, which is the metric of [Schroecker & Weber 2014, sec. 2].
// q need not be exact: `residual` bounds |x - b - K q|, and |C| residual is added to the thickness.
//
// With K, sigma K is as good, and q / sigma: a distribution of sigma times the extent. So every
// ball may choose its own (`Rate`).
struct Metric {
  int64_t count;
  const double* frame;   // (count, 12) b, and K by rows [m]
  const double* span;    // (count,) at least |b| + ||K||_F [m]
  const int64_t* of;     // (nodes,) the distribution of each node of the tree
  const double* far;     // (nodes,) at least |q| everywhere in the node's box or face
  const double* turned;  // (corners, 3) q of each corner in the distribution of its face
  double residual;       // [m]
};

}  // namespace guard
