// All link motions on one piece: poses at its centre, polynomials, control points, errors
// (trusted).
//
// One value serves every pair of the piece; nothing is computed for links that no open pair needs.
#pragma once

#include <vector>

#include "floating.hpp"
#include "piece.hpp"
#include "reach.hpp"
#include "separation.hpp"

namespace guard {

// No turn moves a point by more than twice its distance from the axis.
constexpr double FROZEN = 2.0;

// A vertex of a part may be a corner of a box around points of the whole. Each of its coordinates
// in the box's axes is one that some point has, so it is within sqrt(3) times what the whole
// reaches. Only rounding asks for it: the errors of a motion are those of points of the surface.
constexpr double PART_REACH = 2.0;

struct Node {
  double d[TERMS];     // polynomial of the joint in tau
  double local[POSE];  // pose in the parent's frame at the centre
  double pose[POSE];   // pose in the root frame at the centre
  double cosine[TERMS], sine[TERMS], delta;
  Growth growth;
  Polynomial polynomial;
  Controls points;
  bool needed, built, sound;
};

// Lengths of a body on a piece [m].
struct Body {
  double reach;       // bound on its coordinates, the same for all pieces
  double slack;       // what tracking adds, the same for all pieces
  double sweep;       // largest displacement from the centre pose
  double linear;      // the same without the chord's cap: linear in the piece's length
  double fuzz;        // error of the centre pose
  double place[3];    // sphere's centre at the piece's centre
  double nearest;     // least distance of that place to a box
  double grown;       // how far an affine motion may stretch the sphere beyond its radius
  double error;       // of the built motion, without tracking and rounding; negative: not yet known
  double radius;      // of the control points of the sphere's centre; negative: not yet known
  int64_t stands_on;  // number of the piece, never used twice, that the columns above belong to
};

struct Motion {
  const Chain& chain;
  const Solids& links;
  const Path& path;
  int64_t padded;  // joints, in whole vectors
  std::vector<Node>& nodes;
  std::vector<Body>& bodies;
  // (wholes, padded) lever arms; rows of `padded`: chord, span, fuzz and fit of the joints.
  std::vector<double>&rho, &chord, &span, &fuzz, &fit;
  FloatingPiece floating{};       // of the floating joint on the piece
  const double* given = nullptr;  // bounds of its segment
  double stretched = 0.0;         // see `stretch`
  double farthest_out = 0.0;      // bound on its translation [m]

  // A part has the lever arms of its whole, which hold for every point of the real surface.
  const double* arms(int64_t b) const { return rho.data() + links.range(b, WHOLE) * padded; }

  // Prepare the bodies of a request; false if the path is not what kernels can take.
  bool begin(const Extents& extents, const int64_t* moved, int64_t count) {
    std::vector<double> travel(chain.nodes);
    for (int64_t j = 0; j < chain.nodes; j++) {
      travel[j] = (size_of(path, chain.nodes, j) + path.slack[j]) * UP;
      if (chain.kind[j] == TRANSLATION || chain.kind[j] == ROTATION) {
        Parts size = path.floating ? size_of(*path.floating, path.segments) : Parts{NAN, NAN};
        farthest_out = size.shift;
        travel[j] = (chain.kind[j] == ROTATION ? size.turn : size.shift + travel[j]) * UP;
      }
      if (!(travel[j] >= 0.0)) return false;
    }
    nodes.resize(chain.nodes);
    bodies.resize(links.count);
    rho.assign(links.wholes * padded, 0.0);
    for (auto* row : {&chord, &span, &fuzz, &fit}) row->assign(padded, 0.0);
    for (int64_t i = 0; i < count; i++) {
      int64_t b = moved[i];
      Body& body = bodies[b];
      double* arm = rho.data() + b * padded;
      body.reach = lever_arms(chain, travel.data(), extents, b, links.range(b, NODE), arm);
      body.slack = 0.0;
      body.stands_on = -1;
      for (int64_t j = 0; j < chain.nodes; j++) body.slack += chorded(j, path.slack[j]) * arm[j];
      body.slack *= UP;
    }
    return true;
  }

  double chorded(int64_t j, double turn) const {
    bool turns = chain.kind[j] == REVOLUTE || chain.kind[j] == ROTATION;
    double most = FROZEN * (1.0 + stretch());
    return turns && turn > most ? most : turn;
  }

  // What an affine motion may add to the length of a vector of length 1 during the piece.
  double stretch() const { return stretched; }

  // Whether link and image are congruent, within what `stretch` allows.
  bool rigid() const { return given == nullptr || given[RIGID] != 0.0; }

  void need_none() {
    for (int64_t j = 0; j < chain.nodes; j++) nodes[j].needed = false;
  }

  void need(int64_t b) {
    for (int64_t j = links.range(b, NODE); j >= 0 && !nodes[j].needed; j = chain.parent[j])
      nodes[j].needed = true;
  }

