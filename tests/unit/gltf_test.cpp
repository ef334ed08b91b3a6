// The glTF importer with small files made here, compared with numbers computed by hand.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "base/error.hpp"
#include "support/folder.hpp"
#include "support/gltf_check.hpp"
#include "support/gltf_import.hpp"
#include "support/gltf_model.hpp"
#include "support/gltf_seeds.hpp"
#include "surface/gltf_import.hpp"

namespace cumulet::surface {
namespace {

namespace fs = std::filesystem;
using test::Bytes;
using test::corners;
using test::GltfModel;
using test::has;
using test::imported;
using test::json;
using test::Lines;
using test::near;
using test::refused;
using test::triangle_model;

TEST(Gltf, OneTriangleAsGltfAndAsGlb) {
  const GltfModel model = triangle_model();
  for (const Bytes& file : {model.gltf(), model.glb()}) {
    const ScenePtr scene = imported(file);
    EXPECT_EQ(scene->triangle_count(), 1U);
    ASSERT_EQ(scene->draws.size(), 1U);
    EXPECT_EQ(scene->draws[0].index_count, 3U);
    EXPECT_EQ(scene->materials.size(), 1U);
    EXPECT_TRUE(scene->animations.empty());
    const Pose pose = scene->pose(3.0);
    near(corners(*scene, pose)[1], {1, 0, 0});
    near(corners(*scene, pose)[2], {0, 1, 0});
    near(pose.vertices[0].normal, {0, 0, 1});
    EXPECT_EQ(pose.vertices[0].tangent, glm::vec4(0.0F));
    EXPECT_EQ(pose.low, glm::dvec3(0.0));
    EXPECT_EQ(pose.high, glm::dvec3(1, 1, 0));
    EXPECT_EQ(pose.flipped, std::vector<std::uint8_t>{0});
  }
}

TEST(Gltf, ExternalFilesAreRelativeToItAndPercentDecoded) {
  const test::Folder folder;
  fs::create_directories(folder / "sub dir");
  const auto write = [](const fs::path& path, const Bytes& bytes) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  };
  GltfModel model = triangle_model();
  Bytes padded = model.data();
  padded.resize(padded.size() + 5);  // longer than byteLength is legal
  write(folder / "sub dir" / "a+b.bin", padded);
  json whole = model.root;
  whole["buffers"] = json::array({{{"byteLength", model.data().size()}, {"uri", "sub%20dir/a+b.bin"}}});
  const auto save = [&](const json& content) {
    const std::string text = content.dump();
    write(folder / "scene.gltf", Bytes(text.begin(), text.end()));
    return (folder / "scene.gltf").string();
  };
  EXPECT_EQ(import_gltf(save(whole), Log())->triangle_count(), 1U);

  const auto line = [&](const std::string& path) -> std::string {
    try {
      import_gltf(path, Log());
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::file);
      EXPECT_TRUE(has(error.what(), path)) << error.what();
      return error.what();
    }
    return "was imported";
  };
  EXPECT_TRUE(has(line((folder / "none.gltf").string()), "no such file"));
  EXPECT_TRUE(has(line(folder.path().string()), "is not a file"));
  for (const auto& [uri, cause] :
       std::vector<std::pair<std::string, std::string>>{{"other.bin", "other.bin: no such file"},
                                                        {"sub%20dir", "is not a file"},
                                                        {"/etc/passwd", "not a relative path"},
                                                        {"file:///etc/passwd", "not a relative path"},
                                                        {"http://example.org/a.bin", "not a relative path"},
                                                        {"..%2f..%00", "not a relative path"},
                                                        {"", "its URI is empty"},
                                                        {"data:application/octet-stream;base64,@@@@", "not base64"},
                                                        {"data:application/octet-stream,a%62c", "has 3 bytes, not 36"},
                                                        {"data:;base64", "no data"},
                                                        {"data:;base64,AAAA", "has 3 bytes, not 36"}}) {
    json bad = whole;
    bad["buffers"][0]["uri"] = uri;
    const std::string told = line(save(bad));
    EXPECT_TRUE(has(told, cause)) << uri << ": " << told;
  }
  write(folder / "sub dir" / "a+b.bin", Bytes(10));
  EXPECT_TRUE(has(line(save(whole)), "has 10 bytes, not 36"));
}

// Files that Khronos' validator accepts, with buffers that have no data. They matter only where something reads them.
TEST(Gltf, MissingBufferDataMattersOnlyIfRead) {
  const auto with = [](const std::function<void(json&)>& change) {
    GltfModel model = triangle_model();
    // These buffers are added after the model's own.
    change(model.root);
    return model;
  };
  const auto add_view = [](json& root, const json& buffer) {
    root["buffers"] = json::array({buffer});
    root["bufferViews"].push_back({{"buffer", 1}, {"byteLength", 36}});
    root["accessors"].push_back({{"bufferView", 1}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}});
  };
  const auto read_it = [](json& root) { root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 1; };
  struct Case {
    const char* what;
    json buffer;
    std::size_t warnings;
    const char* cause;  ///< the warning once something reads the buffer; null: it is not drawn
  };
  for (const Case& c :
       {Case{"no data", {{"byteLength", 36}}, 0, nullptr},
        Case{"elsewhere",
             {{"byteLength", 36}, {"uri", "http://example.org/a.bin"}},
             1,
             "POSITION: buffer 1: \"http://example.org/a.bin\" is not a relative path"},
        Case{"missing", {{"byteLength", 36}, {"uri", "no.bin"}}, 1, "POSITION: buffer 1: no.bin: no such file"}}) {
    SCOPED_TRACE(c.what);
    Lines lines;
    EXPECT_EQ(imported(with([&](json& root) { add_view(root, c.buffer); }), lines.log)->triangle_count(), 1U);
    EXPECT_EQ(lines.warnings.size(), c.warnings);
    const GltfModel reading = with([&](json& root) {
      add_view(root, c.buffer);
      read_it(root);
    });
    if (c.cause != nullptr) {
      EXPECT_TRUE(has(refused(reading), c.cause));
      continue;
    }
    EXPECT_EQ(imported(reading, lines.log)->triangle_count(), 0U);
    ASSERT_EQ(lines.warnings.size(), 2U);
    EXPECT_TRUE(has(lines.warnings[0], "1 primitives are ignored: their buffer has no data"));
    EXPECT_TRUE(has(lines.warnings[1], "has no triangles"));
  }
  // Skins, animations and morph targets cannot read it either. Compressed data in it is missing too.
  GltfModel animated = with([&](json& root) {
    add_view(root, {{"byteLength", 36}});
    root["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 36}});
    root["bufferViews"].back()["extensions"]["EXT_meshopt_compression"] = {
        {"buffer", 1}, {"byteLength", 9}, {"byteStride", 12}, {"count", 3}, {"mode", "ATTRIBUTES"}};
    root["accessors"].push_back({{"bufferView", 2}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}});
    root["skins"] = json::array({{{"joints", {0}}, {"inverseBindMatrices", 1}}});
    root["animations"] =
        json::array({{{"samplers", json::array({{{"input", 1}, {"output", 1}}})},
                      {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}})}}});
    json second = root["meshes"][0]["primitives"][0];
    second["targets"] = json::array({{{"POSITION", 2}}});
    root["meshes"][0]["primitives"].push_back(second);
  });
  Lines lines;
  EXPECT_EQ(imported(animated, lines.log)->triangle_count(), 1U);
  ASSERT_EQ(lines.warnings.size(), 2U);
  EXPECT_TRUE(has(lines.warnings[0], "2 skins and animation channels are ignored: their buffer has no data"));
  EXPECT_TRUE(has(lines.warnings[1], "1 primitives are ignored"));
  // A view must fit into the declared length of a buffer without data.
  EXPECT_TRUE(has(refused(with([&](json& root) {
                    add_view(root, {{"byteLength", 35}});
                  })),
                  "buffer view 1 exceeds the 35 bytes of buffer 1"));

  const json odd = {{"componentType", 5126}, {"count", 3}, {"type", "NOTAVEC3"}};
  EXPECT_EQ(imported(with([&](json& root) { root["accessors"].push_back(odd); }))->triangle_count(), 1U);
  EXPECT_TRUE(has(refused(with([&](json& root) {
                    root["accessors"].push_back(odd);
                    read_it(root);
                  })),
                  "POSITION has an unknown element type"));
}

