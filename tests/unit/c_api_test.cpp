#include <gtest/gtest.h>

#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "cumulet/cumulet.h"
#include "headless.hpp"

extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa.so\n"; }

namespace {

template <class Desc>
Desc make_desc() {
  Desc desc{};
  desc.struct_size = sizeof(Desc);
  return desc;
}

class CApi : public testing::Test {
 protected:
  CApi() : context_(cumulet::headless::Context::create(cumulet::headless::Backend::automatic)) {}

  void SetUp() override {
    auto desc = make_desc<cumulet_create_desc>();
    desc.get_proc = cumulet::headless::Context::get_proc;
    desc.get_proc_user = &context_;
    ASSERT_EQ(cumulet_create(&desc, &viewer_, nullptr, 0), CUMULET_OK);
  }
  void TearDown() override { cumulet_destroy(viewer_); }

  [[nodiscard]] std::string error() const { return cumulet_last_error(viewer_); }

  cumulet::headless::Context context_;
  cumulet_viewer* viewer_ = nullptr;
};

TEST(CApiCreate, SaysWhatIsMissing) {
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

TEST_F(CApi, ChecksSizesEnumsAndNumbers) {
  auto grid = make_desc<cumulet_grid_desc>();
  EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_OK);
  EXPECT_EQ(error(), "");
  grid.struct_size = sizeof grid + 8;
  EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(error().find("struct_size"), std::string::npos);
  grid.struct_size = 0;
  EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_ERROR_INVALID_ARGUMENT);
  grid.struct_size = sizeof(size_t) + sizeof(cumulet_march);  // an older, shorter struct
  EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_OK);
  grid = make_desc<cumulet_grid_desc>();
  for (const int wrong : {3, 77}) {
    std::memcpy(&grid.march, &wrong, sizeof wrong);
    EXPECT_EQ(cumulet_set_grid(viewer_, &grid), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(error().find("march"), std::string::npos);
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
  auto light = make_desc<cumulet_light_desc>();
  light.sky_radiance[2] = -1.0F;
  EXPECT_EQ(cumulet_set_light(viewer_, &light), CUMULET_ERROR_INVALID_ARGUMENT);
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
  EXPECT_EQ(cumulet_render(viewer_, &frame, nullptr), CUMULET_OK);  // nothing is loaded: nothing is shown
  float pixels[64];
  EXPECT_EQ(cumulet_read_linear(viewer_, pixels, 64), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(CApi, MissingFileNamesIt) {
  EXPECT_EQ(cumulet_load_volume(viewer_, "no such cloud.vdb", nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_ERROR_FILE);
  EXPECT_NE(error().find("no such cloud.vdb"), std::string::npos);
  EXPECT_EQ(error().find('\n'), std::string::npos);
  auto progress = make_desc<cumulet_progress>();
  EXPECT_EQ(cumulet_get_progress(viewer_, &progress), CUMULET_OK);
  EXPECT_EQ(progress.stage, CUMULET_STAGE_IDLE);
  EXPECT_EQ(progress.status, CUMULET_ERROR_FILE);
  EXPECT_EQ(error(), std::string(progress.message));
  auto frame = make_desc<cumulet_frame_desc>();
  auto result = make_desc<cumulet_frame_result>();
  EXPECT_EQ(cumulet_render(viewer_, &frame, &result), CUMULET_OK);
  EXPECT_EQ(result.flags, static_cast<uint32_t>(CUMULET_RENDER_FAILED));
  auto stats = make_desc<cumulet_stats>();
  EXPECT_EQ(cumulet_get_stats(viewer_, &stats), CUMULET_OK);
  EXPECT_EQ(stats.cells, 0U);
  EXPECT_NE(std::string(stats.gl_version), "");
}

TEST(CApiVersion, IsTheHeaders) { EXPECT_EQ(cumulet_version(), 200U); }

/// One triangle, 2 wide and 2 high, that moves 5 to the right in 2 seconds, and a camera, in a file of its own.
class CApiSurfaces : public CApi {
 protected:
  void SetUp() override {
    CApi::SetUp();
    path_ = (std::filesystem::temp_directory_path() / ("c_api_" + std::to_string(getpid()) + ".gltf")).string();
    const float floats[] = {-1, -1, 0, 1, -1, 0, 0, 1, 0, 0, 2, 0, 0, 0, 5, 0, 0};
    std::ofstream(path_ + ".bin", std::ios::binary).write(reinterpret_cast<const char*>(floats), sizeof floats);
    std::ofstream(path_) << R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
      "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 10]}],
      "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
      "animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                      "samplers": [{"input": 1, "output": 2}]}],
      "buffers": [{"byteLength": 68, "uri": ")"
                         << std::filesystem::path(path_).filename().string() << R"(.bin"}],
      "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 8},
                      {"buffer": 0, "byteOffset": 44, "byteLength": 24}],
      "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [2]},
        {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}]})";
  }
  void TearDown() override {
    CApi::TearDown();
    std::filesystem::remove(path_);
    std::filesystem::remove(path_ + ".bin");
  }
  [[nodiscard]] cumulet_surfaces_info info() const {
    auto info = make_desc<cumulet_surfaces_info>();
    EXPECT_EQ(cumulet_get_surfaces_info(viewer_, &info), CUMULET_OK) << error();
    return info;
  }
  /// Until converged; the mean alpha of the picture.
  double coverage() {
    auto frame = make_desc<cumulet_frame_desc>();
    frame.target = CUMULET_TARGET_NONE;
    frame.width = frame.height = 16;
    auto result = make_desc<cumulet_frame_result>();
    for (int i = 0; i < 2000 && (result.flags & CUMULET_RENDER_CONVERGED) == 0; ++i) {
      EXPECT_EQ(cumulet_render(viewer_, &frame, &result), CUMULET_OK) << error();
      cumulet_wait(viewer_, -1.0);
    }
    EXPECT_NE(result.flags & CUMULET_RENDER_CONVERGED, 0U);
    std::vector<float> rgba(16 * 16 * 4);
    EXPECT_EQ(cumulet_read_linear(viewer_, rgba.data(), rgba.size()), CUMULET_OK) << error();
    double sum = 0.0;
    for (std::size_t i = 3; i < rgba.size(); i += 4) sum += rgba[i];
    return sum / 256.0;
  }

  std::string path_;
};

