// Listing 1: cover a motion by balls and close pairs of faces, piece by piece (trusted books).
//
// A piece of the motion starts with the pairs of clusters that its parent could not close; a pair
// closed on a piece is closed on all of its parts, so the balls need not be nested (Remark 2). A
// pair of clusters is closed by a plane (`cluster`), a pair of faces by Listing 2 with the static
// test (`fat_polygon`). What stays open is split in space while the clusters are larger than the
// motion's uncertainty R rho, else in time. A piece ends as
//
// * FREE when no pair is open;
// * SUSPECT when the uncertainty at one open pair of faces is below epsilon (11), or depth, tests or
//   patience are spent; its other pairs are not looked at any more;
// * PENDING at a level where the caller wants to share out the work, with its open pairs.
//
// **Thickness.** The tests take the computed g for the ball's centre. All else that may part a true
// image of x from the curve's, in length: clearance, the errors given with the motion,
// |C_d| residual <= 6 M_C residual of the metric (`surface`; the entries of a difference are at most
// 2 M_C, nine of them), and rounding. With Y = 3 M_C X + 2 M_t, which bounds every image of the
// moving surface within |x| <= X, and the fixed surface within F: halving 2.1 n l u Y (`ball`; a
// curve evaluated by others at an instant, 4 n u Y), images 8 u Y twice, planes between clusters
// 32 u (Y + F), boxes 4 u. Together less than
//
//     (THICK + 8 n (l + 1)) u (Y + F),         THICK = 128,
//
// and 2^-400 m, so that no square of it leaves the range of doubles.
#pragma once

#include <vector>

#include "cluster.hpp"
#include "fat_polygon.hpp"

namespace guard {

constexpr double THICK = 128.0;
constexpr double LEAST_THICKNESS = 0x1p-400;
constexpr double BETWEEN = 16.0;  // a plane between corners: 10 roundings on |n| (Y + F)
constexpr int64_t DEEPEST_PIECE = 48;

// Clusters larger than this many times the uncertainty are split in space.
constexpr double SPLIT = 1.0;

enum : int64_t { PENDING = 0, BALL_FREE = 1, BALL_SUSPECT = 2 };
enum : int64_t { BY_EPSILON, BY_RECURSION, BY_TESTS, BY_PATIENCE };

struct BallRequest {
  double clearance, shift_error, turn_error;  // [m], [m], [m/m]
  double epsilon;                             // [m]
  int64_t max_depth, max_tests;
  int64_t plain;             // every pair of faces by itself, without any memory
  int64_t adapted;           // every ball has the extent of distributions that suits it
  int64_t numerator, level;  // the piece to cover
  int64_t until;             // level at which open pieces are handed back; -1: none are
};

// A piece [numerator, numerator + 1] / 2^level that nobody halves any more.
struct BallLeaf {
  int64_t numerator, level, status, reason;
  int64_t moving_face, fixed_face;
  int64_t first, last;  // open pairs of a pending piece
  Contact contact;
};

// Two nodes that may meet.
struct Open {
  int64_t moving, fixed;
};

struct Counts {
  int64_t pieces, node_tests, polygon_tests, depth;
};

// Radii by distribution, kept by a thread from one request to the next: which piece of all that the
// thread ever examined they belong to tells whether they are of use.
struct BallWork {
  std::vector<Radius> radius;
  std::vector<int64_t> radius_piece;
  int64_t piece = 0;
};

class BallCover {
 public:
  std::vector<BallLeaf> leaves;
  std::vector<Open> handed;  // pairs of pending pieces
  Counts counts{};

  BallCover(const Surface& moving, const Surface& fixed, const Metric& metric, const Curve& curve,
            const BallRequest& request, const int64_t* stop, int64_t* tests_of, BallWork& work)
      : moving(moving),
        fixed(fixed),
        metric(metric),
        request(request),
        stop(stop),
        tests_of(tests_of),
        work(work),
        halves(DEEPEST_PIECE + 1) {
    if (int64_t(work.radius.size()) < metric.count) {
      // In this order, so that no failure leaves less of the second than of the first.
      work.radius_piece.resize(metric.count, -1);
      work.radius.resize(metric.count);
    }
    ball.size = size_of(curve);
    double images = 3.0 * ball.size.linear * moving.reach + 2.0 * ball.size.shift;
    double unit = UNIT_ROUNDOFF * (images + fixed.reach);
    double steps = 8.0 * double(curve.degree) * double(request.max_depth + 1);
    between = BETWEEN * unit + LEAST_THICKNESS;
    thickness = (request.clearance + request.shift_error + request.turn_error * moving.reach +
                 6.0 * ball.size.linear * metric.residual + (THICK + steps) * unit) *
                    UP +
                LEAST_THICKNESS;
    start = homogeneous(curve);
    for (int64_t level = request.level - 1; level >= 0; level--) {
      Halves halved;
      halve(start, halved);
      start = request.numerator >> level & 1 ? halved.right : halved.left;
    }
  }

