// Winding checks: whether the faces of closed meshes point outwards, and the importer's warning about meshes whose
// faces do not.

#include "surface/winding.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "support/gltf_model.hpp"
#include "surface/gltf_import.hpp"

namespace cumulet::surface {
namespace {

using glm::vec3;
using test::GltfModel;
using test::json;

struct Mesh {
  std::vector<vec3> positions;
  std::vector<std::uint32_t> indices;

  void quad(const vec3& a, const vec3& b, const vec3& c, const vec3& d) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {a, b, c, d});
    for (const std::uint32_t i : {0U, 1U, 2U, 0U, 2U, 3U}) indices.push_back(first + i);
  }
  /// Faces share no vertices. inward: number of the six faces with inverted winding.
  void box(const vec3& low, const vec3& high, int inward = 0) {
    const vec3 size = high - low;
    for (int face = 0; face < 6; ++face) {
      const int axis = face % 3;
      vec3 u(0.0F);
      vec3 v(0.0F);
      u[(axis + 1) % 3] = size[(axis + 1) % 3];
      v[(axis + 2) % 3] = size[(axis + 2) % 3];
      vec3 corner = low;
      if (face < 3) {
        corner[axis] = high[axis];
      } else {
        std::swap(u, v);
      }
      if (face < inward) std::swap(u, v);
      quad(corner, corner + u, corner + u + v, corner + v);
    }
  }
  [[nodiscard]] detail::Winding winding() const { return detail::winding_of(positions, indices); }
};

TEST(Winding, CountsInwardFacingArea) {
  Mesh box;
  box.box(vec3(1e4F), vec3(1e4F) + vec3(1.0F));
  EXPECT_NEAR(box.winding().area, 6.0, 1e-5);
  EXPECT_EQ(box.winding().inward, 0.0);
  for (const int inward : {1, 2, 3, 5, 6}) {
    Mesh mesh;
    mesh.box(vec3(-1.0F), vec3(0.0F), inward);
    EXPECT_NEAR(mesh.winding().inward, inward, 1e-6);
  }
}

TEST(Winding, OnlyClosedMeshesAreChecked) {
  Mesh open;
  open.box(vec3(0.0F), vec3(1.0F), 6);
  open.indices.resize(30);  // without a lid
  EXPECT_EQ(open.winding().area, 0.0);
  Mesh sheet;  // of two sides
  sheet.quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  sheet.quad({0, 1, 0}, {1, 1, 0}, {1, 0, 0}, {0, 0, 0});
  EXPECT_EQ(sheet.winding().area, 0.0);
  Mesh fin;  // an additional wall: an edge of three faces
  fin.box(vec3(0.0F), vec3(1.0F), 6);
  fin.quad({0, 0, 0}, {0, 0, 1}, {-1, 0, 1}, {-1, 0, 0});
  EXPECT_EQ(fin.winding().area, 0.0);
  Mesh strip;  // a closed twisted strip: it has no inside
  constexpr int sides = 9;
  for (int i = 0; i < sides; ++i) {
    const auto across = [](int at) {
      const float angle = 6.2831853F * static_cast<float>(at % sides) / static_cast<float>(sides);
      const float half = 0.5F * (at >= sides ? 3.1415927F : 0.5F * angle);
      const vec3 out(std::cos(angle), std::sin(angle), 0.0F);
      const vec3 aside = 0.2F * (std::cos(half) * out + vec3(0.0F, 0.0F, std::sin(half)));
      return at >= sides ? std::pair(out - 0.2F * out, out + 0.2F * out) : std::pair(out + aside, out - aside);
    };
    strip.quad(across(i).first, across(i + 1).first, across(i + 1).second, across(i).second);
  }
  EXPECT_EQ(strip.winding().area, 0.0);
  EXPECT_EQ(Mesh().winding().area, 0.0);
}

TEST(Winding, CavityWallsFaceInward) {
  Mesh hollow;
  hollow.box(vec3(0.0F), vec3(4.0F));
  hollow.box(vec3(1.0F), vec3(3.0F), 6);
  EXPECT_NEAR(hollow.winding().area, 96.0, 1e-4);
  EXPECT_EQ(hollow.winding().inward, 0.0);
  hollow.box(vec3(5.0F), vec3(6.0F), 6);
  EXPECT_NEAR(hollow.winding().inward, 6.0, 1e-4);
}

/// The warnings about a file of these meshes, which use materials[0].
std::vector<std::string> warnings(const std::vector<Mesh>& meshes, const json& material = json::object(),
                                  const json& node = json::object()) {
  GltfModel model;
  model.add("materials", material);
  for (const Mesh& mesh : meshes) {
    std::vector<float> numbers;
    for (const vec3& p : mesh.positions) numbers.insert(numbers.end(), {p.x, p.y, p.z});
    model.show({{"attributes", {{"POSITION", model.vec3(numbers)}}},
                {"indices", model.accessor("SCALAR", 1, mesh.indices)},
                {"material", 0}},
               node);
    model.root["meshes"].back()["name"] = "Box\n" + std::to_string(model.root["meshes"].size());
  }
  std::vector<std::string> lines;
  const Log log([&](LogLevel level, const char* line) {
    if (level >= LogLevel::warning) lines.emplace_back(line);
  });
  import_gltf(model.gltf(), "made.gltf", std::nullopt, log, nullptr, {});
  return lines;
}

TEST(Winding, TheImporterNamesFileAndMesh) {
  const auto box = [](int inward) {
    Mesh mesh;
    mesh.box(vec3(0.0F), vec3(1.0F, 8.0F, 1.0F), inward);
    return mesh;
  };
  EXPECT_TRUE(warnings({box(0), box(0)}).empty());
  EXPECT_TRUE(warnings({box(6)}, {{"doubleSided", true}}).empty());
  // glTF inverts the winding of mirrored nodes.
  EXPECT_TRUE(warnings({box(0)}, json::object(), {{"scale", {-1, 1, 1}}}).empty());
  for (const int inward : {6, 2}) {  // 2: half of the four long sides, as of a bar with two inverted faces
    EXPECT_EQ(warnings({box(0), box(inward)}),
              std::vector<std::string>{"made.gltf: triangles of mesh 1 (Box 2) appear to be wound inside out and are "
                                       "invisible from outside; use double_sided of the surface settings"});
  }
  const auto many = warnings({box(6), box(6), box(6), box(6), box(6)});
  ASSERT_EQ(many.size(), 1U);
  EXPECT_NE(many[0].find("mesh 0 (Box 1), mesh 1 (Box 2), mesh 2 (Box 3) and 2 more"), std::string::npos) << many[0];
}

}  // namespace
}  // namespace cumulet::surface
