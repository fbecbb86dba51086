// The functions that Python calls. Each returns 0, 1 if memory ran out, or 2 if the path is not
// what kernels can take.
#include <algorithm>
#include <chrono>
#include <deque>
#include <new>

#include "cover.hpp"
#include "rational.hpp"

namespace guard {

// What a request is answered with; valid until the thread's next requests. No leaves are -1: the
// path is not what kernels can take.
struct Answer {
  int64_t leaf_count, entry_count, piece_count, opened_count, wanted_count, pieces;
  double seconds;
  const Leaf* leaves;
  const Entry* entries;
  const Piece* proved_on;
  const Opened* opened;
  const Wanted* wanted;
};

// Room for the requests of a thread; it stays from call to call.
static std::deque<Work>& room(size_t count) {
  static thread_local std::deque<Work> rooms;
  if (rooms.size() < count) rooms.resize(count);
  return rooms;
}

}  // namespace guard

using namespace guard;

extern "C" {

// Cover all segments of each of `count` paths, one after the other.
int guard_cover(const Chain* chain, const Solids* links, const Solids* obstacles,
                const Boxes* boxes, const Extents* extents, int64_t count, const Path* paths,
                const Request* requests, const int64_t* stop, Answer* answers) try {
  using Clock = std::chrono::steady_clock;
  std::deque<Work>& rooms = room(count);
  for (int64_t i = 0; i < count; i++) {
    Work& work = rooms[i];
    Clock::time_point begin = Clock::now();
    Cover cover(*chain, *links, *obstacles, *boxes, paths[i], *extents, requests[i], stop, work);
    bool taken = cover.run();
    std::chrono::duration<double> spent = Clock::now() - begin;
    const Proof& proof = work.proof;
    answers[i] = {taken ? int64_t(work.leaves.size()) : -1,
                  int64_t(proof.entries.size()),
                  int64_t(proof.pieces.size()),
                  int64_t(work.opened.size()),
                  int64_t(work.wanted.size()),
                  work.pieces + work.part_pairs / PART_PAIRS,
                  spent.count(),
                  work.leaves.data(),
                  proof.entries.data(),
                  proof.pieces.data(),
                  work.opened.data(),
                  work.wanted.data()};
  }
  return 0;
} catch (const std::bad_alloc&) {
  return 1;
}

// Build the motion of one body on one piece: control matrices (K, 12) and scaled weights (K,); K is
// written to `count`, at most `room_for`. lengths: error without tracking, what tracking adds,
// largest displacement from the centre [m], and 1 if the motion is usable.
int guard_link_motion(const Chain* chain, const Solids* links, const Path* path,
                      const Extents* extents, int64_t body, const Piece* piece, int64_t rational,
                      int64_t room_for, double* matrices, double* weights, double* lengths,
                      int64_t* count) try {
  Work work;
  Motion motion{*chain,     *links,      *path,    (chain->nodes + LANES - 1) / LANES * LANES,
                work.nodes, work.bodies, work.rho, work.chord,
                work.span,  work.fuzz,   work.fit};
  if (!motion.begin(*extents, &body, 1)) return 2;
  motion.need_none();
  motion.need(body);
  motion.centre(*piece);
  const Body& lever = motion.stand(body, 0);
  int64_t node = links->range(body, NODE);
  lengths[1] = lever.slack;
  lengths[2] = lever.sweep;
  double kappa;
  if (rational) {
    RationalLink link = rational_link(motion, body);
    *count = int64_t(link.weights.size());
    if (*count <= room_for) {
      std::copy(link.matrices.begin(), link.matrices.end(), matrices);
      std::copy(link.weights.begin(), link.weights.end(), weights);
    }
    lengths[0] = link.error;
    lengths[3] = link.sound;
    kappa = link.kappa;
  } else {
    motion.build();
    const Controls& points = motion.controls(node);
    *count = CONTROLS;
    double binomial = 1.0;
    for (int i = 0; i < CONTROLS && *count <= room_for; i++) {
      weights[i] = binomial;
      binomial = binomial * (CONTROLS - 1 - i) / (i + 1);
      for (int e = 0; e < 12; e++) matrices[12 * i + e] = points.entry[3 * (e % 4) + e / 4][i];
    }
    lengths[0] = motion.fit_error(body);
    lengths[3] = motion.nodes[node].sound;
    kappa = motion.nodes[node].growth.kappa;
  }
  lengths[0] += chain_margin(chain->depth[node], kappa, lever.reach);
  return 0;
} catch (const std::bad_alloc&) {
  return 1;
}

// Say which pairs (Q, 2) touch at the path's first instant.
int guard_touching(const Chain* chain, const Solids* links, const Solids* obstacles,
                   const Path* path, const int64_t* pairs, int64_t count,
                   unsigned char* touch) try {
  std::vector<double> poses(POSE * (chain->nodes + 1), 0.0);
  double* root = poses.data() + POSE * chain->nodes;
  root[0] = root[5] = root[10] = 1.0;
  for (int64_t j = 0; j < chain->nodes; j++) {
    double local[POSE], d[TERMS];
    restrict_to(path->coefficients + j * TERMS, 0.0, 1.0, d);
    turn(*chain, j, d[0], local);
    int64_t up = chain->parent[j];
    compose(up < 0 ? root : poses.data() + POSE * up, local, poses.data() + POSE * j);
  }
  for (int64_t i = 0; i < count; i++) {
    int64_t b = pairs[2 * i], o = pairs[2 * i + 1], node = links->range(b, NODE);
    double balls = links->length(b, BALL) + obstacles->length(o, BALL);
    double up[3] = {0.0, 0.0, 1.0};
    Search found;
    Found state = gjk(up, Standing{node < 0 ? root : poses.data() + POSE * node}, *links, b,
                      *obstacles, o, balls, false, 1e-9, ROUNDS, found);
    touch[i] = state == Found::OVERLAP || found.distance <= balls;
  }
  return 0;
} catch (const std::bad_alloc&) {
  return 1;
}

}  // extern "C"
