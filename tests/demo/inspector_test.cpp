// The inspector and the timeline of cumulet-demo: groups of settings, and their size in small and large windows.

#include <gtest/gtest.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "about.hpp"
#include "panel_fixture.hpp"
#include "selection.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet::demo;
namespace settings = cumulet::settings;

class InspectorTest : public cumulet::test::PanelTest {
 protected:
  InspectorTest() {
    model_.scene.volume = "/a/fire.vdb";
    select(model_, Item{Item::Kind::volume, 0, 0});
  }
  void give_grids(const std::vector<cumulet_ramp>& grids) {
    for (const cumulet_ramp grid : grids) model_.status.fields[grid].most = 1.0f;
  }
  void frames() {
    for (int i = 0; i < 4; ++i) frame();
  }
  bool has(const char* control) { return panel_.ui().controls().contains(control); }
  /// Shows a sequence of three files, of which the first is the current one.
  void play() {
    for (const char* name : {"f_1.vdb", "f_2.vdb", "f_3.vdb"}) std::ofstream(folder_.path() / name) << "x";
    Play play{nullptr, *FrameRow::of_name((folder_.path() / "f_#.vdb").string()), {}, {1, 2, 0}, {}};
    play.info.frames = 3;
    play.info.ready_frames = play.info.failed_frames = 1;
    model_.status.play = play;
  }
  static float hidden_height() {
    float most = -1.0f;
    for (const ImGuiWindow* window : ImGui::GetCurrentContext()->Windows)
      if (std::string_view(window->Name).find("/inspector_") != std::string_view::npos) most = window->ScrollMax.y;
    return most;
  }

  cumulet::test::Folder folder_;
};

TEST_P(InspectorTest, MaterialHidesWhatCannotAct) {
  frames();
  EXPECT_TRUE(has("Material/Density") && has("Material/Scattering") && has("Scatter color"));
  EXPECT_FALSE(has("Material/Fire") || has("Material/Ramps")) << "there are no grids";
  EXPECT_FALSE(has("Second direction") || has("Lobe mix") || has("Droplet size")) << "there is one lobe";
  give_grids({CUMULET_RAMP_FLAME});
  frames();
  EXPECT_TRUE(has("Material/Fire") && has("Flame brightness") && has("Material/Ramps"));
  EXPECT_FALSE(has("Fire brightness")) << "there are no temperatures";
  give_grids({CUMULET_RAMP_TEMPERATURE});
  frames();
  EXPECT_TRUE(has("Fire brightness"));
  EXPECT_FALSE(has("Temperature at 1")) << "without brightness";
  model_.scene.medium.blackbody = 1.0f;
  model_.scene.medium.phase = CUMULET_PHASE_TWO_LOBE;
  frames();
  EXPECT_TRUE(has("Temperature at 1") && has("Second direction") && has("Lobe mix"));
  EXPECT_FALSE(has("Max bounces") || has("Temperature ramp")) << "these groups are closed";
  open_ramps();
  frames();
  EXPECT_TRUE(has("Temperature ramp") && has("Flame colors"));
  EXPECT_FALSE(has("Density ramp")) << "the density is not known";
}

TEST_P(InspectorTest, EverySubjectFitsALargeWindow) {
  if (GetParam().second.y < 900.0f * GetParam().first) GTEST_SKIP() << "the inspector scrolls";
  give_grids({CUMULET_RAMP_DENSITY, CUMULET_RAMP_TEMPERATURE, CUMULET_RAMP_FLAME});
  model_.scene.medium.blackbody = 1.0f;
  model_.scene.medium.phase = CUMULET_PHASE_TWO_LOBE;
  model_.scene.analytic_lights.resize(1);
  model_.scene.cameras.emplace_back().name = "near";
  play();
  std::vector<Subject> subjects = {Part::render, Part::camera, Part::sun_sky, Part::environment, Part::ground};
  for (const Item& item : listed_items(model_.scene)) subjects.emplace_back(item);
  for (const Subject& subject : subjects) {
    select(model_, subject);
    frames();
    EXPECT_EQ(hidden_height(), 0.0f) << subject.index() << " is higher than the window";
  }
  select(model_, Item{Item::Kind::volume, 0, 0});
  for (const char* tab : {"Object", "Grids", "Sequence", "Material"}) {
    frames();
    click(tab);
    frames();
    EXPECT_EQ(hidden_height(), 0.0f) << tab;
  }
}

