#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>

#include "base/error.hpp"
#include "surface/scene.hpp"

// Every model of the shared data: it is imported and holds what scene.hpp says it does, or is refused by one line.

namespace cumulet::surface {
namespace {

const std::filesystem::path models = std::filesystem::path(CUMULET_SHARED_DATA) / "gltf";

/// Part of the path of each model that must be refused, and of the line.
const std::map<std::string, std::string> refused = {};

void note(void* lines, LogLevel /*level*/, const char* message) {
  static_cast<std::vector<std::string>*>(lines)->emplace_back(message);
}

TEST(GltfFiles, EachIsImportedOrRefusedByOneLine) {
  if (!std::filesystem::exists(models)) GTEST_SKIP() << "no shared data";
  for (const auto& entry : std::filesystem::recursive_directory_iterator(models)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".gltf" && extension != ".glb") continue;
    std::vector<std::string> lines;
    try {
      const ScenePtr scene = import_gltf(entry.path().string(), Log(note, &lines));
      const Pose pose = scene->pose(0.0);
      std::printf("%s: %zu tri %zu draws %zu mat %zu img %zu anim lights %zu cams %zu\n", entry.path().c_str(),
                  scene->triangle_count(), scene->draws.size(), scene->materials.size(), scene->images.size(),
                  scene->animations.size(), pose.lights.size(), pose.cameras.size());
    } catch (const Error& error) {
      std::printf("REFUSED %s\n", error.what());
    }
    for (const auto& line : lines) std::printf("  LOG %s\n", line.c_str());
  }
}

}  // namespace
}  // namespace cumulet::surface
