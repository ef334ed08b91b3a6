// The camera: consistency of its matrices, rays and depths, its operations, and the mouse navigation styles.

#include "viewer/camera.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "cumulet/cumulet.h"
#include "viewer/navigation.hpp"

namespace {

using cumulet::viewer::AxisView;
using cumulet::viewer::Bounds;
using cumulet::viewer::Camera;
using cumulet::viewer::CameraPose;
using cumulet::viewer::ClipDepth;
using cumulet::viewer::DepthConvention;
using cumulet::viewer::InputEvent;
using cumulet::viewer::Navigation;
using cumulet::viewer::NavigationSettings;
using cumulet::viewer::NavigationStyle;
using cumulet::viewer::Subject;
using cumulet::viewer::ViewFrame;
using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr ClipDepth both_clips[] = {ClipDepth::negative_one_to_one, ClipDepth::zero_to_one};

class Random {
 public:
  double operator()(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  dvec3 vector(double size) { return {(*this)(-size, size), (*this)(-size, size), (*this)(-size, size)}; }

 private:
  std::mt19937_64 engine_{7};
};

CameraPose pose_at(const dvec3& eye, const dvec3& target = dvec3(0.0)) {
  CameraPose pose;
  pose.eye = eye;
  pose.target = target;
  return pose;
}

CameraPose random_pose(Random& random) {
  CameraPose pose = pose_at(random.vector(20.0), random.vector(20.0));
  pose.up = glm::normalize(random.vector(1.0));
  pose.fovy_degrees = random(5.0, 140.0);
  return pose;
}

double angle(const dvec3& a, const dvec3& b) { return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)); }

double distance(const CameraPose& pose) { return glm::length(pose.target - pose.eye); }

dvec3 forward(const CameraPose& pose) { return glm::normalize(pose.target - pose.eye); }

double elevation(const CameraPose& pose) {
  return std::asin(glm::dot(glm::normalize(pose.eye - pose.target), glm::normalize(pose.up)));
}

void expect_near(const dvec3& a, const dvec3& b, double tolerance) {
  EXPECT_LE(glm::length(a - b), tolerance)
      << a.x << " " << a.y << " " << a.z << " against " << b.x << " " << b.y << " " << b.z;
}

/// Projects a world point with the matrices to image coordinates (-1 to 1) and window depth.
dvec3 project(const Camera& camera, const dvec3& p, double aspect, ClipDepth clip = ClipDepth::zero_to_one) {
  dmat4 view;
  dmat4 projection;
  camera.matrices(aspect, clip, view, projection);
  const dvec4 c = projection * view * dvec4(p, 1.0);
  const double depth = c.z / c.w;
  return {c.x / c.w, c.y / c.w, clip == ClipDepth::zero_to_one ? depth : 0.5 * depth + 0.5};
}

/// Unprojects points of the whole view volume with the inverse matrices. They lie on the frame's rays at the frame's
/// depth.
void expect_frame_agrees(Camera& camera, double aspect, Random& random, double tolerance = 1e-9) {
  const ViewFrame frame = camera.view(aspect, std::nullopt);
  for (const ClipDepth clip : both_clips) {
    dmat4 view;
    dmat4 projection;
    camera.matrices(aspect, clip, view, projection);
    const dmat4 back = glm::inverse(projection * view);
    for (int i = 0; i < 50; ++i) {
      const double depth = random(0.02, 0.98);
      const dvec2 xy(random(-1.0, 1.0), random(-1.0, 1.0));
      const dvec4 q = back * dvec4(xy, clip == ClipDepth::zero_to_one ? depth : 2.0 * depth - 1.0, 1.0);
      const dvec3 p = dvec3(q) / q.w;
      const dvec3 aside = xy.x * frame.right + xy.y * frame.up;
      const dvec3 origin = frame.orthographic ? frame.eye + aside : frame.eye;
      const dvec3 way = frame.orthographic ? frame.forward : frame.forward + aside;
      const double z = glm::dot(p - origin, way) / glm::dot(way, way);
      ASSERT_GT(z, 0.0);
      EXPECT_LE(glm::length(origin + z * way - p), tolerance * (glm::length(p) + glm::length(origin)));
      EXPECT_NEAR(frame.depth_a + (frame.orthographic ? frame.depth_b * z : frame.depth_b / z), depth, tolerance * 100);
    }
  }
}

// ---- Matrices, rays, depths

TEST(Camera, RaysAndDepthsAgreeWithTheMatricesOfEveryPose) {
  Random random;
  for (int i = 0; i < 200; ++i) {
    CameraPose pose = random_pose(random);
    if (i % 2 == 1) pose.orthographic_height = random(0.1, 50.0);
    if (i % 4 >= 2) pose.depth = DepthConvention::reversed;
    if (i % 8 >= 4) {
      pose.near_plane = random(0.01, 2.0);
      pose.far_plane = random(3.0, 100.0);
    }
    if (i % 16 == 13) pose.near_plane = -5.0;  // orthographic: behind the eye
    if (i % 10 == 9) pose.up = pose.target - pose.eye;
    Camera camera(pose);
    expect_frame_agrees(camera, random(0.3, 3.0), random);
  }
}

TEST(Camera, FrameIsSymmetricWithTheAxisOfLengthOne) {
  Random random;
  for (int i = 0; i < 20; ++i) {
    const CameraPose pose = random_pose(random);
    Camera camera(pose);
    const ViewFrame frame = camera.view(1.5, std::nullopt);
    expect_near(frame.forward, forward(pose), 1e-12);
    expect_near(frame.eye, pose.eye, 0.0);
    EXPECT_NEAR(glm::length(frame.up), std::tan(pose.fovy_degrees * pi / 360.0), 1e-9);
    EXPECT_NEAR(glm::length(frame.right), 1.5 * glm::length(frame.up), 1e-9);
    EXPECT_GT(glm::dot(frame.up, pose.up), 0.0);
    EXPECT_GT(glm::dot(glm::cross(frame.right, frame.up), -frame.forward), 0.0);
  }
}

TEST(Camera, DepthMatchesTheFormulaInTheHeader) {
  const double n = 0.5;
  const double f = 80.0;
  const double z = 7.0;
  const double expected = f * (z - n) / (z * (f - n));
  for (const bool reversed : {false, true}) {
    CameraPose pose = pose_at({0, 0, 10});
    pose.near_plane = n;
    pose.far_plane = f;
    pose.depth = reversed ? DepthConvention::reversed : DepthConvention::standard;
    for (const ClipDepth clip : both_clips) {
      EXPECT_NEAR(project(Camera(pose), {0.3, 0.2, 3}, 1.0, clip).z, reversed ? 1.0 - expected : expected, 1e-12);
    }
    pose.near_plane = pose.far_plane = 0.0;  // defaults: 0.1 and infinite
    EXPECT_NEAR(project(Camera(pose), {0, 0, 3}, 1.0).z, reversed ? 0.1 / z : 1.0 - 0.1 / z, 1e-12);
    pose.orthographic_height = 2.0;  // defaults: 0 and 2000
    EXPECT_NEAR(project(Camera(pose), {0, 0, 3}, 1.0).z, reversed ? 1.0 - z / 2000.0 : z / 2000.0, 1e-12);
  }
}

TEST(Camera, NearPlaneBeyondTheSceneIsHandled) {
  for (const double height : {0.0, 4.0}) {
    CameraPose pose = pose_at({0, 0, 0.01});
    pose.orthographic_height = height;
    pose.near_plane = 1e6;  // beyond the default far plane of an orthographic camera
    Camera camera(pose);
    Random random;
    expect_frame_agrees(camera, 1.3, random, 1e-7);
    camera.orbit(0.4, 0.2);
    camera.dolly(0.5);
    camera.frame({dvec3(-1), dvec3(1)}, 1.0);
    EXPECT_LE(std::abs(project(camera, {1, 1, 1}, 1.0).x), 1.0);
  }
  CameraPose pose = pose_at({0, 0, 10});
  pose.near_plane = -3.0;  // the near plane of an orthographic camera, now perspective
  EXPECT_NEAR(project(Camera(pose), {0, 0, 9}, 1.0).z, 0.9, 1e-12);
}

struct HostProjection {
  const char* name;
  dmat4 matrix;
  ClipDepth clip;
  bool reversed;
  bool orthographic = false;
};

std::vector<HostProjection> host_projections() {
  const auto no = ClipDepth::negative_one_to_one;
  const auto zo = ClipDepth::zero_to_one;
  const dmat4 stereo = glm::translate(dmat4(1.0), dvec3(0.03, -0.02, -0.4));
  dmat4 reversed_infinite(0.0);  // as engines use it
  reversed_infinite[0][0] = 1.2;
  reversed_infinite[1][1] = 1.7;
  reversed_infinite[2][3] = -1.0;
  reversed_infinite[3][2] = 0.2;
  dmat4 flipped = glm::perspective(0.8, 1.4, 0.1, 50.0);
  flipped[1][1] = -flipped[1][1];
  return {
      {"perspectiveNO", glm::perspectiveRH_NO(0.8, 1.4, 0.1, 50.0), no, false},
      {"perspectiveZO", glm::perspectiveRH_ZO(0.8, 1.4, 0.1, 50.0), zo, false},
      {"single precision", dmat4(glm::perspectiveRH_NO(0.8F, 1.4F, 0.1F, 50.0F)), no, false},
      {"left-handed", glm::perspectiveLH_ZO(0.8, 1.4, 0.1, 50.0), zo, false},
      {"flipped", flipped, no, false},
      {"scaled", 3.0 * glm::perspectiveRH_NO(0.8, 1.4, 0.1, 50.0), no, false},
      {"frustumNO", glm::frustumRH_NO(-0.05, 0.2, -0.11, 0.07, 0.1, 50.0), no, false},
      {"frustumZO", glm::frustumRH_ZO(-0.05, 0.2, -0.11, 0.07, 0.1, 50.0), zo, false},
      {"stereo", glm::frustumRH_NO(-0.05, 0.2, -0.11, 0.07, 0.1, 50.0) * stereo, no, false},
      {"infinite", glm::infinitePerspective(0.8, 1.4, 0.1), no, false},
      {"tweaked infinite", glm::tweakedInfinitePerspective(0.8, 1.4, 0.1), no, false},
      {"reversed ZO", glm::perspectiveRH_ZO(0.8, 1.4, 50.0, 0.1), zo, true},
      {"reversed NO", glm::perspectiveRH_NO(0.8, 1.4, 50.0, 0.1), no, true},
      {"reversed infinite", reversed_infinite, zo, true},
      {"orthoNO", glm::orthoRH_NO(-3.0, 4.0, -1.0, 2.0, 0.5, 40.0), no, false, true},
      {"orthoZO", glm::orthoRH_ZO(-3.0, 3.0, -2.0, 2.0, -10.0, 40.0), zo, false, true},
      {"ortho of far 0", glm::orthoRH_ZO(-3.0, 3.0, -2.0, 2.0, -10.0, 0.0), zo, false, true},
      {"ortho reversed", glm::orthoRH_ZO(-3.0, 3.0, -2.0, 2.0, 40.0, 0.5), zo, true, true},
      {"ortho scaled", 0.2 * glm::orthoRH_NO(-3.0, 4.0, -1.0, 2.0, 0.5, 40.0), no, false, true},
  };
}

