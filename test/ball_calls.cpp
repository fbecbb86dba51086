// Opens the kernels of the ball cover to the tests.
#include "ball_cover.hpp"

using namespace guard;

extern "C" {

double call_lower_bound(const Plane* z, const Plane* q, double lambda, double spread, double c,
                        int64_t triangle, double* out) {
  Quadratic f = longer(*z, *q, {lambda, spread, c});
  Parameters where{0.0, 0.0};
  double bound = lower_bound(f, triangle ? Domain::TRIANGLE : Domain::SQUARE, where);
  out[0] = where.s;
  out[1] = where.t;
  out[2] = f.size;
  return bound;
}

// The moving surface's only face, with images as they stand, against the fixed one's.
int64_t call_apart(const Surface* moving, const Surface* fixed, const double* turned, double radius,
                   double far, double thickness, double between, int64_t* kind) {
  Face at = face_of(*moving, 0), against = face_of(*fixed, 0);
  at.turned = turned;
  Rate rate({radius, 0.0, 0.0}, far, false);
  Contact contact{NOTHING, {-1, -1}, {-1, -1}, {}};
  bool apart = FatPolygon(at, against, fatness(rate, thickness), between).apart(contact);
  *kind = contact.kind;
  return apart;
}

double call_radius(const Metric* metric, const Curve* curve, double* centre, double* parts) {
  Homogeneous piece = homogeneous(*curve);
  Halves halved;
  halve(piece, halved);
  Ball ball;
  ball.size = size_of(*curve);
  ball.enclose(piece, halved.left);
  for (int e = 0; e < ENTRIES; e++) centre[e] = ball.centre[e];
  Radius radius = ball.radius(*metric, 0);
  parts[0] = radius.shift;
  parts[1] = radius.turn;
  return radius.whole;
}

void call_rate(double whole, double shift, double turn, double far, int64_t adapted, double* out) {
  Rate rate({whole, shift, turn}, far, adapted != 0);
  out[0] = rate.radius;
  out[1] = rate.spread;
  out[2] = rate.uncertain;
}

void call_piece(const Curve* curve, int64_t numerator, int64_t level, double* out) {
  Homogeneous piece = homogeneous(*curve);
  for (level--; level >= 0; level--) {
    Halves halved;
    halve(piece, halved);
    piece = numerator >> level & 1 ? halved.right : halved.left;
  }
  for (size_t i = 0; i < piece.size(); i++) out[i] = piece[i];
}

}  // extern "C"