TEST(Gltf, NewerMinorVersionsAreAccepted) {
  GltfModel model = triangle_model();
  model.root["asset"] = {{"version", "2.1"}};
  Lines silent;
  EXPECT_EQ(imported(model, silent.log)->triangle_count(), 1U);
  EXPECT_TRUE(silent.warnings.empty());
  model.root["asset"] = {{"version", "2.1"}, {"minVersion", "2.1"}};
  Lines lines;
  EXPECT_EQ(imported(model, lines.log)->triangle_count(), 1U);
  ASSERT_EQ(lines.warnings.size(), 1U);
  EXPECT_TRUE(has(lines.warnings[0], "glTF 2.1"));
  for (const char* version : {"3.0", "2", "2.", "2.x", "1.0", ""}) {
    model.root["asset"] = {{"version", "2.0"}, {"minVersion", version}};
    EXPECT_TRUE(has(refused(model, ErrorCode::unsupported), std::string("is glTF ") + version + ", not 2.0"));
  }
}

TEST(Gltf, PlainDataUrisAreReadVerbatim) {
  GltfModel model = triangle_model();
  std::string plain;
  for (const std::uint8_t byte : model.data()) {
    constexpr std::string_view digits = "0123456789aBCdeF";
    plain += byte == 0 ? "%00" : std::string("%") + digits[byte / 16U] + digits[byte % 16U];
  }
  json whole = model.root;
  whole["buffers"] = json::array({{{"byteLength", 36}, {"uri", "data:," + plain}}});
  const std::string text = whole.dump();
  const ScenePtr scene = imported(Bytes(text.begin(), text.end()));
  near(corners(*scene, scene->pose(0.0))[1], {1, 0, 0});
}

TEST(Gltf, OutOfRangeNumbersAreReported) {
  GltfModel model = triangle_model();
  model.root["materials"] = nlohmann::json::array({{{"emissiveFactor", {0.0, 1.0, 0.5}}, {"alphaCutoff", 7.0}}});
  {
    Lines good;
    imported(model, good.log);
    EXPECT_TRUE(good.warnings.empty());
  }
  model.root["materials"][0]["emissiveFactor"] = {0.0, 3.5, 0.5};
  {
    Lines lines;
    imported(model, lines.log);
    ASSERT_EQ(lines.warnings.size(), 1U);
    EXPECT_TRUE(has(lines.warnings[0], "materials[0].emissiveFactor[1] is 3.5, more than the glTF limit of 1"));
  }
  model.root["materials"][0]["pbrMetallicRoughness"] = {{"roughnessFactor", -2}, {"metallicFactor", 1.01}};
  {
    Lines lines;
    imported(model, lines.log);
    ASSERT_EQ(lines.warnings.size(), 1U);
    EXPECT_TRUE(has(lines.warnings[0], ", and 2 more numbers"));
  }
}

TEST(Gltf, UnusedSkinsAndWeightsAreReported) {
  const auto warnings = [](const GltfModel& model) {
    Lines lines;
    imported(model, lines.log);
    std::string all;
    for (const std::string& line : lines.warnings) all += line + "; ";
    return all;
  };
  GltfModel weights = triangle_model();
  weights.root["nodes"][0]["weights"] = {0.5};
  EXPECT_TRUE(has(warnings(weights), "1 nodes have a wrong number of morph weights"));
  GltfModel unbound = triangle_model({{"skin", 0}});
  unbound.add("skins", {{"joints", {unbound.add("nodes", json::object())}}});
  EXPECT_TRUE(has(warnings(unbound), "1 primitives have a skin but no joints"));
  unbound.root["scenes"] = json::array({{{"nodes", {0}}}});
  EXPECT_TRUE(has(warnings(unbound), "1 nodes have a skin with joints that are in no scene"));
}

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

TEST(Gltf, AnimationsInterpolateStepLinearAndCubic) {
  const ScenePtr scene = imported(test::seed_animated().gltf());
  ASSERT_EQ(scene->animations.size(), 2U);
  EXPECT_EQ(scene->animations[0].name, "all");
  EXPECT_EQ(scene->animations[0].duration, 2.0);

  // Joint 0: scaled in steps. Joint 1, its child: moved along a cubic spline and rotated about z by 0, 90 and 180
  // degrees. Its inverse bind matrix subtracts (0, 1, 0). The mesh node's translation (100, 100, 100) must have no
  // effect.
  const auto check = [&](double time, double from) {
    const Pose pose = scene->pose(time);
    const double u = from;
    const double scale = u < 1.0 ? 1.0 : (u < 2.0 ? 2.0 : 3.0);
    // Hermite on [0, 1]: 0 to (1, 1, 0), tangents (3, 0, 0) and (0, 0, 0) after the first key.
    glm::dvec3 moved(0.0);
    if (u <= 1.0) {
      moved.x = (u * u * u - 2 * u * u + u) * 3.0 + (-2 * u * u * u + 3 * u * u) * 1.0;
      moved.y = (2 * u * u * u - 3 * u * u + 1) * 1.0 + (-2 * u * u * u + 3 * u * u) * 1.0;
    } else {
      const double s = u - 1.0;  // (1, 1, 0) to (2, 1, 0), without tangents
      moved = glm::dvec3(1.0 + (-2 * s * s * s + 3 * s * s), 1.0, 0.0);
    }
    const double angle = u * 1.5707963267948966;
    // Vertex 1, (1, 0, 0) and morphed along z by the weights, has weight 0.5 for each joint.
    const double w0 = u <= 1.0 ? u : 2.0 - u;
    const double w1 = u <= 1.0 ? 0.0 : u - 1.0;
    const glm::dvec3 shape(1.0, 0.0, w0 * 1.0 + w1 * 1.0);
    const glm::dvec3 bound = shape - glm::dvec3(0, 1, 0);
    const glm::dvec3 turned(std::cos(angle) * bound.x - std::sin(angle) * bound.y,
                            std::sin(angle) * bound.x + std::cos(angle) * bound.y, bound.z);
    const glm::dvec3 expected = 0.5 * scale * shape + 0.5 * scale * (turned + moved);
    near(pose.vertices[1].position, glm::vec3(expected), 1e-3F);
    EXPECT_EQ(test::broken(*scene, pose), "");
  };
  for (const double time : {0.0, 0.25, 0.5, 0.99, 1.0, 1.5, 2.0}) {
    SCOPED_TRACE(time);
    check(time, time);
  }
  check(2.5, 0.5);  // looped
  check(-0.5, 1.5);
  EXPECT_EQ(scene->pose(2.5).time, 0.5);

  // The second animation moves only joint 0, linearly.
  near(scene->pose(0.5, 1).vertices[0].position, {1.5F, 1.5F, 1.5F});
}