TEST(CameraMatrices, HostMatricesRoundTripWithTheirRaysAndDepths) {
  Random random;
  const dmat4 view = glm::lookAt(dvec3(3, 4, 5), dvec3(0.5, 0, 0), dvec3(0, 1, 0));
  for (const HostProjection& host : host_projections()) {
    SCOPED_TRACE(host.name);
    Camera camera(pose_at({0, 0, 10}));
    camera.set_matrices(view, host.matrix, host.clip);
    dmat4 v;
    dmat4 p;
    camera.matrices(9.0, host.clip, v, p);
    EXPECT_EQ(v, view);
    EXPECT_EQ(p, host.matrix);
    expect_frame_agrees(camera, 9.0, random);
    EXPECT_EQ(camera.view(1.0, std::nullopt).orthographic, host.orthographic);
    EXPECT_EQ(camera.pose().depth == DepthConvention::reversed, host.reversed);
  }
}

TEST(CameraMatrices, MatricesOfAnyPoseAreAcceptedAndShowTheSameView) {
  Random random;
  for (int i = 0; i < 100; ++i) {
    CameraPose pose = random_pose(random);
    if (i % 2 == 1) pose.orthographic_height = random(0.1, 50.0);
    if (i % 4 >= 2) pose.depth = DepthConvention::reversed;
    const ClipDepth clip = both_clips[i % 8 / 4];
    Camera camera(pose);
    dmat4 view;
    dmat4 projection;
    camera.matrices(1.6, clip, view, projection);
    const ViewFrame before = camera.view(1.6, std::nullopt);
    camera.set_matrices(view, projection, clip);
    const ViewFrame after = camera.view(1.6, std::nullopt);
    expect_near(after.eye, before.eye, 1e-9);
    expect_near(after.forward, before.forward, 1e-9);
    expect_near(after.right, before.right, 1e-9 * glm::length(before.right));
    expect_near(after.up, before.up, 1e-9 * glm::length(before.up));
    EXPECT_NEAR(after.depth_a, before.depth_a, 1e-12);
    EXPECT_NEAR(after.depth_b, before.depth_b, 1e-12);
    // The nearest pose is the one that the matrices were made from.
    const CameraPose again = camera.pose();
    expect_near(again.eye, pose.eye, 1e-6);
    expect_near(again.target, pose.target, 1e-6);
    expect_near(again.up, pose.up, 1e-9);
    EXPECT_NEAR(again.fovy_degrees, pose.fovy_degrees, 1e-9);
    EXPECT_NEAR(again.orthographic_height, pose.orthographic_height, 1e-9);
    EXPECT_EQ(again.depth, pose.depth);
  }
}

TEST(CameraMatrices, NearestPoseKeepsPlanesCenterAndLevelHorizon) {
  Camera camera(pose_at({0, 0, 10}, {0, 1, 0}));
  // Single precision, off axis: when an operation switches to a pose, the point in the image's center stays there.
  const glm::mat4 view = glm::lookAt(glm::vec3(6, 5, 4), glm::vec3(0, 1, 0), glm::vec3(0, 1, 0));
  camera.set_matrices(dmat4(view), glm::frustumRH_NO(-0.05, 0.2, -0.11, 0.07, 0.1, 50.0),
                      ClipDepth::negative_one_to_one);
  const ViewFrame off_axis = camera.view(1.0, std::nullopt);
  const CameraPose pose = camera.pose();
  EXPECT_LT(angle(forward(pose), off_axis.forward), 1e-6);
  EXPECT_NEAR(pose.near_plane, 0.1, 1e-9);
  EXPECT_NEAR(pose.far_plane, 50.0, 1e-6);
  // A level view: orbits continue about +Y at the old target's distance.
  camera.set_matrices(dmat4(view), glm::infinitePerspective(0.8, 1.4, 0.3), ClipDepth::negative_one_to_one);
  EXPECT_EQ(camera.pose().up, dvec3(0, 1, 0));
  EXPECT_NEAR(camera.pose().near_plane, 0.3, 1e-9);
  EXPECT_EQ(camera.pose().far_plane, 0.0);
  expect_near(camera.pose().target, {0, 1, 0}, 1e-5);
  camera.orbit(0.5, 0.0);
  EXPECT_NEAR(camera.pose().eye.y, 5.0, 1e-5);
  EXPECT_NEAR(distance(camera.pose()), glm::length(dvec3(6, 4, 4)), 1e-5);
  // A rolled view sets its own up vector.
  const dmat4 rolled = glm::rotate(dmat4(1.0), 0.3, dvec3(0, 0, 1)) * dmat4(view);
  camera.set_matrices(rolled, glm::infinitePerspective(0.8, 1.4, 0.3), ClipDepth::negative_one_to_one);
  const CameraPose leaning = camera.pose();
  expect_near(leaning.up, glm::normalize(dvec3(glm::transpose(rolled)[1])), 1e-5);
  // A mirrored projection keeps the sign of the up vector.
  dmat4 flipped = glm::perspective(0.8, 1.4, 0.1, 50.0);
  flipped[1][1] = -flipped[1][1];
  camera.set_matrices(rolled, flipped, ClipDepth::negative_one_to_one);
  expect_near(camera.pose().up, leaning.up, 1e-5);
}

TEST(CameraMatrices, TargetIsKeptWhileTheHostRotatesTheView) {
  Camera camera(pose_at({0, 0, 10}, {0, 0, 1}));
  const dmat4 projection = glm::infinitePerspective(0.8, 1.4, 0.3);
  const dvec3 target(0, 0, 1);
  const std::pair<dvec3, dvec3> views[] = {// eye and target
                                           {{0, 0, 10}, {9, 0, 10}},
                                           {{5, 0, 10}, {5, 3, 90}},
                                           {{-5, 2, -10}, {-9, 2, -10}},
                                           {{0, 0, 10}, {0, 0, -7}}};
  for (const auto& [eye, at] : views) {
    camera.set_matrices(glm::lookAt(eye, at, dvec3(0, 1, 0)), projection, ClipDepth::negative_one_to_one);
    EXPECT_NEAR(distance(camera.pose()), glm::length(target - eye), 1e-9);
  }
  expect_near(camera.pose().target, {0, 0, 1}, 1e-9);
}

TEST(CameraMatrices, TargetComesFromTheFirstBoundsAfterSetMatrices) {
  Camera camera;
  const dmat4 view = glm::lookAt(dvec3(0, 0, 50), dvec3(0), dvec3(0, 1, 0));
  camera.set_matrices(view, glm::infinitePerspective(0.8, 1.4, 0.3), ClipDepth::negative_one_to_one);
  EXPECT_EQ(camera.view(1.4, std::nullopt).eye, dvec3(0, 0, 50));
  const Bounds box{dvec3(2, -1, -1), dvec3(4, 1, 9)};
  EXPECT_EQ(camera.view(1.4, box).eye, dvec3(0, 0, 50));
  expect_near(camera.pose().target, {0, 0, 50 - std::hypot(46, 3)}, 1e-9);
  static_cast<void>(camera.view(1.4, Bounds{dvec3(0), dvec3(1)}));  // only once
  expect_near(camera.pose().target, {0, 0, 50 - std::hypot(46, 3)}, 1e-9);
}

std::string refusal(const dmat4& view, const dmat4& projection) {
  Camera camera(pose_at({1, 2, 3}));
  std::string why;
  try {
    camera.set_matrices(view, projection, ClipDepth::negative_one_to_one);
  } catch (const cumulet::Error& error) {
    EXPECT_EQ(error.code(), cumulet::ErrorCode::invalid_argument);
    why = error.what();
  }
  EXPECT_EQ(why.empty(), camera.revision() != 1);
  EXPECT_EQ(why.empty(), camera.pose() != pose_at({1, 2, 3}));
  EXPECT_EQ(why.find('\n'), std::string::npos);
  return why;
}

TEST(CameraMatrices, InvalidViewOrProjectionIsRejected) {
  const dmat4 view = glm::lookAt(dvec3(3, 4, 5), dvec3(0), dvec3(0, 1, 0));
  const dmat4 projection = glm::perspective(0.8, 1.4, 0.1, 50.0);
  const auto with = [](dmat4 m, int column, int row, double value) {
    m[column][row] = value;
    return m;
  };
  EXPECT_EQ(refusal(view, projection), "");
  EXPECT_EQ(refusal(glm::translate(dmat4(1.0), dvec3(1, 2, 3)), projection), "");
  const std::pair<dmat4, const char*> views[] = {
      {with(view, 0, 0, NAN), "view matrix has entries that are not finite"},
      {with(view, 3, 1, infinity), "view matrix has entries that are not finite"},
      {glm::scale(view, dvec3(2)), "scales"},
      {with(view, 1, 0, view[1][0] + 0.1), "shears"},
      {dmat4(0.0), "last row"},
      {with(dmat4(0.0), 3, 3, 1.0), "singular"},
      {glm::scale(view, dvec3(-1, 1, 1)), "mirrors"},
      {with(view, 1, 3, 0.5), "last row"},
  };
  for (const auto& [bad, why] : views) {
    EXPECT_NE(refusal(bad, projection).find(why), std::string::npos) << why << ": " << refusal(bad, projection);
  }
  const dmat4 ortho = glm::ortho(-1.0, 1.0, -1.0, 1.0, 0.0, 9.0);
  const std::pair<dmat4, const char*> projections[] = {
      {with(projection, 3, 2, NAN), "projection matrix has entries that are not finite"},
      {with(projection, 3, 2, infinity), "projection matrix has entries that are not finite"},
      {dmat4(0.0), "singular"},
      {with(projection, 0, 0, 0.0), "singular"},
      {with(projection, 1, 1, 0.0), "singular"},
      {with(projection, 3, 2, 0.0), "singular"},
      {with(projection, 2, 3, 0.0), "singular"},
      {with(projection, 1, 1, 1e-300), "singular"},
      {with(ortho, 2, 2, 0.0), "singular"},
      {with(ortho, 3, 3, 0.0), "singular"},
      {-ortho, "singular"},
      {with(projection, 0, 1, 0.1), "rotates or shears"},
      {with(projection, 0, 2, 0.1), "oblique near plane"},
      {with(projection, 0, 3, 0.1), "neither perspective nor orthographic"},
  };
  for (const auto& [bad, why] : projections) {
    EXPECT_NE(refusal(view, bad).find(why), std::string::npos) << why << ": " << refusal(view, bad);
  }
}

