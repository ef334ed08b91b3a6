// Surfaces through the C API: files, files in memory, variants and triangles of the host.

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
#include "support/folder.hpp"
#include "support/osmesa_leaks.hpp"

namespace {

using cumulet::test::CApi;
using cumulet::test::make_desc;

/// A triangle 2 wide and 2 high that moves 5 to the right in 2 seconds, and a camera, in one file.
class CApiSurfaces : public CApi {
 protected:
  void SetUp() override {
    CApi::SetUp();
    const float floats[] = {-1, -1, 0, 1, -1, 0, 0, 1, 0, 0, 2, 0, 0, 0, 5, 0, 0};
    std::ofstream(path_ + ".bin", std::ios::binary).write(reinterpret_cast<const char*>(floats), sizeof floats);
    std::ofstream(path_) << R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
      "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 10]}],
      "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
      "animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                      "samplers": [{"input": 1, "output": 2}]}],
      "buffers": [{"byteLength": 68, "uri": "triangle.gltf.bin"}],
      "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 8},
                      {"buffer": 0, "byteOffset": 44, "byteLength": 24}],
      "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [2]},
        {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}]})";
  }
  /// The surfaces that the viewer shows. The caller releases them.
  [[nodiscard]] cumulet_surfaces* shown() const {
    cumulet_surfaces* surfaces = nullptr;
    EXPECT_EQ(cumulet_get_surfaces(viewer_, &surfaces), CUMULET_OK) << error();
    return surfaces;
  }
  [[nodiscard]] static cumulet_surfaces_info info_of(const cumulet_surfaces* surfaces) {
    auto info = make_desc<cumulet_surfaces_info>();
    EXPECT_EQ(cumulet_surfaces_get_info(surfaces, &info), CUMULET_OK);
    return info;
  }
  /// An orthographic view of x and y from -2 to 2, from the front or from behind, without a background.
  static void look(cumulet_viewer* viewer, double from = 10.0) {
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = 32;
    ASSERT_EQ(cumulet_set_sampling(viewer, &sampling), CUMULET_OK);
    auto display = make_desc<cumulet_display_desc>();
    display.background = CUMULET_BACKGROUND_TRANSPARENT;
    ASSERT_EQ(cumulet_set_display(viewer, &display), CUMULET_OK);
    auto desc = make_desc<cumulet_camera_desc>();
    desc.eye[2] = from;
    desc.orthographic_height = 4.0;
    cumulet_camera* camera = nullptr;
    ASSERT_EQ(cumulet_get_camera(viewer, &camera), CUMULET_OK);
    EXPECT_EQ(cumulet_camera_set(camera, &desc), CUMULET_OK);
    cumulet_camera_release(camera);
  }
  /// Renders 16 x 16 pixels until converged.
  static std::vector<float> picture(cumulet_viewer* viewer) {
    auto frame = make_desc<cumulet_frame_desc>();
    frame.target = CUMULET_TARGET_NONE;
    frame.width = frame.height = 16;
    auto result = make_desc<cumulet_frame_result>();
    for (int i = 0; i < 2000 && (result.flags & CUMULET_RENDER_CONVERGED) == 0; ++i) {
      EXPECT_EQ(cumulet_render(viewer, &frame, &result), CUMULET_OK) << cumulet_last_error(viewer);
      cumulet_wait(viewer, -1.0);
    }
    EXPECT_NE(result.flags & CUMULET_RENDER_CONVERGED, 0U);
    std::vector<float> rgba(16 * 16 * 4);
    EXPECT_EQ(cumulet_read_linear(viewer, rgba.data(), rgba.size()), CUMULET_OK) << cumulet_last_error(viewer);
    return rgba;
  }
  /// Whether reading fails and a frame draws nothing, not even an older image.
  static bool shows_nothing(cumulet_viewer* viewer) {
    auto frame = make_desc<cumulet_frame_desc>();
    frame.target = CUMULET_TARGET_NONE;
    frame.width = frame.height = 16;
    auto result = make_desc<cumulet_frame_result>();
    EXPECT_EQ(cumulet_render(viewer, &frame, &result), CUMULET_OK) << cumulet_last_error(viewer);
    return result.width == 0 && result.flags == 0;
  }
  /// The mean alpha of an image.
  static double coverage(cumulet_viewer* viewer) {
    const std::vector<float> rgba = picture(viewer);
    double sum = 0.0;
    for (std::size_t i = 3; i < rgba.size(); i += 4) sum += rgba[i];
    return sum / 256.0;
  }

  cumulet::test::Folder folder_;
  std::string path_ = (folder_ / "triangle.gltf").string();
};

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
    std::ifstream file(path);
    const std::string report(std::istreambuf_iterator<char>(file), {});
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
  std::ifstream file(path_);
  std::string text(std::istreambuf_iterator<char>(file), {});
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