TEST_P(InspectorTest, LabelsFitBesideTheirControls) {
  frames();
  std::vector<std::string> labels;
  const auto add = [&](const auto& setting) {
    if (*setting.row.label != '\0') labels.emplace_back(setting.row.label);
    if (*setting.row.color != '\0') labels.emplace_back(setting.row.color);
  };
  const auto add_all = [&]<class... Desc>(const Desc&...) { (settings::for_each<Desc>(add), ...); };
  add_all(cumulet_medium_desc{}, cumulet_sun_sky_desc{}, cumulet_light_desc{}, cumulet_environment_settings_desc{},
          cumulet_ground_desc{}, cumulet_surface_settings_desc{}, cumulet_grid_desc{}, cumulet_sampling_desc{},
          cumulet_display_desc{}, cumulet_playback_desc{}, cumulet_camera_desc{}, cumulet_navigation_desc{});
  for (const auto& ramp : settings::ramps) labels.emplace_back(ramp.label);
  for (const auto& ramp : settings::color_ramps) labels.emplace_back(ramp.label);
  labels.emplace_back("Color temperature");
  for (const std::string& label : labels)
    EXPECT_LT(ImGui::GetFont()->CalcTextSizeA(ImGui::GetFontSize(), 1e9f, 0.0f, label.c_str()).x,
              panel_.ui().px(129.0f))
        << label;
}

TEST_P(InspectorTest, TextsUseTheArtistsTerms) {
  const std::set<std::string_view> strange = {"albedo",     "Albedo",     "turbidity",  "Turbidity", "anisotropy",
                                              "Anisotropy", "black body", "Black body", "extinction"};
  give_grids({CUMULET_RAMP_DENSITY, CUMULET_RAMP_TEMPERATURE, CUMULET_RAMP_FLAME});
  model_.scene.medium.blackbody = 1.0f;
  model_.scene.light.sky = CUMULET_SKY_PHYSICAL;
  for (const Subject& subject : std::vector<Subject>{Part::sun_sky, Part::ground, Item{Item::Kind::volume, 0, 0}}) {
    select(model_, subject);
    frames();
    for (const auto& [name, control] : panel_.ui().controls())
      for (const std::string_view word : strange) EXPECT_EQ(name.find(word), std::string::npos) << name;
  }
}

TEST_P(InspectorTest, TimelineHasItsButtonsInEveryWindow) {
  play();
  frames();
  const Rectangle view = Panel::viewport(model_, static_cast<double>(GetParam().second.x),
                                         static_cast<double>(GetParam().second.y), GetParam().first);
  double left = 0.0;
  for (const char* name : {"First", "Previous", "Play", "Next", "Last", "Loop"}) {
    ASSERT_TRUE(has(name)) << name;
    const Rectangle area = panel_.ui().controls().at(name).rectangle;
    EXPECT_GT(area.x, left) << name << " is out of order";
    left = area.x;
    EXPECT_LE(area.x + area.width, view.x + view.width) << name;
    EXPECT_GE(area.y, view.y + view.height) << name;
    EXPECT_LE(area.y + area.height, static_cast<double>(GetParam().second.y)) << name;
  }
  EXPECT_TRUE(has("Playhead"));
  model_.scene.sequence.playback.repeat = CUMULET_REPEAT_LOOP;
  frames();
  click("Loop");
  EXPECT_EQ(model_.scene.sequence.playback.repeat, CUMULET_REPEAT_HOLD);
  click("Loop");
  EXPECT_EQ(model_.scene.sequence.playback.repeat, CUMULET_REPEAT_LOOP);
  click("Last");
  ASSERT_FALSE(commands_.empty());
  EXPECT_EQ(commands_.back().action, Action::go_to_end);
  EXPECT_EQ(commands_.back().value, 1);
}