// ---- Fitting

double widest(const Camera& camera, const Bounds& box, double aspect) {
  double wide = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const dvec3 p((corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                  (corner & 4) != 0 ? box.max.z : box.min.z);
    const dvec3 at = project(camera, p, aspect);
    wide = std::max({wide, std::abs(at.x), std::abs(at.y)});
    EXPECT_GE(at.z, 0.0);
    EXPECT_LE(at.z, 1.0);
  }
  return wide;
}

/// Distances of the box from the image's edges as fractions of the image's shorter side: left, right, below, above.
std::array<double, 4> margins(const Camera& camera, const Bounds& box, double aspect) {
  dvec2 least(infinity);
  dvec2 most(-infinity);
  for (int corner = 0; corner < 8; ++corner) {
    const dvec3 p((corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                  (corner & 4) != 0 ? box.max.z : box.min.z);
    const dvec2 at(project(camera, p, aspect));
    least = glm::min(least, at);
    most = glm::max(most, at);
  }
  const dvec2 side = 0.5 * dvec2(aspect, 1.0) / std::min(aspect, 1.0);
  return {(least.x + 1.0) * side.x, (1.0 - most.x) * side.x, (least.y + 1.0) * side.y, (1.0 - most.y) * side.y};
}

TEST(CameraFit, MarginsAreEqualOnTheTighterAxis) {
  Random random;
  for (int i = 0; i < 200; ++i) {
    const dvec3 corner = random.vector(100.0);
    const Bounds box{corner, corner + 1.0 + glm::abs(random.vector(50.0))};
    CameraPose pose = i % 4 < 2 ? CameraPose() : random_pose(random);
    pose.fovy_degrees = i % 2 == 0 ? 40.0 : random(5.0, 80.0);
    if (i % 3 == 0) pose.orthographic_height = 1.0;
    const double aspect = random(0.2, 5.0);
    Camera camera(pose);
    if (i % 4 < 2) {
      static_cast<void>(camera.view(aspect, box));
      EXPECT_LT(angle(forward(camera.pose()), dvec3(0.0, -0.2, -1.0)), 1e-9);
    } else {
      camera.fit(box, aspect);
      EXPECT_LT(angle(forward(camera.pose()), forward(pose)), 1e-7);
    }
    EXPECT_EQ(camera.pose().orthographic_height > 0.0, i % 3 == 0);
    const auto [left, right, below, above] = margins(camera, box, aspect);
    const bool by_width = left < below;
    EXPECT_NEAR(by_width ? left : below, 0.06, 1e-9);
    EXPECT_NEAR(by_width ? right : above, 0.06, 1e-9);
    EXPECT_GT(by_width ? below : left, 0.06 - 1e-9);
    EXPECT_GT(by_width ? above : right, 0.06 - 1e-9);
  }
}

TEST(CameraFit, UsesVisibleContentNotTheBoundingBox) {
  // A ball in a larger box. `reach` is the ball's support function.
  const dvec3 centre(3, -2, 5);
  const double radius = 2.0;
  Subject subject(Bounds{dvec3(-20), dvec3(20)});
  dvec3 asked(0.0);
  subject.reach = [&](const dvec3& direction, std::span<const dvec3> normals) {
    asked = direction;
    std::vector<double> reach;
    for (const dvec3& n : normals) reach.push_back(glm::dot(centre, n) + radius * glm::length(n));
    return reach;
  };
  Random random;
  for (int i = 0; i < 50; ++i) {
    CameraPose pose = random_pose(random);
    if (i % 2 == 1) pose.orthographic_height = 1.0;
    const double aspect = random(0.3, 3.0);
    Camera camera(pose);
    camera.fit(subject, aspect);
    const CameraPose fitted = camera.pose();
    EXPECT_LT(std::abs(glm::dot(asked, forward(fitted))), 1.0 + 1e-12);
    EXPECT_GT(std::abs(glm::dot(asked, forward(fitted))), 1.0 - 1e-12);
    expect_near(fitted.target, centre, 1e-9);
    const double half = std::tan(0.5 * fitted.fovy_degrees * pi / 180.0);
    const double reach = i % 2 == 1 ? radius / (0.5 * fitted.orthographic_height)
                                    : std::tan(std::asin(radius / distance(fitted))) / half;
    EXPECT_NEAR(reach, 0.88 * std::min(aspect, 1.0), 1e-9);
    // If nothing is visible (empty reach), the camera fits the bounds.
    Subject unseen(subject.bounds);
    unseen.reach = [](const dvec3&, std::span<const dvec3>) { return std::vector<double>(); };
    camera.fit(unseen, aspect);
    Camera plain(pose);
    plain.fit(subject.bounds, aspect);
    expect_near(camera.pose().eye, plain.pose().eye, 1e-6);
  }
}

TEST(CameraShutter, ShutterPosesUseTheCamerasClipPlanesAndLens) {
  CameraPose pose = pose_at({0.0, 2.0, 9.0});
  pose.orthographic_height = 6.0;
  pose.near_plane = 2.0;
  pose.far_plane = 50.0;
  pose.lens_radius = 0.5;
  pose.focus_distance = 7.0;
  Camera camera;
  camera.set(pose);
  CameraPose open = pose_at({1.0, 2.0, 9.0});
  open.orthographic_height = 6.0;
  open.lens_radius = 0.1;
  camera.set_shutter(open, std::nullopt);
  const ViewFrame now = camera.view(1.0, std::nullopt);
  const auto ends = camera.ends(1.0, now);
  ASSERT_TRUE(ends);
  EXPECT_EQ(ends->close, now);
  Camera there;
  CameraPose same = pose;
  same.eye = open.eye;
  same.target = open.target;
  there.set(same);
  EXPECT_EQ(ends->open, there.view(1.0, std::nullopt));
}

TEST(CameraShutter, ShutterPosesSurviveFittingTheCamera) {
  Camera camera;
  const CameraPose aside = pose_at({5.0, 0.0, 9.0});
  camera.set_shutter(std::nullopt, aside);
  const Bounds subject{dvec3(-1.0), dvec3(1.0)};
  const ViewFrame now = camera.view(1.0, subject);
  EXPECT_TRUE(camera.ends(1.0, now)) << "it is the first time that it is anywhere";
  camera.orbit(0.1, 0.0);
  EXPECT_FALSE(camera.ends(1.0, camera.view(1.0, subject)));
}

TEST(CameraFit, FitIsPermanentAndIncrementsTheRevision) {
  const Bounds box{dvec3(-1), dvec3(2)};
  Camera camera;
  const ViewFrame waiting = camera.view(1.0, std::nullopt);
  EXPECT_EQ(waiting.forward, dvec3(0, 0, -1));
  EXPECT_GT(waiting.eye.z, 0.0);
  EXPECT_EQ(camera.revision(), 1U);
  // Invalid aspect ratios: the camera is not fitted yet.
  for (const double bad : {0.0, -1.0, static_cast<double>(NAN), infinity}) static_cast<void>(camera.view(bad, box));
  EXPECT_EQ(camera.revision(), 1U);
  const ViewFrame frame = camera.view(1.0, box);
  EXPECT_EQ(camera.revision(), 2U);
  EXPECT_EQ(camera.view(1.0, Bounds{dvec3(-9), dvec3(9)}), frame);
  EXPECT_EQ(camera.revision(), 2U);
  EXPECT_NEAR(widest(camera, box, 1.0), 0.88, 1e-9);
}

TEST(CameraFit, NavigationHasNoEffectBeforeThereAreBounds) {
  Camera camera;
  camera.orbit(1.0, 0.5);
  camera.look(1.0, 0.5);
  camera.roll(1.0);
  camera.pan(1.0, 1.0);
  camera.dolly(2.0);
  camera.zoom(2.0);
  camera.fly(1.0, 2.0, 3.0);
  camera.look_from(AxisView::top);
  EXPECT_EQ(camera.pose(), CameraPose());
  EXPECT_EQ(camera.revision(), 1U);
  camera.toggle_orthographic(std::nullopt);
  const Bounds box{dvec3(-1, -2, -1), dvec3(2, 5, 1)};
  EXPECT_TRUE(camera.view(1.0, box).orthographic);
  EXPECT_NEAR(widest(camera, box, 1.0), 0.88, 1e-9);
  Camera framed;
  framed.frame(box, 1.0);
  EXPECT_LT(angle(forward(framed.pose()), dvec3(0.0, -0.2, -1.0)), 1e-9);
  EXPECT_NEAR(widest(framed, box, 1.0), 1.0, 1e-9);
}

TEST(CameraFrame, FrameAllKeepsTheViewDirection) {
  Random random;
  for (int i = 0; i < 200; ++i) {
    CameraPose pose = random_pose(random);
    if (i % 2 == 1) pose.orthographic_height = random(0.1, 50.0);
    if (i % 4 >= 2) pose.near_plane = 0.5;
    const dvec3 corner = random.vector(100.0);
    const Bounds box{corner, corner + 10.0 + glm::abs(random.vector(50.0))};
    const double aspect = random(0.2, 5.0);
    Camera camera(pose);
    camera.frame(box, aspect);
    EXPECT_LT(angle(forward(camera.pose()), forward(pose)), 1e-9);
    // The target's depth in the image is that of the box's center.
    EXPECT_NEAR(glm::dot(camera.pose().target - 0.5 * (box.min + box.max), forward(pose)), 0.0, 1e-9);
    EXPECT_EQ(camera.pose().orthographic_height > 0.0, i % 2 == 1);
    double wide = 0.0;
    double nearest = infinity;
    double farthest = 0.0;
    for (int c = 0; c < 8; ++c) {
      const dvec3 p((c & 1) != 0 ? box.max.x : box.min.x, (c & 2) != 0 ? box.max.y : box.min.y,
                    (c & 4) != 0 ? box.max.z : box.min.z);
      const dvec3 at = project(camera, p, aspect);
      wide = std::max({wide, std::abs(at.x), std::abs(at.y)});
      nearest = std::min(nearest, glm::dot(p - camera.pose().eye, forward(pose)));
      farthest = std::max(farthest, glm::dot(p - camera.pose().eye, forward(pose)));
      EXPECT_TRUE(i % 2 == 0 || at.z >= 0.0);
    }
    EXPECT_LT(wide, 1.0 + 1e-9);
    // The eye's distance from the nearest corner is at least 0.02 of the box's depth. It matters only for wide angles
    // close to a corner.
    const double least = 0.02 * (farthest - nearest);
    EXPECT_TRUE(i % 2 == 1 || nearest > (1.0 - 1e-9) * least);
    EXPECT_TRUE(nearest <= (1.0 + 1e-9) * least || std::abs(wide - 1.0) < 1e-9) << wide;
  }
  // A single point: the distance stays, so the eye is never at the point.
  for (const double height : {0.0, 3.0}) {
    CameraPose pose = pose_at({0, 0, 10});
    pose.orthographic_height = height;
    Camera camera(pose);
    camera.frame({dvec3(5), dvec3(5)}, 1.0);
    expect_near(camera.pose().eye, {5, 5, 15}, 1e-9);
    EXPECT_EQ(camera.pose().orthographic_height, height);
  }
}

// ---- Operations

TEST(CameraOperations, OrbitCirclesTheTargetAboutUp) {
  Camera camera(pose_at({1, 2, 13}, {1, 2, 3}));
  camera.orbit(pi / 2, 0.0);  // from +Z to +X
  expect_near(camera.pose().eye, {11, 2, 3}, 1e-12);
  camera.orbit(-pi / 2, pi / 6);
  expect_near(camera.pose().eye, {1, 7, 3 + 10 * std::cos(pi / 6)}, 1e-12);
  EXPECT_EQ(camera.pose().target, dvec3(1, 2, 3));

  CameraPose z_up = pose_at({0, -10, 0});
  z_up.up = {0, 0, 2};
  Camera other(z_up);
  other.orbit(pi / 2, 0.0);
  expect_near(other.pose().eye, {10, 0, 0}, 1e-12);
  other.orbit(0.0, pi / 4);
  EXPECT_NEAR(other.pose().eye.z, 10 * std::sin(pi / 4), 1e-12);
  EXPECT_EQ(other.pose().up, z_up.up);
}

TEST(CameraOperations, OrbitStopsBeforeThePolesWithoutJitter) {
  for (const double side : {1.0, -1.0}) {
    Camera camera(pose_at({1000, 0, 1010}, {1000, 0, 1000}));
    camera.orbit(0.3, 0.0);
    for (int i = 0; i < 50; ++i) camera.orbit(0.0, side * 0.2);
    const CameraPose at_pole = camera.pose();
    EXPECT_GT(side * elevation(at_pole), pi / 2 - 1e-3);
    EXPECT_LT(side * elevation(at_pole), pi / 2 - 1e-6);
    const ViewFrame before = camera.view(1.0, std::nullopt);
    for (int i = 0; i < 1000; ++i) camera.orbit(0.0, side * 0.1);
    const ViewFrame after = camera.view(1.0, std::nullopt);
    EXPECT_LT(angle(before.right, after.right), 1e-6);
    EXPECT_LT(angle(before.forward, after.forward), 1e-9);
    EXPECT_NEAR(distance(camera.pose()), 10.0, 1e-9);
    // Yaw rotates the image, as elsewhere. Pitch leaves the pole on the side it came from.
    camera.orbit(0.5, 0.0);
    EXPECT_NEAR(angle(camera.view(1.0, std::nullopt).right, before.right), 0.5, 1e-6);
    camera.orbit(-0.5, -side * pi / 2);
    expect_near(camera.pose().eye, dvec3(1000, 0, 1000) + 10.0 * dvec3(std::sin(0.3), 0, std::cos(0.3)), 1e-2);
  }
  // A pose that looks exactly along `up` is left in the direction of the image's vertical axis.
  Camera down(pose_at({0, 10, 0}));
  const dvec3 right = down.view(1.0, std::nullopt).right;
  down.orbit(0.0, -0.3);
  EXPECT_LT(angle(down.view(1.0, std::nullopt).right, right), 1e-9);
  EXPECT_NEAR(elevation(down.pose()), pi / 2 - 0.3, 1e-9);
}

TEST(CameraOperations, OrbitStepsAddUp) {
  Camera once(pose_at({3, 4, 10}, {1, 0, 0}));
  Camera often(once.pose());
  once.orbit(2.0, 0.4);
  for (int i = 0; i < 10000; ++i) often.orbit(2.0 / 10000, 0.4 / 10000);
  expect_near(once.pose().eye, often.pose().eye, 1e-8);
}

TEST(CameraOperations, LookTurnsAboutTheEye) {
  Camera camera(pose_at({1, 2, 13}, {1, 2, 3}));
  camera.look(pi / 2, 0.0);  // from -Z to -X
  expect_near(camera.pose().target, {-9, 2, 13}, 1e-12);
  camera.look(-pi / 2, pi / 6);
  expect_near(camera.pose().target, {1, 7, 13 - 10 * std::cos(pi / 6)}, 1e-12);
  EXPECT_EQ(camera.pose().eye, dvec3(1, 2, 13));
  for (int i = 0; i < 100; ++i) camera.look(0.0, 0.3);
  EXPECT_NEAR(angle(forward(camera.pose()), {0, 1, 0}), 0.0, 1e-3);
  EXPECT_GT(angle(forward(camera.pose()), {0, 1, 0}), 1e-6);
  EXPECT_NEAR(distance(camera.pose()), 10.0, 1e-9);
}

TEST(CameraOperations, RollRotatesOnlyTheImage) {
  Random random;
  for (int i = 0; i < 20; ++i) {
    const CameraPose pose = i == 0 ? pose_at({0, 10, 0}) : random_pose(random);  // the first looks along up
    Camera camera(pose);
    const ViewFrame before = camera.view(1.0, std::nullopt);
    camera.roll(0.7);
    const ViewFrame after = camera.view(1.0, std::nullopt);
    EXPECT_LT(angle(after.forward, before.forward), 1e-12);
    expect_near(after.up, before.up * std::cos(0.7) + before.right * std::sin(0.7), 1e-9 * glm::length(before.up));
    camera.roll(-0.7);
    expect_near(camera.view(1.0, std::nullopt).right, before.right, 1e-9 * glm::length(before.right));
    if (i > 0) {
      expect_near(camera.pose().up, glm::normalize(pose.up), 1e-9);
    }
    EXPECT_EQ(camera.pose().eye, pose.eye);
    EXPECT_EQ(camera.pose().target, pose.target);
  }
}

TEST(CameraOperations, PanMovesTheSceneByFractionsOfTheImageHeight) {
  Random random;
  for (int i = 0; i < 50; ++i) {
    CameraPose pose = random_pose(random);
    if (i % 2 == 1) pose.orthographic_height = random(0.1, 50.0);
    Camera camera(pose);
    const double aspect = random(0.5, 2.0);
    // Any point at the target's depth: it moves by a quarter of the image height.
    const ViewFrame frame = camera.view(aspect, std::nullopt);
    const double far = i % 2 == 1 ? 1.0 : distance(pose);
    const dvec3 p = pose.target + far * (random(-0.9, 0.9) * frame.right + random(-0.9, 0.9) * frame.up);
    const dvec3 before = project(camera, p, aspect);
    camera.pan(0.25, -0.125);
    const dvec3 after = project(camera, p, aspect);
    EXPECT_NEAR((after.x - before.x) / 2.0 * aspect, 0.25, 1e-9);
    EXPECT_NEAR((after.y - before.y) / 2.0, -0.125, 1e-9);
    EXPECT_NEAR(distance(camera.pose()), distance(pose), 1e-9);
  }
}

TEST(CameraOperations, DollyMultipliesTheDistanceWithinLimits) {
  CameraPose pose = pose_at({0, 0, 10});
  Camera camera(pose);
  camera.dolly(0.5);
  expect_near(camera.pose().eye, {0, 0, 5}, 1e-12);
  camera.zoom(2.0);
  expect_near(camera.pose().eye, {0, 0, 10}, 1e-12);
  for (int i = 0; i < 2000; ++i) camera.dolly(0.1);
  EXPECT_GT(distance(camera.pose()), 1e-13);
  const std::uint64_t at_limit = camera.revision();
  camera.dolly(0.1);
  EXPECT_EQ(camera.revision(), at_limit);
  for (int i = 0; i < 2000; ++i) camera.dolly(10.0);
  EXPECT_NEAR(distance(camera.pose()) / 1e12, 1.0, 1e-9);
  camera.dolly(infinity);
  camera.dolly(0.0);
  EXPECT_GT(distance(camera.pose()), 1e-13);
  // Far from the origin, the minimum distance is larger (double precision).
  Camera far(pose_at({1e9, 0, 10}, {1e9, 0, 0}));
  for (int i = 0; i < 2000; ++i) far.dolly(0.5);
  EXPECT_NE(far.pose().eye, far.pose().target);
  EXPECT_LT(angle(forward(far.pose()), {0, 0, -1}), 1e-6);
  // A distance below the limit stays there, and may increase again.
  Camera tiny(pose_at({0, 0, 1e-20}));
  tiny.dolly(0.5);
  EXPECT_EQ(distance(tiny.pose()), 1e-20);
  tiny.dolly(2.0);
  EXPECT_NEAR(distance(tiny.pose()) / 2e-20, 1.0, 1e-9);

  pose.orthographic_height = 4.0;
  Camera flat(pose);
  flat.dolly(0.5);
  EXPECT_EQ(flat.pose().orthographic_height, 2.0);
  expect_near(flat.pose().eye, {0, 0, 5}, 1e-12);
  flat.zoom(0.5);  // the eye does not move, because the near plane is at the eye
  EXPECT_EQ(flat.pose().orthographic_height, 1.0);
  expect_near(flat.pose().eye, {0, 0, 5}, 1e-12);
  for (int i = 0; i < 2000; ++i) flat.zoom(0.1);
  EXPECT_GT(flat.pose().orthographic_height, 1e-13);
}

TEST(CameraOperations, FlyMovesEyeAndTargetAlongTheCamerasAxes) {
  Camera camera(pose_at({10, 0, 0}));
  camera.fly(1.0, 2.0, 3.0);  // right is -Z
  expect_near(camera.pose().eye, {7, 2, -1}, 1e-12);
  expect_near(camera.pose().target, {-3, 2, -1}, 1e-12);
}

TEST(CameraOperations, NonFiniteResultsAreRejected) {
  Camera camera(pose_at({0, 0, 10}));
  const std::function<void()> wild[] = {[&] { camera.fly(1e31, 0, 0); }, [&] { camera.fly(0, 0, 1e25); },
                                        [&] { camera.pan(NAN, 0); }, [&] { camera.pan(0, 1e300); },
                                        [&] { camera.orbit(NAN, 0); }};
  for (const auto& call : wild) {
    EXPECT_THROW(call(), cumulet::Error);
    EXPECT_EQ(camera.pose(), pose_at({0, 0, 10}));
  }
  EXPECT_EQ(camera.revision(), 1U);
}

TEST(CameraOperations, LooksFromAxisViews) {
  struct Case {
    dvec3 up;
    AxisView side;
    dvec3 back, right;
  };
  const dvec3 x(1, 0, 0);
  const dvec3 y(0, 1, 0);
  const dvec3 z(0, 0, 1);
  const Case cases[] = {
      {y, AxisView::front, z, x},
      {y, AxisView::back, -z, -x},
      {y, AxisView::right, x, -z},
      {y, AxisView::left, -x, z},
      {y, AxisView::top, y, x},
      {y, AxisView::bottom, -y, x},
      {z, AxisView::front, -y, x},
      {z, AxisView::right, x, y},
      {z, AxisView::top, z, x},
      {-y, AxisView::front, z, -x},
      {dvec3(0.3, 0.9, 0.2), AxisView::front, z, x},  // rolled: level again
  };
  for (const Case& c : cases) {
    CameraPose pose = pose_at({3, 5, 9}, {1, 1, 1});
    pose.up = c.up;
    Camera camera(pose);
    camera.look_from(c.side);
    const ViewFrame frame = camera.view(1.0, std::nullopt);
    EXPECT_LT(angle(-frame.forward, c.back), 1e-3);
    EXPECT_LT(angle(frame.right, c.right), 1e-6);
    EXPECT_NEAR(distance(camera.pose()), distance(pose), 1e-9);
    EXPECT_EQ(camera.pose().target, pose.target);
    camera.orbit(0.0, c.side == AxisView::top ? -0.1 : 0.1);  // orbiting away from the poles works too
    EXPECT_GT(angle(-camera.view(1.0, std::nullopt).forward, c.back), 0.09);
  }
}

TEST(CameraOperations, OrthographicShowsTheSameAtTheTargetAndNeverCutsTheScene) {
  const Bounds box{dvec3(-2), dvec3(2)};
  Camera camera(pose_at({0.3, 0.2, 1.0}));  // inside
  const dvec3 p(0.1, 0.05, 0.0);
  const CameraPose before = camera.pose();
  const double tall = 2.0 * distance(before) * std::tan(pi / 9);
  camera.toggle_orthographic(box);
  EXPECT_NEAR(camera.pose().orthographic_height, tall, 1e-12);
  EXPECT_LT(angle(forward(camera.pose()), forward(before)), 1e-12);
  for (int i = 0; i < 100; ++i) {
    camera.orbit(0.37, i % 10 < 5 ? 0.5 : -0.5);
    camera.zoom(0.9);
    const ViewFrame frame = camera.view(1.0, std::nullopt);
    for (int c = 0; c < 8; ++c) {
      const dvec3 corner((c & 1) != 0 ? 2 : -2, (c & 2) != 0 ? 2 : -2, (c & 4) != 0 ? 2 : -2);
      EXPECT_GT(glm::dot(corner - frame.eye, frame.forward), 0.0);
    }
  }
  camera.set(before);
  camera.toggle_orthographic(box);
  camera.toggle_orthographic(box);
  EXPECT_EQ(camera.pose().orthographic_height, 0.0);
  expect_near(camera.pose().eye, before.eye, 1e-12);
  // At the target's depth nothing moves in the image.
  Camera flat(pose_at({0, 0, 10}));
  const dvec3 there = project(flat, p, 1.3);
  flat.toggle_orthographic(std::nullopt);
  expect_near(dvec3(dvec2(project(flat, p, 1.3)), 0), dvec3(dvec2(there), 0), 1e-12);
}

TEST(CameraOperations, RevisionCountsOnlyChanges) {
  Camera camera(pose_at({0, 0, 10}));
  camera.set(pose_at({0, 0, 10}));
  camera.orbit(0, 0);
  camera.look(0, 0);
  camera.roll(0);
  camera.pan(0, 0);
  camera.dolly(1);
  camera.fly(0, 0, 0);
  EXPECT_EQ(camera.revision(), 1U);
  camera.set(pose_at({0, 0, 11}));
  EXPECT_EQ(camera.revision(), 2U);
  const dmat4 view = glm::lookAt(dvec3(0, 0, 11), dvec3(0), dvec3(0, 1, 0));
  const dmat4 projection = glm::perspective(0.8, 1.4, 0.1, 50.0);
  for (int i = 0; i < 3; ++i) camera.set_matrices(view, projection, ClipDepth::negative_one_to_one);
  EXPECT_EQ(camera.revision(), 3U);
  camera.set(camera.pose());  // replaces the matrices
  EXPECT_EQ(camera.revision(), 4U);
  camera.orbit(0.1, 0);
  EXPECT_EQ(camera.revision(), 5U);
}

TEST(CameraOperations, ListenersAreNotifiedOnlyOfChanges) {
  auto camera = std::make_unique<Camera>();
  int heard = 0;
  int other = 0;
  auto token = camera->listen([&] { heard += camera->revision() > 1 ? 1 : 1000; });  // no lock is held in listeners
  auto second = camera->listen([&] { ++other; });
  camera->orbit(1.0, 0.0);  // waits for bounds
  static_cast<void>(camera->view(1.0, std::nullopt));
  EXPECT_EQ(heard, 0);
  static_cast<void>(camera->view(1.0, Bounds{dvec3(-1), dvec3(1)}));
  EXPECT_EQ(heard, 1);
  camera->orbit(1.0, 0.0);
  EXPECT_EQ(heard, 2);
  camera->set(camera->pose());
  EXPECT_THROW(camera->fly(NAN, 0, 0), cumulet::Error);
  EXPECT_EQ(heard, 2);
  token.reset();
  camera->set_matrices(dmat4(1.0), glm::perspective(0.8, 1.4, 0.1, 50.0), ClipDepth::negative_one_to_one);
  EXPECT_EQ(heard, 2);
  EXPECT_EQ(other, 3);
  camera.reset();  // destroyed before its listener
  second.reset();
}

TEST(CameraOperations, ConcurrentOperationsAllCount) {
  Camera camera(pose_at({0, 0, 10}));
  {
    std::vector<std::jthread> threads;
    threads.reserve(4);
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&] {
        for (int i = 0; i < 1000; ++i) {
          camera.orbit(pi / 8000, 0.0);
          static_cast<void>(camera.view(1.0, std::nullopt));
        }
      });
    }
  }
  EXPECT_EQ(camera.revision(), 4001U);
  expect_near(camera.pose().eye, {10, 0, 0}, 1e-9);
}

