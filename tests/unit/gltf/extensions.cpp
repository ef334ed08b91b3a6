// glTF extensions for visibility, images, animation pointers and instances, tested with small files made here.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "scene/model_source.hpp"
#include "support/gltf_import.hpp"
#include "support/gltf_model.hpp"
#include "support/gltf_seeds.hpp"

namespace cumulet::surface {
namespace {

using test::Bytes;
using test::GltfModel;
using test::has;
using test::imported;
using test::json;
using test::Lines;
using test::refused;

/// KHR_node_visibility.
json visible(bool is) { return {{"KHR_node_visibility", {{"visible", is}}}}; }

TEST(GltfVisibility, HiddenNodesAndDescendantsAreNotImported) {
  GltfModel model;
  model.root["extensionsUsed"] = {"KHR_node_visibility", "KHR_lights_punctual"};
  model.root["extensionsRequired"] = {"KHR_node_visibility"};
  model.root["extensions"]["KHR_lights_punctual"]["lights"] = json::array({{{"type", "point"}}});
  const json shape = {{"attributes", {{"POSITION", model.triangle()}}}};
  model.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.6}, {"znear", 0.5}}}});
  json light = {{"KHR_lights_punctual", {{"light", 0}}}};
  model.show(shape, {{"name", "shown"}, {"extensions", visible(true)}});
  // An invisible node hides its descendants, even visible ones, with their lights but not their cameras.
  const int child = model.show(shape, {{"translation", {0, 0, 50}}, {"extensions", visible(true)}});
  const int analytic_light = model.add("nodes", {{"extensions", light}, {"camera", 0}});
  model.show(shape, {{"translation", {100, 0, 0}},
                     {"children", json::array({child, analytic_light})},
                     {"extensions", visible(false)}});
  model.add("nodes", {{"extensions", light}, {"translation", {0, 7, 0}}});
  const ScenePtr scene = imported(model);
  EXPECT_EQ(scene->triangle_count(), 1U);
  const Pose pose = scene->pose(0.0);
  EXPECT_EQ(pose.high, glm::dvec3(1, 1, 0));
  ASSERT_EQ(pose.lights.size(), 1U);
  EXPECT_EQ(pose.lights[0].position, glm::vec3(0, 7, 0));
  EXPECT_EQ(pose.cameras.size(), 1U);
}

TEST(GltfVisibility, HiddenJointsStillDeformVisibleMeshes) {
  GltfModel model;
  const json primitive = {{"attributes",
                           {{"POSITION", model.triangle()},
                            {"JOINTS_0", model.accessor<std::uint8_t>("VEC4", 4, std::vector<std::uint8_t>(12, 0))},
                            {"WEIGHTS_0", model.accessor<float>("VEC4", 4, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0})}}}};
  model.add("nodes", {{"translation", {0, 0, 3}}, {"extensions", visible(false)}});
  model.add("skins", {{"joints", {0}}});
  model.show(primitive, {{"skin", 0}});
  const ScenePtr scene = imported(model);
  ASSERT_EQ(scene->triangle_count(), 1U);
  EXPECT_EQ(scene->pose(0.0).low.z, 3.0);
}

TEST(GltfVisibility, NonBooleanVisibilityIsRejected) {
  GltfModel model = test::triangle_model({{"extensions", {{"KHR_node_visibility", {{"visible", 0}}}}}});
  EXPECT_TRUE(has(refused(model), "nodes[0].extensions.KHR_node_visibility.visible is not true or false"));
}

TEST(GltfWebp, TexelsMatchTheImage) {
  const Bytes rgba = {255, 0, 0, 255, 0, 255, 0, 128, 10, 20, 30, 40, 250, 251, 252, 253, 1, 2, 3, 4, 5, 6, 7, 8};
  const ScenePtr scene = imported(test::seed_webp(test::webp(3, 2, rgba)));
  ASSERT_EQ(scene->images.size(), 1U);
  EXPECT_EQ(scene->images[0].width, 3U);
  EXPECT_EQ(scene->images[0].height, 2U);
  EXPECT_EQ(scene->images[0].rgba, rgba);
  EXPECT_EQ(scene->images[0].name, "small");
  EXPECT_EQ(scene->materials[0].base_color_texture.texture, 0);

  Bytes even;
  for (int i = 0; i < 64; ++i) even.insert(even.end(), {200, 40, 90, 255});
  const ScenePtr lossy = imported(test::seed_webp(test::webp(8, 8, even, 90.0F)));
  ASSERT_EQ(lossy->images.size(), 1U);
  for (std::size_t i = 0; i < even.size(); ++i) EXPECT_NEAR(lossy->images[0].rgba[i], even[i], 6) << i;
}

