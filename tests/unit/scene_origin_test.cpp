// Scenes and models have local origins, so that float coordinates stay precise far from the world's origin.

#include <gtest/gtest.h>

#include <array>
#include <glm/gtc/matrix_transform.hpp>
#include <vector>

#include "scene/model_table.hpp"
#include "scene/origin.hpp"
#include "support/gltf_import.hpp"
#include "support/gltf_model.hpp"
#include "surface/triangles.hpp"

namespace cumulet {
namespace {

using glm::dmat4;
using glm::dvec3;
using scene::Extent;
using surface::Pose;
using surface::ScenePtr;
using test::GltfModel;
using test::json;

const dvec3 ecef(4201234.5, 168000.25, 4780000.75);

Extent box_at(const dvec3& middle, double edge) { return {middle - 0.5 * edge, middle + 0.5 * edge}; }

double largest(const dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

TEST(SceneOrigin, IsZeroForNearScenesAndCloseToFarOnes) {
  for (const double size : {1e-3, 1.0, 1e4}) {
    for (const double away : {0.0, 1.0, 20.0, 100.0}) {
      const std::array near{box_at(dvec3(away * size), size)};
      EXPECT_EQ(scene::origin_of_scene(near, std::nullopt), dvec3(0.0)) << size << " " << away;
    }
    for (const double away : {1e3, 1e5, 1e7}) {
      const dvec3 middle = away * size * dvec3(1.0, -0.31, 0.71);
      const std::array far{box_at(middle, size)};
      const dvec3 origin = scene::origin_of_scene(far, std::nullopt);
      EXPECT_LE(largest(origin - middle), 128.0 * size);
      const std::array moved{box_at(middle + dvec3(0.01 * size), 1.01 * size)};
      EXPECT_EQ(scene::origin_of_scene(moved, middle + dvec3(size)), origin) << "it rests while things move a little";
    }
  }
  EXPECT_EQ(scene::origin_of_scene({}, ecef), dvec3(0.0));
}

TEST(SceneOrigin, FollowsTheCameraInLargeScenes) {
  // A marker at 0 and a house on a globe, seen from near each.
  const std::array apart{box_at(dvec3(0.0), 1.0), box_at(ecef, 10.0)};
  EXPECT_LE(largest(scene::origin_of_scene(apart, ecef + dvec3(20.0)) - ecef), 64.0 * 64.0);
  EXPECT_LE(largest(scene::origin_of_scene(apart, dvec3(3.0))), 256.0);
  const std::array globe{box_at(dvec3(0.0), 1.27e7), box_at(ecef, 10.0)};
  EXPECT_LE(largest(scene::origin_of_scene(globe, ecef + dvec3(20.0)) - ecef), 64.0 * 64.0);
  EXPECT_EQ(scene::origin_of_scene(globe, dvec3(4e7, 0.0, 0.0)), dvec3(0.0)) << "from afar the house is a point";
}

// ---- models ----

// A primitive: a box with these half edges around a center, made of six quads.
json box(GltfModel& model, const glm::vec3& half, const glm::vec3& middle = glm::vec3(0.0F)) {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0F, 1.0F}) {
      const auto first = static_cast<std::uint32_t>(positions.size() / 3);
      for (const auto& [u, v] : std::array<std::pair<float, float>, 4>{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}}) {
        glm::vec3 p(0.0F);
        p[axis] = side;
        p[(axis + 1) % 3] = side * u;
        p[(axis + 2) % 3] = v;
        for (int c = 0; c < 3; ++c) positions.push_back(middle[c] + half[c] * p[c]);
      }
      for (const std::uint32_t i : {0U, 1U, 2U, 0U, 2U, 3U}) indices.push_back(first + i);
    }
  }
  return {{"attributes", {{"POSITION", model.vec3(positions)}}},
          {"indices", model.accessor<std::uint32_t>("SCALAR", 1, indices)}};
}

// World positions of all triangle vertices as the path tracer uses them, in double precision.
std::vector<dvec3> corners(const ScenePtr& scene, const Pose& pose, const dmat4& to_world = dmat4(1.0)) {
  const scene::ModelSourcePtr source = scene::make_model_source(scene, pose, nullptr);
  std::vector<dvec3> all;
  for (const scene::ModelMesh& mesh : source->meshes) {
    for (const dmat4& transform : mesh.transforms) {
      for (std::size_t i = 3 * mesh.first_triangle; i < 3 * (mesh.first_triangle + std::size_t{mesh.triangle_count});
           ++i)
        all.emplace_back(to_world * transform * glm::dvec4(source->pose.vertices[scene->indices[i]].position, 1.0));
    }
  }
  return all;
}

void expect_moved(const std::vector<dvec3>& far, const std::vector<dvec3>& near, const dmat4& by, double within,
                  const std::string& what) {
  ASSERT_EQ(far.size(), near.size());
  double worst = 0.0;
  for (std::size_t i = 0; i < far.size(); ++i)
    worst = std::max(worst, glm::distance(far[i], dvec3(by * glm::dvec4(near[i], 1.0))));
  EXPECT_LT(worst, within) << what;
}

