// Meshes of the glTF importer: transforms, normals, tangents, indices and accessors of every kind.

#include <gtest/gtest.h>

#include <cmath>

#include "support/gltf_check.hpp"
#include "support/gltf_import.hpp"
#include "support/gltf_model.hpp"
#include "support/gltf_seeds.hpp"

namespace cumulet::surface {
namespace {

using test::Bytes;
using test::corners;
using test::GltfModel;
using test::has;
using test::imported;
using test::json;
using test::Lines;
using test::near;
using test::triangle_model;

TEST(Gltf, NodesOfTranslationRotationScaleAndMatrix) {
  // A child scaled by (2, 3, 4) under a parent that is rotated by 90 degrees about z and translated.
  GltfModel model;
  model.show({{"attributes", {{"POSITION", model.triangle()}}}},
             {{"scale", {2, 3, 4}}, {"translation", {0, 0, 5}}, {"name", "child"}});
  model.add(
      "nodes",
      {{"rotation", {0, 0, 0.70710678, 0.70710678}}, {"translation", {10, 0, 0}}, {"children", json::array({0})}});
  const ScenePtr scene = imported(model);
  const Pose pose = scene->pose(0.0);
  const auto at = corners(*scene, pose);
  near(at[0], {10, 0, 5});
  near(at[1], {10, 2, 5});  // x, doubled, becomes y
  near(at[2], {7, 0, 5});   // y, tripled, becomes -x
  near(pose.vertices[0].normal, {0, 0, 1});
  EXPECT_EQ(scene->draws[0].node, 0U);

  // The same transform as a matrix, in column order.
  GltfModel other;
  other.show({{"attributes", {{"POSITION", other.triangle()}}}},
             {{"matrix", {0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 4, 0, 10, 0, 5, 1}}});
  const ScenePtr same = imported(other);
  for (std::size_t k = 0; k < 3; ++k) near(corners(*same, same->pose(0.0))[k], at[k]);
}

TEST(Gltf, NormalsUnderNonUniformScale) {
  GltfModel model;
  const float h = std::sqrt(0.5F);
  model.show({{"attributes", {{"POSITION", model.triangle()}, {"NORMAL", model.vec3({h, h, 0, h, h, 0, h, h, 0})}}}},
             {{"scale", {2, 1, 1}}});
  const ScenePtr scene = imported(model);
  // The inverse transpose: (1/2, 1) instead of (1, 1).
  near(scene->pose(0.0).vertices[0].normal, glm::normalize(glm::vec3(0.5F, 1.0F, 0.0F)));
}

TEST(Gltf, MirroredNodesAreFlippedAndKeepTheirSides) {
  GltfModel model;
  const json textured = {{"normalTexture", {{"index", 0}}}};
  model.add("images", {{"bufferView", model.view(test::png(1, 1, 8, 2, {128, 128, 255}))}});
  model.add("textures", {{"source", 0}});
  model.add("materials", textured);
  const json shape = {{"attributes",
                       {{"POSITION", model.triangle()},
                        {"NORMAL", model.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1})},
                        {"TANGENT", model.accessor<float>("VEC4", 4, {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1})},
                        {"TEXCOORD_0", model.vec2({0, 0, 1, 0, 0, 1})}}},
                      {"material", 0}};
  const int mesh = model.add("meshes", {{"primitives", json::array({shape})}});
  model.add("nodes", {{"mesh", mesh}});
  model.add("nodes", {{"mesh", mesh}, {"scale", {-1, 1, 1}}});
  model.add("nodes", {{"mesh", mesh}, {"scale", {-1, -1, 1}}});
  const ScenePtr scene = imported(model);
  const Pose pose = scene->pose(0.0);
  EXPECT_EQ(pose.flipped, (std::vector<std::uint8_t>{0, 1, 0}));
  for (const std::size_t v : {0U, 3U, 6U}) near(pose.vertices[v].normal, {0, 0, 1});
  near(glm::vec3(pose.vertices[0].tangent), {1, 0, 0});
  near(glm::vec3(pose.vertices[3].tangent), {-1, 0, 0});
  // The bitangent cross(n, t) * w is +y at first. Mirrored in x it stays +y, rotated it is -y.
  const auto bitangent = [&](std::size_t v) {
    return glm::cross(pose.vertices[v].normal, glm::vec3(pose.vertices[v].tangent)) * pose.vertices[v].tangent.w;
  };
  near(bitangent(0), {0, 1, 0});
  near(bitangent(3), {0, 1, 0});
  near(bitangent(6), {0, -1, 0});
}