TEST(Gltf, RotationsTakeTheShorterArc) {
  GltfModel model = triangle_model();
  // The identity, and 90 degrees about z with the sign of the quaternion reversed: halfway is 45 degrees.
  const int turns = model.accessor<float>("VEC4", 4, {0, 0, 0, 1, 0, 0, -0.70710678F, -0.70710678F});
  model.add("animations",
            {{"samplers", json::array({{{"input", model.scalars({1, 3})}, {"output", turns}}})},
             {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", "rotation"}}}}})}});
  const ScenePtr scene = imported(model);
  const float h = std::sqrt(0.5F);
  near(corners(*scene, scene->pose(2.0))[1], {h, h, 0});
  near(corners(*scene, scene->pose(0.5))[1], {1, 0, 0});  // before the first key
  near(corners(*scene, scene->pose(3.0))[1], {0, 1, 0});
}

TEST(Gltf, ShutterCrossesTheLoopOnlyIfItsEndsMatch) {
  const auto moved_by = [](const std::vector<float>& way) {
    GltfModel model = triangle_model();
    model.add("animations",
              {{"samplers", json::array({{{"input", model.scalars({0, 1, 2})}, {"output", model.vec3(way)}}})},
               {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}})}});
    return imported(model);
  };
  const auto expect_ends = [](const Scene& scene, double time, double seconds, float open, float close) {
    SCOPED_TRACE(time);
    const std::optional<surface::PoseEnds> ends = scene.pose_ends(time, 0, seconds);
    ASSERT_TRUE(ends);
    near(corners(scene, ends->open)[0], {open, 0, 0});
    near(corners(scene, ends->close)[0], {close, 0, 0});
  };
  const ScenePtr once = moved_by({0, 0, 0, 1, 0, 0, 3, 0, 0});
  expect_ends(*once, 1.0, 1.0, 0.5F, 2.0F);
  expect_ends(*once, 0.25, 1.0, 0.0F, 0.75F);
  expect_ends(*once, 2.0, 1.0, 2.0F, 3.0F);
  expect_ends(*once, 5.75, 1.0, 1.5F, 3.0F);  // looped
  EXPECT_FALSE(once->may_move(1));
  EXPECT_FALSE(once->pose_ends(1.0, 1, 1.0));
  const ScenePtr again = moved_by({0, 0, 0, 4, 0, 0, 0, 0, 0});
  expect_ends(*again, 0.25, 1.0, 1.0F, 3.0F);
  expect_ends(*again, 1.75, 1.0, 3.0F, 1.0F);
  expect_ends(*again, 1.0, 4.0, 0.0F, 0.0F);  // more than the whole animation
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

TEST(Gltf, MaterialsAreReadCompletely) {
  Lines lines;
  const ScenePtr scene = imported(test::seed_materials().glb(), lines.log);
  ASSERT_EQ(scene->materials.size(), 4U);
  const Material& m = scene->materials[0];
  EXPECT_EQ(m.name, "everything");
  near(glm::vec3(m.base_color), {0.1F, 0.2F, 0.3F});
  EXPECT_FLOAT_EQ(m.base_color.a, 0.4F);
  EXPECT_FLOAT_EQ(m.metallic, 0.25F);
  EXPECT_FLOAT_EQ(m.roughness, 0.75F);
  EXPECT_FLOAT_EQ(m.normal_scale, 0.5F);
  EXPECT_FLOAT_EQ(m.occlusion_strength, 0.6F);
  near(m.emission, {4, 8, 0});
  EXPECT_EQ(m.alpha_mode, AlphaMode::mask);
  EXPECT_FLOAT_EQ(m.alpha_cutoff, 0.3F);
  EXPECT_TRUE(m.double_sided);
  EXPECT_FALSE(m.unlit);
  EXPECT_FLOAT_EQ(m.ior, 1.33F);
  EXPECT_FLOAT_EQ(m.specular, 0.7F);
  near(m.specular_color, {0.9F, 0.8F, 0.7F});
  EXPECT_FLOAT_EQ(m.clearcoat, 0.8F);
  EXPECT_FLOAT_EQ(m.clearcoat_roughness, 0.15F);
  EXPECT_FLOAT_EQ(m.transmission, 0.35F);
  EXPECT_FLOAT_EQ(m.thickness, 2.0F);
  near(m.absorption, {0.0F, 2.0F * std::log(2.0F), 2.0F * std::log(4.0F)});
  EXPECT_FLOAT_EQ(m.dispersion, 0.36F);
  near(m.sheen_color, {0.3F, 0.2F, 0.1F});
  EXPECT_FLOAT_EQ(m.sheen_roughness, 0.45F);
  EXPECT_FLOAT_EQ(m.anisotropy, 0.65F);
  EXPECT_FLOAT_EQ(m.anisotropy_rotation, 1.57F);
  EXPECT_FLOAT_EQ(m.iridescence, 0.55F);
  EXPECT_FLOAT_EQ(m.film_ior, 1.8F);
  EXPECT_FLOAT_EQ(m.film_thinnest, 150.0F);
  EXPECT_FLOAT_EQ(m.film_thickest, 650.0F);
  EXPECT_EQ(m.film_thickness_texture.uv_set, 1U);
  for (const TextureUse* use :
       {&m.base_color_texture, &m.metallic_roughness_texture, &m.normal_texture, &m.occlusion_texture,
        &m.emission_texture, &m.specular_texture, &m.specular_color_texture, &m.clearcoat_texture,
        &m.clearcoat_roughness_texture, &m.transmission_texture, &m.sheen_color_texture, &m.sheen_roughness_texture,
        &m.anisotropy_texture, &m.iridescence_texture, &m.film_thickness_texture}) {
    EXPECT_GE(use->texture, 0);
  }
  // KHR_texture_transform at uv = (1, 0) and (0, 1): scaled, rotated by 0.5, translated.
  const TextureUse& turned = m.base_color_texture;
  EXPECT_EQ(turned.uv_set, 1U);
  const float c = std::cos(0.5F);
  const float s = std::sin(0.5F);
  const glm::vec2 right = turned.transform * glm::vec3(1, 0, 1);
  const glm::vec2 down = turned.transform * glm::vec3(0, 1, 1);
  near({right, 0}, {2 * c + 0.5F, -2 * s + 0.25F, 0});
  near({down, 0}, {3 * s + 0.5F, 3 * c + 0.25F, 0});

  const Material& blend = scene->materials[1];
  EXPECT_EQ(blend.alpha_mode, AlphaMode::blend);
  EXPECT_TRUE(blend.unlit);

  // KHR_materials_pbrSpecularGlossiness is converted: see gltf_extensions_test.
  const Material& glossy = scene->materials[2];
  EXPECT_EQ(glossy.base_color, glm::vec4(1.0F));
  EXPECT_EQ(glossy.metallic, 1.0F);
  EXPECT_EQ(glossy.roughness, 1.0F);
  ASSERT_GE(glossy.metallic_roughness_texture.texture, 0);
  EXPECT_NE(glossy.base_color_texture.texture, glossy.metallic_roughness_texture.texture);
  const Texture& likeness = scene->textures[static_cast<std::size_t>(glossy.metallic_roughness_texture.texture)];
  EXPECT_EQ(scene->images[likeness.image].rgba[1], 64);  // roughness 0.25
  ASSERT_EQ(lines.warnings.size(), 1U);
  EXPECT_TRUE(has(lines.warnings[0], "KHR_materials_pbrSpecularGlossiness")) << lines.warnings[0];

  // The default material.
  EXPECT_EQ(scene->materials[3].base_color, glm::vec4(1.0F));
  EXPECT_EQ(scene->materials[3].metallic, 1.0F);

  const Sampler& sampler = scene->textures[static_cast<std::size_t>(turned.texture)].sampler;
  EXPECT_EQ(sampler.magnify, Filter::nearest);
  EXPECT_EQ(sampler.minify, Filter::linear);
  EXPECT_EQ(sampler.between_mipmaps, Filter::nearest);
  EXPECT_TRUE(sampler.mipmaps);
  EXPECT_EQ(sampler.wrap_s, Wrap::clamp);
  EXPECT_EQ(sampler.wrap_t, Wrap::mirrored);

  // Vertices: two uv sets and a color.
  const VertexAttributes& v = scene->attributes[0];
  EXPECT_EQ(v.uv[0], glm::vec2(0, 1));
  EXPECT_EQ(v.uv[1], glm::vec2(0, 1));
  near(glm::vec3(v.color), {1, 0, 0.2F});
}

TEST(Gltf, ImagesOfEightAndSixteenBitsAndJpeg) {
  const ScenePtr scene = imported(test::seed_materials().gltf());
  const auto image = [&](const TextureUse& use) -> const Image& {
    return scene->images[scene->textures[static_cast<std::size_t>(use.texture)].image];
  };
  const Material& m = scene->materials[0];
  const Image& png = image(m.base_color_texture);
  EXPECT_EQ(png.name, "two");
  EXPECT_EQ(png.width, 2U);
  EXPECT_EQ(png.height, 1U);
  EXPECT_EQ(png.rgba, (std::vector<std::uint8_t>{255, 0, 0, 255, 0, 255, 0, 128}));
  const Image& wide = image(m.normal_texture);  // 0x8000, 0x007F, 0xFFFF of 65535
  EXPECT_EQ(wide.rgba, (std::vector<std::uint8_t>{128, 0, 255, 255}));
  const Image& jpeg = image(m.occlusion_texture);
  EXPECT_EQ(jpeg.width, 8U);
  for (std::size_t i = 0; i < 64; ++i) {
    EXPECT_NEAR(jpeg.rgba[4 * i], 200, 4);
    EXPECT_NEAR(jpeg.rgba[4 * i + 1], 40, 4);
    EXPECT_NEAR(jpeg.rgba[4 * i + 2], 90, 4);
    EXPECT_EQ(jpeg.rgba[4 * i + 3], 255);
  }
  EXPECT_EQ(scene->images.size(), 5U);  // independent of the number of uses; two are converted images
}

TEST(Gltf, CamerasAndLightsUseTheirNodesTransforms) {
  const ScenePtr scene = imported(test::seed_materials().gltf());
  const Pose pose = scene->pose(0.0);
  ASSERT_EQ(pose.cameras.size(), 2U);
  const SceneCamera& eye = pose.cameras[0];
  EXPECT_EQ(eye.name, "eye");
  EXPECT_FALSE(eye.orthographic);
  EXPECT_EQ(eye.vertical_fov, 0.6);
  EXPECT_EQ(eye.aspect, 1.5);
  EXPECT_EQ(eye.near_plane, 0.5);
  EXPECT_EQ(eye.far_plane, 90.0);
  near(glm::vec3(eye.to_world[3]), {1, 2, 3});
  near(-glm::vec3(eye.to_world[2]), {-1, 0, 0});
  const SceneCamera& flat = pose.cameras[1];
  EXPECT_TRUE(flat.orthographic);
  EXPECT_EQ(flat.height, 4.0);
  EXPECT_EQ(flat.aspect, 2.0);

  ASSERT_EQ(pose.lights.size(), 3U);
  const PunctualLight& sun = pose.lights[0];
  EXPECT_EQ(sun.kind, PunctualLight::Kind::directional);
  near(sun.intensity, {4, 2, 1});
  near(sun.direction, {-1, 0, 0});
  const PunctualLight& spot = pose.lights[1];
  EXPECT_EQ(spot.kind, PunctualLight::Kind::spot);
  EXPECT_FLOAT_EQ(spot.inner_cone, 0.1F);
  EXPECT_FLOAT_EQ(spot.outer_cone, 0.2F);
  near(spot.direction, {0, 0, -1});  // the node's scale does not change it
  const PunctualLight& bulb = pose.lights[2];
  EXPECT_EQ(bulb.kind, PunctualLight::Kind::point);
  EXPECT_EQ(bulb.range, 7.0F);
  near(bulb.position, {1, 7, 3});
  near(bulb.intensity, {1, 1, 1});
}

TEST(Gltf, OnlyTheDefaultSceneIsImported) {
  GltfModel model = triangle_model();
  model.show({{"attributes", {{"POSITION", model.triangle()}}}}, {{"translation", {5, 0, 0}}});
  model.root["scenes"] = json::array({{{"nodes", json::array({0})}}, {{"nodes", json::array({1})}}});
  EXPECT_EQ(imported(model)->pose(0.0).low.x, 0.0);
  model.root["scene"] = 1;
  EXPECT_EQ(imported(model)->pose(0.0).low.x, 5.0);
  model.root.erase("scene");
  model.root.erase("scenes");
  EXPECT_EQ(imported(model)->triangle_count(), 2U);
  model.root["scene"] = 2;
  EXPECT_TRUE(has(refused(model), "there is no scene 2"));
}

TEST(Gltf, Draco) {
  for (const int speed : {0, 3, 10}) {  // Edgebreaker with two speeds, and sequential
    SCOPED_TRACE(speed);
    const GltfModel model = test::seed_draco(4, speed);
    const ScenePtr scene = imported(model.glb());
    EXPECT_EQ(scene->triangle_count(), 32U);
    const Pose pose = scene->pose(0.0);
    double area = 0.0;
    for (std::size_t t = 0; t < 32; ++t) {
      const auto at = corners(*scene, pose, t);
      const glm::vec3 normal = glm::cross(at[1] - at[0], at[2] - at[0]);
      EXPECT_GT(normal.z, 0.0F);
      area += 0.5 * double{normal.z};
    }
    EXPECT_NEAR(area, 1.0, 1e-3);
  }
}

TEST(Gltf, Meshopt) {
  const ScenePtr scene = imported(test::seed_meshopt().gltf());
  EXPECT_EQ(scene->triangle_count(), 64U);  // once as triangles, once as a list of indices
  const Pose pose = scene->pose(0.0);
  double area = 0.0;
  for (std::size_t t = 0; t < 64; ++t) {
    const auto at = corners(*scene, pose, t);
    area += 0.5 * double{glm::cross(at[1] - at[0], at[2] - at[0]).z};
  }
  EXPECT_NEAR(area, 2.0, 1e-3);
  for (const PosedVertex& v : pose.vertices) near(v.normal, {0, 0, 1}, 1e-2F);
}

TEST(Gltf, MeshoptExponentialAndQuaternionFilters) {
  GltfModel model = triangle_model();
  const auto compressed = [&](const Bytes& filtered, std::size_t stride, std::size_t count, const char* filter) {
    Bytes bytes(meshopt_encodeVertexBufferBound(count, stride));
    bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), filtered.data(), count, stride));
    const int view = model.view(bytes);
    json& made = model.root["bufferViews"][static_cast<std::size_t>(view)];
    made = {{"buffer", 0},
            {"byteLength", count * stride},
            {"extensions",
             {{"EXT_meshopt_compression",
               {{"buffer", 0},
                {"byteOffset", made["byteOffset"]},
                {"byteLength", bytes.size()},
                {"byteStride", stride},
                {"count", count},
                {"mode", "ATTRIBUTES"},
                {"filter", filter}}}}}};
    return view;
  };
  const std::vector<float> coordinates = {0, 0, 0, 4, 2, -8};
  Bytes exponential(24);
  meshopt_encodeFilterExp(exponential.data(), 2, 12, 15, coordinates.data());
  const std::vector<float> turns = {0, 0, 0, 1, 0, 0, 0.70710678F, 0.70710678F};
  Bytes quaternions(16);
  meshopt_encodeFilterQuat(quaternions.data(), 2, 8, 14, turns.data());
  const int moves = model.add("accessors", {{"bufferView", compressed(exponential, 12, 2, "EXPONENTIAL")},
                                            {"componentType", 5126},
                                            {"count", 2},
                                            {"type", "VEC3"}});
  const int rotations = model.add("accessors", {{"bufferView", compressed(quaternions, 8, 2, "QUATERNION")},
                                                {"componentType", 5122},
                                                {"normalized", true},
                                                {"count", 2},
                                                {"type", "VEC4"}});
  const int times = model.scalars({0, 1});
  model.add(
      "animations",
      {{"samplers", json::array({{{"input", times}, {"output", moves}}, {{"input", times}, {"output", rotations}}})},
       {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}},
                                 {{"sampler", 1}, {"target", {{"node", 0}, {"path", "rotation"}}}}})}});
  const ScenePtr scene = imported(model);
  near(corners(*scene, scene->pose(1.0))[1], {4, 3, -8}, 1e-2F);  // (1, 0, 0), rotated to y and translated
}