/// A square of side 1 in the plane z = 0 that faces +Z.
struct Square {
  float positions[12] = {-0.5F, -0.5F, 0, 0.5F, -0.5F, 0, 0.5F, 0.5F, 0, -0.5F, 0.5F, 0};
  float normals[12] = {0, 0, 2, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  uint32_t indices[6] = {0, 1, 2, 0, 2, 3};

  [[nodiscard]] cumulet_mesh_desc mesh(double x, double y) const {
    auto mesh = make_desc<cumulet_mesh_desc>();
    mesh.positions = positions;
    mesh.vertex_count = 4;
    mesh.indices = indices;
    mesh.index_count = 6;
    for (int i = 0; i < 4; ++i) mesh.to_world[5 * i] = 1.0;
    mesh.to_world[12] = x;
    mesh.to_world[13] = y;
    return mesh;
  }
};

cumulet_status make_triangles(const std::vector<cumulet_mesh_desc>& meshes, cumulet_surfaces** out,
                              std::string* message = nullptr) {
  auto desc = make_desc<cumulet_triangles_desc>();
  desc.meshes = meshes.data();
  desc.mesh_count = meshes.size();
  desc.name = "host";
  char error[512] = "";
  const cumulet_status status = cumulet_surfaces_from_triangles(&desc, out, error, sizeof error);
  if (message != nullptr) *message = error;
  return status;
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
  std::ifstream file(path_, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
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
  std::ifstream file(path_);
  std::string text{std::istreambuf_iterator<char>(file), {}};
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

TEST_F(CApiSurfaces, HostTrianglesAreVisible) {
  const Square square;
  cumulet_mesh_desc left = square.mesh(-1.0, 1.0);  // red, indexed, with normals
  left.normals = square.normals;
  left.emission[0] = 3.0F;
  cumulet_mesh_desc right = square.mesh(1.0, -1.0);  // green, three vertices per triangle, one triangle only
  right.indices = nullptr;
  right.index_count = 0;
  right.vertex_count = 3;
  right.emission[1] = 0.5F;
  cumulet_mesh_desc back = square.mesh(1.0, 1.0);  // rotated about the vertical axis, so that it faces away
  back.to_world[0] = back.to_world[10] = -1.0;
  back.emission[2] = 1.0F;
  cumulet_mesh_desc thin = square.mesh(-1.0, -1.0);  // alpha 0.25
  const float colors[16] = {1, 1, 1, 0.5F, 1, 1, 1, 0.5F, 1, 1, 1, 0.5F, 1, 1, 1, 0.5F};
  thin.colors = colors;
  thin.base_color[3] = 0.5F;
  cumulet_surfaces* surfaces = nullptr;
  std::string message;
  ASSERT_EQ(make_triangles({left, right, back, thin}, &surfaces, &message), CUMULET_OK) << message;
  const cumulet_surfaces_info info = info_of(surfaces);
  EXPECT_EQ(info.triangles, 7U);
  EXPECT_EQ(info.materials, 4U);
  EXPECT_STREQ(info.name, "host");
  EXPECT_DOUBLE_EQ(info.bounds_min[0], -1.5);
  EXPECT_DOUBLE_EQ(info.bounds_max[1], 1.5);

  look(viewer_);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, surfaces), CUMULET_OK) << error();
  cumulet_surfaces_release(surfaces);  // the viewer keeps a reference
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  const std::vector<float> rgba = picture(viewer_);
  // A pixel is a quarter of a unit; each square covers exactly 4 x 4 pixels.
  const auto expect = [&rgba](int x, int y, float red, float green, float alpha) {
    const float* pixel = &rgba[static_cast<std::size_t>(4 * (16 * y + x))];
    EXPECT_NEAR(pixel[0], red, 1e-4) << x << ", " << y;
    EXPECT_NEAR(pixel[1], green, 1e-4) << x << ", " << y;
    EXPECT_EQ(pixel[2], 0.0F) << x << ", " << y;
    EXPECT_NEAR(pixel[3], alpha, 1e-4) << x << ", " << y;
  };
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 16; ++x) {
      const bool inside = x >= 2 && x < 6 && y >= 2 && y < 6;
      expect(x, y, inside ? 3.0F : 0.0F, 0.0F, inside ? 1.0F : 0.0F);  // the square that faces away is invisible
    }
  }
  expect(13, 13, 0.0F, 0.5F, 1.0F);  // the triangle is the square's half below the diagonal
  expect(10, 10, 0.0F, 0.0F, 0.0F);
  double covered = 0.0;
  for (int y = 10; y < 14; ++y) {
    for (int x = 2; x < 6; ++x) covered += rgba[static_cast<std::size_t>(4 * (16 * y + x) + 3)] / 16.0;
  }
  EXPECT_NEAR(covered, 0.25, 0.08);  // 512 samples: five standard errors are 0.1

  // Seen from behind: the square that faced away, and double-sided ones.
  look(viewer_, -10.0);
  EXPECT_NEAR(coverage(viewer_), 16.0 / 256.0, 1e-4);
  left.double_sided = 1;
  ASSERT_EQ(make_triangles({left, right}, &surfaces), CUMULET_OK);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, surfaces), CUMULET_OK) << error();
  cumulet_surfaces_release(surfaces);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  EXPECT_NEAR(coverage(viewer_), 16.0 / 256.0, 1e-4);
}

