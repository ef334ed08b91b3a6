// Surfaces through the C API: files, files in memory and variants.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cumulet/cumulet.h"
#include "support/c_api.hpp"
#include "support/c_surfaces.hpp"
#include "support/file_bytes.hpp"
#include "support/folder.hpp"

namespace {

using cumulet::test::bytes_of;
using cumulet::test::CApiSurfaces;
using cumulet::test::make_desc;

TEST_F(CApiSurfaces, LoadPoseLookAndRemove) {
  EXPECT_EQ(shown(), nullptr);
  ASSERT_EQ(cumulet_load_surfaces(viewer_, path_.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  cumulet_surfaces* loaded = shown();
  ASSERT_NE(loaded, nullptr);
  EXPECT_EQ(info_of(loaded).triangles, 1U);
  EXPECT_EQ(std::string(info_of(loaded).name), path_.substr(0, 127));
  cumulet_surfaces* again = shown();
  EXPECT_EQ(again, loaded);
  cumulet_surfaces_release(again);
  cumulet_surfaces_release(loaded);
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
  // The triangle's area divided by the area that the image covers.
  const double side = 2.0 * 10.0 * std::tan(0.25);
  EXPECT_NEAR(coverage(viewer_), 2.0 / (side * side), 0.01);

  auto surfaces = make_desc<cumulet_surface_settings_desc>();
  surfaces.time = 1.0;
  ASSERT_EQ(cumulet_set_surface_settings(viewer_, &surfaces), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  ASSERT_EQ(cumulet_get_bounds(viewer_, low, high), CUMULET_OK);
  EXPECT_NEAR(low[0], 1.5, 1e-5);
  surfaces.time = std::nan("");
  EXPECT_EQ(cumulet_set_surface_settings(viewer_, &surfaces), CUMULET_ERROR_INVALID_ARGUMENT);
  surfaces = make_desc<cumulet_surface_settings_desc>();
  const unsigned unknown = 7;
  std::memcpy(&surfaces.lighting, &unknown, sizeof unknown);
  EXPECT_EQ(cumulet_set_surface_settings(viewer_, &surfaces), CUMULET_ERROR_INVALID_ARGUMENT);
  for (const float roughness : {-0.1F, 1.1F, std::nanf("")}) {
    surfaces = make_desc<cumulet_surface_settings_desc>();
    surfaces.indirect_roughness = roughness;
    EXPECT_EQ(cumulet_set_surface_settings(viewer_, &surfaces), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(error().find("indirect_roughness"), std::string::npos);
  }

  EXPECT_EQ(cumulet_load_surfaces(viewer_, ""), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_load_surfaces(viewer_, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, nullptr), CUMULET_OK);
  EXPECT_EQ(shown(), nullptr);
  EXPECT_EQ(cumulet_get_bounds(viewer_, low, high), CUMULET_ERROR_INVALID_ARGUMENT);
}

// Models of Khronos' glTF-Validator: each model without validation errors must converge.
TEST_F(CApiSurfaces, EveryValidModelOfTheValidatorConverges) {
  const std::filesystem::path suite = std::filesystem::path(CUMULET_SHARED_DATA) / "gltf" / "khronos_validator";
  if (!std::filesystem::exists(suite)) GTEST_SKIP() << "no shared data";
  look(viewer_);
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 1;
  ASSERT_EQ(cumulet_set_sampling(viewer_, &sampling), CUMULET_OK);
  std::size_t pictures = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(suite)) {
    constexpr std::string_view ending = ".report.json";
    const std::string path = entry.path().string();
    if (!path.ends_with(ending)) continue;
    const std::string report = bytes_of(path);
    if (report.find("\"numErrors\": 0,") == std::string::npos) continue;
    const std::string model = path.substr(0, path.size() - ending.size());
    SCOPED_TRACE(model);
    ASSERT_EQ(cumulet_load_surfaces(viewer_, model.c_str()), CUMULET_OK);
    ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
    picture(viewer_);
    ++pictures;
    if (HasFailure()) break;
  }
  EXPECT_GE(pictures, 129U);
}

// One-sided materials are invisible from behind unless the viewer shows both sides. Path traced and rasterized.
TEST_F(CApiSurfaces, DoubleSidedShowsEmissiveBackFaces) {
  std::string text = bytes_of(path_);
  const auto replace = [&text](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace(R"("attributes": {"POSITION": 0})", R"("attributes": {"POSITION": 0}, "material": 0)");
  replace(R"("scene": 0,)", R"("scene": 0, "materials": [{"emissiveFactor": [0.5, 0.5, 0.5]}],)");
  std::ofstream(path_) << text;
  ASSERT_EQ(cumulet_load_surfaces(viewer_, path_.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  const auto middle = [&] {
    const std::vector<float> rgba = picture(viewer_);
    return std::pair(rgba[4 * (8 * 16 + 8)], rgba[4 * (8 * 16 + 8) + 3]);
  };
  for (const cumulet_surface_lighting light : {CUMULET_SURFACE_LIGHTING_GLOBAL, CUMULET_SURFACE_LIGHTING_RASTERIZED}) {
    SCOPED_TRACE(light);
    auto settings = make_desc<cumulet_surface_settings_desc>();
    settings.lighting = light;
    for (const int32_t both : {0, 1, 0}) {
      settings.double_sided = both;
      ASSERT_EQ(cumulet_set_surface_settings(viewer_, &settings), CUMULET_OK);
      ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
      look(viewer_, -10.0);
      EXPECT_NEAR(middle().first, both == 1 ? 0.5F : 0.0F, 1e-3F);
      EXPECT_EQ(middle().second, both == 1 ? 1.0F : 0.0F);
      look(viewer_, 10.0);
      EXPECT_NEAR(middle().first, 0.5F, 1e-3F);
    }
  }
  auto settings = make_desc<cumulet_surface_settings_desc>();
  settings.double_sided = 2;
  EXPECT_EQ(cumulet_set_surface_settings(viewer_, &settings), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(error().find("double_sided is not 0 or 1"), std::string::npos);
}

TEST_F(CApiSurfaces, VolumeFailureIsReportedDespiteSurfaces) {
  ASSERT_EQ(cumulet_load_volume(viewer_, "no such cloud.vdb", nullptr), CUMULET_OK);
  ASSERT_EQ(cumulet_load_surfaces(viewer_, path_.c_str()), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_ERROR_FILE);
  look(viewer_, 10.0);
  EXPECT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_ERROR_FILE);
  auto progress = make_desc<cumulet_progress>();
  ASSERT_EQ(cumulet_get_progress(viewer_, &progress), CUMULET_OK);
  EXPECT_EQ(progress.volume_status, CUMULET_ERROR_FILE);
  EXPECT_EQ(progress.surfaces_status, CUMULET_OK);
}

TEST_F(CApiSurfaces, InvalidFileKeepsTheScene) {
  ASSERT_EQ(cumulet_load_surfaces(viewer_, path_.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  ASSERT_EQ(cumulet_load_surfaces(viewer_, (path_ + ".none").c_str()), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_ERROR_FILE);
  EXPECT_NE(error().find(path_ + ".none: "), std::string::npos) << error();
  auto progress = make_desc<cumulet_progress>();
  ASSERT_EQ(cumulet_get_progress(viewer_, &progress), CUMULET_OK);
  EXPECT_EQ(progress.status, CUMULET_ERROR_FILE);
  EXPECT_EQ(progress.surfaces_status, CUMULET_ERROR_FILE);
  EXPECT_EQ(error(), std::string(progress.surfaces_message));
  EXPECT_EQ(progress.volume_status, CUMULET_OK);
  EXPECT_EQ(std::string(progress.volume_message), "");
  cumulet_surfaces* kept = shown();
  EXPECT_EQ(info_of(kept).triangles, 1U);
  cumulet_surfaces_release(kept);
  // A successful load clears the failure.
  ASSERT_EQ(cumulet_load_surfaces(viewer_, path_.c_str()), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
}

TEST_F(CApiSurfaces, VariantsAreListed) {
  const std::string text = R"({"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_materials_variants"],
      "extensions": {"KHR_materials_variants": {"variants": [{"name": "day"}, {"name": "night"}]}}})";
  cumulet_surfaces* surfaces = nullptr;
  ASSERT_EQ(cumulet_surfaces_from_memory(text.data(), text.size(), nullptr, "made", &surfaces, nullptr, 0), CUMULET_OK);
  EXPECT_EQ(info_of(surfaces).variants, 2U);
  auto variant = make_desc<cumulet_variant_info>();
  EXPECT_EQ(cumulet_surfaces_get_variant(surfaces, 1, &variant), CUMULET_OK);
  EXPECT_STREQ(variant.name, "night");
  EXPECT_EQ(cumulet_surfaces_get_variant(surfaces, 2, &variant), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_surfaces_get_variant(nullptr, 0, &variant), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_surfaces_get_variant(surfaces, 0, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  cumulet_surfaces_release(surfaces);
}

TEST_F(CApiSurfaces, HandlesOpenFilesAndDescribeThem) {
  char error[512] = "";
  cumulet_surfaces* surfaces = nullptr;
  ASSERT_EQ(cumulet_surfaces_open(path_.c_str(), &surfaces, error, sizeof error), CUMULET_OK) << error;
  const cumulet_surfaces_info info = info_of(surfaces);
  EXPECT_EQ(info.triangles, 1U);
  EXPECT_EQ(info.cameras, 1U);
  EXPECT_EQ(info.lights, 0U);
  EXPECT_EQ(info.animations, 1U);
  EXPECT_DOUBLE_EQ(info.bounds_min[0], -1.0);
  EXPECT_DOUBLE_EQ(info.bounds_max[1], 1.0);
  auto animation = make_desc<cumulet_animation_info>();
  EXPECT_EQ(cumulet_surfaces_get_animation(surfaces, 0, &animation), CUMULET_OK);
  EXPECT_DOUBLE_EQ(animation.duration, 2.0);
  EXPECT_EQ(cumulet_surfaces_get_animation(surfaces, 1, &animation), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_surfaces_get_animation(nullptr, 0, &animation), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_surfaces_get_info(surfaces, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  auto unread = make_desc<cumulet_surfaces_info>();
  EXPECT_EQ(cumulet_surfaces_get_info(nullptr, &unread), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_surfaces_retain(surfaces), surfaces);
  cumulet_surfaces_release(surfaces);
  EXPECT_EQ(info_of(surfaces).triangles, 1U);
  cumulet_surfaces_release(surfaces);
  EXPECT_EQ(cumulet_surfaces_retain(nullptr), nullptr);
  cumulet_surfaces_release(nullptr);

  EXPECT_EQ(cumulet_surfaces_open((path_ + ".none").c_str(), &surfaces, error, sizeof error), CUMULET_ERROR_FILE);
  EXPECT_EQ(surfaces, nullptr);
  EXPECT_EQ(std::string(error).rfind(path_ + ".none: ", 0), 0U) << error;
  EXPECT_EQ(cumulet_surfaces_open(nullptr, &surfaces, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_surfaces_open("", &surfaces, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_surfaces_open(path_.c_str(), nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(CApiSurfaces, FileInMemoryReadsOnlyFromItsFolder) {
  const std::string bytes = bytes_of(path_);
  const std::string folder = folder_.path().string();
  char error[512] = "";
  cumulet_surfaces* surfaces = nullptr;
  ASSERT_EQ(cumulet_surfaces_from_memory(bytes.data(), bytes.size(), folder.c_str(), "mine", &surfaces, error, 512),
            CUMULET_OK)
      << error;
  EXPECT_EQ(info_of(surfaces).triangles, 1U);
  EXPECT_STREQ(info_of(surfaces).name, "mine");
  cumulet_surfaces_release(surfaces);

  EXPECT_EQ(cumulet_surfaces_from_memory(bytes.data(), bytes.size(), nullptr, "mine", &surfaces, error, 512),
            CUMULET_ERROR_FILE);
  EXPECT_EQ(surfaces, nullptr);
  EXPECT_EQ(std::string(error).rfind("mine: ", 0), 0U) << error;
  EXPECT_NE(std::string(error).find("triangle.gltf.bin"), std::string::npos) << error;
  EXPECT_EQ(std::string(error).find('\n'), std::string::npos);
  EXPECT_EQ(cumulet_surfaces_from_memory(bytes.data(), 100, nullptr, nullptr, &surfaces, error, 512),
            CUMULET_ERROR_FILE);
  EXPECT_EQ(std::string(error).rfind("memory: ", 0), 0U) << error;
  EXPECT_EQ(cumulet_surfaces_from_memory(nullptr, 0, nullptr, nullptr, &surfaces, error, 512), CUMULET_ERROR_FILE);
  EXPECT_EQ(cumulet_surfaces_from_memory(nullptr, 9, nullptr, nullptr, &surfaces, error, 512),
            CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_surfaces_from_memory(bytes.data(), bytes.size(), folder.c_str(), nullptr, nullptr, nullptr, 0),
            CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(CApiSurfaces, WarningsOfAFileAreKept) {
  std::string text = bytes_of(path_);
  char error[512] = "";
  cumulet_surfaces* surfaces = nullptr;
  ASSERT_EQ(cumulet_surfaces_open(path_.c_str(), &surfaces, error, sizeof error), CUMULET_OK) << error;
  EXPECT_STREQ(info_of(surfaces).warnings, "");
  cumulet_surfaces_release(surfaces);
  const std::string mesh = R"({"POSITION": 0})";
  text.insert(text.find(mesh) + mesh.size(), R"(, "material": 0)");
  text.insert(text.rfind('}'), R"(, "images": [{"uri": "gone.png"}], "textures": [{"source": 0}],
    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}])");
  ASSERT_EQ(cumulet_surfaces_from_memory(text.data(), text.size(), folder_.path().string().c_str(), "mine", &surfaces,
                                         error, sizeof error),
            CUMULET_OK)
      << error;
  const std::string warnings = info_of(surfaces).warnings;
  EXPECT_EQ(warnings.rfind("mine: ", 0), 0U) << warnings;
  EXPECT_NE(warnings.find("gone.png"), std::string::npos) << warnings;
  cumulet_surfaces_release(surfaces);
}

TEST_F(CApiSurfaces, ABinaryFileInMemoryNeedsNoFolder) {
  std::string json = R"({"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "buffers": [{"byteLength": 36}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const float corners[9] = {0, 0, 0, 3, 0, 0, 0, 1, 0};
  const auto json_size = static_cast<uint32_t>(json.size());
  const uint32_t head[5] = {0x46546C67, 2, 12 + 8 + json_size + 8 + 36, json_size, 0x4E4F534A};
  const uint32_t binary[2] = {36, 0x004E4942};
  std::string bytes(reinterpret_cast<const char*>(head), sizeof head);
  bytes += json;
  bytes.append(reinterpret_cast<const char*>(binary), sizeof binary);
  bytes.append(reinterpret_cast<const char*>(corners), sizeof corners);
  char error[512] = "";
  cumulet_surfaces* surfaces = nullptr;
  ASSERT_EQ(cumulet_surfaces_from_memory(bytes.data(), bytes.size(), nullptr, nullptr, &surfaces, error, 512),
            CUMULET_OK)
      << error;
  bytes.assign(bytes.size(), '?');  // the library has its own copy
  EXPECT_DOUBLE_EQ(info_of(surfaces).bounds_max[0], 3.0);
  cumulet_surfaces_release(surfaces);
}

TEST_F(CApiSurfaces, TimeSetDuringLoadingIsUsed) {
  cumulet_surfaces* surfaces = nullptr;
  ASSERT_EQ(cumulet_surfaces_open(path_.c_str(), &surfaces, nullptr, 0), CUMULET_OK);
  auto settings = make_desc<cumulet_surface_settings_desc>();
  for (const bool load : {false, true}) {
    settings.time = 0.5;
    ASSERT_EQ(cumulet_set_surface_settings(viewer_, &settings), CUMULET_OK);
    ASSERT_EQ(load ? cumulet_load_surfaces(viewer_, path_.c_str()) : cumulet_set_surfaces(viewer_, surfaces),
              CUMULET_OK);
    settings.time = 1.0;
    ASSERT_EQ(cumulet_set_surface_settings(viewer_, &settings), CUMULET_OK);
    ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
    double low[3];
    double high[3];
    ASSERT_EQ(cumulet_get_bounds(viewer_, low, high), CUMULET_OK);
    EXPECT_NEAR(low[0], 1.5, 1e-5);
  }
  cumulet_surfaces_release(surfaces);
}

}  // namespace
