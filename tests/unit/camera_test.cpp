// The camera: consistency of its matrices, rays and depths, and fitting it to bounds.

#include "assets/camera.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "support/camera_poses.hpp"

namespace {

using cumulet::test::angle;
using cumulet::test::distance;
using cumulet::test::expect_near;
using cumulet::test::forward;
using cumulet::test::pose_at;
using cumulet::test::project;
using cumulet::test::random_pose;
using cumulet::test::UniformRandom;
using cumulet::test::widest;
using cumulet::viewer::AxisView;
using cumulet::viewer::Bounds;
using cumulet::viewer::Camera;
using cumulet::viewer::CameraPose;
using cumulet::viewer::ClipDepth;
using cumulet::viewer::DepthConvention;
using cumulet::viewer::Subject;
using cumulet::viewer::ViewFrame;
using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr ClipDepth both_clips[] = {ClipDepth::negative_one_to_one, ClipDepth::zero_to_one};

/// Unprojects points of the whole view volume with the inverse matrices. They lie on the frame's rays at the frame's
/// depth.
void expect_frame_agrees(Camera& camera, double aspect, UniformRandom& random, double tolerance = 1e-9) {
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
  UniformRandom random;
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
  UniformRandom random;
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
    UniformRandom random;
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
  UniformRandom random;
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
  UniformRandom random;
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
  UniformRandom random;
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
  UniformRandom random;
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
  UniformRandom random;
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

}  // namespace