TEST(GltfWebp, FallbackImageIsUsedIfWebpFails) {
  const Bytes blue = {0, 0, 255};
  const Bytes other = test::png(1, 1, 8, 2, blue);
  const Bytes good = test::webp(1, 1, {255, 0, 0, 255});
  const auto first_texel = [](const ScenePtr& scene) {
    const auto& use = scene->materials[0].base_color_texture;
    EXPECT_GE(use.texture, 0);
    const auto image = scene->textures.at(static_cast<std::size_t>(use.texture)).image;
    return Bytes(scene->images.at(image).rgba.begin(), scene->images.at(image).rgba.begin() + 3);
  };
  EXPECT_EQ(first_texel(imported(test::seed_webp(good, other))), Bytes({255, 0, 0}));
  Lines lines;
  EXPECT_EQ(first_texel(imported(test::seed_webp(Bytes(good.begin(), good.begin() + 20), other), lines.log)), blue);
  ASSERT_EQ(lines.warnings.size(), 1U);
  EXPECT_TRUE(has(lines.warnings[0], "image 0 (small) is ignored: is a truncated WebP")) << lines.warnings[0];
}

TEST(GltfWebp, InvalidFilesGiveOneWarning) {
  const auto line = [](const Bytes& picture) {
    Lines lines;
    const ScenePtr scene = imported(test::seed_webp(picture), lines.log);
    EXPECT_EQ(scene->materials[0].base_color_texture.texture, -1);
    EXPECT_TRUE(scene->images.empty());
    EXPECT_EQ(lines.warnings.size(), 1U);
    return lines.warnings.empty() ? std::string() : lines.warnings[0];
  };
  const Bytes good = test::webp(8, 8, Bytes(256, 77));
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(line(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size))).empty()) << size;
  }
  Bytes broken = good;
  broken[12] = 'X';
  EXPECT_FALSE(line(broken).empty());
  // VP8X with the animation bit, 2 x 2, without frames.
  EXPECT_TRUE(has(line({'R', 'I', 'F', 'F', 22, 0, 0, 0, 'W', 'E', 'B', 'P', 'V', 'P', '8',
                        'X', 10,  0,   0,   0,  2, 0, 0, 0,   1,   0,   0,   1,   0,   0}),
                  "is an animated WebP"));

  // Few bytes, many pixels: the memory for decoding is checked first.
  const Bytes large = test::webp(2048, 2048, Bytes(std::size_t{4} * 2048 * 2048, 9));
  EXPECT_LT(large.size(), 4096U);
  GltfLimits limits;
  limits.memory = 8U << 20U;
  Lines lines;
  EXPECT_TRUE(imported(test::seed_webp(large).gltf(), lines.log, limits)->images.empty());
  ASSERT_EQ(lines.warnings.size(), 1U);
  EXPECT_TRUE(has(lines.warnings[0], "2048 x 2048 pixels would need more than the 8 MiB")) << lines.warnings[0];
  GltfModel no_image = test::seed_webp(good);
  no_image.root["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 9;
  EXPECT_TRUE(has(refused(no_image), "texture 0: there is no image 9"));
}

/// A textured triangle with texture coordinates under one node, and a light under another.
GltfModel moving_model(const json& material = json::object()) {
  GltfModel model;
  model.root["extensionsUsed"] = {"KHR_lights_punctual"};
  model.add("images", {{"bufferView", model.view(test::png(2, 1, 8, 6, {255, 0, 0, 255, 0, 255, 0, 255}))}});
  model.add("textures", {{"source", 0}});
  json with_texture = {{"emissiveTexture", {{"index", 0}}}};
  with_texture.update(material);
  model.add("materials", with_texture);
  model.show({{"attributes", {{"POSITION", model.triangle()}, {"TEXCOORD_0", model.vec2({0, 0, 1, 0, 0, 1})}}},
              {"targets", json::array({{{"POSITION", model.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1})}}})},
              {"material", 0}});
  model.root["extensions"]["KHR_lights_punctual"]["lights"] =
      json::array({{{"type", "spot"}, {"spot", json::object()}, {"color", {1, 0.5, 0.25}}, {"intensity", 4}}});
  model.add("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  return model;
}