TEST_P(InspectorTest, ToolsAreInEveryWindow) {
  play();
  frames();
  for (const auto& [name, control] : panel_.ui().controls()) {
    if (!name.starts_with("Tool/")) continue;
    EXPECT_TRUE(control.in_view) << name;
    EXPECT_GE(control.rectangle.width, 10.0) << name;
  }
}

// A message covered the menus of a small window.
TEST_P(InspectorTest, MessagesStayInTheImage) {
  for (const char* text : {"The volume burns: dusk light and the filmic tone map", "Saved /a/picture.png, 1920x1080"})
    show_message(model_, true, text, time_);
  for (int i = 0; i < 3; ++i)
    show_message(model_, true,
                 std::string("A long message about a file that cannot be read, number ").append(std::to_string(i)),
                 time_);
  frames();
  const ImGuiWindow* const window = ImGui::FindWindowByName("messages");
  ASSERT_NE(window, nullptr);
  EXPECT_GE(window->Pos.y, ImGui::GetFrameHeight());
  EXPECT_TRUE(has("Dismiss"));
  EXPECT_LE(panel_.ui().controls().at("Dismiss").rectangle.x + panel_.ui().controls().at("Dismiss").rectangle.width,
            static_cast<double>(window->Pos.x + window->Size.x));
}

TEST_P(InspectorTest, CamerasAreAddedWithoutAName) {
  model_.scene.camera.eye[2] = 5.0;
  select(model_, Part::camera);
  for (int i = 0; i < 2; ++i) {
    panel_.ui().bring_into_view("Add camera");
    frames();
    click("Add camera");
  }
  ASSERT_EQ(model_.scene.cameras.size(), 2u);
  EXPECT_EQ(model_.scene.cameras[0].name, "Camera 1");
  EXPECT_EQ(model_.scene.cameras[1].name, "Camera 2");
}

TEST_P(InspectorTest, ALightTakesAColorTemperature) {
  select(model_, Item{Item::Kind::analytic_light, 0, 0});
  auto& color = model_.scene.analytic_lights[0].color;
  frames();
  EXPECT_TRUE(has("Light color"));
  EXPECT_FALSE(has("Color temperature")) << "white is no black body";
  const auto choose = [&](const char* mode) {
    panel_.ui().bring_into_view("Color by");
    frames();
    click("Color by");
    frame();
    click((std::string("Color by/") + mode).c_str());
    frames();
  };
  choose("Temperature");
  EXPECT_TRUE(has("Color temperature"));
  EXPECT_FALSE(has("Light color"));
  EXPECT_NEAR(color[0], 1.0f, 0.1f) << "that of white";
  EXPECT_NEAR(color[2], 1.0f, 0.1f);
  const Rgb warm = color_of_kelvin(2700.0);
  std::ranges::copy(warm, color);
  frames();
  EXPECT_TRUE(has("Color temperature")) << "as in a scene that was opened";
  choose("Color");
  EXPECT_TRUE(has("Light color"));
  EXPECT_FALSE(has("Color temperature"));
  EXPECT_TRUE(std::ranges::equal(color, warm)) << "to look at the color changes nothing";
}

INSTANTIATE_TEST_SUITE_P(Scales, InspectorTest, cumulet::test::panel_sizes());

TEST(About, NamesVersionDriverAndLicenses) {
  const std::string text = about_text("A GPU", "4.5 of a driver");
  for (const char* part : {"Cumulet 0.", "A GPU", "4.5 of a driver", "OpenVDB", "MPL-2.0", "Dear ImGui", "MIT"})
    EXPECT_NE(text.find(part), std::string::npos) << part;
}

}  // namespace
