#pragma once

// Imports small glTF files of tests and collects the importer's messages.

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "support/gltf_check.hpp"
#include "support/gltf_model.hpp"
#include "surface/gltf_import.hpp"

namespace cumulet::test {

/// Messages that an import logs.
struct Lines {
  std::vector<std::string> infos;
  std::vector<std::string> warnings;
  Log log{[this](LogLevel level, const char* message) {
    (level >= LogLevel::warning ? warnings : infos).emplace_back(message);
  }};
};

inline bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

inline surface::ScenePtr imported(const Bytes& file, const Log& log = {}, const surface::GltfLimits& limits = {}) {
  surface::ScenePtr scene = surface::import_gltf(file, "made.gltf", "/nowhere", log, nullptr, limits);
  EXPECT_EQ(broken(*scene), "");
  EXPECT_EQ(broken(*scene, scene->pose(0.0)), "");
  return scene;
}
inline surface::ScenePtr imported(const GltfModel& model, const Log& log = {}) { return imported(model.gltf(), log); }

/// Returns the error message of an import that must fail.
inline std::string refused(const Bytes& file, ErrorCode code = ErrorCode::file,
                           const surface::GltfLimits& limits = {}) {
  try {
    surface::import_gltf(file, "made.gltf", "/nowhere", {}, nullptr, limits);
  } catch (const Error& error) {
    const std::string line = error.what();
    EXPECT_EQ(error.code(), code) << line;
    EXPECT_TRUE(line.starts_with("made.gltf: ")) << line;
    EXPECT_GT(line.size(), 12U) << line;
    EXPECT_LT(line.size(), 600U) << line;
    EXPECT_EQ(line.find_first_of("\n\r\t"), std::string::npos) << line;
    return line;
  }
  ADD_FAILURE() << "was imported";
  return "";
}
inline std::string refused(const GltfModel& model, ErrorCode code = ErrorCode::file) {
  return refused(model.gltf(), code);
}

inline void near(const glm::vec3& a, const glm::vec3& b, float within = 1e-5F) {
  EXPECT_LT(glm::length(a - b), within) << a.x << " " << a.y << " " << a.z << ", not " << b.x << " " << b.y << " "
                                        << b.z;
}

/// Positions of the vertices of a triangle (default: the first).
inline std::array<glm::vec3, 3> corners(const surface::Scene& scene, const surface::Pose& pose,
                                        std::size_t triangle = 0) {
  std::array<glm::vec3, 3> result{};
  for (std::size_t k = 0; k < 3; ++k) result[k] = pose.vertices[scene.indices[3 * triangle + k]].position;
  return result;
}

inline GltfModel triangle_model(const json& node = json::object(), const json& more = json::object()) {
  GltfModel model;
  json primitive = {{"attributes", {{"POSITION", model.triangle()}}}};
  primitive.update(more);
  model.show(primitive, node);
  return model;
}

}  // namespace cumulet::test
