#pragma once

// A viewer that shows surfaces, with a glTF file.

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "cumulet/cumulet.h"
#include "support/c_api.hpp"
#include "support/folder.hpp"

namespace cumulet::test {

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

}  // namespace cumulet::test
