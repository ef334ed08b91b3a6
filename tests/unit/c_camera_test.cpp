// The camera through the C API.

#include "assets/camera.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <memory>
#include <utility>

#include "cumulet/cumulet.h"
#include "support/camera_poses.hpp"

namespace {

using cumulet::test::expect_near;
using cumulet::test::pose_at;
using cumulet::viewer::Camera;
using cumulet::viewer::CameraPose;
using cumulet::viewer::ClipDepth;
using glm::dmat4;
using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();

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

}  // namespace
