// Every model of the shared data is imported and satisfies scene.hpp, or is rejected with a one-line error.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "base/error.hpp"
#include "support/gltf_check.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface {
namespace {

const std::filesystem::path models = std::filesystem::path(CUMULET_SHARED_DATA) / "gltf";
constexpr const char* validator = "khronos_validator";

/// Files that must be rejected, and a part of the error message.
const std::map<std::string, std::string> refused = {
    // a required extension that the importer does not support
    {"assimp_glTF2/BoxTextured-glTF-techniqueWebGL/BoxTextured.gltf", "KHR_technique_webgl"},
    // members of the wrong JSON type
    {"assimp_glTF2/SchemaFailures/sceneWrongType.gltf", "scene is not an index"},
    {"assimp_glTF2/wrongTypes/badNumber.gltf", "materials[0].normalTexture.scale is not a number"},
    {"assimp_glTF2/wrongTypes/badExtension.gltf", "KHR_texture_transform is not an object"},
    {"assimp_glTF2/wrongTypes/badObject.gltf", "materials[0].pbrMetallicRoughness is not an object"},
    {"assimp_glTF2/wrongTypes/badUint.gltf", "baseColorTexture.index is not an index"},
    {"assimp_glTF2/wrongTypes/badArray.gltf", "meshes[0].primitives is not an array"},
    {"assimp_glTF2/wrongTypes/badString.gltf", "scenes[0].name is not a string"},
    // a view beyond its buffer
    {"assimp_glTF2/IncorrectVertexArrays/Cube.gltf", "buffer view 2 exceeds the 514 bytes of buffer 0"},
    // indices beyond the vertices
    {"assimp_glTF2/IndexOutOfRange/IndexOutOfRange.gltf", "index 255 is out of range, of 24 vertices"},
    {"assimp_glTF2/IndexOutOfRange/AllIndicesOutOfRange.gltf", "index 65535 is out of range, of 24 vertices"},
    // positions that are infinite
    {"assimp_glTF2/BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb", "POSITION is not finite"},
    // a node that is its own ancestor
    {"assimp_glTF2/RecursiveNodes/RecursiveNodes.gltf", "node 0 is its own ancestor"},
    // a missing buffer file
    {"assimp_glTF2/MissingBin/BoxTextured.gltf", "BoxTextured0.bin: no such file"},
};

/// Triangle counts of models, known from their accessors.
const std::map<std::string, std::size_t> triangles = {
    {"bevy/FlightHelmet/FlightHelmet.gltf", 94722},
    {"bevy/animated/Fox.glb", 576},
    {"pmndrs/suzi.glb", 14842},
    {"bevy/CornellBox/CornellBox.glb", 36},
    {"assimp_glTF2/BoxTextured-glTF-Binary/BoxTextured.glb", 12},
};

struct Lines {
  std::vector<std::string> warnings;
  std::vector<std::string> all;
  Log log{[this](LogLevel level, const char* message) {
    all.emplace_back(message);
    if (level >= LogLevel::warning) warnings.emplace_back(message);
  }};
};

bool one_line(const std::string& text) { return !text.empty() && text.find_first_of("\n\r") == std::string::npos; }

TEST(GltfFiles, EachIsImportedOrGivesAOneLineError) {
  if (!std::filesystem::exists(models)) GTEST_SKIP() << "no shared data";
  std::set<std::string> seen;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(models)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".gltf" && extension != ".glb") continue;
    const std::string name = entry.path().lexically_relative(models).string();
    if (name.starts_with(validator)) continue;  // tested below
    SCOPED_TRACE(name);
    seen.insert(name);
    const auto expected = refused.find(name);
    Lines lines;
    try {
      const ScenePtr scene = import_gltf(entry.path().string(), lines.log);
      EXPECT_EQ(expected, refused.end()) << "was imported";
      EXPECT_EQ(test::broken(*scene), "");
      for (const double time : {0.0, 0.37, 1e6, -1.0}) {
        for (std::size_t a = 0; a < std::max<std::size_t>(scene->animations.size(), 1); ++a) {
          EXPECT_EQ(test::broken(*scene, scene->pose(time, a)), "") << "animation " << a << " at " << time;
        }
      }
      const auto count = triangles.find(name);
      if (count != triangles.end()) {
        EXPECT_EQ(scene->triangle_count(), count->second);
      }
    } catch (const Error& error) {
      const std::string line = error.what();
      ASSERT_NE(expected, refused.end()) << line;
      EXPECT_TRUE(one_line(line)) << line;
      EXPECT_NE(line.find(entry.path().string()), std::string::npos) << line;
      EXPECT_NE(line.find(expected->second), std::string::npos) << line;
    }
    for (const std::string& line : lines.all) EXPECT_TRUE(one_line(line)) << line;
  }
  for (const auto& [name, cause] : refused) EXPECT_TRUE(seen.contains(name)) << name << " is not there";
  EXPECT_GT(seen.size(), 70U);
}

