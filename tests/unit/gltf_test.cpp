// The glTF importer with small files made here, compared with numbers computed by hand.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "base/error.hpp"
#include "support/folder.hpp"
#include "support/gltf_check.hpp"
#include "support/gltf_import.hpp"
#include "support/gltf_model.hpp"
#include "support/gltf_seeds.hpp"
#include "surface/gltf_import.hpp"

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
using test::refused;
using test::triangle_model;
namespace fs = std::filesystem;

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
    const std::string message = line(save(bad));
    EXPECT_TRUE(has(message, cause)) << uri << ": " << message;
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

  // KHR_materials_pbrSpecularGlossiness is converted: see gltf/materials.cpp.
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

TEST(Gltf, NestedRootsAreImportedOnce) {
  // A chain of 100000 nodes. All are roots of the scene, the deepest first.
  GltfModel model = triangle_model();
  json roots = json::array({0});
  for (int i = 1; i < 100000; ++i) roots.push_back(model.add("nodes", {{"children", json::array({i - 1})}}));
  model.root["scenes"] = json::array({{{"nodes", roots}}});
  EXPECT_EQ(imported(model)->triangle_count(), 1U);
}

}  // namespace
}  // namespace cumulet::surface