  void run(const Open* pairs, int64_t count) {
    if (request.plain) {
      for (int64_t i = 0; i < moving.nodes; i++)
        for (int64_t j = 0; j < fixed.nodes; j++)
          if (leaf_of(moving, i) >= 0 && leaf_of(fixed, j) >= 0) {
            live.assign(1, {i, j});
            cover(start, request.numerator, request.level, 0, 1);
          }
      return;
    }
    live.assign(pairs, pairs + count);
    cover(start, request.numerator, request.level, 0, count);
  }

 private:
  const Surface &moving, &fixed;
  const Metric& metric;
  const BallRequest& request;
  const int64_t* stop;
  int64_t* tests_of;
  BallWork& work;
  double thickness, between;
  Homogeneous start;
  std::vector<Halves> halves;  // of the piece examined last on each level
  Ball ball;
  std::vector<double> images;
  std::vector<Open> live, stack;
  bool given_up = false;
  bool crossing = false;  // the last faces that were not apart
  int64_t given_up_by = BY_TESTS;

  static int64_t leaf_of(const Surface& surface, int64_t node) {
    return surface.branch[3 * node + 2];
  }

  static BallLeaf leaf_on(int64_t numerator, int64_t level, int64_t status) {
    return {numerator, level, status, 0, -1, -1, 0, 0, {NOTHING, {-1, -1}, {-1, -1}, {}}};
  }

  // The open pairs of the piece are first:last of the live ones.
  void cover(const Homogeneous& piece, int64_t numerator, int64_t level, int64_t first,
             int64_t last) {
    if (level == request.until) {
      hand_back(numerator, level, first, last);
      return;
    }
    BallLeaf leaf = leaf_on(numerator, level, BALL_FREE);
    int64_t open = static_cast<int64_t>(live.size());
    Halves& halved = halves[level];
    bool ended = spent() || !examine(piece, halved, level, first, last, leaf);
    int64_t end = static_cast<int64_t>(live.size());
    if (given_up) {
      leaf = leaf_on(numerator, level, BALL_SUSPECT);
      leaf.reason = given_up_by;
    }
    if (ended || end == open) {
      // By itself each pair of faces has its own pieces; those that are free tell nothing.
      if (!request.plain || leaf.status != BALL_FREE) leaves.push_back(leaf);
    } else {
      cover(halved.left, 2 * numerator, level + 1, open, end);
      cover(halved.right, 2 * numerator + 1, level + 1, open, end);
    }
    live.resize(open);
  }

  void hand_back(int64_t numerator, int64_t level, int64_t first, int64_t last) {
    BallLeaf leaf = leaf_on(numerator, level, PENDING);
    leaf.first = static_cast<int64_t>(handed.size());
    handed.insert(handed.end(), live.begin() + first, live.begin() + last);
    leaf.last = static_cast<int64_t>(handed.size());
    leaves.push_back(leaf);
  }

  bool spent() {
    if (given_up) return true;
    if (counts.node_tests + counts.polygon_tests >= request.max_tests)
      given_up_by = BY_TESTS;
    else if (__atomic_load_n(stop, __ATOMIC_RELAXED) != 0)
      given_up_by = BY_PATIENCE;
    else
      return false;
    return given_up = true;
  }

