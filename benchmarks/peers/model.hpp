// A robot and its scene for coal, and how they are read from text.

#pragma once

#include <coal/collision_data.h>
#include <coal/shape/convex.h>

#include <Eigen/Dense>
#include <algorithm>
#include <istream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

using Vector = Eigen::Vector3d;
using Matrix = Eigen::Matrix3d;
using Shape = std::shared_ptr<coal::ShapeBase>;

constexpr int REVOLUTE = 1;

struct Pose {
  Matrix R = Matrix::Identity();
  Vector p = Vector::Zero();
};

// An axis-aligned box in the frame of its body.
struct Bounds {
  Vector center = Vector::Zero();
  Vector half = Vector::Zero();
};

// A link and the joint that carries it.
struct Link {
  int parent = -1;
  int type = 0;
  int joint = -1;
  Pose origin;
  Vector axis;
  Shape shape;
  Bounds box;
  double radius = 0.0;        // of a ball about the box's center
  std::vector<int> movers;    // links whose revolute joints move this one, the nearest first
  std::vector<double> reach;  // per mover: farthest distance of a point from its axis, any pose
};

struct Obstacle {
  Shape shape;
  Pose pose;
  coal::Transform3s placed;
  Bounds box;
  Vector low, high;  // in the root frame
};

struct Checker {
  std::vector<Link> links;
  std::vector<Obstacle> obstacles;
  std::vector<std::pair<int, int>> pairs;
  int joints = 0;

  std::vector<Pose> poses;      // of the links at the configuration looked at
  std::vector<Vector> guesses;  // per pair, the search direction that was last
  coal::DistanceRequest distance_request;
  coal::CollisionRequest collision_request;
  long queries = 0;

  Checker() {
    distance_request.gjk_initial_guess = coal::GJKInitialGuess::CachedGuess;
    collision_request.num_max_contacts = 1;
  }
};

inline Vector read_vector(std::istream& in) {
  Vector v;
  in >> v[0] >> v[1] >> v[2];
  return v;
}

inline Pose read_pose(std::istream& in) {
  Pose pose;
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) in >> pose.R(i, j);
    in >> pose.p[i];
  }
  return pose;
}

// Reads "none", "box" with its size, or "hull" with its vertices and triangles.
inline Shape read_shape(std::istream& in, std::vector<Vector>& vertices) {
  std::string kind;
  in >> kind;
  if (kind == "none") return nullptr;
  if (kind == "box") {
    const Vector size = read_vector(in);
    for (int i = 0; i < 8; i++) {
      const Vector corner(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
      vertices.push_back(corner.cwiseProduct(size));
    }
    return std::make_shared<coal::Box>(size[0], size[1], size[2]);
  }
  int count;
  in >> count;
  auto points = std::make_shared<std::vector<coal::Vec3s>>();
  for (int i = 0; i < count; i++) {
    vertices.push_back(read_vector(in));
    points->push_back(vertices.back());
  }
  in >> count;
  auto triangles = std::make_shared<std::vector<coal::Triangle>>();
  for (int i = 0; i < count; i++) {
    std::size_t a, b, c;
    in >> a >> b >> c;
    triangles->emplace_back(a, b, c);
  }
  return std::make_shared<coal::Convex<coal::Triangle>>(points, points->size(), triangles,
                                                        triangles->size());
}

inline Bounds bounds_of(const std::vector<Vector>& vertices) {
  Vector low = vertices[0], high = vertices[0];
  for (const Vector& v : vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  return {(low + high) / 2, (high - low) / 2};
}

// Notes which joints move a link and how far its points can be from their axes: for its own joint
// the distance from the axis, for those above the sum of the offsets between.
inline void find_reach(Checker& checker, int index, const std::vector<Vector>& vertices) {
  Link& link = checker.links[index];
  double farthest = 0.0, across = 0.0;
  for (const Vector& v : vertices) {
    farthest = std::max(farthest, v.norm());
    across = std::max(across, (v - link.axis * link.axis.dot(v)).norm());
  }
  if (link.type == REVOLUTE) {
    link.movers.push_back(index);
    link.reach.push_back(across);
  }
  for (int k = index; checker.links[k].parent >= 0;) {
    farthest += checker.links[k].origin.p.norm();
    k = checker.links[k].parent;
    if (checker.links[k].type == REVOLUTE) {
      link.movers.push_back(k);
      link.reach.push_back(farthest);
    }
  }
}

inline void read_links(Checker& checker, std::istream& in, std::vector<char>& checked) {
  int count;
  in >> count >> checker.joints;
  checker.links.resize(count);
  for (int i = 0; i < count; i++) {
    Link& link = checker.links[i];
    int is_checked;
    in >> link.parent >> link.type >> link.joint >> is_checked;
    link.origin = read_pose(in);
    link.axis = read_vector(in);
    std::vector<Vector> vertices;
    link.shape = read_shape(in, vertices);
    checked.push_back(link.shape && is_checked);
    if (link.shape) {
      link.box = bounds_of(vertices);
      for (const Vector& v : vertices) {
        link.radius = std::max(link.radius, (v - link.box.center).norm());
      }
      link.shape->computeLocalAABB();
    }
    find_reach(checker, i, vertices);
  }
}

inline void read_obstacles(Checker& checker, std::istream& in) {
  int count;
  in >> count;
  checker.obstacles.resize(count);
  for (Obstacle& obstacle : checker.obstacles) {
    obstacle.pose = read_pose(in);
    std::vector<Vector> vertices;
    obstacle.shape = read_shape(in, vertices);
    obstacle.shape->computeLocalAABB();
    obstacle.placed = coal::Transform3s(obstacle.pose.R, obstacle.pose.p);
    obstacle.box = bounds_of(vertices);
    for (Vector& v : vertices) v = obstacle.pose.p + obstacle.pose.R * v;
    const Bounds world = bounds_of(vertices);
    obstacle.low = world.center - world.half;
    obstacle.high = world.center + world.half;
  }
}