TEST(Gltf, UnknownRequiredExtensionsAreRejectedByName) {
  GltfModel model = triangle_model();
  model.root["extensionsRequired"] = {"KHR_texture_transform", "VENDOR_secret"};
  EXPECT_TRUE(has(refused(model, ErrorCode::unsupported), "VENDOR_secret"));
  model.root["extensionsRequired"] = json::array({"KHR_texture_basisu"});
  EXPECT_TRUE(has(refused(model, ErrorCode::unsupported), "KHR_texture_basisu"));
  model.root.erase("extensionsRequired");
  model.root["extensionsUsed"] = {"VENDOR_secret", "KHR_materials_ior", "KHR_materials_diffuse_transmission"};
  Lines lines;
  imported(model, lines.log);
  ASSERT_EQ(lines.warnings.size(), 1U);
  EXPECT_TRUE(has(lines.warnings[0], "KHR_materials_diffuse_transmission, VENDOR_secret")) << lines.warnings[0];
  EXPECT_FALSE(has(lines.warnings[0], "ior"));
}

TEST(Gltf, UnreadableTexturesAreDroppedWithAWarning) {
  const auto with = [](const json& texture, const json& image) {
    GltfModel model;
    if (!image.is_null()) model.add("images", image);
    model.add("textures", texture);
    model.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
    model.show({{"attributes", {{"POSITION", model.triangle()}}}, {"material", 0}});
    return model;
  };
  const auto line = [](const GltfModel& model) {
    Lines lines;
    const ScenePtr scene = imported(model, lines.log);
    EXPECT_EQ(scene->materials[0].base_color_texture.texture, -1);
    EXPECT_TRUE(scene->images.empty());
    EXPECT_EQ(lines.warnings.size(), 1U);
    return lines.warnings.empty() ? "" : lines.warnings[0];
  };
  const auto embedded = [&](const Bytes& bytes) {
    return with({{"source", 0}}, {{"uri", "data:image/png;base64," + test::base64(bytes)}});
  };
  EXPECT_TRUE(
      has(line(with({{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}}, nullptr)), "KHR_texture_basisu"));
  EXPECT_TRUE(has(line(with({{"source", 0}}, {{"uri", "none.png"}})), "none.png: no such file"));
  EXPECT_TRUE(has(line(with({{"source", 0}}, {{"name", "empty"}})), "neither a URI nor a buffer view"));
  EXPECT_TRUE(has(line(embedded({0xAB, 'K', 'T', 'X', ' ', '2', '0'})), "KTX2"));
  EXPECT_TRUE(has(line(embedded({'G', 'I', 'F', '8', '9', 'a', 0, 0, 0, 0})), "neither PNG, JPEG nor WebP"));
  EXPECT_TRUE(has(line(embedded(test::png(0, 1, 8, 2, {}))), "no pixels"));
  EXPECT_TRUE(has(line(embedded(test::png(1, 0x7FFFFFFF, 8, 2, {0, 0, 0}))), "exceed the limit"));
  EXPECT_TRUE(has(line(embedded(test::png(16000, 16000, 8, 6, {0, 0, 0, 0}))), "do not fit into its"));
  Bytes cut = test::png(2, 2, 8, 2, Bytes(12));
  cut.resize(50);
  EXPECT_TRUE(has(line(embedded(cut)), "cannot be decoded"));
  EXPECT_TRUE(has(line(embedded({0xFF, 0xD8, 0xFF, 0xE0, 0, 16})), "is a JPEG that cannot be read"));
  // uv set 2.
  GltfModel far = embedded(test::png(1, 1, 8, 2, {1, 2, 3}));
  far.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 2;
  EXPECT_TRUE(has(line(far), "TEXCOORD_2"));
  // An index out of range is an error.
  far.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 1;
  EXPECT_TRUE(has(refused(far), "there is no texture 1"));
  EXPECT_TRUE(has(refused(with({{"source", 3}}, nullptr)), "there is no image 3"));
  EXPECT_TRUE(has(refused(with({{"source", 0}, {"sampler", 1}}, {{"bufferView", 0}})), "there is no sampler 1"));
}