TEST(GltfAnimationPointers, NodePointersMatchNodeChannels) {
  GltfModel model = moving_model();
  animate(model, {{"/nodes/0/translation", 3, {0, 0, 0, 10, 0, 0}},
                  {"/nodes/0/scale", 3, {1, 1, 1, 3, 3, 3}},
                  {"/nodes/0/rotation", 4, {0, 0, 0, 1, 0, 0, 0.70710678F, 0.70710678F}},
                  {"/nodes/0/weights", 1, {0, 1}}});
  const ScenePtr scene = imported(model);
  ASSERT_EQ(scene->animations.size(), 1U);
  EXPECT_EQ(scene->animations[0].duration, 1.0);
  // The end of the animation itself is not wrapped to its start.
  const auto at = test::corners(*scene, scene->pose(1.0));
  test::near(at[0], {10, 0, 3});
  test::near(at[1], {10, 3, 3});
  test::near(test::corners(*scene, scene->pose(0.5))[0], {5, 0, 1});
}

TEST(GltfAnimationPointers, VisibilityCanBeAnimated) {
  GltfModel model = moving_model({{"emissiveFactor", {1, 1, 1}}});
  const json second = model.root["meshes"][0]["primitives"][0];
  const int far = model.show(second, {{"translation", {50, 0, 0}}});
  const int parent =
      model.add("nodes", {{"children", json::array({far, 1})}, {"extensions", visible(false)}});  // with the light
  animate(model,
          {{"/nodes/" + std::to_string(parent) + "/extensions/KHR_node_visibility/visible", 1, {0, 1, 0}, "STEP"}});
  const ScenePtr scene = imported(model);
  EXPECT_EQ(scene->triangle_count(), 2U);
  const Pose without = scene->pose(0.5);
  const Pose with = scene->pose(1.5);
  EXPECT_EQ(without.hidden, (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(with.hidden, (std::vector<std::uint8_t>{0, 0}));
  EXPECT_EQ(without.high.x, 1.0);
  EXPECT_EQ(with.high.x, 51.0);
  EXPECT_TRUE(without.lights.empty());
  EXPECT_EQ(with.lights.size(), 1U);
  EXPECT_EQ(scene->pose(0.0, 7).hidden, without.hidden);  // at rest
  EXPECT_EQ(scene->pose(2.0).hidden, without.hidden);     // the last key's value

  Progress progress;
  const scene::ModelSourcePtr first = scene::make_model_source(scene, without, &progress);
  EXPECT_EQ(first->meshes.at(0).bvh.records().size(), 1U);
  EXPECT_EQ(first->emissive.size(), 1U);
  EXPECT_EQ(first->raster->solid.size(), 1U);
  const scene::ModelSourcePtr then = scene::make_model_source(*first, with, &progress);
  EXPECT_EQ(then->meshes.at(0).bvh.records().size(), 2U);
  EXPECT_EQ(then->emissive.size(), 2U);
  EXPECT_EQ(then->raster->solid.size(), 2U);
  EXPECT_EQ(then->raster->pictures, first->raster->pictures);
  EXPECT_EQ(then->words, scene::make_model_source(scene, with, &progress)->words);
}

TEST(GltfAnimationPointers, MaterialsCanBeAnimated) {
  GltfModel model = moving_model({{"emissiveFactor", {0, 0, 0}},
                                  {"alphaMode", "MASK"},
                                  {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 2}}}}}});
  const std::string of = "/materials/0/";
  const std::string transform = of + "emissiveTexture/extensions/KHR_texture_transform/";
  animate(model, {{of + "pbrMetallicRoughness/baseColorFactor", 4, {0, 0, 0, 0, 1, 0.5F, 0.25F, 1}},
                  {of + "pbrMetallicRoughness/metallicFactor", 1, {0, 1}},
                  {of + "pbrMetallicRoughness/roughnessFactor", 1, {1, 3}},  // beyond the valid range
                  {of + "alphaCutoff", 1, {0.2F, 0.4F}},
                  {of + "emissiveFactor", 3, {0, 0, 0, 1, 0.5F, 0}},
                  {of + "extensions/KHR_materials_emissive_strength/emissiveStrength", 1, {4, 8}},
                  {of + "extensions/KHR_materials_ior/ior", 1, {1.5F, 2}},
                  {transform + "offset", 2, {0, 0, 1, 2}},
                  {transform + "scale", 2, {1, 1, 3, -1}},
                  {transform + "rotation", 1, {0, 1}}});
  Lines lines;
  const ScenePtr scene = imported(model.gltf(), lines.log);
  EXPECT_TRUE(lines.warnings.empty());
  // Compared with a file that has these values without animation.
  const json still_transform = {{"offset", {0.5, 1}}, {"scale", {2, 0}}, {"rotation", 0.5}};
  const json still = {
      {"pbrMetallicRoughness",
       {{"baseColorFactor", {0.5, 0.25, 0.125, 0.5}}, {"metallicFactor", 0.5}, {"roughnessFactor", 1}}},
      {"alphaMode", "MASK"},
      {"alphaCutoff", 0.3F},
      {"emissiveFactor", {0.5, 0.25, 0}},
      {"emissiveTexture", {{"index", 0}, {"extensions", {{"KHR_texture_transform", still_transform}}}}},
      {"extensions",
       {{"KHR_materials_emissive_strength", {{"emissiveStrength", 6}}}, {"KHR_materials_ior", {{"ior", 1.75}}}}}};
  const ScenePtr same = imported(moving_model(still).gltf());
  const Pose pose = scene->pose(0.5);
  ASSERT_EQ(pose.materials.size(), scene->materials.size());
  const Material& got = pose.materials[0];
  const Material& wanted = same->materials[0];
  for (int c = 0; c < 4; ++c) EXPECT_FLOAT_EQ(got.base_color[c], wanted.base_color[c]);
  for (int c = 0; c < 3; ++c) {
    EXPECT_FLOAT_EQ(got.emission[c], wanted.emission[c]);
    for (int r = 0; r < 2; ++r) {
      EXPECT_NEAR(got.emission_texture.transform[c][r], wanted.emission_texture.transform[c][r], 1e-6);
    }
  }
  EXPECT_FLOAT_EQ(got.metallic, wanted.metallic);
  EXPECT_FLOAT_EQ(got.roughness, wanted.roughness);
  EXPECT_FLOAT_EQ(got.alpha_cutoff, wanted.alpha_cutoff);
  EXPECT_FLOAT_EQ(got.ior, wanted.ior);
  EXPECT_EQ(got.emission_texture.texture, wanted.emission_texture.texture);
  EXPECT_EQ(materials_of(*scene, scene->pose(0.0, 7))[0], scene->materials[0]);  // at rest
  // At the beginning the material is dark, so the triangle is not a light.
  Progress progress;
  const scene::ModelSourcePtr dark = scene::make_model_source(scene, scene->pose(0.0), &progress);
  EXPECT_TRUE(dark->emissive.empty());
  const scene::ModelSourcePtr bright = scene::make_model_source(*dark, pose, &progress);
  const scene::ModelSourcePtr fresh = scene::make_model_source(scene, pose, &progress);
  EXPECT_EQ(bright->emissive.size(), 1U);
  EXPECT_EQ(bright->words, fresh->words);
  EXPECT_NE(bright->words, dark->words);
  EXPECT_EQ(bright->raster->material_blocks, fresh->raster->material_blocks);
  EXPECT_EQ(bright->raster->pictures, dark->raster->pictures);
  EXPECT_EQ(bright->images, dark->images);
}

