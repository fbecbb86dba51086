// The functions of the ball cover that Python calls: a unit of its own, compiled when it is needed.
// Each returns 0, or 1 if memory ran out.
#include <new>

#include "ball_cover.hpp"

namespace guard {

// Valid until the thread's next request.
struct BallAnswer {
  int64_t leaf_count, pair_count;
  Counts counts;
  const BallLeaf* leaves;
  const Open* pairs;
};

}  // namespace guard

using namespace guard;

extern "C" {

// Cover one piece of a motion, `count` pairs of nodes being open on it.
int guard_ball_cover(const Surface* moving, const Surface* fixed, const Metric* metric,
                     const Curve* curve, const BallRequest* request, const Open* pairs,
                     int64_t count, const int64_t* stop, int64_t* tests_of,
                     BallAnswer* answer) try {
  static thread_local std::vector<BallLeaf> leaves;
  static thread_local std::vector<Open> handed;
  static thread_local BallWork work;
  BallCover cover(*moving, *fixed, *metric, *curve, *request, stop, tests_of, work);
  cover.run(pairs, count);
  leaves.swap(cover.leaves);
  handed.swap(cover.handed);
  *answer = {int64_t(leaves.size()), int64_t(handed.size()), cover.counts, leaves.data(),
             handed.data()};
  return 0;
} catch (const std::bad_alloc&) {
  return 1;
}

}  // extern "C"
