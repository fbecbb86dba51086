// A point deep inside both solids at one instant (search), and how deep it is (trusted for G3).
//
// Maximise t subject to a.y + t <= d over the faces of both solids: the centre of the largest
// common ball of two polytopes. Dual simplex on a 4x4 basis: start from an artificial tetrahedron,
// bring in the most violated face, drop the one that keeps the multipliers positive. The optimum
// only falls, so t <= 0 ends the search. The multipliers of the link's faces add up to the
// direction in which the two are least entangled.
#pragma once

#include <vector>

#include "motion.hpp"

namespace guard {

constexpr int PIVOTS = 60;

// Rows (n, d) of a polytope's faces, one array a column.
struct Faces {
  const double *x, *y, *z, *d;
  int64_t count;  // in whole vectors
};

inline Faces faces_of(const Solids& solids, int64_t b) {
  const double* x = solids.faces + solids.range(b, FACE_FIRST);
  return {x, x + solids.face_stride, x + 2 * solids.face_stride, x + 3 * solids.face_stride,
          solids.range(b, FACE_LAST) - solids.range(b, FACE_FIRST)};
}

// How deep a point lies inside a polytope, min (d - n.x), negative outside [m]; minus infinity
// without faces and for NaN.
inline double depth(const Faces& faces, const double* x) {
  Lanes best = all(INFINITY);
  Mask lost = {};
  for (int64_t f = 0; f < faces.count; f += LANES) {
    Lanes inside = load(faces.d + f) - load(faces.x + f) * x[0] - load(faces.y + f) * x[1] -
                   load(faces.z + f) * x[2];
    lost |= inside != inside;
    best = inside < best ? inside : best;
  }
  return faces.count == 0 || any(lost) ? -INFINITY : least(best);
}

// How deep a point lies inside a sphere or a cylinder as they really are, negative outside [m];
// minus infinity for other solids.
//
// The core of a cylinder is the segment between its first two vertices plus a disc. A ball of radius
// d about x lies in it if d is less than the distance of x from both ends and from the side. The
// real solid is convex and its support function at least the core's plus INSIDE, so that it contains
// the ball of radius d + INSIDE, if that is a radius. A sphere's core is a point, its vertex: where
// d = -|x - c|.
inline double round_depth(const Solids& solids, int64_t b, const double* x) {
  double inside = solids.length(b, INSIDE);
  if (!(inside > -INFINITY)) return -INFINITY;
  int64_t v = solids.range(b, FIRST);
  double off[3], axis[3], along = 0.0, length = 0.0, square = 0.0, radius = solids.length(b, DISC);
  for (int r = 0; r < 3; r++) {
    const double* row = solids.vertices + r * solids.vertex_stride + v;
    off[r] = x[r] - row[0];
    axis[r] = solids.at(b, AXIS)[r];
    along += off[r] * axis[r];
    length += (row[1] - row[0]) * axis[r];
  }
  if (radius == 0.0) return inside - std::sqrt(off[0] * off[0] + off[1] * off[1] + off[2] * off[2]);
  for (int r = 0; r < 3; r++) square += (off[r] - along * axis[r]) * (off[r] - along * axis[r]);
  double ends = length < 0.0 ? std::fmin(-along, along - length) : std::fmin(along, length - along);
  return std::fmin(ends, radius - std::sqrt(square)) + inside;
}

// How deep a point lies inside a solid, negative outside [m]: in its polytope, and if `round` may be
// taken as what it is, in that.
inline double depth(const Solids& solids, int64_t b, bool round, const double* x) {
  double flat = depth(faces_of(solids, b), x);
  return round ? std::fmax(flat, round_depth(solids, b, x)) : flat;
}

// The face that (x, t) violates most, if by more than `worst`, which is raised.
inline bool most_violated(const Faces& faces, const double* x, double t, double& worst,
                          int64_t& f) {
  Lanes most = all(-INFINITY);
  Mask where = {}, now = {0, 1, 2, 3, 4, 5, 6, 7};
  for (int64_t i = 0; i < faces.count; i += LANES, now += LANES) {
    Lanes excess = load(faces.x + i) * x[0] + load(faces.y + i) * x[1] + load(faces.z + i) * x[2] +
                   t - load(faces.d + i);
    where = excess > most ? now : where;
    most = excess > most ? excess : most;
  }
  bool found = false;
  for (int i = 0; i < LANES; i++)
    if (most[i] > worst) {
      worst = most[i];
      f = where[i];
      found = true;
    }
  return found;
}

// What the search found at one instant.
struct Common {
  double point[3];      // in the node frame [m]
  double direction[3];  // from the obstacle towards the link, root frame; zero if none
  double place[3];      // of the point in the root frame [m]
  double mine, theirs;  // its depth in the link and in the obstacle [m]
};

// The four faces that met at an optimum; they are often the same an instant later.
struct Meeting {
  int64_t face[4];
  bool own[4];  // of the link, else of the obstacle
  bool known;
};

// A basis of the dual simplex: rows (n, 1) and values d of four faces, the inverse of the rows, the
// multipliers.
struct Basis4 {
  double row[4][4], value[4], inverse[4][4], weight[4];
  Meeting at;