TEST(GltfAnimationPointers, EachAnimationHasItsOwnMaterials) {
  GltfModel model = moving_model();
  animate(model, {{"/materials/0/alphaCutoff", 1, {0, 1}}});
  animate(model, {{"/materials/0/pbrMetallicRoughness/metallicFactor", 1, {1, 0}}});
  const ScenePtr scene = imported(model);
  EXPECT_FLOAT_EQ(scene->pose(0.25, 0).materials.at(0).alpha_cutoff, 0.25F);
  EXPECT_FLOAT_EQ(scene->pose(0.25, 1).materials.at(0).metallic, 0.75F);
  EXPECT_FLOAT_EQ(scene->pose(0.25, 1).materials.at(0).alpha_cutoff, 0.5F);
}

TEST(GltfAnimationPointers, LightsCanBeAnimated) {
  GltfModel model = moving_model();
  const std::string of = "/extensions/KHR_lights_punctual/lights/0/";
  animate(model, {{of + "color", 3, {0, 0, 0, 1, 0.5F, 0}},
                  {of + "intensity", 1, {0, 8}},
                  {of + "spot/outerConeAngle", 1, {0.2F, 0.4F}},
                  {of + "spot/innerConeAngle", 1, {0, 2}}});
  const ScenePtr scene = imported(model);
  const Pose pose = scene->pose(0.5);
  ASSERT_EQ(pose.lights.size(), 1U);
  EXPECT_EQ(pose.lights[0].intensity, glm::vec3(2, 1, 0));
  EXPECT_FLOAT_EQ(pose.lights[0].outer_cone, 0.3F);
  EXPECT_FLOAT_EQ(pose.lights[0].inner_cone, 0.3F);  // at most the outer angle
  EXPECT_EQ(scene->pose(0.0, 7).lights[0].intensity, glm::vec3(4, 2, 1));
}