// base_color under a white sky: the image's channels are ordered as those of the color.
TEST_F(CApiSurfaces, HostTrianglesAreLit) {
  const Square square;
  cumulet_mesh_desc mesh = square.mesh(0.0, 0.0);
  mesh.base_color[0] = 0.8F;
  mesh.base_color[1] = 0.4F;
  mesh.base_color[3] = 1.0F;
  cumulet_surfaces* surfaces = nullptr;
  ASSERT_EQ(make_triangles({mesh}, &surfaces), CUMULET_OK);
  look(viewer_);
  auto light = make_desc<cumulet_sun_sky_desc>();
  for (float& c : light.sky_radiance) c = 1.0F;
  ASSERT_EQ(cumulet_set_sun_sky(viewer_, &light), CUMULET_OK);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, surfaces), CUMULET_OK);
  cumulet_surfaces_release(surfaces);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  const std::vector<float> rgba = picture(viewer_);
  double mean[3] = {};
  for (int y = 6; y < 10; ++y) {
    for (int x = 6; x < 10; ++x) {
      for (int c = 0; c < 3; ++c) mean[c] += rgba[static_cast<std::size_t>(4 * (16 * y + x) + c)] / 16.0;
    }
  }
  // Blue is only the colorless specular reflection, a few percent. The base color scales the diffuse rest.
  EXPECT_GT(mean[2], 0.01);
  EXPECT_LT(mean[2], 0.12);
  EXPECT_NEAR(mean[0] - mean[2], 2.0 * (mean[1] - mean[2]), 0.03);
  EXPECT_NEAR(mean[0], mean[2] + 0.8 * (1.0 - mean[2]), 0.05);
}