  void put(int k, const Faces& faces, int64_t f, bool own) {
    row[k][0] = faces.x[f];
    row[k][1] = faces.y[f];
    row[k][2] = faces.z[f];
    row[k][3] = 1.0;
    value[k] = faces.d[f];
    at.face[k] = f;
    at.own[k] = own;
  }

  // A regular tetrahedron around a solid, multipliers 1/4 each. The rows (n, 1), n corners of a
  // cube over sqrt(3), are orthogonal: their inverse is known.
  void surround(const double* centre, double radius) {
    static const double CORNER[4][3] = {{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}};
    for (int k = 0; k < 4; k++) {
      value[k] = 4.0 * radius;
      for (int r = 0; r < 3; r++) {
        row[k][r] = CORNER[k][r] / std::sqrt(3.0);
        value[k] += row[k][r] * centre[r];
        inverse[r][k] = 0.75 * row[k][r];
      }
      row[k][3] = 1.0;
      inverse[3][k] = weight[k] = 0.25;
      at.face[k] = -1;
      at.own[k] = false;
    }
  }

  // Start where four faces met before; false if their multipliers are no longer positive.
  bool meet_again(const Meeting& before, const Faces& mine, const Faces& theirs) {
    if (!before.known) return false;
    for (int k = 0; k < 4; k++)
      put(k, before.own[k] ? mine : theirs, before.face[k], before.own[k]);
    double u[3][3], c[3][3], det = 0.0;
    for (int k = 0; k < 3; k++)
      for (int r = 0; r < 3; r++) u[k][r] = row[k][r] - row[3][r];
    for (int k = 0; k < 3; k++) {
      const double *p = u[(k + 1) % 3], *q = u[(k + 2) % 3];
      for (int r = 0; r < 3; r++)
        c[k][r] = p[(r + 1) % 3] * q[(r + 2) % 3] - p[(r + 2) % 3] * q[(r + 1) % 3];
    }
    for (int r = 0; r < 3; r++) det += u[0][r] * c[0][r];
    if (!(std::fabs(det) > 1e-9)) return false;
    for (int r = 0; r < 4; r++) inverse[r][3] = r == 3 ? 1.0 : 0.0;
    for (int k = 0; k < 3; k++) {
      inverse[3][k] = 0.0;
      for (int r = 0; r < 3; r++) {
        inverse[r][k] = c[k][r] / det;
        inverse[r][3] -= inverse[r][k];
        inverse[3][k] -= row[3][r] * inverse[r][k];
      }
      inverse[3][3] -= inverse[3][k];
    }
    for (int k = 0; k < 4; k++) {
      weight[k] = inverse[3][k];
      if (!(weight[k] > 1e-9)) return false;
    }
    return true;
  }
};

// Propose a point deep inside a link and an obstacle at one pose; true if it is inside both.
//
// round: whether the depths may be those of spheres and cylinders. moved: scratch for the obstacle's
// faces in the node frame. meeting: where to start, and where it ended.
inline bool deepest(const double* pose, const Solids& links, int64_t b, const Solids& obstacles,
                    int64_t o, bool round, std::vector<double>& moved, Meeting& meeting,
                    Common& out) {
  Faces mine = faces_of(links, b), world = faces_of(obstacles, o);
  for (int r = 0; r < 3; r++) out.point[r] = out.direction[r] = 0.0;
  if (mine.count == 0 || world.count == 0) return false;
  moved.resize(4 * world.count);
  double* row = moved.data();
  Faces theirs{row, row + world.count, row + 2 * world.count, row + 3 * world.count, world.count};
  for (int64_t f = 0; f < world.count; f += LANES) {
    Lanes x = load(world.x + f), y = load(world.y + f), z = load(world.z + f);
    for (int c = 0; c < 3; c++)
      store(row + c * world.count + f, x * pose[4 * c] + y * pose[4 * c + 1] + z * pose[4 * c + 2]);
    store(row + 3 * world.count + f,
          load(world.d + f) - (x * pose[12] + y * pose[13] + z * pose[14]));
  }
  double radius = links.length(b, CORE) + links.length(b, BALL);
  Basis4 basis;
  if (!basis.meet_again(meeting, mine, theirs)) basis.surround(links.at(b, CENTRE), radius);
  double x[4] = {0.0, 0.0, 0.0, 0.0};
  for (int pivot = 0; pivot < PIVOTS; pivot++) {
    for (int r = 0; r < 4; r++)
      x[r] = basis.inverse[r][0] * basis.value[0] + basis.inverse[r][1] * basis.value[1] +
             basis.inverse[r][2] * basis.value[2] + basis.inverse[r][3] * basis.value[3];
    double worst = 1e-12 * radius;
    int64_t f = 0;
    bool any_mine = most_violated(mine, x, x[3], worst, f);
    bool any_theirs = most_violated(theirs, x, x[3], worst, f);
    if (!(any_mine || any_theirs) || !(x[3] > 0.0)) break;
    const Faces& from = any_theirs ? theirs : mine;
    double shares[4], ratio = INFINITY;
    int leave = -1;
    for (int k = 0; k < 4; k++) {
      shares[k] = from.x[f] * basis.inverse[0][k] + from.y[f] * basis.inverse[1][k] +
                  from.z[f] * basis.inverse[2][k] + basis.inverse[3][k];
      if (shares[k] > 1e-12 && basis.weight[k] / shares[k] < ratio) {
        ratio = basis.weight[k] / shares[k];
        leave = k;
      }
    }
    if (leave < 0) break;
    for (int k = 0; k < 4; k++) basis.weight[k] -= ratio * shares[k];
    basis.weight[leave] = ratio;
    for (int r = 0; r < 4; r++) basis.inverse[r][leave] /= shares[leave];
    for (int k = 0; k < 4; k++)
      if (k != leave)
        for (int r = 0; r < 4; r++) basis.inverse[r][k] -= shares[k] * basis.inverse[r][leave];
    basis.put(leave, from, f, !any_theirs);
  }
  meeting = basis.at;
  meeting.known = true;
  for (int64_t f : meeting.face) meeting.known = meeting.known && f >= 0;
  for (int r = 0; r < 3; r++) out.point[r] = x[r];
  double g[3] = {0.0, 0.0, 0.0}, n[3];
  for (int k = 0; k < 4; k++)
    if (basis.at.own[k])
      for (int r = 0; r < 3; r++) g[r] -= basis.weight[k] * basis.row[k][r];
  for (int r = 0; r < 3; r++) n[r] = pose[r] * g[0] + pose[4 + r] * g[1] + pose[8 + r] * g[2];
  double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  if (length > 1e-9)
    for (int r = 0; r < 3; r++) out.direction[r] = n[r] / length;
  if (!(x[3] > 0.0)) return false;
  image(pose, out.point, out.place);
  out.mine = depth(links, b, round, out.point);
  out.theirs = depth(obstacles, o, round, out.place);
  return true;
}

}  // namespace guard
