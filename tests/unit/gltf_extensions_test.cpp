// Extensions of glTF that say what is shown, when and of which material, by small files made here.

#include <gtest/gtest.h>

#include <optional>

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

TEST(GltfVisibility, HiddenNodesAndWhatDescendsFromThemAreNotThere) {
  GltfModel model;
  model.root["extensionsUsed"] = {"KHR_node_visibility", "KHR_lights_punctual"};
  model.root["extensionsRequired"] = {"KHR_node_visibility"};
  model.root["extensions"]["KHR_lights_punctual"]["lights"] = json::array({{{"type", "point"}}});
  const json shape = {{"attributes", {{"POSITION", model.triangle()}}}};
  model.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.6}, {"znear", 0.5}}}});
  json light = {{"KHR_lights_punctual", {{"light", 0}}}};
  model.show(shape, {{"name", "shown"}, {"extensions", visible(true)}});
  // An invisible node hides its child, though that is visible; with their light, not with their camera.
  const int child = model.show(shape, {{"translation", {0, 0, 50}}, {"extensions", visible(true)}});
  const int lamp = model.add("nodes", {{"extensions", light}, {"camera", 0}});
  model.show(shape,
             {{"translation", {100, 0, 0}}, {"children", json::array({child, lamp})}, {"extensions", visible(false)}});
  model.add("nodes", {{"extensions", light}, {"translation", {0, 7, 0}}});
  const ScenePtr scene = imported(model);
  EXPECT_EQ(scene->triangle_count(), 1U);
  const Pose pose = scene->pose(0.0);
  EXPECT_EQ(pose.high, glm::dvec3(1, 1, 0));
  ASSERT_EQ(pose.lights.size(), 1U);
  EXPECT_EQ(pose.lights[0].position, glm::vec3(0, 7, 0));
  EXPECT_EQ(pose.cameras.size(), 1U);
}

TEST(GltfVisibility, HiddenJointsMoveWhatIsSeen) {
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

TEST(GltfVisibility, WhatIsNoTruthValueIsRefused) {
  GltfModel model = test::triangle_model({{"extensions", {{"KHR_node_visibility", {{"visible", 0}}}}}});
  EXPECT_TRUE(has(refused(model), "nodes[0].extensions.KHR_node_visibility.visible is not true or false"));
}

TEST(GltfWebp, TexelsAreThoseOfThePicture) {
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

TEST(GltfWebp, TheOtherImageIsForWhereThereIsNone) {
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
  EXPECT_TRUE(has(lines.warnings[0], "image 0 (small) is left out: is a WebP cut short")) << lines.warnings[0];
}

TEST(GltfWebp, HostileFilesCostOneLine) {
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
  // VP8X with the animation's bit, 2 x 2, and nothing in it.
  EXPECT_TRUE(has(line({'R', 'I', 'F', 'F', 22, 0, 0, 0, 'W', 'E', 'B', 'P', 'V', 'P', '8',
                        'X', 10,  0,   0,   0,  2, 0, 0, 0,   1,   0,   0,   1,   0,   0}),
                  "is an animated WebP"));

  // Few bytes, many pixels: what decoding would take is asked for first.
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

}  // namespace
}  // namespace cumulet::surface
