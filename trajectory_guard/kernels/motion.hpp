// All link motions on one piece: poses at its centre, polynomials, control points, errors
// (trusted).
//
// One value serves every pair of the piece; nothing is computed for links that no open pair needs.
#pragma once

#include <vector>

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

  // A part has the lever arms of its whole, which hold for every point of the real surface.
  const double* arms(int64_t b) const { return rho.data() + links.range(b, WHOLE) * padded; }

  // Prepare the bodies of a request; false if the path is not what kernels can take.
  bool begin(const Extents& extents, const int64_t* moved, int64_t count) {
    std::vector<double> travel(chain.nodes);
    for (int64_t j = 0; j < chain.nodes; j++) {
      travel[j] = (size_of(path, chain.nodes, j) + path.slack[j]) * UP;
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
    return chain.kind[j] == REVOLUTE && turn > FROZEN ? FROZEN : turn;
  }

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
      const Node* up = chain.parent[j] < 0 ? nullptr : &nodes[chain.parent[j]];
      double phi[TERMS] = {0.0, node.d[1], node.d[2], node.d[3], node.d[4], node.d[5]};
      node.growth =
          extend(up ? &up->polynomial : nullptr, up ? &up->growth : nullptr, chain.kind[j],
                 node.local, span[j], phi, node.cosine, node.sine, node.delta, node.polynomial);
      fit[j] = node.growth.fit;
    }
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
    return sum(total) * UP;
  }

  // How far the joints above a body turn it in a piece, linear in its length [rad].
  double turned(int64_t b) const {
    double total = 0.0;
    for (int64_t j = links.range(b, NODE); j >= 0; j = chain.parent[j])
      if (chain.kind[j] == REVOLUTE) total += span[j];
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