  // Close what can be closed; pairs that need halves are appended to the live ones. False if the
  // piece ends, and `leaf` says why.
  bool examine(const Homogeneous& piece, Halves& halved, int64_t level, int64_t first, int64_t last,
               BallLeaf& leaf) {
    counts.pieces++;
    work.piece++;
    if (level > counts.depth) counts.depth = level;
    halve(piece, halved);
    ball.enclose(piece, halved.left);
    Axes axes(ball.centre);
    bool deep = level >= request.max_depth || level >= DEEPEST_PIECE;
    size_t open = live.size();
    for (int64_t i = first; i < last; i++) {
      stack.assign(1, live[i]);
      while (!stack.empty()) {
        Open pair = stack.back();
        stack.pop_back();
        if (spent()) return false;
        Rate rate(radius_of(pair.moving), metric.far[pair.moving], request.adapted != 0);
        double uncertain = rate.uncertain;
        if (!request.plain && clusters_apart(axes, pair, uncertain)) continue;
        int64_t m = leaf_of(moving, pair.moving), f = leaf_of(fixed, pair.fixed);
        if (m >= 0 && f >= 0) {
          if (faces_apart(rate, m, f, leaf.contact)) continue;
          if (deep || uncertain < request.epsilon) {
            leaf.status = BALL_SUSPECT;
            leaf.reason = uncertain < request.epsilon ? BY_EPSILON : BY_RECURSION;
            leaf.moving_face = m;
            leaf.fixed_face = f;
            name_vertices(leaf);
            return false;
          }
          live.push_back(pair);
          if (crossing && !request.plain) {
            leave(open, i + 1, last);
            return true;
          }
        } else if (!split(pair, uncertain, deep || uncertain < request.epsilon)) {
          live.push_back(pair);
        }
      }
    }
    return true;
  }

  // Leave the pairs that were not looked at for the halves: the faces of the last survivor seem to
  // cross in the middle, where the halves meet, so it comes first, and the rest can wait.
  void leave(size_t open, int64_t next, int64_t last) {
    std::swap(live[open], live.back());
    live.insert(live.end(), stack.begin(), stack.end());
    for (; next < last; next++) {
      Open pair = live[next];
      live.push_back(pair);
    }
  }

  const Radius& radius_of(int64_t node) {
    int64_t which = metric.of[node];
    if (work.radius_piece[which] != work.piece) {
      work.radius_piece[which] = work.piece;
      work.radius[which] = ball.radius(metric, which);
    }
    return work.radius[which];
  }

  bool clusters_apart(const Axes& axes, const Open& pair, double uncertain) {
    counts.node_tests++;
    const double* box = moving.box + 6 * pair.moving;
    double place[3];
    ball.image(box, place);
    return axes.apart(place, box + 3, fixed.box + 6 * pair.fixed, (uncertain + thickness) * UP);
  }

  // Replace the larger cluster by its parts; false if both are small enough to wait for halves.
  bool split(const Open& pair, double uncertain, bool now) {
    const int64_t* m = moving.branch + 3 * pair.moving;
    const int64_t* f = fixed.branch + 3 * pair.fixed;
    double m_size = m[2] < 0 ? size_of_box(moving, pair.moving) : -1.0;
    double f_size = f[2] < 0 ? size_of_box(fixed, pair.fixed) : -1.0;
    if (!now && !(std::fmax(m_size, f_size) > SPLIT * uncertain)) return false;
    for (int side = 0; side < 2; side++)
      stack.push_back(m_size >= f_size ? Open{m[side], pair.fixed} : Open{pair.moving, f[side]});
    return true;
  }

  static double size_of_box(const Surface& surface, int64_t node) {
    const double* half = surface.box + 6 * node + 3;
    return std::sqrt(product(half, half));
  }

  bool faces_apart(const Rate& rate, int64_t m, int64_t f, Contact& contact) {
    counts.polygon_tests++;
    tests_of[m]++;
    Face at = face_of(moving, m), against = face_of(fixed, f);
    images.resize(3 * at.corners);
    for (int64_t i = 0; i < at.corners; i++) ball.image(at.corner + 3 * i, &images[3 * i]);
    at.corner = images.data();
    at.turned = metric.turned + 3 * moving.corner_first[m];
    FatPolygon polygon(at, against, fatness(rate, thickness), between);
    if (polygon.apart(contact)) return true;
    crossing = polygon.cross();
    return false;
  }

  // Corners within a face become the polyhedron's vertices.
  void name_vertices(BallLeaf& leaf) const {
    for (int end = 0; end < 2; end++) {
      int64_t& m = leaf.contact.moving[end];
      int64_t& f = leaf.contact.fixed[end];
      if (m >= 0) m = moving.vertex[moving.corner_first[leaf.moving_face] + m];
      if (f >= 0) f = fixed.vertex[fixed.corner_first[leaf.fixed_face] + f];
    }
  }
};

}  // namespace guard