TEST_F(CApiSurfaces, LoadPoseLookAndRemove) {
  auto none = make_desc<cumulet_surfaces_info>();
  EXPECT_EQ(cumulet_get_surfaces_info(viewer_, &none), CUMULET_ERROR_INVALID_ARGUMENT);
  ASSERT_EQ(cumulet_load_surfaces(viewer_, path_.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  EXPECT_EQ(info().triangles, 1U);
  EXPECT_EQ(info().cameras, 1U);
  EXPECT_EQ(info().animations, 1U);
  EXPECT_DOUBLE_EQ(info().duration, 2.0);
  double low[3];
  double high[3];
  ASSERT_EQ(cumulet_get_bounds(viewer_, low, high), CUMULET_OK);
  EXPECT_DOUBLE_EQ(low[0], -1.0);
  EXPECT_DOUBLE_EQ(high[1], 1.0);

  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 32;
  ASSERT_EQ(cumulet_set_sampling(viewer_, &sampling), CUMULET_OK);
  auto display = make_desc<cumulet_display_desc>();
  display.background = CUMULET_BACKGROUND_TRANSPARENT;
  ASSERT_EQ(cumulet_set_display(viewer_, &display), CUMULET_OK);
  EXPECT_EQ(cumulet_use_surface_camera(viewer_, 1), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(error().find("camera 1"), std::string::npos);
  ASSERT_EQ(cumulet_use_surface_camera(viewer_, 0), CUMULET_OK) << error();
  // The triangle's area over that of the picture's plane.
  const double side = 2.0 * 10.0 * std::tan(0.25);
  EXPECT_NEAR(coverage(), 2.0 / (side * side), 0.01);

  auto surfaces = make_desc<cumulet_surfaces_desc>();
  surfaces.time = 1.0;
  ASSERT_EQ(cumulet_set_surfaces(viewer_, &surfaces), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  EXPECT_NEAR(info().bounds_min[0], 1.5, 1e-5);
  surfaces.time = std::nan("");
  EXPECT_EQ(cumulet_set_surfaces(viewer_, &surfaces), CUMULET_ERROR_INVALID_ARGUMENT);
  surfaces = make_desc<cumulet_surfaces_desc>();
  const unsigned unknown = 7;
  std::memcpy(&surfaces.light, &unknown, sizeof unknown);
  EXPECT_EQ(cumulet_set_surfaces(viewer_, &surfaces), CUMULET_ERROR_INVALID_ARGUMENT);

  EXPECT_EQ(cumulet_load_surfaces(viewer_, ""), CUMULET_ERROR_INVALID_ARGUMENT);
  ASSERT_EQ(cumulet_load_surfaces(viewer_, nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_get_bounds(viewer_, low, high), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(CApiSurfaces, ABadFileLosesNothing) {
  ASSERT_EQ(cumulet_load_surfaces(viewer_, path_.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  ASSERT_EQ(cumulet_load_surfaces(viewer_, (path_ + ".none").c_str()), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_ERROR_FILE);
  EXPECT_NE(error().find(path_ + ".none: "), std::string::npos) << error();
  auto progress = make_desc<cumulet_progress>();
  ASSERT_EQ(cumulet_get_progress(viewer_, &progress), CUMULET_OK);
  EXPECT_EQ(progress.status, CUMULET_ERROR_FILE);
  EXPECT_EQ(info().triangles, 1U);
  // A good one then clears the failure.
  ASSERT_EQ(cumulet_load_surfaces(viewer_, path_.c_str()), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
}

}  // namespace