struct Hostile {
  const char* name;
  std::function<void(GltfModel&)> change;
  const char* cause;
};

TEST(Gltf, InvalidFilesGiveAOneLineError) {
  const auto accessor = [](GltfModel& m) -> json& { return m.root["accessors"][0]; };
  const auto primitive = [](GltfModel& m) -> json& { return m.root["meshes"][0]["primitives"][0]; };
  const Hostile cases[] = {
      {"no asset", [](GltfModel& m) { m.root.erase("asset"); }, "asset.version is missing"},
      {"asset is no object", [](GltfModel& m) { m.root["asset"] = 3; }, "asset is not an object"},
      {"nodes is no array", [](GltfModel& m) { m.root["nodes"] = json::object(); }, "nodes is not an array"},
      {"a node is no object", [](GltfModel& m) { m.root["nodes"][0] = 1; }, "nodes[0] is not an object"},
      {"negative index", [&](GltfModel& m) { primitive(m)["attributes"]["POSITION"] = -1; }, "is not an index"},
      {"index with a fraction", [&](GltfModel& m) { primitive(m)["attributes"]["POSITION"] = 0.5; }, "is not an index"},
      {"huge index", [&](GltfModel& m) { primitive(m)["attributes"]["POSITION"] = 5e9; }, "is not an index"},
      {"mode", [&](GltfModel& m) { primitive(m)["mode"] = 7; }, "mode 7 is unknown"},
      {"material", [&](GltfModel& m) { primitive(m)["material"] = 0; }, "there is no material 0"},
      {"no such accessor", [&](GltfModel& m) { primitive(m)["attributes"]["POSITION"] = 9; }, "there is no accessor 9"},
      {"no such indices", [&](GltfModel& m) { primitive(m)["indices"] = 9; }, "there is no accessor 9"},
      {"indices are floats", [&](GltfModel& m) { primitive(m)["indices"] = 0; }, "does not contain unsigned integers"},
      {"count beyond the view", [&](GltfModel& m) { accessor(m)["count"] = 4; }, "exceeds the 36 bytes"},
      {"count of 2^52", [&](GltfModel& m) { accessor(m)["count"] = std::uint64_t{1} << 52U; }, "2^32"},
      {"count of 2^60", [&](GltfModel& m) { accessor(m)["count"] = std::uint64_t{1} << 60U; }, "is not a size"},
      {"count of a billion without bytes",
       [&](GltfModel& m) {
         accessor(m).erase("bufferView");
         accessor(m)["count"] = 1000000000;
       },
       "without a buffer view exceed the limit"},
      {"offset", [&](GltfModel& m) { accessor(m)["byteOffset"] = (std::uint64_t{1} << 53U) - 1; }, "exceeds the "},
      {"element type", [&](GltfModel& m) { accessor(m)["type"] = "VEC2"; }, "wrong type of element"},
      {"component type", [&](GltfModel& m) { accessor(m)["componentType"] = 5124; }, "component type 5124"},
      {"double", [&](GltfModel& m) { accessor(m)["componentType"] = 5130; }, "component type 5130"},
      {"no such view", [&](GltfModel& m) { accessor(m)["bufferView"] = 1; }, "there is no buffer view 1"},
      {"view beyond the buffer", [](GltfModel& m) { m.root["bufferViews"][0]["byteOffset"] = 4; }, "exceeds the "},
      {"no such buffer", [](GltfModel& m) { m.root["bufferViews"][0]["buffer"] = 1; }, "there is no buffer 1"},
      {"stride", [](GltfModel& m) { m.root["bufferViews"][0]["byteStride"] = 8; }, "is too small"},
      {"stride of 2^31", [](GltfModel& m) { m.root["bufferViews"][0]["byteStride"] = 2147483648; }, "byteStride"},
      {"sparse beyond",
       [&](GltfModel& m) {
         accessor(m)["sparse"] = {{"count", 1},
                                  {"indices", {{"bufferView", 0}, {"byteOffset", 36}, {"componentType", 5125}}},
                                  {"values", {{"bufferView", 0}}}};
       },
       "exceeds the "},
      {"sparse index beyond",
       [&](GltfModel& m) {
         accessor(m)["sparse"] = {{"count", 1},
                                  {"indices", {{"bufferView", 0}, {"byteOffset", 12}, {"componentType", 5125}}},
                                  {"values", {{"bufferView", 0}}}};
       },
       "sparse indices"},
      {"sparse count",
       [&](GltfModel& m) {
         accessor(m)["sparse"] = {
             {"count", 99}, {"indices", {{"bufferView", 0}, {"componentType", 5125}}}, {"values", {{"bufferView", 0}}}};
       },
       "has malformed sparse storage"},
      {"its own child", [](GltfModel& m) { m.root["nodes"][0]["children"] = json::array({0}); }, "is its own ancestor"},
      {"two parents",
       [](GltfModel& m) {
         m.root["nodes"].push_back({{"children", json::array({0})}});
         m.root["nodes"].push_back({{"children", json::array({0})}});
       },
       "node 0 has two parents"},
      {"no such child", [](GltfModel& m) { m.root["nodes"][0]["children"] = json::array({7}); }, "there is no node 7"},
      {"no such mesh", [](GltfModel& m) { m.root["nodes"][0]["mesh"] = 7; }, "there is no mesh 7"},
      {"no such skin", [](GltfModel& m) { m.root["nodes"][0]["skin"] = 7; }, "there is no skin 7"},
      {"no such camera", [](GltfModel& m) { m.root["nodes"][0]["camera"] = 7; }, "there is no camera 7"},
      {"no such light", [](GltfModel& m) { m.root["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 7; },
       "there is no light 7"},
      {"matrix of 15", [](GltfModel& m) { m.root["nodes"][0]["matrix"] = std::vector<int>(15, 1); }, "16 numbers"},
      {"transform too large",
       [](GltfModel& m) {
         m.root["nodes"][0]["scale"] = {1e30, 1, 1};
       },
       "too large"},
      {"number beyond double", [](GltfModel& m) { m.root["nodes"][0]["scale"] = "@"; },
       "nodes[0].scale is not an array"},
      {"skin without joints",
       [](GltfModel& m) {
         m.add("skins", {{"joints", json::array()}});
       },
       "no joints"},
      {"joint",
       [](GltfModel& m) {
         m.add("skins", {{"joints", {5, 0}}});
       },
       "there is no node 5"},
      {"camera",
       [](GltfModel& m) {
         m.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", -1}, {"znear", 1}}}});
         m.root["nodes"][0]["camera"] = 0;
       },
       "malformed perspective"},
      {"animation of no node",
       [](GltfModel& m) {
         m.add("animations",
               {{"samplers", json::array({{{"input", 0}, {"output", 0}}})},
                {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 5}, {"path", "scale"}}}}})}});
       },
       "there is no node 5"},
      {"animation of few keys",
       [](GltfModel& m) {
         const int input = m.scalars({0, 1, 2, 3});
         m.add("animations",
               {{"samplers", json::array({{{"input", input}, {"output", 0}}})},
                {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}})}});
       },
       "has 9 numbers, not 12"},
      {"times that fall",
       [](GltfModel& m) {
         const int input = m.scalars({0, 2, 1});
         m.add("animations",
               {{"samplers", json::array({{{"input", input}, {"output", 0}}})},
                {"channels", json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}})}});
       },
       "times are not increasing"},
      {"version 1", [](GltfModel& m) { m.root["asset"]["version"] = "1.0"; }, "is glTF 1.0, not 2.0"},
      {"morph target of another size",
       [&](GltfModel& m) {
         primitive(m)["targets"] = json::array({{{"POSITION", m.vec3({0, 0, 0})}}});
       },
       "does not have one element per vertex"},
      {"attribute of another size",
       [&](GltfModel& m) {
         primitive(m)["attributes"]["NORMAL"] = m.vec3({0, 0, 1});
       },
       "has 1 elements for 3 vertices"},
      {"NaN",
       [&](GltfModel& m) {
         primitive(m)["attributes"]["POSITION"] = m.vec3({0, 0, 0, NAN, 0, 0, 0, 1, 0});
       },
       "POSITION is not finite"},
      {"infinity",
       [&](GltfModel& m) {
         primitive(m)["attributes"]["POSITION"] = m.vec3({0, 0, 0, INFINITY, 0, 0, 0, 1, 0});
       },
       "POSITION is not finite"},
      {"line breaks in names",
       [&](GltfModel& m) {
         m.root["materials"] = json::array({{{"alphaMode", "a\nb\r\n\tc"}}});
       },
       "\"a b c\" is unknown"},
  };
  for (const Hostile& hostile : cases) {
    SCOPED_TRACE(hostile.name);
    GltfModel model = triangle_model();
    hostile.change(model);
    const bool version = std::string_view(hostile.name) == "version 1";
    for (const Bytes& file : {model.gltf(), model.glb()}) {
      const std::string line = refused(file, version ? ErrorCode::unsupported : ErrorCode::file);
      EXPECT_TRUE(has(line, hostile.cause)) << line;
    }
  }
}

