// The panel of cumulet-demo without a window.

#include <gtest/gtest.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "menus.hpp"
#include "model.hpp"
#include "panel.hpp"
#include "panel_fixture.hpp"
#include "rows.hpp"
#include "selection.hpp"

namespace {

using namespace cumulet::demo;
using cumulet::test::PanelTest;

TEST_P(PanelTest, EveryControlHasATooltipAndItsOwnArea) {
  model_.scene.volume = "/a/cloud.vdb";
  model_.scene.models.push_back({"/a/tree.glb"});
  std::vector<Subject> subjects = {Part::render, Part::camera, Part::sun_sky, Part::environment, Part::ground};
  for (const Item& item : listed_items(model_.scene)) subjects.emplace_back(item);
  EXPECT_EQ(subjects.size(), 9u);
  for (const Subject& subject : subjects) {
    select(model_, subject);
    frame();
    frame();
    check_controls();
  }
}

TEST_P(PanelTest, LabelsFitBesideTheirControls) {
  frame();
  frame();
  for (const char* label : {"Camera adaptive", "Sun elevation", "Density", "GPU memory", "Background"}) {
    EXPECT_LT(ImGui::GetFont()->CalcTextSizeA(ImGui::GetFontSize(), 1e9f, 0.0f, label).x, panel_.ui().px(126.0f))
        << label;
  }
}

TEST_P(PanelTest, ThumbnailRotatesTheEnvironment) {
  select(model_, Part::environment);
  panel_.ui().bring_into_view("Environment view");
  for (int i = 0; i < 5; ++i) frame();
  const auto rectangle = panel_.ui().find("Environment view");
  ASSERT_TRUE(rectangle);
  EXPECT_NEAR(rectangle->height, 0.5 * rectangle->width, 1.0);
  const auto at = [&](double x) {
    return ImVec2(static_cast<float>(rectangle->x + x * rectangle->width),
                  static_cast<float>(rectangle->y + 0.5 * rectangle->height));
  };
  float& rotation = model_.scene.environment_settings.rotation_degrees;
  ImGuiIO& io = ImGui::GetIO();
  frame(at(0.5));
  EXPECT_EQ(rotation, 0.0f) << "nothing is turned by looking";
  io.MouseDown[0] = true;
  frame(at(0.5));
  EXPECT_EQ(rotation, 0.0f);
  frame(at(0.6));
  EXPECT_NEAR(rotation, -36.0f, 1.0f);
  frame(at(-0.15));  // dragged beyond the edge
  EXPECT_NEAR(rotation, 360.0f * 0.65f - 360.0f, 1.0f);
  io.MouseDown[0] = false;
  frame(at(0.2));
  const float kept = rotation;
  for (int i = 0; i < 40; ++i) frame(at(0.3));
  EXPECT_EQ(rotation, kept);
  for (int i = 0; i < 2; ++i) {
    io.MouseDown[0] = true;
    frame(at(0.3));
    io.MouseDown[0] = false;
    frame(at(0.3));
  }
  EXPECT_EQ(rotation, 0.0f) << "a double click turns it back";
}

TEST_P(PanelTest, PathsAreElidedAtTheStart) {
  const std::string path = "/a/folder/of a very long name/\xc3\xa9t\xc3\xa9/another/cloud_0042.vdb";
  ImGui::NewFrame();
  const float whole = ImGui::CalcTextSize(path.c_str()).x;
  EXPECT_EQ(end_of(path, whole + 1.0f), path);
  for (float width = 0.9f * whole; width > 0.5f * whole; width -= 0.01f * whole) {
    const std::string shown = end_of(path, width);
    EXPECT_TRUE(shown.starts_with("...") && path.ends_with(shown.substr(3))) << shown;
    EXPECT_TRUE(shown.ends_with("cloud_0042.vdb"));
    EXPECT_LE(ImGui::CalcTextSize(shown.c_str()).x, width);
    EXPECT_NE(static_cast<unsigned char>(shown[3]) & 0xC0U, 0x80U) << "within a character";
  }
  ImGui::EndFrame();
}

TEST_P(PanelTest, DrawingChangesNothing) {
  const SceneOptions before = model_.scene;
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_TRUE(same_scene(before, model_.scene));
  EXPECT_TRUE(commands_.empty());
}

TEST_P(PanelTest, SceneWithOnlyAModelIsListedAndSaved) {
  model_ = Model();
  model_.scene.models.push_back({"/a/town.glb"});
  model_.status.has_content = true;
  for (int i = 0; i < 2; ++i) frame();
  EXPECT_TRUE(panel_.ui().controls().contains("Scene/Model 1"));
  EXPECT_NE(panel_.state(), "");
  model_.status.saving = "/b/picture.png";
  frame();
  EXPECT_NE(panel_.state().find("saving picture.png"), std::string::npos) << panel_.state();
}

TEST_P(PanelTest, MenusIssueTheirCommands) {
  frame();
  frame();
  click("File");
  click("File/Open...");
  ASSERT_EQ(commands_.size(), 1u);
  EXPECT_EQ(commands_[0].action, Action::open_dialog);
  model_.undo = "Density";
  click("Edit");
  click("Edit/Undo");
  ASSERT_EQ(commands_.size(), 2u);
  EXPECT_EQ(commands_[1].action, Action::undo);
}

TEST_P(PanelTest, OutlinerSelectsHidesAndDeletes) {
  model_.scene.volume = "/a/cloud.vdb";
  frame();
  frame();
  EXPECT_EQ(subject_of(model_), Subject(Item{Item::Kind::volume, 0, 0})) << "the first object, until the user selects";
  EXPECT_TRUE(panel_.ui().controls().contains("Density"));
  EXPECT_FALSE(model_.chosen);
  click("Scene/Sun & sky");
  EXPECT_TRUE(panel_.ui().controls().contains("Sun dial"));
  EXPECT_FALSE(panel_.ui().controls().contains("Density"));
  panel_.ui().bring_into_view("Eye/Volume 1");
  for (int i = 0; i < 3; ++i) frame();
  click("Eye/Volume 1");
  EXPECT_FALSE(model_.scene.visible);
  EXPECT_EQ(subject_of(model_), Subject(Part::sun_sky)) << "an eye selects nothing";
}

TEST_P(PanelTest, OutlinerSelectsSeveral) {
  if (GetParam().second.y < 800.0f * GetParam().first) GTEST_SKIP() << "the list scrolls";
  model_.scene.volume = "/a/cloud.vdb";
  model_.scene.analytic_lights.push_back(model_.scene.analytic_lights.back());
  frame();
  frame();
  const auto light = [](std::size_t index) { return Item{Item::Kind::analytic_light, index, 0}; };
  ImGuiIO& io = ImGui::GetIO();
  click("Scene/Light 1");
  io.KeyCtrl = true;
  click("Scene/Light 3");
  io.KeyCtrl = false;
  EXPECT_EQ(selected_items(model_), (std::vector<Item>{light(0), light(2)}));
  click("Scene/Light 2");
  EXPECT_EQ(selected_items(model_), std::vector<Item>{light(1)});
  io.KeyShift = true;
  click("Scene/Volume 1");
  EXPECT_EQ(selected_items(model_).size(), 3u) << "the rows from the light to the volume";
  click("Scene/Light 1");
  io.KeyShift = false;
  EXPECT_EQ(selected_items(model_), (std::vector<Item>{light(0), light(1)}));
  // A box from the group's name over the first two lights.
  const Rectangle first = *panel_.ui().find("Scene/Light 1");
  const Rectangle second = *panel_.ui().find("Scene/Light 2");
  const auto x = static_cast<float>(first.x + 0.5 * first.width);
  select(model_, light(2));
  drag_mouse({x, static_cast<float>(first.y - 0.5 * first.height)},
             {x, static_cast<float>(second.y + 0.5 * second.height)});
  EXPECT_EQ(selected_items(model_), (std::vector<Item>{light(0), light(1)}));
}

TEST_P(PanelTest, OutlinerRowsMoveByDragging) {
  if (GetParam().second.y < 800.0f * GetParam().first) GTEST_SKIP() << "the list scrolls";
  model_.scene.analytic_lights.push_back(model_.scene.analytic_lights.back());
  for (std::size_t i = 0; i < 3; ++i) model_.scene.analytic_lights[i].power = static_cast<float>(i + 1);
  frame();
  frame();
  const auto middle = [&](const char* control) {
    const Rectangle row = *panel_.ui().find(control);
    return ImVec2(static_cast<float>(row.x + 0.5 * row.width), static_cast<float>(row.y + 0.5 * row.height));
  };
  drag_mouse(middle("Scene/Light 1"), middle("Scene/Light 3"));
  EXPECT_EQ(model_.scene.analytic_lights[0].power, 2.0f);
  EXPECT_EQ(model_.scene.analytic_lights[2].power, 1.0f);
  EXPECT_EQ(subject_of(model_), Subject(Item{Item::Kind::analytic_light, 2, 0}));
  drag_mouse(middle("Scene/Light 1"), middle("Scene/Camera"));
  EXPECT_EQ(model_.scene.analytic_lights[0].power, 2.0f) << "a part is no place for a light";
}

TEST_P(PanelTest, RampsAreCopiedAndPasted) {
  model_.scene.volume = "/a/cloud.vdb";
  model_.scene.ramps[0] = {{0.0f, 0.0f}, {0.5f, 0.25f}, {1.0f, 1.0f}};
  model_.scene.ramps[1] = {{0.0f, 0.0f}, {1.0f, 1.0f}};
  select(model_, Item{Item::Kind::volume, 0, 0});
  const auto press = [&](const char* control) {
    for (int i = 0; i < 5; ++i) {
      panel_.ui().bring_into_view(control);
      frame();
    }
    click(control);
  };
  press("Copy##density");
  press("Paste##temperature");
  EXPECT_EQ(model_.scene.ramps[1], model_.scene.ramps[0]);
  ImGui::SetClipboardText("no curve");
  press("Paste##density");
  EXPECT_EQ(model_.scene.ramps[0].size(), 3u);
  ASSERT_FALSE(model_.messages.empty());
  EXPECT_EQ(model_.messages.back().text, "The clipboard has no curve");
}

// A color ramp is shown if the volume has its grid. Stops are added, dragged, dragged off and deleted, colors are
// copied.
TEST_P(PanelTest, ColorRampsAreEdited) {
  model_.scene.volume = "/a/fire.vdb";
  select(model_, Item{Item::Kind::volume, 0, 0});
  auto& stops = model_.scene.color_ramps[CUMULET_RAMP_TEMPERATURE];
  frame();
  frame();
  EXPECT_FALSE(panel_.ui().find("Temperature colors"));
  EXPECT_FALSE(panel_.ui().controls().contains("Density colors")) << "there is no grid";
  model_.status.fields[CUMULET_RAMP_DENSITY].most = 1.0f;
  model_.status.fields[CUMULET_RAMP_TEMPERATURE].most = 2.0f;
  const auto show = [&](const char* control) {
    for (int i = 0; i < 5; ++i) {
      panel_.ui().bring_into_view(control);
      frame();
    }
  };
  open_ramps();
  show("Temperature colors");
  click("Temperature colors");
  ASSERT_GE(stops.size(), 3u);
  EXPECT_EQ(stops.back()[0], 2.0f);
  EXPECT_FALSE(panel_.ui().controls().contains("Flame colors"));
  stops = {{0.0f, 0.0f, 0.0f, 0.0f}, {2.0f, 4.0f, 2.0f, 0.0f}};
  show("Temperature colors bar");
  const auto at = [&](float along, float below = 0.5f) {
    const Rectangle bar = *panel_.ui().find("Temperature colors bar");
    return ImVec2(static_cast<float>(bar.x + along * bar.width), static_cast<float>(bar.y + below * bar.height));
  };
  drag_mouse(at(0.25f), at(0.5f));
  ASSERT_EQ(stops.size(), 3u) << "a press beside the stops adds one";
  EXPECT_NEAR(stops[1][0], 1.0f, 0.05f);
  EXPECT_NEAR(stops[1][1], 1.0f, 0.2f) << "with the color of the place where it was added";
  drag_mouse(at(0.5f), at(0.5f, 4.0f));
  EXPECT_EQ(stops.size(), 2u) << "dragged off";
  drag_mouse(at(0.75f), at(0.75f));
  ASSERT_EQ(stops.size(), 3u);
  frame(at(0.3f));
  EXPECT_TRUE(panel_.ui().takes_delete());
  ImGui::GetIO().KeyMap[ImGuiKey_Delete] = 261;
  ImGui::GetIO().KeysDown[261] = true;
  frame(at(0.3f));
  ImGui::GetIO().KeysDown[261] = false;
  frame(at(0.3f));
  EXPECT_EQ(stops.size(), 2u) << "the selected one is deleted";
  show("Copy##Temperature colors");
  click("Copy##Temperature colors");
  EXPECT_STREQ(ImGui::GetClipboardText(), "0:0/0/0,2:4/2/0");
  EXPECT_FALSE(panel_.ui().takes_delete());
  show("Density colors");
  click("Density colors");
  show("Paste##Density colors");
  click("Paste##Density colors");
  ASSERT_FALSE(model_.messages.empty());
  EXPECT_EQ(model_.messages.back().text, "The clipboard has no colors that suit this grid") << "an albedo is at most 1";
}

TEST_P(PanelTest, RightClickResetsASetting) {
  select(model_, Part::render);
  panel_.ui().bring_into_view("Exposure");
  for (int i = 0; i < 4; ++i) frame();
  model_.scene.display.exposure_stops = 2.0f;
  click("Exposure", ImGuiMouseButton_Right);
  EXPECT_EQ(model_.scene.display.exposure_stops, 0.0f);
  select(model_, Part::sun_sky);
  panel_.ui().bring_into_view("Haze");
  for (int i = 0; i < 4; ++i) frame();
  model_.scene.light.sky = CUMULET_SKY_PHYSICAL;
  model_.scene.light.turbidity = 9.0f;
  frame();
  panel_.ui().bring_into_view("Haze");
  for (int i = 0; i < 4; ++i) frame();
  click("Haze", ImGuiMouseButton_Right);
  EXPECT_EQ(model_.scene.light.turbidity, default_of<cumulet_sun_sky_desc>().turbidity);
}

TEST_P(PanelTest, DoubleClickTypesANumber) {
  select(model_, Part::render);
  panel_.ui().bring_into_view("Exposure");
  for (int i = 0; i < 4; ++i) frame();
  float& exposure = model_.scene.display.exposure_stops;
  exposure = 2.0f;
  click("Exposure");
  EXPECT_NE(exposure, 2.0f) << "a click sets the value at the pointer";
  EXPECT_TRUE(panel_.ui().may_become_double_click());
  click("Exposure");
  EXPECT_EQ(exposure, 2.0f) << "a double click takes that back";
  ImGui::GetIO().AddInputCharactersUTF8("1.5");
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_EQ(exposure, 1.5f);
}

TEST_P(PanelTest, NumbersBeyondTheLimitsAreReported) {
  select(model_, Part::render);
  panel_.ui().bring_into_view("Exposure");
  for (int i = 0; i < 4; ++i) frame();
  click("Exposure");
  click("Exposure");
  ImGui::GetIO().AddInputCharactersUTF8("5e30");
  for (int i = 0; i < 6; ++i) frame();
  EXPECT_TRUE(model_.messages.empty()) << "not while it is typed";
  ImGui::ClearActiveID();
  for (int i = 0; i < 3; ++i) frame();
  ASSERT_EQ(model_.messages.size(), 1u);
  EXPECT_EQ(model_.messages[0].text.rfind("Exposure: 5e30 is not from ", 0), 0u) << model_.messages[0].text;
  EXPECT_NE(model_.messages[0].text.find("; set to "), std::string::npos) << model_.messages[0].text;
}

TEST_P(PanelTest, ShiftDragsSlowly) {
  select(model_, Part::render);
  panel_.ui().bring_into_view("Exposure");
  for (int i = 0; i < 4; ++i) frame();
  const Rectangle row = *panel_.ui().find("Exposure");
  const auto at = [&](double part) {
    return ImVec2(static_cast<float>(row.x + part * row.width), static_cast<float>(row.y + 0.5 * row.height));
  };
  ImGuiIO& io = ImGui::GetIO();
  const auto drag = [&](bool shift) {
    frame(at(0.5));
    io.MouseDown[0] = true;
    frame(at(0.5));
    frame(at(0.5));
    const float before = model_.scene.display.exposure_stops;
    io.KeyShift = shift;
    frame(at(0.8));
    const float change = model_.scene.display.exposure_stops - before;
    io.KeyShift = false;
    io.MouseDown[0] = false;
    for (int i = 0; i < 60; ++i) frame(at(0.8));  // so that the next press is no double click
    return change;
  };
  const float normal = drag(false);
  const float fine = drag(true);
  EXPECT_GT(normal, 0.0f);
  EXPECT_NEAR(fine, 0.1f * normal, 0.03f * normal);
}

TEST_P(PanelTest, EdgeChangesTheWidth) {
  frame();
  frame();
  const Rectangle edge = *panel_.ui().find("Panel edge");
  const auto y = static_cast<float>(edge.y + edge.height / 2);
  ImGuiIO& io = ImGui::GetIO();
  const auto drag = [&](float width) {
    const Rectangle from = *panel_.ui().find("Panel edge");
    const ImVec2 start(static_cast<float>(from.x + from.width / 2), y);
    frame(start);
    io.MouseDown[0] = true;
    frame(start);
    frame({io.DisplaySize.x - panel_.ui().px(width), y});
    io.MouseDown[0] = false;
    frame({io.DisplaySize.x - panel_.ui().px(width), y});
    frame();
    frame();
  };
  drag(300.0f);
  EXPECT_EQ(model_.preferences.panel_width, 300.0f);
  drag(100.0f);
  EXPECT_EQ(model_.preferences.panel_width, 280.0f);
  drag(900.0f);
  EXPECT_EQ(model_.preferences.panel_width, 480.0f);
}

INSTANTIATE_TEST_SUITE_P(Scales, PanelTest, cumulet::test::panel_sizes());

TEST(Menus, ReachEveryAction) {
  // Actions of dialogs, messages, of the outliner and of Escape.
  const std::set<Action> elsewhere = {Action::add_volume,       Action::add_model,    Action::save_scene_as,
                                      Action::save_png,         Action::save_exr,     Action::discard_changes,
                                      Action::recover,          Action::cancel,       Action::choose_grid,
                                      Action::discard_recovery, Action::clear_log,    Action::render,
                                      Action::show_in_folder,   Action::quit_anyway,  Action::cancel_render,
                                      Action::clear_renders,    Action::daylight,     Action::white,
                                      Action::keep_place,       Action::follow_light, Action::open_sample,
                                      Action::ocio_dialog,      Action::open_ocio,    Action::go_to};
  for (int i = 0; i <= static_cast<int>(Action::about); ++i) {
    const auto action = static_cast<Action>(i);
    const bool listed = std::ranges::any_of(menus(), [&](const Menu& menu) {
      return std::ranges::any_of(
          menu.entries, [&](const MenuEntry& entry) { return *entry.label != '\0' && entry.command.action == action; });
    });
    EXPECT_NE(listed, elsewhere.contains(action)) << i;
  }
}

TEST(Menus, ShowTheKeys) {
  EXPECT_EQ(keys_of({Action::save_scene_dialog}), "Ctrl+Shift+S");
  EXPECT_EQ(keys_of({Action::step, "", -1}), ",");
  EXPECT_EQ(keys_of({Action::view, "", CUMULET_VIEW_STEPS}), "3");
  EXPECT_EQ(keys_of({Action::add_light}), "");
}

}  // namespace