// Test models of Khronos' glTF-Validator with its report for each.
TEST(GltfFiles, ValidFilesLoadAndOthersAreReported) {
  const auto suite = models / validator;
  if (!std::filesystem::exists(suite)) GTEST_SKIP() << "no shared data";
  std::size_t valid = 0;
  std::size_t invalid = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(suite)) {
    constexpr std::string_view ending = ".report.json";
    const std::string report = entry.path().string();
    if (!report.ends_with(ending)) continue;
    const std::string file = report.substr(0, report.size() - ending.size());
    SCOPED_TRACE(file);
    const auto issues = nlohmann::json::parse(std::ifstream(report))["issues"];
    const bool good = issues["numErrors"] == 0;
    ++(good ? valid : invalid);
    std::string causes;
    for (const auto& message : issues["messages"]) {
      if (message["severity"] != 0) continue;
      causes.append(" ").append(message.value("code", "")).append("@").append(message.value("pointer", ""));
    }
    Lines lines;
    try {
      const ScenePtr scene = import_gltf(file, lines.log);
      EXPECT_EQ(test::broken(*scene), "");
      EXPECT_EQ(test::broken(*scene, scene->pose(0.5)), "");
      // An invalid model that is imported must cause a warning. Most show nothing at all.
      EXPECT_TRUE(good || !lines.warnings.empty()) << "reported none:" << causes;
    } catch (const Error& error) {
      EXPECT_FALSE(good) << error.what();
      EXPECT_TRUE(one_line(error.what())) << error.what();
      EXPECT_NE(std::string(error.what()).find(file), std::string::npos) << error.what();
    }
    for (const std::string& line : lines.all) EXPECT_TRUE(one_line(line)) << line;
  }
  EXPECT_GE(valid, 129U);
  EXPECT_GE(invalid, 243U);
}

TEST(GltfFiles, DracoFileMatchesTheUncompressedOne) {
  const auto folder = models / "assimp_glTF2";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no shared data";
  const Pose plain = import_gltf((folder / "2CylinderEngine-glTF-Binary/2CylinderEngine.glb").string(), {})->pose(0.0);
  const Pose small = import_gltf((folder / "draco/2CylinderEngine.gltf").string(), {})->pose(0.0);
  const double size = glm::length(plain.high - plain.low);
  EXPECT_LT(glm::length(plain.low - small.low), 1e-3 * size);
  EXPECT_LT(glm::length(plain.high - small.high), 1e-3 * size);
}

TEST(GltfFiles, UnreadableImagesGiveOneWarningEach) {
  const auto file = models / "bevy/AnisotropyBarnLamp/AnisotropyBarnLamp.gltf";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no shared data";
  Lines lines;
  const ScenePtr scene = import_gltf(file.string(), lines.log);
  EXPECT_EQ(scene->images.size(), 1U);
  std::size_t ktx2 = 0;
  for (const std::string& line : lines.warnings) ktx2 += line.find("KTX2") != std::string::npos ? 1 : 0;
  EXPECT_EQ(ktx2, 3U);  // normals, anisotropy and roughness
}

}  // namespace
}  // namespace cumulet::surface
