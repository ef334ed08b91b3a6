#pragma once

// Poses of cameras, their angles and distances, and random ones.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "assets/camera.hpp"

namespace cumulet::test {

/// Uniformly distributed numbers and vectors. Every instance gives the same ones.
class UniformRandom {
 public:
  double operator()(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  glm::dvec3 vector(double size) { return {(*this)(-size, size), (*this)(-size, size), (*this)(-size, size)}; }

 private:
  std::mt19937_64 engine_{7};
};

inline viewer::CameraPose pose_at(const glm::dvec3& eye, const glm::dvec3& target = glm::dvec3(0.0)) {
  viewer::CameraPose pose;
  pose.eye = eye;
  pose.target = target;
  return pose;
}

inline viewer::CameraPose random_pose(UniformRandom& random) {
  viewer::CameraPose pose = pose_at(random.vector(20.0), random.vector(20.0));
  pose.up = glm::normalize(random.vector(1.0));
  pose.fovy_degrees = random(5.0, 140.0);
  return pose;
}

inline double angle(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

inline double distance(const viewer::CameraPose& pose) { return glm::length(pose.target - pose.eye); }

inline glm::dvec3 forward(const viewer::CameraPose& pose) { return glm::normalize(pose.target - pose.eye); }

inline double elevation(const viewer::CameraPose& pose) {
  return std::asin(glm::dot(glm::normalize(pose.eye - pose.target), glm::normalize(pose.up)));
}

inline void expect_near(const glm::dvec3& a, const glm::dvec3& b, double tolerance) {
  EXPECT_LE(glm::length(a - b), tolerance)
      << a.x << " " << a.y << " " << a.z << " against " << b.x << " " << b.y << " " << b.z;
}

/// Projects a world point with the matrices to image coordinates (-1 to 1) and window depth.
inline glm::dvec3 project(const viewer::Camera& camera, const glm::dvec3& p, double aspect,
                          viewer::ClipDepth clip = viewer::ClipDepth::zero_to_one) {
  glm::dmat4 view;
  glm::dmat4 projection;
  camera.matrices(aspect, clip, view, projection);
  const glm::dvec4 c = projection * view * glm::dvec4(p, 1.0);
  const double depth = c.z / c.w;
  return {c.x / c.w, c.y / c.w, clip == viewer::ClipDepth::zero_to_one ? depth : 0.5 * depth + 0.5};
}

/// The largest image coordinate of the corners of the box, from 0 at the center to 1 at the edges.
inline double widest(const viewer::Camera& camera, const viewer::Bounds& box, double aspect) {
  double wide = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p((corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                       (corner & 4) != 0 ? box.max.z : box.min.z);
    const glm::dvec3 at = project(camera, p, aspect);
    wide = std::max({wide, std::abs(at.x), std::abs(at.y)});
    EXPECT_GE(at.z, 0.0);
    EXPECT_LE(at.z, 1.0);
  }
  return wide;
}

}  // namespace cumulet::test
