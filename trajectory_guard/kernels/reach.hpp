// Lever arms: how far a joint's error can move a body (trusted).
//
// If joint j is off by an angle eps, a point at distance r from its axis is off by the chord
// 2 r sin(eps/2) <= min(eps, 2) r. Changing one joint after the other, from the root outward, gives
//
//     |x(theta + eps) - x(theta)| <= sum_j min(|eps_j|, 2) rho_j(x),
//
// where rho_j(x) bounds the distance of x to the axis of joint j over *all* configurations of the
// joints beyond j (for a prismatic joint the factor is |eps_j| and rho_j = 1). The distance to the
// axis is at most the part of the next joint's origin perpendicular to the axis plus the lengths
// of all later offsets and slides plus |x|. A body's ball is left out: it looks the same however
// the body turns, so it stays where its centre is.
//
// A floating joint hangs on the root. Its translation is a slide in any direction; its rotation has
// no axis, so the arm is the distance to its origin, and if its linear part may stretch by a factor
// f, all that lies beyond is moved by f times as much.
#pragma once

#include <cmath>

#include "margin.hpp"
#include "values.hpp"

namespace guard {

// Write the lever arms of a body on all n joints (zero where the joint is not above it) [m, or 1
// for a slide]; returns a bound on every length that enters the body's position [m]. travel: (n,)
// bound on |q| of a slide, tolerance included [m]; the factor f of a rotation.
inline double lever_arms(const Chain& chain, const double* travel, const Extents& extents,
                         int64_t b, int64_t node, double* rho) {
  // `far`: bound on the distance of the body's points to the origin of the node below j, `axis`:
  // the same to the axis of j.
  double far = extents.extent[b], axis = extents.perpendicular[b];
  for (int64_t j = node; j >= 0; j = chain.parent[j]) {
    if (chain.kind[j] == PRISMATIC || chain.kind[j] == TRANSLATION) {
      rho[j] = 1.0;
      far += travel[j];
    } else if (chain.kind[j] == ROTATION) {
      far *= travel[j];
      rho[j] = far * UP;
      for (int64_t k = node; k != j; k = chain.parent[k]) rho[k] *= travel[j] * UP;
    } else {
      rho[j] = axis * UP;
    }
    double x = chain.transform[12 * j + 3], y = chain.transform[12 * j + 7],
           z = chain.transform[12 * j + 11];
    axis = far + std::sqrt(x * x + y * y);
    far += std::sqrt(x * x + y * y + z * z);
  }
  return (far + extents.offsets[b]) * UP;
}

}  // namespace guard