// ---- The C ABI

struct Release {
  void operator()(cumulet_camera* camera) const { cumulet_camera_release(camera); }
};
using Handle = std::unique_ptr<cumulet_camera, Release>;

cumulet_camera_desc camera_desc(const dvec3& eye) {
  cumulet_camera_desc desc{};
  desc.struct_size = sizeof desc;
  std::copy_n(glm::value_ptr(eye), 3, desc.eye);
  return desc;
}

Handle make_camera(const cumulet_camera_desc& desc) {
  cumulet_camera* camera = nullptr;
  EXPECT_EQ(cumulet_camera_create(&desc, &camera), CUMULET_OK);
  return Handle(camera);
}

TEST(CameraAbi, DefaultsAndRoundTrip) {
  const Handle camera = make_camera(camera_desc({0, 0, 10}));
  cumulet_camera_desc got{};
  got.struct_size = sizeof got;
  ASSERT_EQ(cumulet_camera_get(camera.get(), &got), CUMULET_OK);
  EXPECT_EQ(got.eye[2], 10.0);
  EXPECT_EQ(got.up[1], 1.0);
  EXPECT_EQ(got.fovy_degrees, 40.0);
  EXPECT_EQ(got.orthographic_height, 0.0);
  EXPECT_EQ(got.struct_size, sizeof got);
  got.target[0] = 3.0;
  got.up[0] = 1e200;  // a direction of any length
  got.orthographic_height = 7.0;
  got.near_plane = -2.0;
  got.far_plane = 50.0;
  got.depth = CUMULET_DEPTH_REVERSED;
  ASSERT_EQ(cumulet_camera_set(camera.get(), &got), CUMULET_OK);
  cumulet_camera_desc again{};
  again.struct_size = sizeof again;
  ASSERT_EQ(cumulet_camera_get(camera.get(), &again), CUMULET_OK);
  EXPECT_EQ(again.target[0], 3.0);
  EXPECT_EQ(again.up[0], 1.0);
  EXPECT_EQ(again.orthographic_height, 7.0);
  EXPECT_EQ(again.near_plane, -2.0);
  EXPECT_EQ(again.far_plane, 50.0);
  EXPECT_EQ(again.depth, CUMULET_DEPTH_REVERSED);
  // A host of an older header gets the members that its struct has.
  again = {};
  again.struct_size = offsetof(cumulet_camera_desc, up);
  ASSERT_EQ(cumulet_camera_get(camera.get(), &again), CUMULET_OK);
  EXPECT_EQ(again.target[0], 3.0);
  EXPECT_EQ(again.up[0], 0.0);
}

