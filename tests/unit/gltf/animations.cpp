// Animations of glTF files.

#include <gtest/gtest.h>

#include <cmath>

#include "support/folder.hpp"
#include "support/gltf_check.hpp"
#include "support/gltf_import.hpp"
#include "support/gltf_model.hpp"
#include "support/gltf_seeds.hpp"
#include "surface/gltf_import.hpp"

namespace cumulet::surface {
namespace {

using test::corners;
using test::GltfModel;
using test::imported;
using test::json;
using test::near;
using test::triangle_model;

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

}  // namespace
}  // namespace cumulet::surface
