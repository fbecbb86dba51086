// The kernels' parts that only kernels call, opened to the tests (`kernel_calls.py`).
#include <cstddef>
#include <cstdio>

#include "kernels.cpp"

namespace {

// Control points from rows of [C | t]; the last one is repeated up to whole vectors.
Controls controls_of(const double* matrices, int64_t count) {
  Controls points;
  for (int i = 0; i < CONTROL_ROW; i++)
    for (int e = 0; e < 12; e++)
      points.entry[3 * (e % 4) + e / 4][i] = matrices[12 * (i < count ? i : count - 1) + e];
  return points;
}

// A pose by columns from rows of [R | t].
void pose_of(const double* rows, double* pose) {
  for (int c = 0; c < 4; c++) {
    for (int r = 0; r < 3; r++) pose[4 * c + r] = rows[4 * r + c];
    pose[4 * c + 3] = 0.0;
  }
}

void rows_of(const double* pose, double* rows) {
  for (int c = 0; c < 4; c++)
    for (int r = 0; r < 3; r++) rows[4 * r + c] = pose[4 * c + r];
}

void copy(const double* from, double* to, int count) {
  std::copy(from, from + count, to);
}

}  // namespace

extern "C" {

double call_separation(const double* n, const double* matrices, int64_t count, const Solids* links,
                       int64_t b, const Solids* obstacles, int64_t o, double error, double depth,
                       double kappa, double reach, double wanted) {
  return separation(n, controls_of(matrices, count), *links, b, *obstacles, o,
                    {error, depth, kappa, reach}, wanted);
}

int64_t call_turning(const double* n, const double* m, const double* k, const double* matrices,
                     const Solids* links, int64_t b, const Solids* obstacles, int64_t o,
                     double error, double depth, double kappa, double reach, double distance) {
  Turn turn{{n[0], n[1], n[2]}, {m[0], m[1], m[2]}, {k[0], k[1], k[2]}};
  return turning(turn, controls_of(matrices, CONTROLS), *links, b, *obstacles, o,
                 {error, depth, kappa, reach}, distance);
}

double call_box_distance(const double* x, const Solids* solids, int64_t o) {
  return box_distance(x, *solids, o);
}

// n (3), best, distance and place (3) are written to `out`.
int64_t call_gjk(const double* first, const double* matrices, int64_t count, const Solids* links,
                 int64_t b, const Solids* obstacles, int64_t o, double want, int64_t stop,
                 double accuracy, int64_t rounds, double* out) {
  Search found;
  Found state;
  if (count == 1) {
    double pose[POSE];
    pose_of(matrices, pose);
    state = gjk(first, Standing{pose}, *links, b, *obstacles, o, want, stop != 0, accuracy,
                int(rounds), found);
  } else {
    Controls points = controls_of(matrices, count);
    state = gjk(first, Moving{points}, *links, b, *obstacles, o, want, stop != 0, accuracy,
                int(rounds), found);
  }
  copy(found.n, out, 3);
  out[3] = found.best;
  out[4] = found.distance;
  copy(found.place, out + 5, 3);
  return int64_t(state);
}

// point (3), direction (3), place (3), depths in link and obstacle are written to `out`.
int64_t call_deepest(const double* matrix, const Solids* links, int64_t b, const Solids* obstacles,
                     int64_t o, double* out) {
  double pose[POSE];
  pose_of(matrix, pose);
  std::vector<double> moved;
  Common found{};
  Meeting meeting{};
  bool inside = deepest(pose, *links, b, *obstacles, o, true, moved, meeting, found);
  copy(found.point, out, 3);
  copy(found.direction, out + 3, 3);
  copy(found.place, out + 6, 3);
  out[9] = found.mine;
  out[10] = found.theirs;
  return inside;
}

double call_depth(const Solids* solids, int64_t b, const double* x) {
  return depth(*solids, b, true, x);
}

double call_farthest(const double* x, const double* place, const double* matrices, int64_t count) {
  return farthest(x, place, controls_of(matrices, count));
}

// The same for solids that overlap by little along a direction.
int64_t call_shallow(const double* matrix, const Solids* links, int64_t b, const Solids* obstacles,
                     int64_t o, const double* n, double* out) {
  double pose[POSE];
  pose_of(matrix, pose);
  Common found{};
  bool inside = shallow(pose, *links, b, *obstacles, o, n, found);
  copy(found.point, out, 3);
  copy(found.place, out + 3, 3);
  out[6] = found.mine;
  out[7] = found.theirs;
  return inside;
}

// Say whether a common point proves an overlap: one that moves from y0 to y1 in the link; where
// y0 is null, one that stands, found at the pose `centre`. known: place, depth, start, end.
int64_t call_witness(const double* matrices, double eps, const double* centre, const Solids* links,
                     int64_t b, const Solids* obstacles, int64_t o, double error, double fuzz,
                     double margin, const double* n, const double* y0, const double* y1,
                     double* known) {
  Node node{};
  node.points = controls_of(matrices, CONTROLS);
  node.growth.eps = eps;
  node.sound = true;
  pose_of(centre, node.pose);
  Known told{};
  bool proved;
  if (y0 != nullptr) {
    proved = moving_witness(*links, b, *obstacles, o, true, node, error, margin, y0, y1, told);
  } else {
    std::vector<double> moved;
    Meeting meeting{};
    Common found{};
    proved = standing_witness(*links, b, *obstacles, o, true, n, node, error, fuzz, margin, moved,
                              meeting, found, told);
  }
  copy(told.place, known, 3);
  known[3] = told.depth;
  copy(told.start, known + 4, 3);
  copy(told.end, known + 7, 3);
  return proved;
}

// How far two triangles (3, 3) that cross may move and still cross; where is written to `place`.
double call_crossing(const double* mine, const double* theirs, double* place) {
  Triangle a, b;
  std::memcpy(a.corner, mine, sizeof a.corner);
  std::memcpy(b.corner, theirs, sizeof b.corner);
  return crossing(a, b, place);
}

// How far a contact of a triangle may move; the link's point and its place are written to `out`.
double call_contact(const double* matrix, const Solids* links, const Solids* obstacles,
                    double* out) {
  double pose[POSE];
  pose_of(matrix, pose);
  return contact(*links, 0, *obstacles, 0, pose, out, out + 3);
}

void call_restrict(const double* coefficients, double m, double h, double* d, double* out) {
  Restricted r = restrict_to(coefficients, m, h, d);
  out[0] = r.span;
  out[1] = r.fuzz;
}

double call_fit_half_angle(const double* d, double span, double* u) {
  return fit_half_angle(d, span, u);
}

double call_fit_slide(const double* d, double* u) {
  return fit_slide(d, u);
}

double call_economise_to_cubic(double* p, int64_t top) {
  return economise_to_cubic(p, int(top));
}

int64_t call_factors(int64_t kind, const double* u, double* cosine, double* sine, double* weight,
                     double* kappa) {
  Factors f = factors(kind, u);
  copy(f.cosine, cosine, 7);
  copy(f.sine, sine, 7);
  copy(f.weight, weight, 7);
  *kappa = f.kappa;
  return f.degree;
}

double call_fit_rotation(const double* phi, double span, double* cosine, double* sine) {
  return fit_rotation(phi, span, cosine, sine);
}

// Eight turns at once, (TERMS, 8) each.
void call_fit_rotations(const double* phi, const double* span, double* cosine, double* sine,
                        double* delta) {
  Lanes x[TERMS], c[TERMS], s[TERMS];
  for (int k = 0; k < TERMS; k++) x[k] = load(phi + LANES * k);
  store(delta, fit_rotation(x, load(span), c, s));
  for (int k = 0; k < TERMS; k++) {
    store(cosine + LANES * k, c[k]);
    store(sine + LANES * k, s[k]);
  }
}

void call_economise(double* p) {
  economise(p);
}

void call_bernstein(double* out) {
  copy(BASIS.row[0], out, TERMS * CONTROL_ROW);
}

double call_lever_arms(const Chain* chain, const double* travel, const Extents* extents, int64_t b,
                       int64_t node, double* rho) {
  return lever_arms(*chain, travel, *extents, b, node, rho);
}

double call_chain_margin(double depth, double kappa, double reach) {
  return chain_margin(depth, kappa, reach);
}

double call_plane_margin(double kappa, double reach, double obstacle) {
  return plane_margin(kappa, reach, obstacle);
}

double call_sphere_margin(double reach, double obstacle) {
  return sphere_margin(reach, obstacle);
}

// The obstacles that a swept sphere at a place does not keep clear of; returns how many.
int64_t call_scan(const Solids* links, int64_t b, const Boxes* boxes, double clearance,
                  const double* place, double reach, double slack, double sweep, double fuzz,
                  int64_t* open) {
  Body body{};
  copy(place, body.place, 3);
  body.reach = reach;
  body.slack = slack;
  body.sweep = sweep;
  body.fuzz = fuzz;
  body.nearest = INFINITY;
  int64_t count = 0;
  scan(*links, b, *boxes, clearance, body, [&](int64_t o) { open[count++] = o; });
  return count;
}

// The motion of a body on a piece and what its error is made of: fit, kappa, reach, depth, error
// of the centre, eps, whether it is sound. The centre pose is written as rows of [R | t]. Returns the
// number of control points, 0 if the path is refused.
int64_t call_motion(const Chain* chain, const Solids* links, const Path* path,
                    const Extents* extents, int64_t b, const Piece* piece, int64_t rational,
                    double* matrices, double* weights, double* centre, double* lengths) {
  Work work;
  Motion motion{*chain,     *links,      *path,    (chain->nodes + LANES - 1) / LANES * LANES,
                work.nodes, work.bodies, work.rho, work.chord,
                work.span,  work.fuzz,   work.fit};
  if (!motion.begin(*extents, &b, 1)) return 0;
  motion.need_none();
  motion.need(b);
  motion.centre(*piece);
  const Body& body = motion.stand(b, 0);
  const Node& node = motion.nodes[links->range(b, NODE)];
  rows_of(node.pose, centre);
  lengths[2] = body.reach;
  lengths[3] = double(chain->depth[links->range(b, NODE)]);
  lengths[4] = body.fuzz;
  if (rational) {
    RationalLink link = rational_link(motion, b);
    std::copy(link.matrices.begin(), link.matrices.end(), matrices);
    std::copy(link.weights.begin(), link.weights.end(), weights);
    lengths[0] = link.error;
    lengths[1] = link.kappa;
    lengths[5] = 0.0;
    lengths[6] = link.sound;
    return int64_t(link.weights.size());
  }
  motion.build();
  const Controls& points = motion.controls(links->range(b, NODE));
  double binomial = 1.0;
  for (int i = 0; i < CONTROLS; i++) {
    weights[i] = binomial;
    binomial = binomial * (CONTROLS - 1 - i) / (i + 1);
    for (int e = 0; e < 12; e++) matrices[12 * i + e] = points.entry[3 * (e % 4) + e / 4][i];
  }
  lengths[0] = motion.fit_error(b);
  lengths[1] = node.growth.kappa;
  lengths[5] = node.growth.eps;
  lengths[6] = node.sound;
  return CONTROLS;
}

// Sizes, offsets and values that Python must agree with, one `name value` a line.
int64_t call_layout(char* text, int64_t room) {
  int64_t used = 0;
  auto say = [&](const char* name, long long value) {
    used +=
        std::snprintf(text + used, room > used ? size_t(room - used) : 0, "%s %lld\n", name, value);
  };
#define VALUE(name) say(#name, (long long)(name))
#define FIELD(type, field) say(#type "." #field, (long long)offsetof(type, field))
#define SIZE(type) say(#type, (long long)sizeof(type))
  VALUE(REVOLUTE), VALUE(PRISMATIC), VALUE(TRANSLATION), VALUE(ROTATION);
  VALUE(TERMS), VALUE(LANES);
  VALUE(TURN_ERROR), VALUE(SHIFT_ERROR), VALUE(STRETCH), VALUE(RIGID);
  VALUE(guard::FIRST), VALUE(guard::LAST), VALUE(FACE_FIRST), VALUE(FACE_LAST);
  VALUE(guard::NODE), VALUE(WHOLE), VALUE(PARTS), VALUE(CHILD), VALUE(RANGES);
  VALUE(NO_PARTS), VALUE(BUILT), VALUE(UNBUILT), VALUE(TRIANGLE);
  VALUE(BALL), VALUE(DISC), VALUE(CORE), VALUE(FAR), VALUE(INSIDE), VALUE(SIZES);
  VALUE(AXIS), VALUE(CENTRE), VALUE(HALF), VALUE(BOX), VALUE(PLACES), VALUE(BOX_ROWS);
  VALUE(UNDECIDED), VALUE(guard::FREE), VALUE(SUSPECT), VALUE(COLLISION);
  VALUE(BY_TOLERANCE), VALUE(BY_DEPTH), VALUE(BY_BUDGET), VALUE(BY_STOP), VALUE(BY_SCOPE);
  VALUE(BY_HULL), VALUE(BY_ENCLOSURE);
  VALUE(SCOPE_ALL), VALUE(SCOPE_FIRST), VALUE(SCOPE_VERDICT);
  VALUE(BALLS_APART), VALUE(PLANE_BETWEEN), VALUE(PLANE_TURNING);
  VALUE(CONTROLS), VALUE(CONTROL_ROW), VALUE(ROUNDS), VALUE(DEEPEST_LEVEL);
  say("UP", (long long)((UP - 1.0) * 0x1p52));
  say("1/RELATIVE", (long long)(1.0 / RELATIVE));
  say("16 LARGEST_ANGLE", (long long)(16.0 * LARGEST_ANGLE));
  SIZE(Leaf);
  FIELD(Leaf, segment), FIELD(Leaf, start), FIELD(Leaf, end), FIELD(Leaf, level);
  FIELD(Leaf, status), FIELD(Leaf, reason), FIELD(Leaf, body), FIELD(Leaf, obstacle);
  FIELD(Leaf, witness), FIELD(Leaf, known);
  SIZE(Known);
  FIELD(Known, lower), FIELD(Known, upper), FIELD(Known, place), FIELD(Known, depth);
  FIELD(Known, near), FIELD(Known, start), FIELD(Known, end);
  SIZE(Piece);
  FIELD(Piece, segment), FIELD(Piece, numerator), FIELD(Piece, level);
  SIZE(Entry);
  FIELD(Entry, kind), FIELD(Entry, piece), FIELD(Entry, body), FIELD(Entry, obstacle);
  FIELD(Entry, turn.n), FIELD(Entry, turn.m), FIELD(Entry, turn.k), FIELD(Entry, offset);
  SIZE(Opened);
  FIELD(Opened, segment), FIELD(Opened, numerator), FIELD(Opened, level), FIELD(Opened, body);
  FIELD(Opened, obstacle);
  SIZE(Wanted);
  FIELD(Wanted, side), FIELD(Wanted, solid);
  SIZE(Chain);
  FIELD(Chain, nodes), FIELD(Chain, parent), FIELD(Chain, kind), FIELD(Chain, transform);
  FIELD(Chain, depth);
  SIZE(Solids);
  FIELD(Solids, count), FIELD(Solids, wholes), FIELD(Solids, ranges), FIELD(Solids, size),
      FIELD(Solids, place);
  FIELD(Solids, vertices), FIELD(Solids, vertex_stride), FIELD(Solids, faces);
  FIELD(Solids, face_stride);
  SIZE(Boxes);
  FIELD(Boxes, blocks), FIELD(Boxes, box), FIELD(Boxes, obstacle), FIELD(Boxes, nodes);
  FIELD(Boxes, bounds), FIELD(Boxes, branch), FIELD(Boxes, far);
  SIZE(Path);
  FIELD(Path, segments), FIELD(Path, coefficients), FIELD(Path, rounding), FIELD(Path, slack);
  FIELD(Path, floating);
  SIZE(Floating);
  FIELD(Floating, first), FIELD(Floating, control), FIELD(Floating, weight);
  FIELD(Floating, bounds);
  SIZE(Extents);
  FIELD(Extents, extent), FIELD(Extents, perpendicular), FIELD(Extents, offsets);
  SIZE(Request);
  FIELD(Request, tolerance), FIELD(Request, clearance), FIELD(Request, max_pieces);
  FIELD(Request, scope), FIELD(Request, want_proof), FIELD(Request, sharpen);
  FIELD(Request, bodies), FIELD(Request, body_count);
  SIZE(Answer);
  FIELD(Answer, leaf_count), FIELD(Answer, entry_count), FIELD(Answer, piece_count);
  FIELD(Answer, opened_count), FIELD(Answer, wanted_count);
  FIELD(Answer, pieces), FIELD(Answer, seconds), FIELD(Answer, leaves), FIELD(Answer, entries);
  FIELD(Answer, proved_on), FIELD(Answer, opened), FIELD(Answer, wanted);
  return used;
}

}  // extern "C"
