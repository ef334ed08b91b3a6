// Objects beside the first volume in cumulet-demo: their media, and the place of added ones.

#include <gtest/gtest.h>
#include <imgui.h>

#include <cmath>
#include <glm/glm.hpp>
#include <string>

#include "panel_fixture.hpp"
#include "placement.hpp"
#include "selection.hpp"

namespace {

using namespace cumulet::demo;
using glm::dvec3;

class ObjectsTest : public cumulet::test::PanelTest {
 protected:
  /// Adds a second volume, which is open. It has a density from 0 to 2, and temperatures.
  void add_volume() {
    model_.scene.volume = "/a/cloud.vdb";
    model_.status.fields[CUMULET_RAMP_DENSITY].most = 1.0f;
    SceneVolume& added = model_.scene.others.emplace_back();
    added.volume = "/a/fire.vdb";
    spell_out_defaults(model_.scene);
    OtherVolume known;
    known.file = added;
    known.open.density_scale = 0.25;
    known.fields[CUMULET_RAMP_DENSITY].most = 2.0f;
    known.fields[CUMULET_RAMP_TEMPERATURE].most = 3.0f;
    model_.status.others.push_back(known);
    select(model_, Item{Item::Kind::volume, 1, 0});
  }
  void show(const char* control) {
    for (int i = 0; i < 6; ++i) {
      panel_.ui().bring_into_view(control);
      frame();
    }
  }
  bool has(const char* control) { return panel_.ui().controls().contains(control); }
};

TEST_P(ObjectsTest, EachVolumeHasItsOwnRamps) {
  add_volume();
  frame();
  open_ramps();
  show("Temperature colors");
  EXPECT_FALSE(has("Flame ramp") || has("Flame colors")) << "it has no flames";
  click("Temperature colors");
  const SceneVolume& other = model_.scene.others[0];
  ASSERT_GE(other.color_ramps[CUMULET_RAMP_TEMPERATURE].size(), 2u);
  EXPECT_EQ(other.color_ramps[CUMULET_RAMP_TEMPERATURE].back()[0], 3.0f);
  show("Density ramp");
  click("Density ramp");
  ASSERT_EQ(other.ramps[CUMULET_RAMP_DENSITY].size(), 2u);
  EXPECT_EQ(other.ramps[CUMULET_RAMP_DENSITY][1][0], 2.0f);
  for (const auto& ramp : model_.scene.ramps) EXPECT_TRUE(ramp.empty()) << "the first volume stays";
  for (const auto& ramp : model_.scene.color_ramps) EXPECT_TRUE(ramp.empty()) << "the first volume stays";
  select(model_, Item{Item::Kind::volume, 0, 0});
  show("Density colors");
  EXPECT_FALSE(has("Temperature ramp") || has("Temperature colors")) << "the first volume has no temperatures";
}

TEST_P(ObjectsTest, TheMediumOfAnotherVolumeBeginsWithWhatItsFileSuggests) {
  add_volume();
  show("Auto density");
  EXPECT_FALSE(has("Max bounces")) << "the first volume's applies to all";
  EXPECT_TRUE(model_.scene.others[0].auto_density_scale);
  EXPECT_EQ(model_.scene.others[0].medium.density_scale, 0.0) << "to look at it changes nothing";
  const SceneVolume& other = model_.scene.others[0];
  model_.scene.others[0].medium.density_scale = 7.0;
  show("Auto density");
  click("Auto density");
  EXPECT_EQ(other.medium.density_scale, 0.25);
  EXPECT_FALSE(other.auto_density_scale);
  EXPECT_TRUE(commands_.empty()) << "the first volume stays";
}

TEST_P(ObjectsTest, ARampWithoutAGridCanBeRemoved) {
  model_.scene.volume = "/a/cloud.vdb";
  model_.scene.ramps[CUMULET_RAMP_FLAME] = {{0.0f, 0.0f}, {1.0f, 1.0f}};
  select(model_, Item{Item::Kind::volume, 0, 0});
  show("Flame ramp");
  EXPECT_FALSE(has("Temperature ramp"));
  click("Flame ramp");
  EXPECT_TRUE(model_.scene.ramps[CUMULET_RAMP_FLAME].empty());
  frame();
  EXPECT_FALSE(has("Flame ramp"));
}

TEST_P(ObjectsTest, TheWheelDoesNotMoveTheOutliner) {
  select(model_, Part::render);
  for (int i = 0; i < 3; ++i) frame();
  const double before = panel_.ui().controls().at("Scene/Render").rectangle.y;
  const Rectangle edge = panel_.ui().controls().at("Panel edge").rectangle;
  const ImVec2 low(static_cast<float>(edge.x + edge.width + 30.0), ImGui::GetIO().DisplaySize.y - 20.0f);
  for (int i = 0; i < 60; ++i) {
    ImGui::GetIO().MouseWheel = -3.0f;
    frame(low);
  }
  EXPECT_EQ(panel_.ui().controls().at("Scene/Render").rectangle.y, before);
}

INSTANTIATE_TEST_SUITE_P(Scales, ObjectsTest, cumulet::test::panel_sizes());

Box cube(const dvec3& middle, double side) { return {middle - 0.5 * side, middle + 0.5 * side}; }

Box placed(const Placement& placement, const Box& box) {
  return {dvec3(placement.transform * glm::dvec4(box.least, 1.0)),
          dvec3(placement.transform * glm::dvec4(box.most, 1.0))};
}

TEST(PlacementTest, ObjectsOfASuitableSizeStay) {
  const Box scene = cube({10, 20, 30}, 100.0);
  EXPECT_FALSE(place_in(scene, cube({10, 20, 30}, 5.0), {0, 0, 300}));
  EXPECT_FALSE(place_in(scene, cube({200, 20, 30}, 150.0), {0, 0, 300}));
  EXPECT_FALSE(place_in(scene, cube({0, 0, 0}, 0.0), {0, 0, 300})) << "no size at all";
}

TEST(PlacementTest, TinyHugeAndFarObjectsGetAPlaceInFrontOfTheScene) {
  const dvec3 eye(10, 60, 400);
  const Box scene = cube({10, 20, 30}, 100.0);
  for (const Box& object : {cube({0, 0, 0}, 2.0), cube({5e5, 0, 0}, 2e4), cube({0, 0, -3000}, 60.0)}) {
    const auto placement = place_in(scene, object, eye);
    ASSERT_TRUE(placement);
    const Box box = placed(*placement, object);
    const double ratio = (box.most.x - box.least.x) / 100.0;
    EXPECT_GT(ratio, 0.15);
    EXPECT_LT(ratio, 0.65);
    EXPECT_NEAR(box.least.y, scene.least.y, 1e-6) << "they stand on the ground of the scene";
    EXPECT_NEAR(box.least.z, scene.most.z, 1e-6) << "in front of it, as the camera sees it";
    EXPECT_NEAR(0.5 * (box.least.x + box.most.x), 10.0, 1e-6);
  }
  EXPECT_EQ(place_in(scene, cube({0, 0, -3000}, 60.0), eye)->scale, 1.0) << "only its place";
  EXPECT_EQ(place_in(scene, cube({0, 0, 0}, 2.0), eye)->scale, 20.0) << "a round number";
}

TEST(PlacementTest, OthersAreAllObjectsWithAKnownBox) {
  Model model;
  const Item added{Item::Kind::model, 0, 0};
  model.scene.models.push_back({"/a/tree.glb"});
  model.status.boxes.models = {{"/a/tree.glb", cube({0, 0, 0}, 2.0)}};
  EXPECT_FALSE(box_of_others(model, added));
  model.scene.volume = "/a/cloud.vdb";
  model.scene.transforms.push_back({2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 100, 0, 0, 1});
  model.status.boxes.volumes = {{model.scene, cube({0, 0, 0}, 10.0)}};
  const auto others = box_of_others(model, added);
  ASSERT_TRUE(others);
  EXPECT_EQ(others->least, dvec3(90, -10, -10));
  EXPECT_EQ(others->most, dvec3(110, 10, 10));
}

TEST(PlacementTest, SurfacesBecomeAModelWithAPlaceIfTheyNeedOne) {
  Model model;
  model.scene.volume = "/a/cloud.vdb";
  model.status.boxes.volumes = {{model.scene, cube({0, 0, 0}, 100.0)}};
  model.scene.surfaces = "/a/fox.glb";
  model.status.surfaces.triangles = 10;
  const auto set_size = [&](double side) {
    for (int axis = 0; axis < 3; ++axis) {
      model.status.surfaces.bounds_min[axis] = -0.5 * side;
      model.status.surfaces.bounds_max[axis] = 0.5 * side;
    }
  };
  set_size(50.0);
  model.scene.surface.holdout = 1;
  model.scene.surface.animation = 2;
  model.scene.surface_variant = "red";
  EXPECT_FALSE(adopt_surfaces(model, true, 0.0));
  EXPECT_EQ(model.scene.surfaces, "");
  ASSERT_EQ(model.scene.models.size(), 1U);
  const SceneModel adopted{.file = "/a/fox.glb", .holdout = true, .animation = 2, .variant = "red"};
  EXPECT_EQ(model.scene.models[0], adopted);
  EXPECT_EQ(model.scene.surface.animation, 0U);
  EXPECT_FALSE(adopt_surfaces(model, true, 0.0)) << "there are no surfaces";
  set_size(0.5);
  model.scene.surfaces = "/a/fox.glb";
  EXPECT_FALSE(adopt_surfaces(model, false, 0.0)) << "a scene has given it its place";
  ASSERT_EQ(model.scene.models.size(), 2U);
  EXPECT_EQ(model.scene.models[1], adopted) << "a scene's surfaces are its first model";
  model.scene.models.clear();
  model.scene.surfaces = "/a/fox.glb";
  EXPECT_TRUE(adopt_surfaces(model, true, 0.0));
  ASSERT_EQ(model.scene.models.size(), 1U);
  const auto transform = transform_of(model.scene, {Item::Kind::model, 0, 0});
  ASSERT_TRUE(transform);
  EXPECT_NEAR((*transform)[0][0], 50.0, 1e-9);
  ASSERT_EQ(model.messages.size(), 1U);
  EXPECT_EQ(model.messages[0].text, "fox.glb is 200 times smaller than the scene: scaled by 50");
}

TEST(PlacementTest, HardlyVisibleObjectsOfASceneAreNamed) {
  Model model;
  model.scene.volume = "/a/cloud.vdb";
  model.scene.models.push_back({"/a/fox.glb"});
  model.status.boxes.volumes = {{model.scene, cube({0, 0, 0}, 100.0)}};
  EXPECT_FALSE(remark_on_tiny(model, 0.0)) << "the model is not loaded yet";
  model.status.boxes.models = {{"/a/fox.glb", cube({0, 0, 0}, 5.0)}};
  EXPECT_TRUE(remark_on_tiny(model, 0.0));
  EXPECT_TRUE(model.messages.empty());
  model.status.boxes.models = {{"/a/fox.glb", cube({0, 0, 0}, 0.5)}};
  EXPECT_TRUE(remark_on_tiny(model, 0.0));
  ASSERT_EQ(model.messages.size(), 1U);
  EXPECT_TRUE(model.messages[0].text.starts_with("fox.glb is 200 times smaller than the scene"))
      << model.messages[0].text;
  model.scene.models[0].visible = false;
  model.messages.clear();
  EXPECT_TRUE(remark_on_tiny(model, 0.0));
  EXPECT_TRUE(model.messages.empty()) << "hidden by the user";
  // Two clouds that are far from each other
  model.scene.transforms = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
  model.scene.others.emplace_back().volume = "/a/other.vdb";
  model.status.boxes.volumes.emplace_back(model.scene.others[0], cube({50000, 0, 0}, 100.0));
  EXPECT_TRUE(remark_on_tiny(model, 0.0));
  EXPECT_EQ(model.messages.size(), 2U);
}

TEST(NumberFormat, HasNoExponentForUsualNumbers) {
  EXPECT_EQ(plain_format("%.4g W", 37120.0), "%.0f W");
  EXPECT_EQ(plain_format("%.3g", -5e6), "%.0f");
  EXPECT_EQ(plain_format("%.4g", 9999.0), "%.4g");
  EXPECT_EQ(plain_format("%.4g", 1e20), "%.4g");
  EXPECT_EQ(plain_format("%.2f h", 1e6), "%.2f h");
  EXPECT_EQ(plain_format("none", 1e6), "none");
}

}  // namespace