TEST_F(CApiSurfaces, InvalidTrianglesGiveAOneLineError) {
  const Square square;
  const cumulet_mesh_desc good = square.mesh(0.0, 0.0);
  std::string message;
  const auto refused = [&](const cumulet_mesh_desc& bad, const std::string& cause) {
    cumulet_surfaces* surfaces = reinterpret_cast<cumulet_surfaces*>(1);
    EXPECT_EQ(make_triangles({good, bad}, &surfaces, &message), CUMULET_ERROR_INVALID_ARGUMENT) << cause;
    EXPECT_EQ(surfaces, nullptr);
    EXPECT_EQ(message.rfind("host: mesh 1: ", 0), 0U) << message;
    EXPECT_NE(message.find(cause), std::string::npos) << message << " for " << cause;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  };
  cumulet_mesh_desc bad = good;
  const uint32_t beyond[3] = {0, 1, 4};
  bad.indices = beyond;
  bad.index_count = 3;
  refused(bad, "index 4 is out of range, of 4 vertices");
  bad.index_count = 2;
  refused(bad, "the number of indices is not a multiple of 3");
  bad = good;
  bad.index_count = 0;
  refused(bad, "the number of vertices is not a multiple of 3");
  bad = good;
  bad.indices = nullptr;
  refused(bad, "indices are NULL");
  bad = good;
  bad.positions = nullptr;
  refused(bad, "positions are NULL");
  bad = good;
  bad.vertex_count = UINT64_MAX / 8;
  refused(bad, "exceed the address space");
  float numbers[16] = {};
  numbers[7] = std::nanf("");
  bad = good;
  bad.positions = numbers;
  refused(bad, "positions");
  bad = good;
  bad.normals = numbers;
  refused(bad, "normals");
  bad = good;
  bad.colors = numbers;
  refused(bad, "color");
  bad = good;
  bad.to_world[3] = 0.5;
  refused(bad, "affine");
  bad = good;
  bad.to_world[12] = INFINITY;
  refused(bad, "to_world");
  for (float cumulet_mesh_desc::*field : {&cumulet_mesh_desc::metallic, &cumulet_mesh_desc::smoothness}) {
    bad = good;
    bad.*field = 1.5F;
    refused(bad, "from 0 to 1");
  }
  bad = good;
  bad.base_color[2] = -0.1F;
  refused(bad, "base_color");
  bad = good;
  bad.emission[1] = std::nanf("");
  refused(bad, "emission");
  bad = good;
  bad.double_sided = 2;
  refused(bad, "double_sided");
  bad = good;
  bad.struct_size = sizeof(size_t);
  refused(bad, "struct_size");

  cumulet_surfaces* surfaces = nullptr;
  float huge[12] = {};
  huge[4] = 3e38F;
  bad = good;
  bad.positions = huge;
  EXPECT_EQ(make_triangles({bad}, &surfaces, &message), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(message.find("too large"), std::string::npos) << message;
  EXPECT_EQ(cumulet_surfaces_from_triangles(nullptr, &surfaces, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  auto desc = make_desc<cumulet_triangles_desc>();
  desc.mesh_count = 1;
  EXPECT_EQ(cumulet_surfaces_from_triangles(&desc, &surfaces, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  desc.meshes = &good;
  desc.mesh_count = UINT64_MAX / 2;
  EXPECT_EQ(cumulet_surfaces_from_triangles(&desc, &surfaces, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  desc.mesh_count = 1;
  EXPECT_EQ(cumulet_surfaces_from_triangles(&desc, nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  // A list without meshes is legal: a host's scene may be empty for a while.
  ASSERT_EQ(make_triangles({}, &surfaces, &message), CUMULET_OK) << message;
  EXPECT_EQ(info_of(surfaces).triangles, 0U);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, surfaces), CUMULET_OK);
  cumulet_surfaces_release(surfaces);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  look(viewer_);
  EXPECT_EQ(coverage(viewer_), 0.0);
}

// A scene without triangles gives an empty converged image; the host does not wait for it.
TEST_F(CApiSurfaces, WithoutTrianglesThePictureConvergesAndIsEmpty) {
  const auto without_mesh = folder_ / "camera.gltf";
  std::ofstream(without_mesh) << R"({"asset": {"version": "2.0"},
    "nodes": [{"camera": 0, "translation": [0, 0, 10]}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]})";
  ASSERT_EQ(cumulet_load_surfaces(viewer_, without_mesh.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  double low[3];
  double high[3];
  EXPECT_EQ(cumulet_get_bounds(viewer_, low, high), CUMULET_ERROR_INVALID_ARGUMENT);
  auto light = make_desc<cumulet_sun_sky_desc>();
  light.sky_radiance[0] = 0.25F;
  ASSERT_EQ(cumulet_set_sun_sky(viewer_, &light), CUMULET_OK);
  for (const cumulet_surface_lighting surface_light :
       {CUMULET_SURFACE_LIGHTING_GLOBAL, CUMULET_SURFACE_LIGHTING_RASTERIZED}) {
    auto settings = make_desc<cumulet_surface_settings_desc>();
    settings.lighting = surface_light;
    ASSERT_EQ(cumulet_set_surface_settings(viewer_, &settings), CUMULET_OK);
    const std::vector<float> rgba = picture(viewer_);
    for (std::size_t i = 0; i < rgba.size(); ++i) EXPECT_EQ(rgba[i], i % 4 == 0 ? 0.25F : 0.0F) << i;
  }
  // Its camera can be used without geometry.
  EXPECT_EQ(cumulet_use_surface_camera(viewer_, 0), CUMULET_OK) << error();
  EXPECT_EQ(coverage(viewer_), 0.0);
  std::vector<float> depth(256);
  EXPECT_EQ(cumulet_read_aov(viewer_, CUMULET_AOV_SURFACE_DEPTH, depth.data(), depth.size()), CUMULET_OK) << error();
  EXPECT_TRUE(std::isinf(depth[0]));
  // Loads geometry, then a file without any again.
  ASSERT_EQ(cumulet_load_surfaces(viewer_, path_.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  EXPECT_GT(coverage(viewer_), 0.01);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, nullptr), CUMULET_OK);
  EXPECT_TRUE(shows_nothing(viewer_));
}

// An array of an older header's struct, which ended before `emission`.
TEST_F(CApiSurfaces, OlderMeshStructSizesAreAccepted) {
  struct Older {
    alignas(cumulet_mesh_desc) unsigned char bytes[offsetof(cumulet_mesh_desc, emission) / 8 * 8];
  };
  const Square square;
  std::vector<Older> older(2);
  for (int i = 0; i < 2; ++i) {
    cumulet_mesh_desc mesh = square.mesh(i, 0.0);
    mesh.struct_size = sizeof(Older);
    std::memcpy(older[static_cast<std::size_t>(i)].bytes, &mesh, sizeof(Older));
  }
  auto desc = make_desc<cumulet_triangles_desc>();
  desc.meshes = reinterpret_cast<const cumulet_mesh_desc*>(older.data());
  desc.mesh_count = 2;
  cumulet_surfaces* surfaces = nullptr;
  char error[512] = "";
  ASSERT_EQ(cumulet_surfaces_from_triangles(&desc, &surfaces, error, sizeof error), CUMULET_OK) << error;
  EXPECT_EQ(info_of(surfaces).triangles, 4U);
  EXPECT_DOUBLE_EQ(info_of(surfaces).bounds_max[0], 1.5);
  cumulet_surfaces_release(surfaces);
}

TEST_F(CApiSurfaces, TwoViewersShareAHandleThatOutlivesThem) {
  const Square square;
  cumulet_surfaces* surfaces = nullptr;
  ASSERT_EQ(make_triangles({square.mesh(0.0, 0.0)}, &surfaces), CUMULET_OK);
  auto create = make_desc<cumulet_create_desc>();
  create.get_proc = cumulet::headless::Context::get_proc;
  create.get_proc_user = &context_;
  cumulet_viewer* other = nullptr;
  ASSERT_EQ(cumulet_create(&create, &other, nullptr, 0), CUMULET_OK);
  for (cumulet_viewer* viewer : {viewer_, other}) {
    look(viewer);
    ASSERT_EQ(cumulet_set_surfaces(viewer, surfaces), CUMULET_OK);
    cumulet_surfaces* got = nullptr;
    ASSERT_EQ(cumulet_get_surfaces(viewer, &got), CUMULET_OK);
    EXPECT_EQ(got, surfaces);  // available at once, the same object
    cumulet_surfaces_release(got);
  }
  for (cumulet_viewer* viewer : {viewer_, other}) {
    ASSERT_EQ(cumulet_wait(viewer, -1.0), CUMULET_OK) << cumulet_last_error(viewer);
    EXPECT_NEAR(coverage(viewer), 16.0 / 256.0, 1e-4);
  }
  cumulet_destroy(other);
  EXPECT_EQ(info_of(surfaces).triangles, 2U);
  ASSERT_EQ(cumulet_set_surfaces(viewer_, nullptr), CUMULET_OK);
  EXPECT_TRUE(shows_nothing(viewer_));
  // The viewer's reference keeps them alive after the host's release.
  ASSERT_EQ(cumulet_set_surfaces(viewer_, surfaces), CUMULET_OK);
  cumulet_surfaces_release(surfaces);
  ASSERT_EQ(cumulet_wait(viewer_, -1.0), CUMULET_OK) << error();
  EXPECT_NEAR(coverage(viewer_), 16.0 / 256.0, 1e-4);
  EXPECT_EQ(cumulet_set_surfaces(nullptr, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_get_surfaces(viewer_, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
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
