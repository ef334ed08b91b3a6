// Extensions of glTF that say what is shown, when and of which material, by small files made here.

#include <gtest/gtest.h>

#include "support/gltf_import.hpp"
#include "support/gltf_model.hpp"

namespace cumulet::surface {
namespace {

using test::GltfModel;
using test::has;
using test::imported;
using test::json;
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

}  // namespace
}  // namespace cumulet::surface