const std::array far_positions{dvec3(1e5, 0.0, -1e5), dvec3(1e6, 3.0, 2e6), ecef, dvec3(-1e7, 1e7, 0.0), dvec3(1e8)};
constexpr double precision = 2e-5;  // of objects of size 1

// A rotated, nested box, with a camera and a light above it.
GltfModel georeferenced(const dvec3& at) {
  GltfModel model;
  model.root["extensionsUsed"] = {"KHR_lights_punctual"};
  model.root["extensions"]["KHR_lights_punctual"]["lights"] = json::array({{{"type", "point"}}});
  model.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}});
  const int shown = model.show(box(model, {0.5F, 0.25F, 0.125F}), {{"rotation", {0.0, 0.6, 0.0, 0.8}}});
  const int camera = model.add("nodes", {{"camera", 0}, {"translation", {0.0, 0.0, 3.0}}});
  const int light =
      model.add("nodes", {{"translation", {0.0, 2.0, 0.0}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  const int house = model.add("nodes", {{"children", {shown, camera, light}}, {"translation", {1.0, 2.0, 3.0}}});
  const int root = model.add("nodes", {{"children", {house}}, {"translation", {at.x, at.y, at.z}}});
  model.root["scenes"] = json::array({{{"nodes", {root}}}});
  model.root["scene"] = 0;
  return model;
}

TEST(FarModels, KeepTheirShape) {
  const ScenePtr near = test::imported(georeferenced(dvec3(0.0)));
  const Pose near_pose = near->pose(0.0);
  EXPECT_EQ(near_pose.origin, dvec3(0.0));
  const std::vector<dvec3> shape = corners(near, near_pose);
  for (const dvec3& at : far_positions) {
    const ScenePtr far = test::imported(georeferenced(at));
    EXPECT_EQ(far->precision_remark, "");
    const Pose pose = far->pose(0.0);
    const std::string where = std::to_string(at.x);
    expect_moved(corners(far, pose), shape, glm::translate(dmat4(1.0), at), precision, where);
    EXPECT_LT(glm::distance(pose.low, near_pose.low + at), precision);
    EXPECT_LT(glm::distance(pose.high, near_pose.high + at), precision);
    EXPECT_LT(glm::distance(dvec3(pose.cameras.at(0).to_world[3]), dvec3(1.0, 2.0, 6.0) + at), precision);
    const auto light =
        scene::transformed(pose.lights.at(0), surface::from_origin(glm::translate(dmat4(1.0), -at), pose));
    EXPECT_LT(glm::distance(dvec3(light.position), dvec3(1.0, 4.0, 3.0)), precision);
    for (std::size_t v = 0; v < pose.vertices.size(); ++v)
      EXPECT_LT(glm::distance(pose.vertices[v].normal, near_pose.vertices[v].normal), 1e-5F);
  }
}

// A box whose vertices contain the offset, under a node that subtracts it. No precision is lost beyond that of the
// float vertices.
TEST(FarModels, VertexAndNodeOffsetsCancel) {
  const glm::vec3 middle(4201234.5F, 168000.25F, 4780000.5F);  // exact floats
  for (const bool instanced : {false, true}) {
    GltfModel model;
    json node = {{"translation", {-double{middle.x}, -double{middle.y}, -double{middle.z}}}};
    if (instanced) {
      model.root["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
      node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", model.vec3({0, 0, 0, 32, 0, 0})}};
    }
    model.show(box(model, glm::vec3(8.0F, 16.0F, 4.0F), middle), node);
    const ScenePtr scene = test::imported(model);
    const std::vector<dvec3> found = corners(scene, scene->pose(0.0));
    GltfModel plain;
    plain.show(box(plain, glm::vec3(8.0F, 16.0F, 4.0F)));
    const ScenePtr small = test::imported(plain);
    const std::vector<dvec3> expected = corners(small, small->pose(0.0));
    ASSERT_EQ(found.size(), expected.size() * (instanced ? 2 : 1));
    for (std::size_t i = 0; i < found.size(); ++i) {
      const dvec3 beside(i < expected.size() ? 0.0 : 32.0, 0.0, 0.0);
      EXPECT_LT(glm::distance(found[i], expected[i % expected.size()] + beside), 1e-3);
    }
    const scene::ModelSourcePtr source = scene::make_model_source(scene, scene->pose(0.0), nullptr);
    for (const surface::PosedVertex& v : source->pose.vertices)
      EXPECT_LT(largest(dvec3(v.position)), 1e4) << "near the origin that it counts from";
  }
}

// A strip that bends at a joint, with both far away. It returns half a second later.
GltfModel skinned(const dvec3& at) {
  GltfModel model;
  json primitive = {{"attributes",
                     {{"POSITION", model.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0, 1, 2, 0})},
                      {"JOINTS_0", model.accessor<std::uint8_t>("VEC4", 4, {0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0,
                                                                            0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0})},
                      {"WEIGHTS_0", model.accessor<float>("VEC4", 4, {1,   0,   0, 0, 1, 0, 0, 0, .5F, .5F, 0, 0,
                                                                      .5F, .5F, 0, 0, 1, 0, 0, 0, 1,   0,   0, 0})}}},
                    {"indices", model.accessor<std::uint16_t>("SCALAR", 1, {0, 1, 2, 2, 1, 3, 2, 3, 4, 4, 3, 5})}};
  const int mesh = model.add("meshes", {{"primitives", json::array({primitive})}});
  const int tip = model.add("nodes", {{"translation", {0.0, 1.0, 0.0}}});
  const int root = model.add("nodes", {{"children", {tip}}, {"translation", {at.x, at.y, at.z}}});
  const std::vector<float> bind{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,  0, 1,
                                1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1};
  const int skin =
      model.add("skins", {{"joints", {root, tip}}, {"inverseBindMatrices", model.accessor<float>("MAT4", 16, bind)}});
  const int body = model.add("nodes", {{"mesh", mesh}, {"skin", skin}});
  json turns = {{"input", model.accessor<float>("SCALAR", 1, {0, 1}, {{"min", {0}}, {"max", {1}}})},
                {"output", model.accessor<float>("VEC4", 4, {0, 0, 0, 1, 0, 0, 0.6F, 0.8F})}};
  model.add("animations",
            {{"samplers", json::array({turns})},
             {"channels", json::array({{{"sampler", 0}, {"target", {{"node", tip}, {"path", "rotation"}}}}})}});
  model.root["scenes"] = json::array({{{"nodes", {root, body}}}});
  return model;
}

TEST(FarModels, SkinAndAnimateLikeNearModels) {
  const ScenePtr near = test::imported(skinned(dvec3(0.0)));
  for (const dvec3& at : far_positions) {
    const ScenePtr far = test::imported(skinned(at));
    for (const double time : {0.0, 0.5, 1.0}) {
      expect_moved(corners(far, far->pose(time)), corners(near, near->pose(time)), glm::translate(dmat4(1.0), at),
                   precision, std::to_string(at.x));
    }
    const auto far_ends = far->pose_ends(0.5, 0, 0.25);
    const auto near_ends = near->pose_ends(0.5, 0, 0.25);
    ASSERT_TRUE(far_ends && near_ends);
    const dvec3 origin = far->pose(0.5).origin;
    EXPECT_EQ(far_ends->open.origin, origin) << "paths go straight from one end to the other";
    EXPECT_EQ(far_ends->close.origin, origin);
    expect_moved(corners(far, far_ends->close), corners(near, near_ends->close), glm::translate(dmat4(1.0), at),
                 precision, "its end");
  }
}

// ---- precision that a file itself has lost ----

TEST(FarModels, ImpreciseVerticesGiveAWarning) {
  const auto remark = [](const glm::vec3& half, const glm::vec3& middle) {
    GltfModel model;
    const int node = model.show(box(model, half, middle));
    model.root["meshes"][model.root["nodes"][node]["mesh"].get<int>()]["name"] = "house";
    return test::imported(model)->precision_remark;
  };
  EXPECT_EQ(remark(glm::vec3(0.5F), glm::vec3(0.0F)), "");
  EXPECT_EQ(remark(glm::vec3(0.5F), glm::vec3(100.0F)), "");
  EXPECT_EQ(remark(glm::vec3(500.0F), glm::vec3(5e5F)), "");
  const std::string far = remark(glm::vec3(0.5F), glm::vec3(ecef));
  EXPECT_TRUE(
      far.starts_with("made.gltf: the positions of mesh 0 (house) lose precision: they reach 4.78e+06, where "
                      "32-bit floats have a rounding error of up to 0.25, "))
      << far;
  EXPECT_TRUE(test::has(far, " % of its size")) << far;
  EXPECT_TRUE(test::has(remark(glm::vec3(0.5F), glm::vec3(1e8F)), "more than its size")) << "it is one point";

  // Translations of animations and of instances are floats too.
  GltfModel animated = skinned(dvec3(0.0));
  json& channel = animated.root["animations"][0]["channels"][0]["target"];
  channel["path"] = "translation";
  animated.root["animations"][0]["samplers"][0]["output"] =
      animated.accessor<float>("VEC3", 3, {4201234.5F, 0, 0, 4201235.5F, 0, 0});
  EXPECT_TRUE(test::has(test::imported(animated)->precision_remark, "the positions of animation 0 lose precision"));
  GltfModel instanced;
  instanced.root["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  json node;
  node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", instanced.vec3({4e6F, 0, 0})}};
  instanced.show(box(instanced, glm::vec3(0.5F)), node);
  EXPECT_TRUE(test::has(test::imported(instanced)->precision_remark, "the positions of node 0's instances lose"));

  const std::vector<float> positions{1e7F, 0, 0, 1e7F + 1, 0, 0, 1e7F, 1, 0};
  surface::TriangleMesh mesh;
  mesh.positions = positions;
  EXPECT_TRUE(test::has(surface::import_triangles(std::array{mesh}, "the host's")->precision_remark,
                        "the host's: the positions of mesh 0 lose precision"));
}

}  // namespace
}  // namespace cumulet