TEST(CameraAbi, RefusesBadDescriptors) {
  const Handle camera = make_camera(camera_desc({0, 0, 10}));
  const std::pair<const char*, std::function<void(cumulet_camera_desc&)>> bad[] = {
      {"struct_size 0", [](auto& d) { d.struct_size = 0; }},
      {"struct_size large", [](auto& d) { d.struct_size = sizeof d + 1; }},
      {"eye", [](auto& d) { d.eye[1] = NAN; }},
      {"eye far", [](auto& d) { d.eye[1] = 1e31; }},
      {"target", [](auto& d) { d.target[2] = infinity; }},
      {"too near", [](auto& d) { d.eye[2] = 1e-200; }},
      {"up", [](auto& d) { d.up[0] = NAN; }},
      {"fovy", [](auto& d) { d.fovy_degrees = 180.0; }},
      {"fovy negative", [](auto& d) { d.fovy_degrees = -40.0; }},
      {"fovy NaN", [](auto& d) { d.fovy_degrees = NAN; }},
      {"height", [](auto& d) { d.orthographic_height = -1.0; }},
      {"near", [](auto& d) { d.near_plane = -0.1; }},
      {"near infinite", [](auto& d) { d.near_plane = infinity; }},
      {"far", [](auto& d) { d.far_plane = 0.05; }},
      {"far NaN", [](auto& d) { d.far_plane = NAN; }},
      {"far infinite", [](auto& d) { d.far_plane = infinity, d.orthographic_height = 1.0; }},
      {"depth",
       [](auto& d) {
         const unsigned two = 2;
         std::memcpy(&d.depth, &two, sizeof two);
       }},
  };
  for (const auto& [what, spoil] : bad) {
    cumulet_camera_desc desc = camera_desc({0, 0, 5});
    spoil(desc);
    EXPECT_EQ(cumulet_camera_set(camera.get(), &desc), CUMULET_ERROR_INVALID_ARGUMENT) << what;
    auto* none = camera.get();
    EXPECT_EQ(cumulet_camera_create(&desc, &none), CUMULET_ERROR_INVALID_ARGUMENT) << what;
    EXPECT_EQ(none, nullptr);
  }
  cumulet_camera_desc got = camera_desc({});
  ASSERT_EQ(cumulet_camera_get(camera.get(), &got), CUMULET_OK);
  EXPECT_EQ(got.eye[2], 10.0);
  got.far_plane = infinity;  // allowed for perspective
  EXPECT_EQ(cumulet_camera_set(camera.get(), &got), CUMULET_OK);
}