TEST(Gltf, FlatNormalsFaceTheFrontOfMirroredTriangles) {
  const ScenePtr scene = imported(triangle_model({{"scale", {-1, 1, 1}}}));
  const Pose pose = scene->pose(0.0);
  EXPECT_EQ(pose.flipped[0], 1);
  near(pose.vertices[0].normal, {0, 0, 1});
}

TEST(Gltf, ListsStripsAndFansWithAndWithoutIndices) {
  const std::vector<float> five = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0};
  const auto drawn = [&](int mode, const std::vector<std::uint8_t>& indices) {
    GltfModel model;
    json primitive = {{"attributes", {{"POSITION", model.vec3(five)}}}, {"mode", mode}};
    if (!indices.empty()) primitive["indices"] = model.accessor<std::uint8_t>("SCALAR", 1, indices);
    model.show(primitive);
    const ScenePtr scene = imported(model);
    const Pose pose = scene->pose(0.0);
    std::vector<int> vertices;  // vertex indices in the order of drawing
    for (const std::uint32_t index : scene->indices) {
      for (std::size_t v = 0; v < 5; ++v) {
        const glm::vec3 position(five[3 * v], five[3 * v + 1], five[3 * v + 2]);
        if (pose.vertices[index].position == position) vertices.push_back(static_cast<int>(v));
      }
    }
    return vertices;
  };
  using List = std::vector<int>;
  EXPECT_EQ(drawn(4, {}), (List{0, 1, 2}));  // two vertices are left over
  EXPECT_EQ(drawn(4, {2, 1, 3, 4, 2, 3}), (List{2, 1, 3, 4, 2, 3}));
  EXPECT_EQ(drawn(5, {}), (List{0, 1, 2, 1, 3, 2, 2, 3, 4}));
  EXPECT_EQ(drawn(5, {4, 3, 2, 1}), (List{4, 3, 2, 3, 1, 2}));
  EXPECT_EQ(drawn(6, {}), (List{1, 2, 0, 2, 3, 0, 3, 4, 0}));
  EXPECT_EQ(drawn(6, {1, 3, 4, 2}), (List{3, 4, 1, 4, 2, 1}));
  EXPECT_EQ(drawn(4, {0, 1, 1, 0, 1, 2}), (List{0, 1, 2}));  // one triangle is degenerate
}

TEST(Gltf, PointsAndLinesAreSkippedWithOneLine) {
  GltfModel model;
  const int positions = model.triangle();
  for (const int mode : {0, 1, 2, 3, 4}) {
    model.show({{"attributes", {{"POSITION", positions}}}, {"mode", mode}});
  }
  Lines lines;
  EXPECT_EQ(imported(model, lines.log)->triangle_count(), 1U);
  ASSERT_EQ(lines.infos.size(), 1U);
  EXPECT_TRUE(has(lines.infos[0], "4 primitives")) << lines.infos[0];
  EXPECT_TRUE(lines.warnings.empty());
}

template <class T>
glm::vec3 read_as(bool normalized, std::array<T, 3> value) {
  GltfModel model;
  std::vector<T> values(9, T(0));
  std::copy(value.begin(), value.end(), values.begin() + 3);
  values[7] = T(1);
  const int positions = model.accessor<T>("VEC3", 3, values, {{"normalized", normalized}});
  model.show({{"attributes", {{"POSITION", positions}, {"NORMAL", model.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1})}}}});
  return imported(model)->pose(0.0).vertices[1].position;
}

TEST(Gltf, EveryComponentTypePlainAndNormalised) {
  near(read_as<std::int8_t>(false, {-128, 127, 5}), {-128, 127, 5});
  near(read_as<std::int8_t>(true, {-128, 127, 64}), {-1, 1, 64.0F / 127.0F});
  near(read_as<std::uint8_t>(false, {0, 255, 5}), {0, 255, 5});
  near(read_as<std::uint8_t>(true, {0, 255, 51}), {0, 1, 0.2F});
  near(read_as<std::int16_t>(false, {-32768, 32767, 5}), {-32768, 32767, 5});
  near(read_as<std::int16_t>(true, {-32768, 32767, -16384}), {-1, 1, -16384.0F / 32767.0F});
  near(read_as<std::uint16_t>(false, {0, 65535, 5}), {0, 65535, 5});
  near(read_as<std::uint16_t>(true, {0, 65535, 13107}), {0, 1, 0.2F});
  near(read_as<std::uint32_t>(false, {0, 1000000, 5}), {0, 1000000, 5});
  near(read_as<float>(false, {-1.5F, 0.25F, 1e10F}), {-1.5F, 0.25F, 1e10F});
}