TEST(Gltf, InvalidContainersGiveAOneLineError) {
  const auto text = [](const std::string& content) { return Bytes(content.begin(), content.end()); };
  EXPECT_TRUE(has(refused(Bytes{}), "is empty"));
  EXPECT_TRUE(has(refused(text("{")), "is not JSON"));
  EXPECT_TRUE(has(refused(text("[]")), "JSON is not an object"));
  EXPECT_TRUE(has(refused(text("\x01\x02\xFF\xFE")), "is not JSON"));
  EXPECT_TRUE(has(refused(text(std::string(1000000, '['))), "nests deeper"));
  EXPECT_TRUE(has(refused(text(R"({"asset":{"version":"2.0"},"nodes":[{"scale":[1e999,1,1]}]})")), "is not JSON"));
  const Bytes whole = triangle_model().glb();
  for (std::size_t size = 0; size < whole.size(); size += size < 40 ? 1 : 7) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    refused(cut);
  }
  Bytes lengths = whole;
  lengths[12] = 0xFF;  // length of the JSON chunk
  lengths[15] = 0xFF;
  EXPECT_TRUE(has(refused(lengths), "ends within chunk 0"));
  Bytes swapped = whole;
  swapped[16] = 'X';
  EXPECT_TRUE(has(refused(swapped), "does not begin with a JSON chunk"));
  Bytes old = whole;
  old[4] = 1;
  EXPECT_TRUE(has(refused(old, ErrorCode::unsupported), "binary glTF 1"));
  // A byte order mark is accepted.
  Bytes marked = {0xEF, 0xBB, 0xBF};
  const Bytes plain = triangle_model().gltf();
  marked.insert(marked.end(), plain.begin(), plain.end());
  EXPECT_EQ(imported(marked)->triangle_count(), 1U);
}