  // Fill polynomials and the poses at the centre for the needed nodes.
  void centre(const Piece& piece) {
    double m = piece.centre(), h = piece.half();
    for (int64_t j = 0; j < chain.nodes; j++) {
      Node& node = nodes[j];
      node.built = false;
      if (!node.needed) {
        chord[j] = span[j] = fuzz[j] = 0.0;
        continue;
      }
      if (chain.kind[j] == TRANSLATION || chain.kind[j] == ROTATION) {
        centre_floating(piece, j);
        continue;
      }
      int64_t row = piece.segment * chain.nodes + j;
      Restricted r = restrict_to(path.coefficients + row * TERMS, m, h, node.d);
      span[j] = r.span;
      chord[j] = chorded(j, r.span);
      fuzz[j] = r.fuzz + path.rounding[row];
      turn(chain, j, node.d[0], node.local);
      if (chain.parent[j] < 0)
        std::memcpy(node.pose, node.local, sizeof node.pose);
      else
        compose(nodes[chain.parent[j]].pose, node.local, node.pose);
    }
  }

  // The same for a part of the floating joint; its translation comes first.
  void centre_floating(const Piece& piece, int64_t j) {
    Node& node = nodes[j];
    if (chain.kind[j] == TRANSLATION) {
      given = path.floating->bounds + FLOATING_BOUNDS * piece.segment;
      fit_floating(*path.floating, piece.segment, piece.centre(), piece.half(), floating);
      turn(chain, j, 0.0, node.local);
      double moved[POSE] = {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0};
      for (int r = 0; r < 3; r++) moved[12 + r] = floating.centre.zt[4 + r];
      compose(node.local, moved, node.pose);
      span[j] = floating.span.shift;
      fuzz[j] = floating.fuzz.shift + given[SHIFT_ERROR];
    } else {
      store(node.local, floating.centre.xy);
      store(node.local + LANES, floating.centre.zt);
      for (int r = 12; r < POSE; r++) node.local[r] = 0.0;
      compose(nodes[chain.parent[j]].pose, node.local, node.pose);
      span[j] = floating.span.turn;
      fuzz[j] = floating.fuzz.turn + given[TURN_ERROR];
      stretched = given[STRETCH];
      if (!rigid()) {
        double norm = (spectral_norm(floating.centre) + span[j] + fuzz[j]) * UP;
        stretched = norm < 1.0 + stretched ? std::fmax(norm - 1.0, 0.0) : stretched;
      }
    }
    chord[j] = chorded(j, span[j]);
  }

  // Fill what the centre pose says of a body, once a piece.
  Body& stand(int64_t b, int64_t piece) {
    Body& body = bodies[b];
    if (body.stands_on == piece) return body;
    body.stands_on = piece;
    Lanes sweep{}, linear{}, off{};
    for (int64_t j = 0; j < padded; j += LANES) {
      Lanes arm = load(arms(b) + j);
      sweep += load(chord.data() + j) * arm;
      linear += load(span.data() + j) * arm;
      off += load(fuzz.data() + j) * arm;
    }
    int64_t node = links.range(b, NODE);
    body.sweep = sum(sweep) * UP;
    body.linear = sum(linear) * UP;
    body.fuzz = (sum(off) + chain_margin(chain.depth[node], 1.0, body.reach)) * UP;
    place(b, body);
    return body;
  }

  // The same for a part, which moves as its whole does. Kept out of the way of what every piece
  // runs.
  __attribute__((noinline)) Body& stand_part(int64_t b, int64_t piece) {
    Body& body = bodies[b];
    if (body.stands_on == piece) return body;
    body = stand(links.range(b, WHOLE), piece);
    body.reach *= PART_REACH;
    place(b, body);
    return body;
  }

  void place(int64_t b, Body& body) const {
    image(nodes[links.range(b, NODE)].pose, links.at(b, CENTRE), body.place);
    body.grown = stretch() * (links.length(b, CORE) + links.length(b, BALL)) * UP;
    body.nearest = INFINITY;
    body.error = body.radius = -1.0;
  }

  // Build the polynomial poses of the needed nodes.
  void build() {
    int64_t lane[LANES];
    int filled = 0;
    for (int64_t j = 0; j < chain.nodes; j++) {
      fit[j] = 0.0;
      if (nodes[j].needed && chain.kind[j] == REVOLUTE && span[j] > 0.0 && span[j] < LARGEST_ANGLE)
        lane[filled++] = j;
      if (filled == LANES || (filled > 0 && j + 1 == chain.nodes)) {
        rotations(lane, filled);
        filled = 0;
      }
    }
    for (int64_t j = 0; j < chain.nodes; j++) {
      Node& node = nodes[j];
      if (!node.needed) continue;
      if (chain.kind[j] == TRANSLATION || chain.kind[j] == ROTATION) {
        build_floating(j);
        continue;
      }
      const Node* up = chain.parent[j] < 0 ? nullptr : &nodes[chain.parent[j]];
      double phi[TERMS] = {0.0, node.d[1], node.d[2], node.d[3], node.d[4], node.d[5]};
      node.growth =
          extend(up ? &up->polynomial : nullptr, up ? &up->growth : nullptr, chain.kind[j],
                 node.local, span[j], phi, node.cosine, node.sine, node.delta, node.polynomial);
      fit[j] = node.growth.fit;
    }
  }