TEST(Gltf, IndicesOfEverySize) {
  const auto count = [](auto zero) {
    using T = decltype(zero);
    GltfModel model;
    model.show(
        {{"attributes", {{"POSITION", model.triangle()}}}, {"indices", model.accessor<T>("SCALAR", 1, {2, 0, 1})}});
    const ScenePtr scene = imported(model);
    near(corners(*scene, scene->pose(0.0))[0], {0, 1, 0});
    return scene->triangle_count();
  };
  EXPECT_EQ(count(std::uint8_t{}), 1U);
  EXPECT_EQ(count(std::uint16_t{}), 1U);
  EXPECT_EQ(count(std::uint32_t{}), 1U);
}

TEST(Gltf, InterleavedAttributes) {
  GltfModel model;
  // Position, then color, padded to 20 bytes.
  Bytes bytes;
  const float coordinates[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  for (std::size_t v = 0; v < 3; ++v) {
    const Bytes position = test::bytes_of(std::vector<float>(coordinates + 3 * v, coordinates + 3 * v + 3));
    bytes.insert(bytes.end(), position.begin(), position.end());
    const auto shade = static_cast<std::uint8_t>(51 * (v + 1));
    bytes.insert(bytes.end(), {shade, 0, 255, 0, 0, 0, 0, 0});
  }
  bytes.resize(bytes.size() - 5);  // the last element need not be padded
  const int view = model.view(bytes, {{"byteStride", 20}});
  const int positions =
      model.add("accessors", {{"bufferView", view}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}});
  const int colors = model.add("accessors", {{"bufferView", view},
                                             {"byteOffset", 12},
                                             {"componentType", 5121},
                                             {"normalized", true},
                                             {"count", 3},
                                             {"type", "VEC3"}});
  model.show({{"attributes", {{"POSITION", positions}, {"COLOR_0", colors}}}});
  const ScenePtr scene = imported(model);
  near(corners(*scene, scene->pose(0.0))[2], {0, 1, 0});
  for (std::size_t v = 0; v < 3; ++v) {
    near(glm::vec3(scene->attributes[v].color), {0.2F * static_cast<float>(v + 1), 0, 1});
    EXPECT_EQ(scene->attributes[v].color.a, 1.0F);
  }
}

TEST(Gltf, UnreferencedVerticesAreDropped) {
  GltfModel model;
  std::vector<float> many(300, 1000.0F);
  for (std::size_t i = 0; i < 9; ++i) many[i + 30] = i == 3 || i == 7 ? 1.0F : 0.0F;
  const std::vector<float> up = [] {
    std::vector<float> normals;
    for (int i = 0; i < 100; ++i) normals.insert(normals.end(), {0, 0, 1});
    return normals;
  }();
  model.show({{"attributes", {{"POSITION", model.vec3(many)}, {"NORMAL", model.vec3(up)}}},
              {"indices", model.accessor<std::uint8_t>("SCALAR", 1, {10, 11, 12})}});
  const ScenePtr scene = imported(model);
  EXPECT_EQ(scene->attributes.size(), 3U);
  EXPECT_EQ(scene->pose(0.0).high, glm::dvec3(1, 1, 0));
}

TEST(Gltf, SparseAccessors) {
  const Bytes bytes = test::seed_animated().gltf();
  const ScenePtr scene = imported(bytes);
  const Pose pose = scene->pose(0.0, 99);  // at rest: first target with weight 0.5
  // Vertex 3 is (2, 2, 0) instead of (1, 1, 0). The sparse target over zeros has (0, 0, 1) and (0, 0, 2) at 1 and 3.
  ASSERT_EQ(pose.vertices.size(), 4U);
  near(pose.vertices[0].position, {0, 0, 0});
  near(pose.vertices[1].position, {1, 0, 0.5F});
  near(pose.vertices[2].position, {0, 1, 0});
  near(pose.vertices[3].position, {2, 2, 1});
  // The target of normals: (0, 0, 1) + 1/2 (1, 0, 0).
  near(pose.vertices[0].normal, glm::normalize(glm::vec3(0.5F, 0, 1)));
  near(pose.vertices[1].normal, {0, 0, 1});
}

