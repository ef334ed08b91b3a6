#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "cumulet/cumulet.h"
#include "headless.hpp"
#include "support/c_api.hpp"
#include "support/osmesa_leaks.hpp"

namespace {

using cumulet::test::CApi;
using cumulet::test::make_desc;

TEST(CApiCreate, ErrorsNameMissingFunctions) {
  char message[200] = "unchanged";
  cumulet_viewer* viewer = reinterpret_cast<cumulet_viewer*>(1);
  auto desc = make_desc<cumulet_create_desc>();
  desc.struct_size = 3;
  EXPECT_EQ(cumulet_create(&desc, &viewer, message, sizeof message), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(viewer, nullptr);
  EXPECT_NE(std::string(message).find("struct_size"), std::string::npos);
  desc = make_desc<cumulet_create_desc>();
  desc.get_proc = [](void*, const char*) -> void* { return nullptr; };
  EXPECT_EQ(cumulet_create(&desc, &viewer, message, sizeof message), CUMULET_ERROR_UNSUPPORTED);
  EXPECT_NE(std::string(message).find("OpenGL"), std::string::npos);
  char tiny[4];
  EXPECT_EQ(cumulet_create(&desc, &viewer, tiny, sizeof tiny), CUMULET_ERROR_UNSUPPORTED);
  EXPECT_EQ(std::strlen(tiny), 3U);
  EXPECT_EQ(cumulet_create(nullptr, &viewer, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_create(&desc, nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST(CApiCreate, RefusesAContextWithoutComputeFunctions) {
  auto context = cumulet::headless::Context::create(cumulet::headless::Backend::automatic);
  auto desc = make_desc<cumulet_create_desc>();
  desc.get_proc = [](void* user, const char* name) -> void* {
    return std::strcmp(name, "glDispatchCompute") == 0 ? nullptr : cumulet::headless::Context::get_proc(user, name);
  };
  desc.get_proc_user = &context;
  cumulet_viewer* viewer = nullptr;
  char message[200];
  EXPECT_EQ(cumulet_create(&desc, &viewer, message, sizeof message), CUMULET_ERROR_UNSUPPORTED);
  EXPECT_EQ(viewer, nullptr);
}

TEST_F(CApi, NullHandlesAndPointersAreErrors) {
  EXPECT_EQ(cumulet_render(nullptr, nullptr, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_render(viewer_, nullptr, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_load_volume(viewer_, nullptr, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_set_grid(viewer_, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_get_stats(viewer_, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_read_linear(viewer_, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(error(), "");
  EXPECT_STREQ(cumulet_last_error(nullptr), "viewer is NULL");
  cumulet_destroy(nullptr);
  cumulet_cancel(nullptr);
}

TEST_F(CApi, EveryStatusHasAText) {
  for (int status = CUMULET_ERROR_TIMEOUT; status <= CUMULET_OK; ++status) {
    EXPECT_STRNE(cumulet_status_text(static_cast<cumulet_status>(status)), "unknown status");
  }
}

TEST_F(CApi, InvalidRampsGiveAOneLineError) {
  using Points = std::vector<float>;
  const auto set = [&](int ramp, const Points& points, std::size_t count) {
    cumulet_ramp which{};
    std::memcpy(&which, &ramp, sizeof which);
    return cumulet_set_ramp(viewer_, which, points.data(), count);
  };
  const float nan = std::nanf("");
  const float inf = INFINITY;
  struct Case {
    Points points;
    const char* cause;
  };
  for (const Case& c :
       {Case{{1, 2}, "the ramp of flame has 1 point; it must have 0 or 2 to 32"},
        Case{Points(66, 1.0F), "the ramp of flame has 33 points; it must have 0 or 2 to 32"},
        Case{{0, 0, 0, 1}, "the ramp of flame has a point 0:1 whose input is not above that of 0:0"},
        Case{{1, 0, 0.7F, 1}, "the ramp of flame has a point 0.7:1 whose input is not above that of 1:0"},
        Case{{0, -1, 1, 0}, "the ramp of flame has a point 0:-1 whose output is not from 0 to 1e30"},
        Case{{0, 1, 1, nan}, "the ramp of flame has a point 1:nan whose output is not from 0 to 1e30"},
        Case{{0, 1, 1, inf}, "the ramp of flame has a point 1:inf whose output is not from 0 to 1e30"},
        Case{{nan, 1, 1, 1}, "the ramp of flame has a point nan:1 whose input is not from -1e30 to 1e30"},
        Case{{0, 1, inf, 1}, "the ramp of flame has a point inf:1 whose input is not from -1e30 to 1e30"}}) {
    EXPECT_EQ(set(CUMULET_RAMP_FLAME, c.points, c.points.size() / 2), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(error(), c.cause);
  }
  EXPECT_EQ(cumulet_set_ramp(viewer_, CUMULET_RAMP_FLAME, nullptr, 2), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(error(), "points are NULL");
  EXPECT_EQ(set(3, {0, 0, 1, 1}, 2), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(error(), "ramp is unknown");
  EXPECT_EQ(set(0, {0, 0, 1, 1}, ~std::size_t{0}), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(set(CUMULET_RAMP_TEMPERATURE, {-1, 0, 1, 3}, 2), CUMULET_OK);
  EXPECT_EQ(cumulet_set_ramp(viewer_, CUMULET_RAMP_TEMPERATURE, nullptr, 0), CUMULET_OK);
}

TEST_F(CApi, InvalidColorRampsGiveAOneLineError) {
  using Stops = std::vector<float>;
  struct Case {
    cumulet_ramp ramp;
    Stops stops;
    const char* cause;
  };
  const float nan = std::nanf("");
  for (const Case& c :
       {Case{CUMULET_RAMP_FLAME, {1, 2, 3, 4}, "the color ramp of flame has 1 point; it must have 0 or 2 to 32"},
        Case{CUMULET_RAMP_FLAME, Stops(132, 1.0F), "the color ramp of flame has 33 points; it must have 0 or 2 to 32"},
        Case{CUMULET_RAMP_TEMPERATURE,
             {1, 0, 0, 0, 0.5F, 0, 0.25F, 1},
             "the color ramp of temperature has a point 0.5:0/0.25/1 whose input is not above that of 1:0/0/0"},
        Case{CUMULET_RAMP_DENSITY,
             {0, 0, 0, 0, 1, 0.5F, 1.5F, 0},
             "the color ramp of density has a point 1:0.5/1.5/0 whose color is not from 0 to 1"},
        Case{CUMULET_RAMP_FLAME,
             {0, 0, 0, 0, 1, 0.5F, 1.5F, -1},
             "the color ramp of flame has a point 1:0.5/1.5/-1 whose color is not from 0 to 1e30"},
        Case{CUMULET_RAMP_FLAME,
             {0, nan, 0, 0, 1, 0, 0, 0},
             "the color ramp of flame has a point 0:nan/0/0 whose color is not from 0 to 1e30"},
        Case{CUMULET_RAMP_FLAME,
             {nan, 0, 0, 0, 1, 0, 0, 0},
             "the color ramp of flame has a point nan:0/0/0 whose input is not from -1e30 to 1e30"}}) {
    EXPECT_EQ(cumulet_set_color_ramp(viewer_, c.ramp, c.stops.data(), c.stops.size() / 4),
              CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(error(), c.cause);
  }
  EXPECT_EQ(cumulet_set_color_ramp(viewer_, CUMULET_RAMP_FLAME, nullptr, 2), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(error(), "stops are NULL");
  const Stops good = {-1, 0, 0, 0, 1, 1, 1, 1};
  cumulet_ramp unknown{};
  const int number = 3;
  std::memcpy(&unknown, &number, sizeof unknown);
  EXPECT_EQ(cumulet_set_color_ramp(viewer_, unknown, good.data(), 2), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(error(), "ramp is unknown");
  EXPECT_EQ(cumulet_set_color_ramp(viewer_, CUMULET_RAMP_DENSITY, good.data(), 2), CUMULET_OK);
  EXPECT_EQ(cumulet_set_color_ramp(viewer_, CUMULET_RAMP_DENSITY, nullptr, 0), CUMULET_OK);
}

TEST_F(CApi, ChecksSizesEnumsAndNumbers) {
  auto grid = make_desc<cumulet_grid_desc>();
  EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_OK);
  EXPECT_EQ(error(), "");
  grid.struct_size = sizeof grid + 8;
  EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(error().find("struct_size"), std::string::npos);
  grid.struct_size = 0;
  EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_ERROR_INVALID_ARGUMENT);
  grid.struct_size = sizeof(size_t) + sizeof(cumulet_grid_type);  // an older, shorter struct
  EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_OK);
  grid = make_desc<cumulet_grid_desc>();
  for (const int wrong : {3, 77}) {
    std::memcpy(&grid.type, &wrong, sizeof wrong);
    EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(error().find("type"), std::string::npos);
  }
  grid = make_desc<cumulet_grid_desc>();
  grid.threshold = std::nan("");
  EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_ERROR_INVALID_ARGUMENT);

  auto medium = make_desc<cumulet_medium_desc>();
  medium.anisotropy = 1.0F;
  EXPECT_EQ(cumulet_set_medium(viewer_, &medium), CUMULET_ERROR_INVALID_ARGUMENT);
  medium.anisotropy = 0.5F;
  medium.coalbedo[1] = 1.5F;
  EXPECT_EQ(cumulet_set_medium(viewer_, &medium), CUMULET_ERROR_INVALID_ARGUMENT);
  medium.coalbedo[1] = 0.0F;
  medium.emission[2] = -1.0F;
  EXPECT_EQ(cumulet_set_medium(viewer_, &medium), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(error().find("emission"), std::string::npos);
  auto light = make_desc<cumulet_sun_sky_desc>();
  light.sky_radiance[2] = -1.0F;
  EXPECT_EQ(cumulet_set_sun_sky(viewer_, &light), CUMULET_ERROR_INVALID_ARGUMENT);
  cumulet_camera* view = nullptr;
  ASSERT_EQ(cumulet_get_camera(viewer_, &view), CUMULET_OK);
  auto camera = make_desc<cumulet_camera_desc>();
  camera.fovy_degrees = 200.0;
  EXPECT_EQ(cumulet_camera_set(view, &camera), CUMULET_ERROR_INVALID_ARGUMENT);
  camera.fovy_degrees = 0.0;
  camera.eye[0] = INFINITY;
  EXPECT_EQ(cumulet_camera_set(view, &camera), CUMULET_ERROR_INVALID_ARGUMENT);
  cumulet_camera_release(view);
  auto frame = make_desc<cumulet_frame_desc>();
  frame.target = CUMULET_TARGET_NONE;
  EXPECT_EQ(cumulet_render(viewer_, &frame, nullptr), CUMULET_OK);  // size zero is legal
  frame.width = frame.height = 4;
  frame.viewport[2] = 5;
  frame.viewport[3] = 1;
  EXPECT_EQ(cumulet_render(viewer_, &frame, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(error().find("viewport"), std::string::npos);
  frame.viewport[2] = frame.viewport[3] = 0;
  frame.budget_ms = std::nan("");
  EXPECT_EQ(cumulet_render(viewer_, &frame, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  frame.budget_ms = 1.0;
  EXPECT_EQ(cumulet_render(viewer_, &frame, nullptr), CUMULET_OK);  // nothing is loaded, so nothing is shown
  float pixels[64];
  EXPECT_EQ(cumulet_read_linear(viewer_, pixels, 64), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(CApi, MissingFileErrorNamesTheFile) {
  EXPECT_EQ(cumulet_load_volume(viewer_, "no such cloud.vdb", nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_ERROR_FILE);
  EXPECT_NE(error().find("no such cloud.vdb"), std::string::npos);
  EXPECT_EQ(error().find('\n'), std::string::npos);
  auto progress = make_desc<cumulet_progress>();
  EXPECT_EQ(cumulet_get_progress(viewer_, &progress), CUMULET_OK);
  EXPECT_EQ(progress.stage, CUMULET_STAGE_IDLE);
  EXPECT_EQ(progress.status, CUMULET_ERROR_FILE);
  EXPECT_EQ(error(), std::string(progress.message));
  EXPECT_EQ(progress.volume_status, CUMULET_ERROR_FILE);
  EXPECT_EQ(error(), std::string(progress.volume_message));
  EXPECT_EQ(progress.surfaces_status, CUMULET_OK);
  auto frame = make_desc<cumulet_frame_desc>();
  auto result = make_desc<cumulet_frame_result>();
  EXPECT_EQ(cumulet_render(viewer_, &frame, &result), CUMULET_OK);
  EXPECT_EQ(result.flags, static_cast<uint32_t>(CUMULET_RENDER_FAILED));
  auto stats = make_desc<cumulet_stats>();
  EXPECT_EQ(cumulet_get_stats(viewer_, &stats), CUMULET_OK);
  EXPECT_EQ(stats.cells, 0U);
  EXPECT_NE(std::string(stats.gl_version), "");
}

TEST(CApiVersion, MatchesTheHeader) { EXPECT_EQ(cumulet_version(), 200U); }

}  // namespace