TEST(CameraAbi, RefusesNullsAndBadNumbers) {
  const Handle handle = make_camera(camera_desc({0, 0, 10}));
  cumulet_camera* const camera = handle.get();
  cumulet_camera_desc desc = camera_desc({0, 0, 5});
  double m[16] = {};
  const double low[3] = {-1, -1, -1};
  const double high[3] = {1, 1, 1};
  const double nan3[3] = {NAN, 0, 0};
  const auto no = CUMULET_CLIP_NEGATIVE_ONE_TO_ONE;
  auto unknown = no;
  const unsigned two = 2;
  std::memcpy(&unknown, &two, sizeof two);
  cumulet_camera* out = nullptr;
  const cumulet_status refused[] = {
      cumulet_camera_create(nullptr, &out),
      cumulet_camera_create(&desc, nullptr),
      cumulet_camera_set(nullptr, &desc),
      cumulet_camera_set(camera, nullptr),
      cumulet_camera_get(nullptr, &desc),
      cumulet_camera_get(camera, nullptr),
      cumulet_camera_set_matrices(nullptr, m, m, no),
      cumulet_camera_set_matrices(camera, nullptr, m, no),
      cumulet_camera_set_matrices(camera, m, nullptr, no),
      cumulet_camera_set_matrices(camera, m, m, no),  // zeros
      cumulet_camera_get_matrices(nullptr, 1.0, no, m, m),
      cumulet_camera_get_matrices(camera, 1.0, no, nullptr, m),
      cumulet_camera_get_matrices(camera, 1.0, no, m, nullptr),
      cumulet_camera_get_matrices(camera, 0.0, no, m, m),
      cumulet_camera_get_matrices(camera, NAN, no, m, m),
      cumulet_camera_get_matrices(camera, 1.0, unknown, m, m),
      cumulet_camera_orbit(nullptr, 0, 0),
      cumulet_camera_orbit(camera, NAN, 0),
      cumulet_camera_look(nullptr, 0, 0),
      cumulet_camera_look(camera, 0, infinity),
      cumulet_camera_roll(nullptr, 0),
      cumulet_camera_roll(camera, NAN),
      cumulet_camera_pan(nullptr, 0, 0),
      cumulet_camera_pan(camera, infinity, 0),
      cumulet_camera_dolly(nullptr, 1),
      cumulet_camera_dolly(camera, 0),
      cumulet_camera_dolly(camera, -1),
      cumulet_camera_dolly(camera, NAN),
      cumulet_camera_fly(nullptr, 0, 0, 0),
      cumulet_camera_fly(camera, 0, NAN, 0),
      cumulet_camera_fly(camera, 0, 0, 1e40),
      cumulet_camera_frame(nullptr, low, high, 1),
      cumulet_camera_frame(camera, nullptr, high, 1),
      cumulet_camera_frame(camera, low, nullptr, 1),
      cumulet_camera_frame(camera, high, low, 1),
      cumulet_camera_frame(camera, nan3, high, 1),
      cumulet_camera_frame(camera, low, high, -1),
  };
  for (std::size_t i = 0; i < std::size(refused); ++i) EXPECT_EQ(refused[i], CUMULET_ERROR_INVALID_ARGUMENT) << i;
  cumulet_camera_release(nullptr);
  ASSERT_EQ(cumulet_camera_get(camera, &desc), CUMULET_OK);
  EXPECT_EQ(desc.eye[2], 10.0);
}

TEST(CameraAbi, CFunctionsMatchTheCamera) {
  const Handle handle = make_camera(camera_desc({0, 0, 10}));
  cumulet_camera* const camera = handle.get();
  Camera same(pose_at({0, 0, 10}));
  const double low[3] = {-1, -2, -3};
  const double high[3] = {2, 4, 6};
  EXPECT_EQ(cumulet_camera_orbit(camera, 0.3, 0.2), CUMULET_OK);
  same.orbit(0.3, 0.2);
  EXPECT_EQ(cumulet_camera_look(camera, 0.1, -0.2), CUMULET_OK);
  same.look(0.1, -0.2);
  EXPECT_EQ(cumulet_camera_roll(camera, 0.4), CUMULET_OK);
  same.roll(0.4);
  EXPECT_EQ(cumulet_camera_pan(camera, 0.4, 0.7), CUMULET_OK);
  same.pan(0.4, 0.7);
  EXPECT_EQ(cumulet_camera_dolly(camera, 1.7), CUMULET_OK);
  same.dolly(1.7);
  EXPECT_EQ(cumulet_camera_fly(camera, 1, 2, 3), CUMULET_OK);
  same.fly(1, 2, 3);
  const auto expect_same = [&] {
    cumulet_camera_desc got = camera_desc({});
    ASSERT_EQ(cumulet_camera_get(camera, &got), CUMULET_OK);
    const CameraPose pose = same.pose();
    expect_near(glm::make_vec3(got.eye), pose.eye, 0.0);
    expect_near(glm::make_vec3(got.target), pose.target, 0.0);
    expect_near(glm::make_vec3(got.up), pose.up, 0.0);
  };
  expect_same();
  double view[16];
  double projection[16];
  dmat4 v;
  dmat4 p;
  ASSERT_EQ(cumulet_camera_get_matrices(camera, 1.5, CUMULET_CLIP_ZERO_TO_ONE, view, projection), CUMULET_OK);
  same.matrices(1.5, ClipDepth::zero_to_one, v, p);
  EXPECT_EQ(glm::make_mat4(view), v);
  EXPECT_EQ(glm::make_mat4(projection), p);
  EXPECT_EQ(cumulet_camera_set_matrices(camera, view, projection, CUMULET_CLIP_ZERO_TO_ONE), CUMULET_OK);
  same.set_matrices(v, p, ClipDepth::zero_to_one);
  expect_same();
  EXPECT_EQ(cumulet_camera_frame(camera, low, high, 1.5), CUMULET_OK);
  same.frame({glm::make_vec3(low), glm::make_vec3(high)}, 1.5);
  expect_same();
}

// ---- Navigation

constexpr std::uint32_t shift = CUMULET_MODIFIER_SHIFT;
constexpr std::uint32_t ctrl = CUMULET_MODIFIER_CTRL;
constexpr std::uint32_t alt = CUMULET_MODIFIER_ALT;
constexpr double width = 800.0;
constexpr double height = 400.0;

/// An image of 800 x 400 pixels with a box of 4 x 4 x 2, seen from +Z at a distance of 10.
struct Session {
  explicit Session(NavigationStyle style = NavigationStyle::simple, bool fly = false) {
    NavigationSettings settings;
    settings.style = style;
    settings.fly = fly;
    navigation.set(settings);
  }
  bool send(const InputEvent& event) { return navigation.input(event, camera, width, height, bounds); }
  bool down(int button, double x, double y, std::uint32_t modifiers = 0) {
    return send({InputEvent::Type::button_down, x, y, 0.0, button, 0, modifiers});
  }
  bool move(double x, double y, std::uint32_t modifiers = 0) {
    return send({InputEvent::Type::pointer_move, x, y, 0.0, 0, 0, modifiers});
  }
  bool up(int button, double x, double y, std::uint32_t modifiers = 0) {
    return send({InputEvent::Type::button_up, x, y, 0.0, button, 0, modifiers});
  }
  bool wheel(double steps) { return send({InputEvent::Type::wheel, 0.0, 0.0, steps, 0, 0, 0}); }
  bool press(int key, std::uint32_t modifiers = 0) {
    return send({InputEvent::Type::key_down, 0.0, 0.0, 0.0, 0, key, modifiers});
  }
  bool lift(int key, std::uint32_t modifiers = 0) {
    return send({InputEvent::Type::key_up, 0.0, 0.0, 0.0, 0, key, modifiers});
  }
  bool lose_focus() { return send({InputEvent::Type::focus_lost, 0.0, 0.0, 0.0, 0, 0, 0}); }
  bool advance(double seconds) { return navigation.advance(seconds, camera, bounds); }
  [[nodiscard]] dvec3 eye() const { return camera.pose().eye; }
  [[nodiscard]] dvec3 target() const { return camera.pose().target; }

  Camera camera{pose_at({0, 0, 10})};
  Navigation navigation;
  std::optional<Bounds> bounds = Bounds{dvec3(-2, -2, -1), dvec3(2, 2, 1)};
};

enum class Motion { none, orbit, pan, dolly, look };

/// The camera motion caused by a short drag with this button and these modifiers.
Motion motion_of(NavigationStyle style, bool fly, int button, std::uint32_t modifiers) {
  Session session(style, fly);
  const bool began = session.down(button, 400, 200, modifiers);
  EXPECT_EQ(session.move(420, 215, modifiers), began);
  EXPECT_EQ(session.up(button, 420, 215, modifiers), began);
  EXPECT_FALSE(session.move(500, 300));
  const bool eye = session.eye() != dvec3(0, 0, 10);
  const bool target = session.target() != dvec3(0);
  const bool far = std::abs(distance(session.camera.pose()) - 10.0) > 1e-9;
  if (far) return eye && !target ? Motion::dolly : Motion::none;
  if (eye && target) return Motion::pan;
  if (eye) return Motion::orbit;
  return target ? Motion::look : Motion::none;
}

