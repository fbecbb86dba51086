// Where the links are on a spline, how far they can get in a span of time, and coal's answers there.

#pragma once

#include <coal/collision.h>
#include <coal/distance.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "model.hpp"

// The spline of a trajectory: joint j of segment i is at sum_k c[k] u^k, u in s from its start.
struct Spline {
  int joints, segments;
  const double* knots;
  const double* coefficients;

  const double* at(int segment) const { return coefficients + 4 * joints * segment; }
  double length(int segment) const { return knots[segment + 1] - knots[segment]; }
};

// A span of time of one segment and the pairs that may come into contact in it.
struct Span {
  int segment;
  double begin, end;
  std::vector<int> pairs;
};

// Places all links at a configuration.
inline void forward(Checker& checker, const double* q) {
  checker.poses.resize(checker.links.size());
  for (std::size_t i = 0; i < checker.links.size(); i++) {
    const Link& link = checker.links[i];
    const Pose above = link.parent >= 0 ? checker.poses[link.parent] : Pose();
    Pose& pose = checker.poses[i];
    pose.R = above.R * link.origin.R;
    pose.p = above.p + above.R * link.origin.p;
    if (link.type == REVOLUTE) {
      pose.R = pose.R * Eigen::AngleAxisd(q[link.joint], link.axis).toRotationMatrix();
    }
  }
}

inline void evaluate(const Spline& spline, int segment, double u, double* q) {
  const double* c = spline.at(segment);
  for (int j = 0; j < spline.joints; j++, c += 4) {
    q[j] = c[0] + u * (c[1] + u * (c[2] + u * c[3]));
  }
}

// Bounds each joint's path over a span: largest speed (exact for a cubic) times duration.
inline void path_lengths(const Spline& spline, int segment, double begin, double end,
                         double* lengths) {
  const double* c = spline.at(segment);
  for (int j = 0; j < spline.joints; j++, c += 4) {
    const auto speed = [c](double u) { return std::fabs(c[1] + u * (2 * c[2] + 3 * u * c[3])); };
    double fastest = std::max(speed(begin), speed(end));
    if (c[3] != 0) {
      const double u = -c[2] / (3 * c[3]);
      if (u > begin && u < end) fastest = std::max(fastest, speed(u));
    }
    lengths[j] = fastest * (end - begin) * (1 + 1e-12);
  }
}

// Bounds how far the points of each link get from where they are while the joints travel the
// given paths: per joint, the distance of the link from its axis, as it is now and may become.
inline void drifts(const Checker& checker, const double* lengths, std::vector<double>& drift) {
  drift.assign(checker.links.size(), 0.0);
  for (std::size_t i = 0; i < checker.links.size(); i++) {
    const Link& link = checker.links[i];
    if (!link.shape) continue;
    const Vector center = checker.poses[i].p + checker.poses[i].R * link.box.center;
    for (std::size_t k = 0; k < link.movers.size(); k++) {
      const Link& mover = checker.links[link.movers[k]];
      const Pose& pose = checker.poses[link.movers[k]];
      const Vector axis = pose.R * mover.axis;
      const Vector arm = center - pose.p;
      const double across = (arm - axis * axis.dot(arm)).norm() + link.radius;
      drift[i] += std::min(link.reach[k], across + drift[i]) * lengths[mover.joint];
    }
  }
}

// Queries at the configuration of the last forward().

inline double outside(const Vector& between, const Vector& first, const Vector& second) {
  return (between.cwiseAbs() - first - second).cwiseMax(0).norm();
}

// Bounds a pair's distance from below by boxes aligned with the world, the obstacle and the link.
inline double box_distance(const Checker& checker, int pair) {
  const Link& link = checker.links[checker.pairs[pair].first];
  const Obstacle& obstacle = checker.obstacles[checker.pairs[pair].second];
  const Pose& pose = checker.poses[checker.pairs[pair].first];
  const Vector center = pose.p + pose.R * link.box.center;
  const double in_world =
      outside(center - (obstacle.low + obstacle.high) * 0.5, pose.R.cwiseAbs() * link.box.half,
              (obstacle.high - obstacle.low) * 0.5);
  const Matrix R = obstacle.pose.R.transpose() * pose.R;
  const double in_obstacle =
      outside(obstacle.pose.R.transpose() * (center - obstacle.pose.p) - obstacle.box.center,
              R.cwiseAbs() * link.box.half, obstacle.box.half);
  const Vector other = obstacle.pose.p + obstacle.pose.R * obstacle.box.center;
  const double in_link = outside(pose.R.transpose() * (other - center), link.box.half,
                                 R.transpose().cwiseAbs() * obstacle.box.half);
  return std::max({in_world, in_obstacle, in_link});
}

inline coal::Transform3s placed(const Pose& pose) {
  return coal::Transform3s(pose.R, pose.p);
}

// Returns a pair's distance; of an overlap the negative depth if signed_ is set.
inline double distance(Checker& checker, int pair, bool signed_) {
  const auto [link, obstacle] = checker.pairs[pair];
  checker.queries++;
  checker.distance_request.enable_signed_distance = signed_;
  checker.distance_request.cached_gjk_guess = checker.guesses[pair];
  coal::DistanceResult result;
  const double d =
      coal::distance(checker.links[link].shape.get(), placed(checker.poses[link]),
                     checker.obstacles[obstacle].shape.get(), checker.obstacles[obstacle].placed,
                     checker.distance_request, result);
  checker.guesses[pair] = result.cached_gjk_guess;
  return d;
}

inline bool collide(Checker& checker, int pair) {
  const auto [link, obstacle] = checker.pairs[pair];
  checker.queries++;
  coal::CollisionResult result;
  return coal::collide(checker.links[link].shape.get(), placed(checker.poses[link]),
                       checker.obstacles[obstacle].shape.get(), checker.obstacles[obstacle].placed,
                       checker.collision_request, result) > 0;
}