TEST(GltfAnimationPointers, OverflowingSplinesStayFinite) {
  // In-tangents, values and out-tangents of two keys.
  constexpr float steep = 3e38F;
  const auto spline = [](const std::string& pointer, std::size_t width) {
    std::vector<float> values;
    for (int key = 0; key < 2; ++key) {
      values.insert(values.end(), width, key == 0 ? 0.0F : -steep);
      values.insert(values.end(), width, 1.5F);
      values.insert(values.end(), width, key == 0 ? steep : 0.0F);
    }
    return test::Pointing{pointer, width, values, "CUBICSPLINE"};
  };
  GltfModel model = moving_model();
  const std::string of = "/materials/0/";
  const std::string transform = of + "emissiveTexture/extensions/KHR_texture_transform/";
  animate(model, {spline(of + "extensions/KHR_materials_ior/ior", 1), spline(of + "normalTexture/scale", 1),
                  spline(of + "emissiveFactor", 3), spline(transform + "offset", 2), spline(transform + "scale", 2),
                  spline(transform + "rotation", 1), spline("/extensions/KHR_lights_punctual/lights/0/intensity", 1),
                  spline("/nodes/0/translation", 3), spline("/nodes/0/rotation", 4)});
  // Tangents are per second. Each is bounded, but multiplied by a long time they exceed a float's range.
  constexpr float last = 1e25F;
  for (auto& accessor : model.root["animations"][0]["samplers"]) accessor["input"] = model.scalars({0, last});
  const ScenePtr scene = imported(model);
  for (const double time : {0.01, 0.3, 0.5, 0.99}) {
    const Pose pose = scene->pose(time * double{last});
    const Material& got = pose.materials.at(0);
    EXPECT_TRUE(std::isfinite(got.ior) && got.ior >= 1.0F) << time;
    EXPECT_TRUE(std::isfinite(got.normal_scale)) << time;
    for (int c = 0; c < 3; ++c) {
      EXPECT_TRUE(std::isfinite(got.emission[c])) << time;
      for (int r = 0; r < 2; ++r) EXPECT_TRUE(std::isfinite(got.emission_texture.transform[c][r])) << time;
      EXPECT_TRUE(std::isfinite(pose.lights.at(0).intensity[c])) << time;
      EXPECT_TRUE(std::isfinite(pose.low[c]) && std::isfinite(pose.high[c])) << time;
    }
  }
}

