// NULL and NaN arguments return one-line errors. Debug groups of a host whose stack is full.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "cumulet/cumulet.h"
#include "support/c_host.hpp"

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::converge;
using cumulet::test::HostTarget;
using cumulet::test::load_gl;
using cumulet::test::make_ball;
using cumulet::test::make_desc;
using cumulet::test::make_viewer;
using cumulet::test::picture_of;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;

constexpr int side = 16;
constexpr std::size_t pixels = side * side;

class ApiArguments : public testing::Test {
 protected:
  void expect_refused(const char* what, cumulet_status status, const std::string& line) const {
    SCOPED_TRACE(what);
    EXPECT_EQ(status, CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(std::string(cumulet_last_error(v_)), line);
  }

  Context context_ = Context::create(Backend::automatic);
  GladGLContext gl_ = load_gl(Context::get_proc, &context_);
  HostTarget target_{gl_, side, side};
  ViewerPtr viewer_ = make_viewer({.get_proc = Context::get_proc, .user = &context_});
  cumulet_viewer* v_ = viewer_.get();
  VolumeRef volume_ = make_ball(8, 2.0F);
};

TEST_F(ApiArguments, ReadingIntoNullIsAnError) {
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.preview = CUMULET_PREVIEW_OFF;
  sampling.light_groups = 1;
  sampling.samples = 1;
  ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  picture_of(v_, volume_.get(), target_);
  expect_refused("linear", cumulet_read_linear(v_, nullptr, 4 * pixels), "rgba is NULL");
  expect_refused("display", cumulet_read_display(v_, nullptr, 4 * pixels), "rgba is NULL");
  const auto denoise = make_desc<cumulet_denoise_desc>();
  expect_refused("denoised", cumulet_read_denoised(v_, &denoise, nullptr, 4 * pixels), "rgba is NULL");
  expect_refused("aov", cumulet_read_aov(v_, CUMULET_AOV_SURFACE_DEPTH, nullptr, pixels), "values is NULL");
  expect_refused("group", cumulet_read_light_group(v_, 0, nullptr, 3 * pixels), "rgb is NULL");
  const auto name = [](void*, cumulet_object_kind, uint64_t, uint32_t) { return "a"; };
  expect_refused("mattes", cumulet_read_cryptomatte(v_, name, nullptr, 2, nullptr, 4 * pixels), "values is NULL");
  expect_refused("mattes", cumulet_read_cryptomatte(v_, nullptr, nullptr, 2, nullptr, 4 * pixels), "name is NULL");
  expect_refused("accumulation", cumulet_read_accumulation(v_, nullptr, nullptr), "size is NULL");
  expect_refused("accumulation", cumulet_restore_accumulation(v_, nullptr, 64), "bytes is NULL");
  expect_refused("noise", cumulet_measure_noise(v_, nullptr), "noise is NULL");
  std::array<uint8_t, 4> bytes{};
  expect_refused("encode", cumulet_encode_display(v_, nullptr, bytes.data(), 4), "linear or rgba is NULL");
  std::array<double, 3> box{};
  expect_refused("bounds", cumulet_get_bounds(v_, box.data(), nullptr), "box_min or box_max is NULL");
  expect_refused("interpolation", cumulet_get_interpolation(v_, nullptr), "interpolation is NULL");
  // A buffer that is too small has a different error.
  std::vector<float> few(4);
  expect_refused("few", cumulet_read_linear(v_, few.data(), few.size()), "the image needs 1024 floats");
}

TEST_F(ApiArguments, NonFinitePositionsAndTimesAreRejected) {
  picture_of(v_, volume_.get(), target_);
  const double nan = std::nan("");
  auto pick = make_desc<cumulet_pick>();
  for (const double bad : {nan, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}) {
    expect_refused("x", cumulet_pick_at(v_, bad, 1.0, &pick), "x or y is not finite");
    expect_refused("y", cumulet_pick_at(v_, 1.0, bad, &pick), "x or y is not finite");
  }
  expect_refused("pick", cumulet_pick_at(v_, 1.0, 1.0, nullptr), "cumulet_pick is NULL");
  EXPECT_EQ(cumulet_pick_at(v_, -1.0, 1e9, &pick), CUMULET_OK);
  EXPECT_EQ(pick.hit, 0);
  EXPECT_EQ(cumulet_pick_at(v_, 0.5 * side, 0.5 * side, &pick), CUMULET_OK);
  EXPECT_EQ(pick.hit, 1);
  expect_refused("wait", cumulet_wait(v_, nan), "timeout_ms is not a number");
  expect_refused("camera", cumulet_set_previous_camera(v_, nullptr, nan), "seconds is not from -1e9 to 1e9");
  expect_refused("camera", cumulet_set_camera(v_, nullptr), "camera is NULL");
  auto event = make_desc<cumulet_event>();
  event.x = nan;
  expect_refused("event", cumulet_input(v_, &event, nullptr), "cumulet_event's position or wheel is out of range");
  expect_refused("event", cumulet_input(v_, nullptr, nullptr), "cumulet_event is NULL");
  std::array<double, 16> matrix{};
  matrix.fill(nan);
  expect_refused("places", cumulet_set_volume_transforms(v_, matrix.data(), 1), "transform 0: to_world is not finite");
  expect_refused("places", cumulet_set_volume_transforms(v_, nullptr, 1), "transforms are NULL");
  expect_refused("shutter", cumulet_set_volume_shutter_transforms(v_, matrix.data(), nullptr, 1),
                 "transform 0: open_to_world is not finite");
  auto frame = target_.frame();
  frame.budget_ms = nan;
  expect_refused("budget", cumulet_render(v_, &frame, nullptr),
                 "cumulet_frame_desc.budget_ms is above 1e9 or not finite");
  frame = target_.frame();
  frame.scale = nan;
  expect_refused("scale", cumulet_render(v_, &frame, nullptr), "cumulet_frame_desc.scale is not from 0.1 to 16");
  auto map = make_desc<cumulet_transmittance_map>();
  auto request = make_desc<cumulet_transmittance_map_desc>();
  request.light = CUMULET_MAP_LIGHT_POINT;
  request.position[1] = nan;
  expect_refused("map", cumulet_update_transmittance_map(v_, &request, &map),
                 "cumulet_transmittance_map_desc.position is not finite");
  request.position[1] = 0.0;
  request.budget_ms = nan;
  expect_refused("map", cumulet_update_transmittance_map(v_, &request, &map),
                 "cumulet_transmittance_map_desc.budget_ms is not from 0 to 1e9");
  expect_refused("paths", cumulet_load_volume(v_, nullptr, nullptr), "path is NULL or empty");
  std::array<char, 64> error{};
  cumulet_inspection* inspection = nullptr;
  EXPECT_EQ(cumulet_inspect_volume_file("", &inspection, error.data(), error.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(error.data(), "path is NULL or empty");
  const auto each = [](void*, const char*, const char*, const char*) {};
  EXPECT_EQ(cumulet_list_grids("", each, nullptr, error.data(), error.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(error.data(), "path is NULL or empty");
}

// The driver rejects a debug group beyond its limit. Popping it would pop one of the host's groups.
TEST_F(ApiArguments, FullDebugGroupStackIsNotPopped) {
  picture_of(v_, volume_.get(), target_);
  GLint most = 0;
  GLint before = 0;
  gl_.GetIntegerv(GL_MAX_DEBUG_GROUP_STACK_DEPTH, &most);
  gl_.GetIntegerv(GL_DEBUG_GROUP_STACK_DEPTH, &before);
  ASSERT_GT(most, before + 3);
  const auto depth = [&] {
    GLint now = 0;
    gl_.GetIntegerv(GL_DEBUG_GROUP_STACK_DEPTH, &now);
    return now;
  };
  // From two free entries, the most that the library uses, down to none.
  while (depth() < most - 2) gl_.PushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, -1, "host");
  for (GLint free = 2; free >= 0; --free) {
    SCOPED_TRACE(free);
    ASSERT_EQ(depth(), most - free);
    const auto frame = target_.frame();
    EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
    EXPECT_EQ(depth(), most - free);
    auto result = make_desc<cumulet_warm_up_result>();
    EXPECT_EQ(cumulet_warm_up(v_, &frame, CUMULET_WARM_UP_SCENE, &result), CUMULET_OK);
    std::vector<float> linear(4 * pixels);
    EXPECT_EQ(cumulet_read_linear(v_, linear.data(), linear.size()), CUMULET_OK);
    EXPECT_EQ(depth(), most - free);
    EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
    if (free > 0) gl_.PushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, -1, "host");
  }
  while (depth() > before) gl_.PopDebugGroup();
  EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
}

}  // namespace
