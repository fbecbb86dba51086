// Eight doubles at once, in portable vector extensions: strict IEEE, lane by lane.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

namespace guard {

typedef double Lanes __attribute__((vector_size(64)));
typedef int64_t Mask __attribute__((vector_size(64)));

constexpr int LANES = 8;

inline Lanes load(const double* p) {
  Lanes x;
  std::memcpy(&x, p, sizeof x);
  return x;
}

inline void store(double* p, Lanes x) {
  std::memcpy(p, &x, sizeof x);
}

inline Lanes all(double x) {
  return Lanes{x, x, x, x, x, x, x, x};
}

inline Lanes absolute(Lanes x) {
  return x < 0.0 ? -x : x;
}

inline Lanes root(Lanes x) {
  for (int i = 0; i < LANES; i++) x[i] = std::sqrt(x[i]);
  return x;
}

inline bool any(Mask m) {
  int64_t joined = 0;
  for (int i = 0; i < LANES; i++) joined |= m[i];
  return joined != 0;
}

inline double sum(Lanes x) {
  return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]));
}

// The least lane; a lane that is NaN must have been noticed before.
inline double least(Lanes x) {
  double best = x[0];
  for (int i = 1; i < LANES; i++) best = x[i] < best ? x[i] : best;
  return best;
}

}  // namespace guard