TEST(GltfAnimationPointers, UnsupportedPointersAreReportedOnce) {
  GltfModel model = moving_model();
  animate(model, {{"/cameras/0/perspective/yfov", 1, {0.5F, 1}},
                  {"/materials/0/extensions/KHR_materials_transmission/transmissionFactor", 1, {0, 1}},
                  {"/materials/0/normalTexture/extensions/KHR_texture_transform/rotation", 1, {0, 1}},
                  {"/nodes/x/translation", 3, {0, 0, 0, 1, 0, 0}},
                  {"/nodes/0", 1, {0, 1}},
                  {"", 1, {0, 1}},
                  {"/nodes/0/translation", 3, {0, 0, 0, 10, 0, 0}}});
  Lines lines;
  const ScenePtr scene = imported(model, lines.log);
  ASSERT_EQ(lines.warnings.size(), 1U);
  EXPECT_TRUE(has(lines.warnings[0], "unsupported animated pointers: /cameras/0/perspective/yfov and 5 more"))
      << lines.warnings[0];
  EXPECT_EQ(scene->pose(1.0).low.x, 10.0);
}

TEST(GltfAnimationPointers, InvalidPointersGiveAOneLineError) {
  const auto line = [](const test::Pointing& pointing) {
    GltfModel model = moving_model();
    animate(model, {pointing});
    return refused(model);
  };
  EXPECT_TRUE(has(line({"/nodes/9/translation", 3, {0, 0, 0}}), "there is no node 9"));
  // The index after the file's last is the default material's, which files cannot name.
  EXPECT_TRUE(has(line({"/materials/1/alphaCutoff", 1, {0}}), "there is no material 1"));
  EXPECT_TRUE(has(line({"/extensions/KHR_lights_punctual/lights/1/intensity", 1, {0}}), "there is no light 1"));
  EXPECT_TRUE(has(line({"/nodes/0/extensions/KHR_node_visibility/visible", 1, {0, 1}}), "only be animated with STEP"));
  EXPECT_TRUE(has(line({"/materials/0/emissiveFactor", 2, {0, 1}}), "wrong type of element"));
  EXPECT_TRUE(has(line({"/materials/0/emissiveFactor", 4, {0, 1, 2, 3}}), "wrong type of element"));
}

/// A triangle under a node with instances of these accessors.
GltfModel instanced_model(const std::function<json(GltfModel&)>& attributes, const json& node = json::object()) {
  GltfModel model;
  model.root["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  model.root["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  json with_instances = node;
  with_instances["extensions"] = {{"EXT_mesh_gpu_instancing", {{"attributes", attributes(model)}}}};
  model.show({{"attributes", {{"POSITION", model.triangle()}}}}, with_instances);
  return model;
}

/// World positions of the triangle's vertices in this instance.
std::array<glm::vec3, 3> transformed_corners(const Scene& scene, const Pose& pose, std::size_t instance) {
  std::array<glm::vec3, 3> corners{};
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec4 own(pose.vertices.at(scene.indices.at(i)).position, 1.0);
    corners[i] = glm::vec3(pose.prototype_transforms.at(0).at(instance) * own);
  }
  return corners;
}

TEST(GltfInstances, TransformsCombineAttributesAndNode) {
  GltfModel model = instanced_model(
      [](GltfModel& m) {
        return json{
            {"TRANSLATION", m.vec3({0, 0, 0, 10, 0, 0, 0, 0, 5})},
            // Identity, 90 degrees about z, identity, as normalized integers.
            {"ROTATION", m.accessor<std::int16_t>("VEC4", 4, {0, 0, 0, 32767, 0, 0, 23170, 23170, 0, 0, 0, 32767},
                                                  {{"normalized", true}})},
            {"SCALE", m.vec3({1, 1, 1, 2, 3, 1, -1, 1, 1})}};
      },
      {{"translation", {100, 0, 0}}, {"scale", {2, 2, 2}}});
  Lines lines;
  const ScenePtr scene = imported(model, lines.log);
  EXPECT_TRUE(lines.warnings.empty());
  EXPECT_EQ(scene->shown_triangles(), 3U);
  ASSERT_EQ(scene->triangle_count(), 1U);  // stored once
  ASSERT_EQ(scene->prototypes.size(), 1U);
  const Pose pose = scene->pose(0.0);
  test::near(transformed_corners(*scene, pose, 0)[1], {102, 0, 0});
  const auto turned = transformed_corners(*scene, pose, 1);
  test::near(turned[0], {120, 0, 0}, 1e-3F);
  test::near(turned[1], {120, 4, 0}, 1e-3F);  // x, doubled twice, becomes y
  test::near(turned[2], {114, 0, 0}, 1e-3F);  // y becomes -x
  test::near(transformed_corners(*scene, pose, 2)[1], {98, 0, 10});
  EXPECT_LT(glm::determinant(glm::dmat3(pose.prototype_transforms[0][2])), 0.0);
  EXPECT_EQ(pose.low.x, 98.0);
  test::near(glm::vec3(pose.high), {120, 4, 10}, 1e-3F);
}