TEST(Gltf, CompressedDataOfInvalidSizesIsRejected) {
  GltfModel huge = test::seed_meshopt();
  huge.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["count"] = 100000000;
  EXPECT_TRUE(has(refused(huge), "cannot hold 100000000 elements"));
  GltfModel odd = test::seed_meshopt();
  odd.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["byteStride"] = 6;
  EXPECT_TRUE(has(refused(odd), "EXT_meshopt_compression is malformed"));
  GltfModel cut = test::seed_meshopt();
  cut.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["byteLength"] = 20;
  EXPECT_TRUE(has(refused(cut), "cannot be decompressed"));
  GltfModel draco = test::seed_draco();
  draco.root["bufferViews"][0]["byteLength"] = 30;
  EXPECT_TRUE(has(refused(draco), "cannot be decompressed"));
}

TEST(Gltf, MissingDracoAttributesAreRejected) {
  GltfModel model = test::seed_draco();
  model.root["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 77;
  EXPECT_TRUE(has(refused(model), "there is no Draco attribute 77"));
}

TEST(Gltf, AnimationsBeyondFloatStayFinite) {
  // Two nodes, each scaled by 1e18 and more, above an animated and skinned triangle, a camera and a light.
  GltfModel model = test::seed_animated();
  const int huge = model.vec3({1, 1, 1, 1e30F, 1e30F, 1e30F, 1e18F, -1e18F, 1e18F});
  json& samplers = model.root["animations"][0]["samplers"];
  samplers[2]["output"] = huge;
  samplers[2]["interpolation"] = "LINEAR";
  const auto scale = [](int node) { return json{{"sampler", 2}, {"target", {{"node", node}, {"path", "scale"}}}}; };
  for (const int node : {0, 1, 2}) model.root["animations"][0]["channels"].push_back(scale(node));
  model.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}});
  model.root["extensions"]["KHR_lights_punctual"]["lights"] =
      json::array({{{"type", "spot"}, {"spot", json::object()}}});
  model.root["nodes"][2]["camera"] = 0;
  model.root["nodes"][2]["extensions"]["KHR_lights_punctual"]["light"] = 0;
  const ScenePtr scene = imported(model);
  for (const double time : {0.0, 0.3, 1.0, 1.7, 2.0}) EXPECT_EQ(test::broken(*scene, scene->pose(time)), "") << time;
}