TEST(Gltf, MorphedFlatTrianglesUpdateTheirNormals) {
  GltfModel model;
  const int target = model.vec3({0, 0, 0, 0, 0, 0, 0, -1, 1});  // the third vertex: from (0, 1, 0) to (0, 0, 1)
  model.show({{"attributes", {{"POSITION", model.triangle()}}}, {"targets", json::array({{{"POSITION", target}}})}},
             {{"weights", {1}}});
  const ScenePtr scene = imported(model);
  near(scene->pose(0.0).vertices[0].normal, {0, -1, 0});
}

/// A material with a normal map on a quad of two triangles.
GltfModel mapped_quad(const std::vector<float>& uvs, const std::vector<std::uint8_t>& indices, bool normals) {
  GltfModel model;
  model.add("images", {{"bufferView", model.view(test::png(1, 1, 8, 2, {128, 128, 255}))}});
  model.add("textures", {{"source", 0}});
  model.add("materials", {{"normalTexture", {{"index", 0}}}});
  json attributes = {{"POSITION", model.vec3({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0})}, {"TEXCOORD_0", model.vec2(uvs)}};
  if (normals) attributes["NORMAL"] = model.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  model.show(
      {{"attributes", attributes}, {"indices", model.accessor<std::uint8_t>("SCALAR", 1, indices)}, {"material", 0}});
  return model;
}

TEST(Gltf, MissingTangentsFollowTheTexture) {
  for (const bool normals : {true, false}) {
    // u to the right and v down, as in the image: the tangent is +x, the bitangent +y (up in the image).
    const ScenePtr upright = imported(mapped_quad({0, 1, 1, 1, 1, 0, 0, 0}, {0, 1, 2, 0, 2, 3}, normals));
    for (const PosedVertex& v : upright->pose(0.0).vertices) {
      near(glm::vec3(v.tangent), {1, 0, 0});
      EXPECT_EQ(v.tangent.w, 1.0F);
    }
    // u to the left: mirrored.
    const ScenePtr mirrored = imported(mapped_quad({1, 1, 0, 1, 0, 0, 1, 0}, {0, 1, 2, 0, 2, 3}, normals));
    for (const PosedVertex& v : mirrored->pose(0.0).vertices) {
      near(glm::vec3(v.tangent), {-1, 0, 0});
      EXPECT_EQ(v.tangent.w, -1.0F);
    }
    // The image rotated by 90 degrees: u up.
    const ScenePtr turned = imported(mapped_quad({0, 0, 0, 1, 1, 1, 1, 0}, {0, 1, 2, 0, 2, 3}, normals));
    for (const PosedVertex& v : turned->pose(0.0).vertices) {
      near(glm::vec3(v.tangent), {0, 1, 0});
      EXPECT_EQ(v.tangent.w, 1.0F);
    }
    // No area in texture space: any valid tangent.
    const ScenePtr point = imported(mapped_quad({0, 0, 0, 0, 0, 0, 0, 0}, {0, 1, 2, 0, 2, 3}, normals));
    EXPECT_EQ(point->triangle_count(), 2U);
  }
}

TEST(Gltf, VerticesOnASeamOfMirroredTexturesAreSplit) {
  // The diagonal's ends belong to triangles of both orientations: (0,1,2) with v down, (0,2,3) mirrored.
  GltfModel model = mapped_quad({0, 1, 1, 1, 1, 0, 1, 1}, {0, 1, 2, 0, 2, 3}, true);
  const ScenePtr scene = imported(model);
  const Pose pose = scene->pose(0.0);
  EXPECT_EQ(pose.vertices.size(), 6U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(pose.vertices[scene->indices[k]].tangent.w, 1.0F);
    EXPECT_EQ(pose.vertices[scene->indices[3 + k]].tangent.w, -1.0F);
  }
  near(corners(*scene, pose, 1)[0], {0, 0, 0});
  near(corners(*scene, pose, 1)[1], {1, 1, 0});
  near(corners(*scene, pose, 1)[2], {0, 1, 0});
}

TEST(Gltf, BrokenNormalsAreReplaced) {
  GltfModel model;
  const float nan = std::nanf("");
  model.show(
      {{"attributes", {{"POSITION", model.triangle()}, {"NORMAL", model.vec3({0, 0, 0, nan, 0, 0, 0, 0, -5})}}}});
  Lines lines;
  const ScenePtr scene = imported(model, lines.log);
  const Pose pose = scene->pose(0.0);
  near(pose.vertices[0].normal, {0, 0, 1});
  near(pose.vertices[1].normal, {0, 0, 1});
  near(pose.vertices[2].normal, {0, 0, -1});
  EXPECT_EQ(lines.warnings.size(), 1U);
}

}  // namespace
}  // namespace cumulet::surface