TEST(GltfInstances, FollowTheirNode) {
  GltfModel model = instanced_model([](GltfModel& m) { return json{{"TRANSLATION", m.vec3({0, 0, 0, 3, 0, 0})}}; });
  animate(model, {{"/nodes/0/translation", 3, {0, 0, 0, 0, 8, 0}}});
  const ScenePtr scene = imported(model);
  test::near(transformed_corners(*scene, scene->pose(1.0), 1)[0], {3, 8, 0});
}

TEST(GltfInstances, UnsupportedAttributesAreReported) {
  Lines lines;
  GltfModel model = instanced_model([](GltfModel& m) { return json{{"_COLOR", m.vec3({1, 0, 0, 0, 1, 0})}}; });
  const ScenePtr scene = imported(model, lines.log);
  EXPECT_EQ(scene->shown_triangles(), 2U);  // both at the same position
  ASSERT_EQ(lines.warnings.size(), 1U);
  EXPECT_TRUE(has(lines.warnings[0], "instances are rendered without _COLOR")) << lines.warnings[0];
  // Without attributes, the node shows one ordinary mesh.
  EXPECT_EQ(imported(instanced_model([](GltfModel&) { return json::object(); }))->triangle_count(), 1U);
}

TEST(GltfInstances, InvalidInstancesGiveAOneLineError) {
  const auto line = [](const std::function<json(GltfModel&)>& attributes) {
    return refused(instanced_model(attributes));
  };
  EXPECT_TRUE(has(line([](GltfModel& m) {
                    return json{{"TRANSLATION", m.vec3({0, 0, 0})}, {"SCALE", m.vec3({1, 1, 1, 2, 2, 2})}};
                  }),
                  "node 0, instances' TRANSLATION has 1 elements, another attribute 2"));
  EXPECT_TRUE(has(line([](GltfModel& m) { return json{{"SCALE", m.scalars({1})}}; }), "wrong type of element"));
  EXPECT_TRUE(has(line([](GltfModel& m) { return json{{"ROTATION", m.vec3({0, 0, 0})}}; }), "wrong type of element"));
  EXPECT_TRUE(has(line([](GltfModel&) { return json{{"SCALE", 77}}; }), "there is no accessor 77"));
  EXPECT_TRUE(has(line([](GltfModel& m) { return json{{"SCALE", m.vec3({1, 1e30F, 1})}}; }), "or too large"));
  const auto many = [](std::size_t count) {
    return instanced_model([count](GltfModel& m) {
             return json{{"SCALE", m.vec3(std::vector<float>(3 * count, 1.0F))}};
           })
        .gltf();
  };
  // Each instance needs memory for its transform.
  GltfLimits small;
  small.memory = 400U << 10U;
  EXPECT_EQ(imported(many(100), {}, small)->shown_triangles(), 100U);
  EXPECT_TRUE(has(refused(many(1000), ErrorCode::file, small), "instances' transforms would need more than the"));
}

TEST(GltfInstances, ZeroScaleInstancesAreNotDrawn) {
  const ScenePtr scene = imported(instanced_model([](GltfModel& m) {
    return json{{"SCALE", m.vec3({1, 1, 1, 1, 0, 1, 0, 0, 0})}};
  }));
  EXPECT_EQ(scene->pose(0.0).prototype_transforms.at(0).size(), 1U);
}

}  // namespace
}  // namespace cumulet::surface