TEST(Gltf, NestedRootsAreImportedOnce) {
  // A chain of 100000 nodes. All are roots of the scene, the deepest first.
  GltfModel model = triangle_model();
  json roots = json::array({0});
  for (int i = 1; i < 100000; ++i) roots.push_back(model.add("nodes", {{"children", json::array({i - 1})}}));
  model.root["scenes"] = json::array({{{"nodes", roots}}});
  EXPECT_EQ(imported(model)->triangle_count(), 1U);
}

TEST(Gltf, MemoryIsBounded) {
  // A thousand nodes with a mesh of 33 thousand vertices: 2.5 GiB of vertices from half a megabyte.
  GltfModel model;
  const test::Grid grid(180);
  const int mesh = model.add(
      "meshes",
      {{"primitives", json::array({{{"attributes", {{"POSITION", model.vec3(grid.positions)}}},
                                    {"indices", model.accessor<std::uint32_t>("SCALAR", 1, grid.indices)}}})}});
  for (int i = 0; i < 1000; ++i) model.add("nodes", {{"mesh", mesh}});
  GltfLimits limits;
  limits.memory = std::uint64_t{256} << 20U;
  EXPECT_TRUE(has(refused(model.glb(), ErrorCode::file, limits), "would need more than the 256 MiB"));
}

TEST(Gltf, CancelledImportsEnd) {
  Progress progress;
  progress.cancel();
  try {
    import_gltf(triangle_model().gltf(), "made.gltf", "", {}, &progress);
    FAIL() << "was imported";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
}

// --- mutations -------------------------------------------------------------------------------------------------------

/// Changes a file in one to four positions: bits, bytes, ranges, and numbers in its JSON.
Bytes mutated(const Bytes& from, std::mt19937& random) {
  constexpr const char* words[] = {"-1",   "0",    "1",     "2",     "255",  "65535", "4294967295", "9007199254740991",
                                   "1e38", "1e18", "-1e38", "0.5",   "null", "true",  "\"\"",       "[]",
                                   "{}",   "5120", "5126",  "[1,2]", "64",   "3"};
  Bytes bytes = from;
  const auto below = [&random](std::size_t n) { return n == 0 ? 0 : random() % n; };
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
    if (bytes.size() < 8) break;
    const auto at = static_cast<std::ptrdiff_t>(below(bytes.size()));
    switch (below(6)) {
      case 0:
        bytes[static_cast<std::size_t>(at)] ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 1:
        bytes[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(random());
        break;
      case 2:
        bytes.resize(static_cast<std::size_t>(at));
        break;
      case 3: {  // overwrites a range with another
        const std::size_t length = 1 + below(16);
        const std::size_t source = below(bytes.size());
        for (std::size_t k = 0; k < length; ++k) {
          if (static_cast<std::size_t>(at) + k < bytes.size() && source + k < bytes.size()) {
            bytes[static_cast<std::size_t>(at) + k] = bytes[source + k];
          }
        }
        break;
      }
      default: {  // replaces the next number by another of the same length, padded with blanks
        auto digit = std::find_if(bytes.begin() + at, bytes.end(), [](std::uint8_t c) { return c >= '0' && c <= '9'; });
        auto end = std::find_if(digit, bytes.end(), [](std::uint8_t c) { return c < '0' || c > '9'; });
        const std::string word = words[below(std::size(words))];
        const auto offset = digit - bytes.begin();
        const auto length = end - digit;
        if (word.size() <= static_cast<std::size_t>(length)) {
          for (std::ptrdiff_t k = 0; k < length; ++k) {
            bytes[static_cast<std::size_t>(offset + k)] =
                static_cast<std::size_t>(k) < word.size() ? static_cast<std::uint8_t>(word[static_cast<std::size_t>(k)])
                                                          : ' ';
          }
        } else if (bytes[0] == '{') {  // text files may grow, because they store no length
          bytes.erase(digit, end);
          bytes.insert(bytes.begin() + offset, word.begin(), word.end());
        }
        break;
      }
    }
  }
  return bytes;
}

TEST(Gltf, MutatedFilesAreImportedOrGiveAOneLineError) {
  const GltfModel seeds[] = {test::seed_materials(), test::seed_animated(),
                             test::seed_draco(),     test::seed_meshopt(),
                             triangle_model(),       test::seed_pointers(),
                             test::seed_instances(), test::seed_webp(test::webp(8, 8, Bytes(256, 77), 50.0F))};
  GltfLimits limits;
  limits.memory = std::uint64_t{64} << 20U;
  limits.unbacked = 1U << 16U;
  limits.image_side = 1024;
  std::mt19937 random(7);
  std::size_t good = 0;
  std::size_t bad = 0;
  for (const GltfModel& seed : seeds) {
    for (const Bytes& file : {seed.gltf(), seed.glb()}) {
      for (int i = 0; i < 2000; ++i) {
        const Bytes changed = mutated(file, random);
        try {
          const ScenePtr scene = import_gltf(changed, "mutated", "/nowhere", {}, nullptr, limits);
          ++good;
          ASSERT_EQ(test::broken(*scene), "");
          for (const double time : {0.0, 0.6}) ASSERT_EQ(test::broken(*scene, scene->pose(time)), "");
        } catch (const Error& error) {
          ++bad;
          const std::string line = error.what();
          ASSERT_TRUE(line.starts_with("mutated: ")) << line;
          ASSERT_EQ(line.find_first_of("\n\r"), std::string::npos) << line;
        }
      }
    }
  }
  // Neither all nor none are valid. Otherwise the mutations would reach only the first check.
  EXPECT_GT(good, 1000U);
  EXPECT_GT(bad, 4000U);
}

}  // namespace
}  // namespace cumulet::surface