TEST(Navigation, ButtonsFollowTheNavigationStyle) {
  for (const auto style : {NavigationStyle::simple, NavigationStyle::blender, NavigationStyle::maya}) {
    for (const int button : {CUMULET_BUTTON_LEFT, CUMULET_BUTTON_MIDDLE, CUMULET_BUTTON_RIGHT}) {
      for (std::uint32_t modifiers = 0; modifiers < 8; ++modifiers) {
        const auto is = [&](NavigationStyle s, int b, std::uint32_t m) {
          return style == s && button == b && modifiers == m;
        };
        Motion expected = Motion::none;
        if (is(NavigationStyle::simple, CUMULET_BUTTON_LEFT, 0)) expected = Motion::orbit;
        if (is(NavigationStyle::simple, CUMULET_BUTTON_LEFT, shift)) expected = Motion::pan;
        if (is(NavigationStyle::simple, CUMULET_BUTTON_MIDDLE, 0)) expected = Motion::pan;
        if (is(NavigationStyle::simple, CUMULET_BUTTON_RIGHT, 0)) expected = Motion::dolly;
        if (is(NavigationStyle::blender, CUMULET_BUTTON_MIDDLE, 0)) expected = Motion::orbit;
        if (is(NavigationStyle::blender, CUMULET_BUTTON_MIDDLE, shift)) expected = Motion::pan;
        if (is(NavigationStyle::blender, CUMULET_BUTTON_MIDDLE, ctrl)) expected = Motion::dolly;
        if (is(NavigationStyle::maya, CUMULET_BUTTON_LEFT, alt)) expected = Motion::orbit;
        if (is(NavigationStyle::maya, CUMULET_BUTTON_MIDDLE, alt)) expected = Motion::pan;
        if (is(NavigationStyle::maya, CUMULET_BUTTON_RIGHT, alt)) expected = Motion::dolly;
        EXPECT_EQ(motion_of(style, false, button, modifiers), expected)
            << static_cast<int>(style) << " button " << button << " modifiers " << modifiers;
        EXPECT_EQ(motion_of(style, true, button, modifiers), Motion::look);
      }
    }
  }
}

TEST(Navigation, DragsRotateTheSceneWithThePointer) {
  Session session;
  session.down(CUMULET_BUTTON_LEFT, 100, 200);
  session.move(300, 200);  // right by half the height: the scene's front goes right, the eye left
  expect_near(session.eye(), {-10, 0, 0}, 1e-9);
  session.move(300, 200 + height / 6);  // down: the eye rises
  EXPECT_NEAR(elevation(session.camera.pose()), pi / 6, 1e-9);
  session.up(CUMULET_BUTTON_LEFT, 100, 200 + height / 6);  // the position of the button release counts too
  EXPECT_NEAR(session.eye().x, 0.0, 1e-9);
  EXPECT_NEAR(session.eye().z, 10 * std::cos(pi / 6), 1e-9);

  Session in_two;
  in_two.down(CUMULET_BUTTON_RIGHT, 400, 300);
  in_two.move(400, 250);
  in_two.move(400, 100);  // up by half the height: nearer by a factor of the square root of 10
  EXPECT_NEAR(distance(in_two.camera.pose()), 10.0 / std::sqrt(10.0), 1e-9);

  Session maya(NavigationStyle::maya);
  maya.down(CUMULET_BUTTON_RIGHT, 400, 300, alt);
  maya.move(500, 300, alt);  // right dollies in as well
  EXPECT_LT(distance(maya.camera.pose()), 9.0);

  Session fly(NavigationStyle::simple, true);
  fly.down(CUMULET_BUTTON_LEFT, 400, 200);
  fly.move(600, 200);  // right: the view direction follows
  EXPECT_GT(fly.target().x, 1.0);
  fly.move(600, 100);  // up
  EXPECT_GT(fly.target().y, 1.0);
  EXPECT_EQ(fly.eye(), dvec3(0, 0, 10));
}

TEST(Navigation, PanKeepsThePointUnderThePointer) {
  for (const double orthographic_height : {0.0, 3.0}) {
    Session session;
    CameraPose pose = pose_at({3, 4, 10}, {1, 0, 0});
    pose.orthographic_height = orthographic_height;
    session.camera.set(pose);
    const ViewFrame frame = session.camera.view(width / height, std::nullopt);
    const double far = orthographic_height > 0.0 ? 1.0 : distance(pose);
    const dvec3 p = pose.target + far * (0.25 * frame.right - 0.5 * frame.up);  // at pixel 500, 300
    session.down(CUMULET_BUTTON_MIDDLE, 500, 300);
    for (const dvec2 pixel : {dvec2(510, 290), dvec2(350, 20), dvec2(-40, 390.5)}) {
      session.move(pixel.x, pixel.y);
      const dvec3 at = project(session.camera, p, width / height);
      EXPECT_NEAR((at.x + 1.0) / 2.0 * width, pixel.x, 1e-6);
      EXPECT_NEAR((1.0 - at.y) / 2.0 * height, pixel.y, 1e-6);
    }
  }
}

TEST(Navigation, DragEndsWhenItsButtonIsReleased) {
  Session session;
  EXPECT_FALSE(session.move(10, 10));
  EXPECT_FALSE(session.up(CUMULET_BUTTON_LEFT, 10, 10));
  EXPECT_EQ(session.camera.revision(), 1U);
  EXPECT_TRUE(session.down(CUMULET_BUTTON_LEFT, 100, 100));
  EXPECT_FALSE(session.down(CUMULET_BUTTON_RIGHT, 120, 100));
  EXPECT_FALSE(session.down(CUMULET_BUTTON_MIDDLE, 120, 100));
  EXPECT_TRUE(session.move(150, 100, shift));  // still an orbit, whichever buttons and keys are held
  EXPECT_FALSE(session.up(CUMULET_BUTTON_RIGHT, 150, 100));
  EXPECT_TRUE(session.move(200, 100));
  expect_near(session.eye(), {-10 * std::sin(pi / 4), 0, 10 * std::cos(pi / 4)}, 1e-9);
  EXPECT_TRUE(session.up(CUMULET_BUTTON_LEFT, 200, 100));
  EXPECT_FALSE(session.move(300, 300));
  EXPECT_FALSE(session.up(CUMULET_BUTTON_MIDDLE, 300, 300));
  // In Maya's style alt may be released first.
  Session maya(NavigationStyle::maya);
  maya.down(CUMULET_BUTTON_LEFT, 100, 100, alt);
  EXPECT_TRUE(maya.move(120, 100));
  EXPECT_TRUE(maya.up(CUMULET_BUTTON_LEFT, 120, 100));
  // A second press of the button (its release was lost) starts a new drag without a jump.
  maya.down(CUMULET_BUTTON_LEFT, 100, 100, alt);
  const dvec3 eye = maya.eye();
  EXPECT_TRUE(maya.down(CUMULET_BUTTON_LEFT, 700, 100, alt));
  EXPECT_EQ(maya.eye(), eye);
  maya.move(700, 100);
  EXPECT_EQ(maya.eye(), eye);
}

TEST(Navigation, FocusLossReleasesButtonsAndKeys) {
  Session session(NavigationStyle::simple, true);
  EXPECT_FALSE(session.lose_focus());
  session.press('W', shift);
  session.down(CUMULET_BUTTON_LEFT, 100, 100, shift);
  EXPECT_TRUE(session.navigation.moving());
  EXPECT_TRUE(session.lose_focus());
  EXPECT_FALSE(session.navigation.moving());
  EXPECT_FALSE(session.advance(1.0));
  EXPECT_FALSE(session.move(300, 300));
  EXPECT_FALSE(session.lift('W'));
  EXPECT_FALSE(session.up(CUMULET_BUTTON_LEFT, 300, 300));
  EXPECT_EQ(session.camera.revision(), 1U);
}

TEST(Navigation, ChangingTheStyleEndsTheCurrentDrag) {
  Session session(NavigationStyle::simple, true);
  session.press('W');
  session.down(CUMULET_BUTTON_LEFT, 100, 100);
  NavigationSettings settings = session.navigation.settings();
  settings.speed = 2.0;
  session.navigation.set(settings);  // only the speed changed: the drag continues
  EXPECT_TRUE(session.navigation.moving());
  EXPECT_TRUE(session.move(110, 100));
  settings.fly = false;
  session.navigation.set(settings);
  EXPECT_FALSE(session.navigation.moving());
  EXPECT_FALSE(session.move(120, 100));
}

TEST(Navigation, WheelStepsMayBeFractional) {
  Session session;
  EXPECT_TRUE(session.wheel(1.0));
  const double step = 10.0 / distance(session.camera.pose());
  EXPECT_GT(step, 1.1);
  EXPECT_LT(step, 1.2);
  for (int i = 0; i < 10; ++i) session.wheel(-0.1);
  EXPECT_NEAR(distance(session.camera.pose()), 10.0, 1e-9);
  EXPECT_FALSE(session.wheel(0.0));
  session.wheel(1e300);
  EXPECT_GT(distance(session.camera.pose()), 0.0);
  session.wheel(-1e300);
  EXPECT_LT(distance(session.camera.pose()), 1e13);

  CameraPose pose = pose_at({0, 0, 10});
  pose.orthographic_height = 4.0;
  session.camera.set(pose);
  session.wheel(1.0);
  EXPECT_NEAR(session.camera.pose().orthographic_height, 4.0 / step, 1e-9);
  EXPECT_EQ(session.eye(), dvec3(0, 0, 10));
}

TEST(Navigation, SpeedScalesEveryMotion) {
  NavigationSettings settings;
  settings.speed = 0.5;
  Session session;
  session.navigation.set(settings);
  session.down(CUMULET_BUTTON_LEFT, 0, 0);
  session.up(CUMULET_BUTTON_LEFT, -height, 0);
  expect_near(session.eye(), {10, 0, 0}, 1e-9);
  Session half;
  half.navigation.set(settings);
  Session whole;
  half.wheel(2.0);
  whole.wheel(1.0);
  expect_near(half.eye(), whole.eye(), 1e-12);
}

TEST(Navigation, DragsWithoutAnImageSizeMoveNothing) {
  Session session;
  session.down(CUMULET_BUTTON_LEFT, 0, 0);
  const InputEvent move{InputEvent::Type::pointer_move, 50, 50, 0.0, 0, 0, 0};
  EXPECT_TRUE(session.navigation.input(move, session.camera, 0.0, 0.0, session.bounds));
  EXPECT_EQ(session.camera.revision(), 1U);
  EXPECT_TRUE(session.press('F'));
  session.navigation.input({InputEvent::Type::key_down, 0, 0, 0, 0, 'F', 0}, session.camera, 0.0, 0.0, session.bounds);
  EXPECT_NEAR(widest(session.camera, *session.bounds, 1.0), 0.88, 1e-9);
}