  // Build a part of the floating joint: the fixed pose below the root times the polynomial.
  //
  // The bounds of `floating` hold for the polynomial as stored; what remains is the fixed pose, as
  // for any node. A translation's coefficients may add up to more than its reach: kappa then says
  // how much more.
  void build_floating(int64_t j) {
    Node& node = nodes[j];
    bool slides = chain.kind[j] == TRANSLATION;
    double fixed[POSE];
    turn(chain, j, 0.0, fixed);
    if (!slides) std::memcpy(fixed, nodes[chain.parent[j]].local, sizeof fixed);
    double size = 0.0;
    for (int k = 0; k < TERMS; k++) {
      double* q = node.polynomial.power[k];
      double power[POSE] = {};
      if (slides) {
        if (k == 0) power[0] = power[5] = power[10] = 1.0;
        for (int r = 0; r < 3; r++) power[12 + r] = floating.power[k].zt[4 + r];
      } else {
        store(power, floating.power[k].xy);
        store(power + LANES, floating.power[k].zt);
        size += norms(floating.power[k]).turn;
      }
      compose(fixed, power, q);
      if (!slides)
        std::memcpy(q + 12, nodes[chain.parent[j]].polynomial.power[k] + 12, 3 * sizeof *q);
      fixed[12] = fixed[13] = fixed[14] = 0.0;
    }
    Growth g{0.0, 0.0, 2.0, MAJORANT};
    if (slides) {
      g.fit = floating.fit.shift;
      g.kappa = MAJORANT * std::fmax(1.0, floating.size.shift / farthest_out * UP);
    } else {
      g = nodes[chain.parent[j]].growth;
      g.fit = floating.fit.turn;
      g.eps = (g.fit + stretch()) * UP;
      g.size = size * UP;
      g.kappa = std::fmax(g.kappa, MAJORANT * std::fmax(g.size, floating.size.turn));
    }
    if (!(g.fit >= 0.0 && g.kappa >= 0.0)) g.fit = g.kappa = INFINITY;
    node.growth = g;
    fit[j] = g.fit;
  }

  // Fit the turns of up to eight joints, one in each lane.
  void rotations(const int64_t* lane, int filled) {
    Lanes phi[TERMS] = {}, cosine[TERMS], sine[TERMS], spans{};
    for (int i = 0; i < filled; i++) {
      spans[i] = span[lane[i]];
      for (int k = 1; k < TERMS; k++) phi[k][i] = nodes[lane[i]].d[k];
    }
    Lanes delta = fit_rotation(phi, spans, cosine, sine);
    for (int i = 0; i < filled; i++) {
      Node& node = nodes[lane[i]];
      node.delta = delta[i];
      for (int k = 0; k < TERMS; k++) {
        node.cosine[k] = cosine[k][i];
        node.sine[k] = sine[k][i];
      }
    }
  }

  // The distance between a body's true motion and the built one, without tracking and rounding.
  double fit_error(int64_t b) const {
    Lanes total{};
    for (int64_t j = 0; j < padded; j += LANES)
      total += (load(fit.data() + j) + load(fuzz.data() + j)) * load(arms(b) + j);
    return (sum(total) + stretch() * links.length(b, BALL)) * UP;
  }

  // How far the joints above a body turn it in a piece, linear in its length [rad].
  double turned(int64_t b) const {
    double total = 0.0;
    for (int64_t j = links.range(b, NODE); j >= 0; j = chain.parent[j])
      if (chain.kind[j] == REVOLUTE || chain.kind[j] == ROTATION) total += span[j];
    return total * UP;
  }

  // The control points of a body's node, built when first asked for.
  const Controls& controls(int64_t node) {
    Node& n = nodes[node];
    if (!n.built) {
      n.built = true;
      n.sound = control_points(n.polynomial, n.points) && n.growth.kappa < INFINITY;
    }
    return n.points;
  }

  Doubt doubt(int64_t b) const {
    int64_t node = links.range(b, NODE);
    return {bodies[b].error, double(chain.depth[node]), nodes[node].growth.kappa, bodies[b].reach};
  }
};

// Bound the distance of a link point's control points from a fixed place [m].
inline double farthest(const double* x, const double* place, const Controls& points) {
  Lanes worst{};
  Mask lost = {};
  for (int half = 0; half < CONTROL_ROW; half += LANES) {
    Lanes square{};
    for (int r = 0; r < 3; r++) {
      Lanes off = load(points.entry[r] + half) * x[0] + load(points.entry[3 + r] + half) * x[1] +
                  load(points.entry[6 + r] + half) * x[2] + load(points.entry[9 + r] + half) -
                  place[r];
      square += off * off;
    }
    lost |= square != square;
    worst = square > worst ? square : worst;
  }
  return any(lost) ? INFINITY : std::sqrt(-least(-worst)) * UP;
}

}  // namespace guard
