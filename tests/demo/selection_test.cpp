// Selections of several objects in cumulet-demo, and the order of objects.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>

#include <string>
#include <utility>
#include <vector>

#include "history.hpp"
#include "selection.hpp"

namespace {

using namespace cumulet::demo;

Item light(std::size_t index) { return {Item::Kind::analytic_light, index, 0}; }
Item volume(std::size_t index, std::size_t transform = 0) { return {Item::Kind::volume, index, transform}; }

/// Returns a scene with three volumes, the second of which has three instances, two models and three lights.
Model objects() {
  Model model;
  model.scene.volume = "a.vdb";
  for (const char* file : {"b.vdb", "c.vdb"}) model.scene.others.emplace_back().volume = file;
  model.scene.others[0].transforms.resize(3);
  for (std::size_t i = 0; i < 3; ++i) model.scene.others[0].transforms[i][12] = static_cast<double>(i);
  model.scene.models = {{"m.glb"}, {"n.glb"}};
  for (int i = 0; i < 3; ++i) {
    cumulet_light_desc& added = model.scene.analytic_lights.emplace_back();
    added.struct_size = sizeof added;
    added.power = static_cast<float>(10 + i);
  }
  spell_out_defaults(model.scene);
  return model;
}

std::vector<float> powers(const Model& model) {
  std::vector<float> all;
  for (const cumulet_light_desc& one : model.scene.analytic_lights) all.push_back(one.power);
  return all;
}

std::vector<std::string> files(const Model& model) {
  std::vector<std::string> all = {model.scene.volume};
  for (const SceneVolume& other : model.scene.others) all.push_back(other.volume);
  return all;
}

TEST(Selection, ClicksWithCtrlAddAndRemove) {
  Model model = objects();
  select(model, light(0));
  toggle_selected(model, volume(2));
  EXPECT_EQ(subject_of(model), Subject(volume(2)));
  EXPECT_EQ(selected_items(model), (std::vector<Item>{volume(2), light(0)}));
  toggle_selected(model, volume(2));
  EXPECT_EQ(selected_items(model), std::vector<Item>{light(0)});
  toggle_selected(model, light(0));
  EXPECT_EQ(selected_items(model), std::vector<Item>{light(0)}) << "the last one stays";
  select(model, Part::camera);
  EXPECT_TRUE(selected_items(model).empty());
  EXPECT_FALSE(has_selection(model) || can_hide(model));
}

TEST(Selection, AllOfItIsRemoved) {
  Model model = objects();
  select_items(model, {light(0), light(2), volume(1, 0), volume(1, 2), volume(2)}, light(2));
  remove_selected(model);
  EXPECT_EQ(powers(model), std::vector<float>{11.0f});
  EXPECT_EQ(files(model), (std::vector<std::string>{"a.vdb", "b.vdb"}));
  ASSERT_EQ(model.scene.others[0].transforms.size(), 1u);
  EXPECT_EQ(model.scene.others[0].transforms[0][12], 1.0);
  EXPECT_FALSE(model.chosen);
  EXPECT_EQ(selected_items(model).size(), 1u) << "the first object";
}

TEST(Selection, AllOfItIsDuplicated) {
  Model model = objects();
  select_items(model, {light(0), light(2), volume(0), volume(1, 0), volume(1, 2)}, light(2));
  duplicate_selected(model);
  EXPECT_EQ(powers(model), (std::vector<float>{10, 10, 11, 12, 12}));
  EXPECT_EQ(files(model), (std::vector<std::string>{"a.vdb", "a.vdb", "b.vdb", "c.vdb"}));
  const auto& transforms = model.scene.others[1].transforms;
  ASSERT_EQ(transforms.size(), 5u);
  const double places[] = {0.0, 0.0, 1.0, 2.0, 2.0};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(transforms[i][12], places[i]) << i;
  EXPECT_EQ(selected_items(model), (std::vector<Item>{volume(1), volume(2, 1), volume(2, 4), light(1), light(4)}));
  EXPECT_EQ(subject_of(model), Subject(light(4)));
  EXPECT_EQ(model.chosen, light(4));
}

TEST(Selection, AllOfItIsHidden) {
  Model model = objects();
  model.scene.others[1].visible = false;
  const Item shape{Item::Kind::model, 1, 0};
  select_items(model, {volume(0), volume(2), shape, light(0)}, shape);
  hide_selected(model);
  EXPECT_FALSE(model.scene.visible || model.scene.others[1].visible || model.scene.models[1].visible);
  EXPECT_TRUE(model.scene.others[0].visible && model.scene.models[0].visible);
  hide_selected(model);
  EXPECT_TRUE(model.scene.visible && model.scene.others[1].visible && model.scene.models[1].visible);
}

TEST(Selection, ObjectsMoveWithinTheirKind) {
  Model model = objects();
  const auto bounces = model.scene.medium.max_bounces;
  EXPECT_TRUE(reorder(model, light(0), light(2)));
  EXPECT_EQ(powers(model), (std::vector<float>{11, 12, 10}));
  EXPECT_EQ(subject_of(model), Subject(light(2)));
  EXPECT_TRUE(reorder(model, volume(2), volume(0)));
  EXPECT_EQ(files(model), (std::vector<std::string>{"c.vdb", "a.vdb", "b.vdb"}));
  EXPECT_EQ(model.scene.medium.max_bounces, bounces);
  EXPECT_TRUE(reorder(model, volume(2, 0), volume(2, 1)));
  EXPECT_EQ(model.scene.others[1].transforms[0][12], 1.0);
  EXPECT_TRUE(reorder(model, {Item::Kind::model, 1, 0}, {Item::Kind::model, 0, 0}));
  EXPECT_EQ(model.scene.models[0].file, "n.glb");
  EXPECT_FALSE(reorder(model, light(0), volume(0)));
  EXPECT_FALSE(reorder(model, light(0), light(0)));
}

TEST(Selection, OrderOfVolumesWithoutAFirstOne) {
  Model model = objects();
  select(model, volume(0));
  remove_selected(model);
  EXPECT_EQ(files(model), (std::vector<std::string>{"", "b.vdb", "c.vdb"}));
  EXPECT_TRUE(reorder(model, volume(1), volume(2)));
  EXPECT_EQ(files(model), (std::vector<std::string>{"", "c.vdb", "b.vdb"}));
}

TEST(Selection, ChangesOfTheOrderAreNamed) {
  Model model = objects();
  const SceneOptions before = model.scene;
  for (const auto& [from, to] : {std::pair(light(0), light(1)), std::pair(volume(0), volume(1))}) {
    model.scene = before;
    EXPECT_TRUE(reorder(model, from, to));
    EXPECT_EQ(change_name(before, model.scene), "Order");
  }
}

TEST(Selection, ANewLightSuitsTheExposure) {
  const auto light_at = [](float stops) {
    Model model;
    model.scene.camera.eye[2] = 10.0;
    model.scene.display.exposure_stops = stops;
    add_light(model);
    return model.scene.analytic_lights.at(0);
  };
  const cumulet_light_desc made = light_at(0.0f);
  const double distance = std::hypot(made.position[0], made.position[1], made.position[2]);
  EXPECT_NEAR(static_cast<double>(made.power), 2.0 * 4.0 * 3.14159265 * distance * distance, 0.01);
  EXPECT_FLOAT_EQ(light_at(3.0f).power, made.power / 8.0f);
}

// A distant light that became a point light kept its W/m² as W, and was black.
TEST(Selection, ALightOfAnotherKindKeepsItsBrightness) {
  Model model;
  model.scene.camera.eye[2] = 10.0;
  add_light(model);
  cumulet_light_desc& light = model.scene.analytic_lights.at(0);
  const float watts = light.power;
  light.kind = CUMULET_LIGHT_DISTANT;
  adapt_light(light, CUMULET_LIGHT_POINT, model.scene);
  EXPECT_FLOAT_EQ(light.power, 2.0f);
  light.kind = CUMULET_LIGHT_RECT;
  adapt_light(light, CUMULET_LIGHT_DISTANT, model.scene);
  EXPECT_NEAR(light.power, watts, 1e-4f * watts);
  const double distance = std::hypot(light.position[0], light.position[1], light.position[2]);
  EXPECT_NEAR(light.width, 0.3 * distance, 1e-9) << "a size that suits the scene";
  EXPECT_EQ(light.height, light.width);
  light.kind = CUMULET_LIGHT_DISK;
  light.width = 7.0;
  adapt_light(light, CUMULET_LIGHT_RECT, model.scene);
  EXPECT_EQ(light.width, 7.0) << "the user's";
  EXPECT_NEAR(light.power, watts, 1e-4f * watts);
  cumulet_light_desc sun{};
  sun.struct_size = sizeof sun;
  sun.direction[1] = -2.0;
  adapt_light(sun, CUMULET_LIGHT_DISTANT, model.scene);
  EXPECT_GT(sun.position[1], 0.5) << "above the target, from where the sun shone";
  EXPECT_GT(sun.power, 2.0f);
}

TEST(Selection, ANewLightIsInView) {
  struct View {
    std::array<double, 3> eye;
    double fovy;
    double orthographic_height;
  };
  for (const View& view : {View{{0, 0, 10}, 0, 0}, View{{300, 200, -100}, 20, 0}, View{{0, 5, 0}, 40, 0},
                           View{{1, 2, 3}, 150, 0}, View{{10, 0, 0}, 40, 4}}) {
    Model model;
    cumulet_camera_desc& camera = model.scene.camera;
    std::ranges::copy(view.eye, camera.eye);
    camera.fovy_degrees = view.fovy;
    camera.orthographic_height = view.orthographic_height;
    add_light(model);
    const auto& light = model.scene.analytic_lights.at(0);
    const glm::dvec3 eye(view.eye[0], view.eye[1], view.eye[2]);
    const glm::dvec3 forward = -glm::normalize(eye);
    const glm::dvec3 at(light.position[0], light.position[1], light.position[2]);
    const double depth = glm::dot(at - eye, forward);
    const double side = glm::length(at - eye - depth * forward);
    const double fovy = view.fovy > 0.0 ? view.fovy : 40.0;
    const double half =
        view.orthographic_height > 0.0 ? 0.5 * view.orthographic_height : depth * std::tan(fovy * 3.14159265 / 360.0);
    EXPECT_GT(depth, 0.0);
    EXPECT_LT(side, half) << "outside of a square image";
    EXPECT_GT(side, 0.3 * std::min(half, glm::length(eye))) << "on the way to the target";
    // It shines at the target.
    const glm::dvec3 direction(light.direction[0], light.direction[1], light.direction[2]);
    EXPECT_NEAR(glm::dot(direction, glm::normalize(at)), -1.0, 1e-9);
  }
}

}  // namespace