TEST(Navigation, FrameAllKeysWork) {
  for (const auto style : {NavigationStyle::simple, NavigationStyle::blender, NavigationStyle::maya}) {
    for (const bool fly : {false, true}) {
      for (const int key :
           {static_cast<int>('F'), static_cast<int>(CUMULET_KEY_HOME), static_cast<int>(CUMULET_KEY_KEYPAD_PERIOD)}) {
        Session session(style, fly);
        session.camera.set(pose_at({30, 40, 100}, {30, 0, 0}));
        const dvec3 ahead = forward(session.camera.pose());
        EXPECT_TRUE(session.press(key));
        EXPECT_NEAR(widest(session.camera, *session.bounds, width / height), 0.88, 1e-9);
        EXPECT_LT(angle(forward(session.camera.pose()), ahead), 1e-9);
        session.lift(key);
        EXPECT_FALSE(session.press(key, ctrl));  // a host's own shortcut
        EXPECT_FALSE(session.press(key, alt));
        session.bounds.reset();
        const std::uint64_t before = session.camera.revision();
        EXPECT_FALSE(session.press(key));
        EXPECT_EQ(session.camera.revision(), before);
      }
    }
  }
}

TEST(Navigation, ArrowPlusAndMinusKeysWorkInEveryStyle) {
  for (const auto style : {NavigationStyle::simple, NavigationStyle::blender, NavigationStyle::maya}) {
    for (const bool fly : {false, true}) {
      Session session(style, fly);
      for (int i = 0; i < 6; ++i) EXPECT_TRUE(session.press(CUMULET_KEY_RIGHT));
      expect_near(session.eye(), {10, 0, 0}, 1e-9);
      for (int i = 0; i < 6; ++i) EXPECT_TRUE(session.press(CUMULET_KEY_LEFT));
      expect_near(session.eye(), {0, 0, 10}, 1e-9);
      EXPECT_TRUE(session.press(CUMULET_KEY_UP));
      EXPECT_NEAR(elevation(session.camera.pose()), pi / 12, 1e-9);
      EXPECT_TRUE(session.press(CUMULET_KEY_DOWN));
      EXPECT_TRUE(session.press(CUMULET_KEY_DOWN));
      EXPECT_NEAR(elevation(session.camera.pose()), -pi / 12, 1e-9);
      EXPECT_TRUE(session.press(CUMULET_KEY_UP));
      EXPECT_TRUE(session.press(CUMULET_KEY_RIGHT, shift));
      EXPECT_GT(session.target().x, 0.1);
      EXPECT_TRUE(session.press(CUMULET_KEY_LEFT, shift));
      EXPECT_TRUE(session.press(CUMULET_KEY_UP, shift));
      EXPECT_GT(session.target().y, 0.1);
      EXPECT_NEAR(distance(session.camera.pose()), 10.0, 1e-9);
      EXPECT_TRUE(session.press('='));
      EXPECT_LT(distance(session.camera.pose()), 9.0);
      EXPECT_TRUE(session.press('-'));
      EXPECT_NEAR(distance(session.camera.pose()), 10.0, 1e-9);
      EXPECT_TRUE(session.press('+', shift));
      EXPECT_LT(distance(session.camera.pose()), 9.0);
      EXPECT_FALSE(session.press(CUMULET_KEY_RIGHT, ctrl));
      EXPECT_FALSE(session.press('Z'));
      EXPECT_FALSE(session.press(CUMULET_KEY_NONE));
    }
  }
}

TEST(Navigation, KeypadViewsMatchBlender) {
  const auto key = [](int digit) { return CUMULET_KEY_KEYPAD_0 + digit; };
  for (const auto style : {NavigationStyle::simple, NavigationStyle::maya}) {
    Session session(style);
    for (int digit = 0; digit < 10; ++digit) EXPECT_FALSE(session.press(key(digit)));
    EXPECT_EQ(session.camera.revision(), 1U);
  }
  Session session(NavigationStyle::blender);
  session.press(CUMULET_KEY_UP);
  session.press(CUMULET_KEY_RIGHT);
  const std::pair<int, dvec3> sides[] = {{1, {0, 0, 10}}, {3, {10, 0, 0}}, {7, {0, 10, 0}}};
  for (const auto& [digit, eye] : sides) {
    EXPECT_TRUE(session.press(key(digit)));
    expect_near(session.eye(), eye, 1e-2);
    EXPECT_TRUE(session.press(key(digit), ctrl));
    expect_near(session.eye(), -eye, 1e-2);
  }
  EXPECT_TRUE(session.press(key(1)));
  EXPECT_TRUE(session.press(key(5)));
  EXPECT_NEAR(session.camera.pose().orthographic_height, 20 * std::tan(pi / 9), 1e-9);
  EXPECT_TRUE(session.press(key(5)));
  EXPECT_EQ(session.camera.pose().orthographic_height, 0.0);
  for (int i = 0; i < 6; ++i) EXPECT_TRUE(session.press(key(6)));
  expect_near(session.eye(), {10, 0, 0}, 1e-9);
  EXPECT_TRUE(session.press(key(4)));
  EXPECT_TRUE(session.press(key(8)));
  EXPECT_NEAR(elevation(session.camera.pose()), pi / 12, 1e-9);
  EXPECT_TRUE(session.press(key(2)));
  expect_near(session.eye(), {10 * std::cos(pi / 12), 0, 10 * std::sin(pi / 12)}, 1e-9);
  EXPECT_FALSE(session.press(key(0)));
  EXPECT_FALSE(session.press(key(5), ctrl));
  EXPECT_FALSE(session.press(key(1), alt));
  // From the top view, an orbit continues about +Y.
  EXPECT_TRUE(session.press(key(7)));
  session.down(CUMULET_BUTTON_MIDDLE, 0, 0);
  session.up(CUMULET_BUTTON_MIDDLE, 0, -height / 2);
  expect_near(session.eye(), {0, 0, 10}, 1e-2);
}

TEST(Navigation, FlySpeedIsIndependentOfTheFrameRate) {
  dvec3 ends[3];
  const int frames[] = {1, 30, 1000};
  for (int i = 0; i < 3; ++i) {
    Session session(NavigationStyle::blender, true);
    EXPECT_FALSE(session.navigation.moving());
    EXPECT_TRUE(session.press('W'));
    EXPECT_TRUE(session.press('D'));
    EXPECT_TRUE(session.press('D'));  // a key repeats
    EXPECT_TRUE(session.navigation.moving());
    for (int frame = 0; frame < frames[i]; ++frame) EXPECT_TRUE(session.advance(1.0 / frames[i]));
    EXPECT_TRUE(session.lift('D'));
    EXPECT_TRUE(session.lift('W'));
    EXPECT_FALSE(session.navigation.moving());
    EXPECT_FALSE(session.advance(1.0));
    ends[i] = session.eye();
    EXPECT_NEAR(distance(session.camera.pose()), 10.0, 1e-9);
  }
  expect_near(ends[0], ends[1], 1e-9);
  expect_near(ends[0], ends[2], 1e-9);
  EXPECT_NEAR(glm::length(ends[0] - dvec3(0, 0, 10)), 3.0, 1e-9);  // half of the box's diagonal: 6
  EXPECT_NEAR(ends[0].x, 3.0 / std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(ends[0].z, 10 - 3.0 / std::sqrt(2.0), 1e-9);
}

TEST(Navigation, FlyKeysMoveAlongTheCamerasAxes) {
  const std::pair<char, dvec3> ways[] = {{'W', {0, 0, -1}}, {'S', {0, 0, 1}}, {'A', {-1, 0, 0}},
                                         {'D', {1, 0, 0}},  {'E', {0, 1, 0}}, {'Q', {0, -1, 0}}};
  for (const auto& [key, way] : ways) {
    Session session(NavigationStyle::simple, true);
    EXPECT_TRUE(session.press(key));
    session.advance(1.0);
    expect_near(session.eye(), dvec3(0, 0, 10) + 3.0 * way, 1e-9);
    // Shift is faster, even if it arrives with another event.
    session.move(5, 5, shift);
    session.advance(0.25);
    expect_near(session.eye(), dvec3(0, 0, 10) + 6.0 * way, 1e-9);
    session.move(5, 5);
    session.advance(1.0);
    expect_near(session.eye(), dvec3(0, 0, 10) + 9.0 * way, 1e-9);
    // Keys with ctrl are the host's; so are all keys if fly mode is off.
    Session plain;
    EXPECT_FALSE(plain.press(key));
    EXPECT_FALSE(plain.advance(1.0));
    Session shortcut(NavigationStyle::simple, true);
    EXPECT_FALSE(shortcut.press(key, ctrl));
    EXPECT_FALSE(shortcut.navigation.moving());
  }
  Session both(NavigationStyle::simple, true);
  both.press('W');
  both.press('S');
  EXPECT_FALSE(both.navigation.moving());
  both.lift('S');
  EXPECT_TRUE(both.navigation.moving());
  // Without bounds the speed depends on the distance to the target.
  both.bounds.reset();
  both.advance(1.0);
  expect_near(both.eye(), {0, 0, 5}, 1e-9);
  both.advance(1.0);  // the distance does not shrink
  expect_near(both.eye(), {0, 0, 0}, 1e-9);
}

TEST(Navigation, TurntableSpeedFollowsTheClock) {
  for (const int frames : {1, 25}) {
    Session session;
    NavigationSettings settings;
    settings.turntable_degrees_per_second = 45.0;
    settings.speed = 7.0;  // speed of mouse motion
    session.navigation.set(settings);
    EXPECT_TRUE(session.navigation.moving());
    for (int i = 0; i < frames; ++i) EXPECT_TRUE(session.advance(2.0 / frames));
    expect_near(session.eye(), {10, 0, 0}, 1e-9);
    EXPECT_FALSE(session.advance(0.0));
    EXPECT_FALSE(session.advance(-1.0));
    EXPECT_FALSE(session.advance(NAN));
    settings.turntable_degrees_per_second = 0.0;
    session.navigation.set(settings);
    EXPECT_FALSE(session.navigation.moving());
  }
  // A camera that waits for its bounds is not moved.
  Session waiting;
  waiting.camera.set(CameraPose());
  NavigationSettings settings;
  settings.turntable_degrees_per_second = 45.0;
  waiting.navigation.set(settings);
  EXPECT_FALSE(waiting.advance(1.0));
}

}  // namespace
