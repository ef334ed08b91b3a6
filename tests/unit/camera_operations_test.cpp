// Operations of the camera: orbit, look, roll, pan, dolly, fly and axis views.

#include "assets/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <thread>
#include <vector>

#include "base/error.hpp"
#include "support/camera_poses.hpp"

namespace {

using cumulet::test::angle;
using cumulet::test::distance;
using cumulet::test::elevation;
using cumulet::test::expect_near;
using cumulet::test::forward;
using cumulet::test::pose_at;
using cumulet::test::project;
using cumulet::test::random_pose;
using cumulet::test::UniformRandom;
using cumulet::viewer::AxisView;
using cumulet::viewer::Bounds;
using cumulet::viewer::Camera;
using cumulet::viewer::CameraPose;
using cumulet::viewer::ClipDepth;
using cumulet::viewer::ViewFrame;
using glm::dmat4;
using glm::dvec2;
using glm::dvec3;

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

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
  UniformRandom random;
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
  UniformRandom random;
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

}  // namespace
