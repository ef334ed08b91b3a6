#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include <cmath>
#include <default_look.hpp>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "demo_options.hpp"
#include "empty_window.hpp"
#include "environment_view.hpp"
#include "given_settings.hpp"
#include "history.hpp"
#include "input.hpp"
#include "model.hpp"
#include "preferences.hpp"
#include "ramp_edit.hpp"
#include "saved_picture.hpp"
#include "sun_dial.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet::demo;

SceneOptions scene_with(double density) {
  SceneOptions scene;
  scene.medium.density_scale = density;
  return scene;
}

using Points = cumulet::settings::RampPoints;

TEST(RampEdit, AddsMovesAndRemovesPoints) {
  Points points = {{0.0f, 0.0f}, {1.0f, 1.0f}};
  EXPECT_EQ(add_point(points, {0.5f, 0.25f}), 1u);
  EXPECT_EQ(add_point(points, {2.0f, 3.0f}), 3u);
  EXPECT_EQ(add_point(points, {1.0f, 0.75f}), 2u) << "of a value that has a point, that is moved";
  EXPECT_EQ(points, (Points{{0.0f, 0.0f}, {0.5f, 0.25f}, {1.0f, 0.75f}, {2.0f, 3.0f}}));
  move_point(points, 1, {0.75f, 0.5f});
  EXPECT_EQ(points[1], (Points::value_type{0.75f, 0.5f}));
  EXPECT_TRUE(remove_point(points, 2));
  EXPECT_TRUE(remove_point(points, 0));
  EXPECT_FALSE(remove_point(points, 0)) << "a ramp has two";
  EXPECT_EQ(points, (Points{{0.75f, 0.5f}, {2.0f, 3.0f}}));
}

// After any edit it is a valid ramp.
TEST(RampEdit, StaysAValidRamp) {
  Points points = {{0.0f, 0.0f}, {1.0f, 1.0f}};
  for (int i = 0; i < 40; ++i) static_cast<void>(add_point(points, {0.01f * static_cast<float>(i * 7 % 40), 0.5f}));
  EXPECT_EQ(points.size(), cumulet::settings::max_ramp_points);
  for (const float to : {-1e38f, 5.0f, 0.1f, 1e38f}) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      move_point(points, i, {to, to});
      EXPECT_EQ(cumulet::settings::ramp_refusal(points), "");
    }
  }
}

TEST(RampEdit, PresetsAndTextsAreValidRamps) {
  EXPECT_GE(ramp_presets().size(), 5u);
  for (const RampPreset& preset : ramp_presets()) {
    for (const float most : {1.0f, 0.003f, 4000.0f}) {
      const Points points = points_of(preset, most);
      EXPECT_EQ(cumulet::settings::ramp_refusal(points), "") << preset.label;
      EXPECT_EQ(points.back()[0], most);
      EXPECT_EQ(ramp_of_text(ramp_text(points)), points) << preset.label;
    }
  }
  EXPECT_EQ(ramp_text({{0.0f, 0.0f}, {0.5f, 0.25f}}), "0:0,0.5:0.25");
  for (const char* text : {"", "none", "hello", "0:0", "1:0,0:0"}) EXPECT_FALSE(ramp_of_text(text)) << text;
}

TEST(RampEdit, FitsTheViewWithAMargin) {
  RampView view;
  view.chosen = 5;
  fit(view, {{0.0f, 0.0f}, {1.0f, 2.0f}}, 3.0f);
  EXPECT_EQ(view.max_value, 3.0f);
  EXPECT_EQ(view.max_result, 2.5f);
  EXPECT_EQ(view.chosen, 1u);
  fit(view, {{-2.0f, 0.0f}, {-1.0f, 0.0f}}, 0.0f);
  EXPECT_EQ(view.max_value, 1.0f);
  EXPECT_EQ(view.max_result, 1.25f);
  view.held = 0;
  fit(view, {{0.0f, 0.0f}, {9.0f, 9.0f}}, 3.0f);
  EXPECT_EQ(view.max_value, 1.0f) << "not while it is dragged";
}

TEST(RampEdit, ReleasesPointsRemovedByUndo) {
  RampView view;
  view.held = view.chosen = 2;
  fit(view, {{0.0f, 0.0f}, {1.0f, 1.0f}}, 1.0f);
  EXPECT_FALSE(view.held.has_value());
  EXPECT_EQ(view.chosen, 1u);
  view.held = view.chosen = 1;
  fit(view, {}, 1.0f);
  EXPECT_FALSE(view.held.has_value());
  EXPECT_EQ(view.chosen, 0u);
}

TEST(UndoHistory, RampChangeIsOneStep) {
  History history(scene_with(1));
  SceneOptions scene = scene_with(1);
  scene.ramps[CUMULET_RAMP_DENSITY] = {{0.0f, 0.0f}, {1.0f, 2.0f}};
  history.offer(scene, false);
  const auto before = history.undo(scene);
  ASSERT_TRUE(before);
  EXPECT_TRUE(before->ramps[CUMULET_RAMP_DENSITY].empty());
}

TEST(UndoHistory, DragIsOneStep) {
  History history(scene_with(1));
  for (const double density : {1.5, 2.0, 3.0}) history.offer(scene_with(density), true);
  history.offer(scene_with(3), false);
  EXPECT_EQ(history.depth(), 1u);
  EXPECT_EQ(history.undo(scene_with(3))->medium.density_scale, 1.0);
  EXPECT_FALSE(history.undo(scene_with(1)).has_value());
  EXPECT_EQ(history.redo(scene_with(1))->medium.density_scale, 3.0);
  EXPECT_FALSE(history.redo(scene_with(3)).has_value());
}

TEST(UndoHistory, LaterChangeIsASeparateStep) {
  History history(scene_with(1));
  history.offer(scene_with(2), false);
  history.offer(scene_with(4), true);
  EXPECT_TRUE(history.can_undo(scene_with(4)));
  EXPECT_EQ(history.undo(scene_with(4))->medium.density_scale, 2.0);
  EXPECT_EQ(history.undo(scene_with(2))->medium.density_scale, 1.0);
  history.offer(scene_with(5), false);
  EXPECT_FALSE(history.can_redo());
}

TEST(UndoHistory, FirstCameraIsNoStep) {
  History history(scene_with(1));
  SceneOptions posed = scene_with(1);
  posed.camera.eye[2] = 5.0;
  history.offer(posed, false);
  EXPECT_EQ(history.depth(), 0u);
  posed.camera.eye[2] = 6.0;
  history.offer(posed, false);
  EXPECT_EQ(history.undo(posed)->camera.eye[2], 5.0);
}

TEST(UndoHistory, StepsHaveNames) {
  const SceneOptions before = scene_with(1);
  const auto name = [&](auto change) {
    SceneOptions after = before;
    change(after);
    return change_name(before, after);
  };
  EXPECT_EQ(name([](SceneOptions& scene) { scene.medium.density_scale = 7.0; }), "Density");
  EXPECT_EQ(name([](SceneOptions& scene) { scene.volume = "/a/cloud.vdb"; }), "Open cloud.vdb");
  EXPECT_EQ(name([](SceneOptions& scene) { scene.analytic_lights.emplace_back(); }), "Add light");
  EXPECT_EQ(name([](SceneOptions& scene) { scene.camera.eye[0] += 1.0; }), "Camera");
  EXPECT_EQ(name([](SceneOptions& scene) {
              scene.light.sun_azimuth_degrees = 12.0f;
              scene.light.sun_elevation_degrees = 34.0f;
            }),
            "Sun & sky");
  History history(before);
  EXPECT_FALSE(history.undo_name(before));
  SceneOptions after = before;
  after.medium.anisotropy = 0.3f;
  EXPECT_EQ(history.undo_name(after), "Scatter direction");
  EXPECT_TRUE(history.undo(after));
  EXPECT_EQ(history.redo_name(), "Scatter direction");
}

TEST(UndoHistory, IsBounded) {
  History history(scene_with(1));
  for (int i = 2; i < 1000; ++i) history.offer(scene_with(i), false);
  EXPECT_LT(history.depth(), 300u);
  EXPECT_EQ(history.undo(scene_with(999))->medium.density_scale, 998.0);
}

TEST(Preferences, FilesThatFailToOpenAreNotRecent) {
  Preferences preferences;
  preferences.remember("/a/cloud.vdb");
  preferences.remember("/a/b/../fire.vdb");
  preferences.forget("/a/fire.vdb");
  EXPECT_EQ(preferences.recent, std::vector<std::string>{"/a/cloud.vdb"});
}

TEST(SunDial, PointsAndAnglesRoundTrip) {
  for (int azimuth = -179; azimuth <= 180; azimuth += 7) {
    for (int elevation = 0; elevation < 90; elevation += 4) {
      const SunAngles sun = dial_angles(dial_point({1.0 * azimuth, 1.0 * elevation}), 0.0);
      EXPECT_NEAR(sun.azimuth, azimuth, 1e-9);
      EXPECT_NEAR(sun.elevation, elevation, 1e-9);
    }
  }
  // +Z is at the bottom, +X on the right.
  EXPECT_NEAR(dial_point({0.0, 0.0}).y, 1.0, 1e-12);
  EXPECT_NEAR(dial_point({90.0, 0.0}).x, 1.0, 1e-12);
  EXPECT_NEAR(dial_point({42.0, 90.0}).x, 0.0, 1e-12);
  EXPECT_EQ(dial_angles({0.0, 0.0}, 42.0).azimuth, 42.0);
  EXPECT_EQ(dial_angles({0.0, 5.0}, 42.0).elevation, 0.0);
  EXPECT_EQ(dial_point({0.0, -30.0}).y, 1.0);
  EXPECT_NEAR(dial_step({179.0, 89.0}, 2.0, 2.0).azimuth, -179.0, 1e-9);
  EXPECT_EQ(dial_step({0.0, 89.0}, 2.0, 2.0).elevation, 90.0);
}

TEST(EnvironmentView, RotationFollowsThePointer) {
  // The image coordinate below a position in the view.
  const auto under = [](double rotation, double offset) {
    const double u = left_edge(rotation) + offset;
    return u - std::floor(u);
  };
  for (int rotation = -180; rotation <= 180; rotation += 30) {
    for (const double width : {-1.7, -0.5, -0.1, 0.0, 0.3, 1.0}) {
      const double after = dragged(rotation, width);
      EXPECT_GT(after, -180.0);
      EXPECT_LE(after, 180.0);
      const double off = under(after, 0.25 + width) - under(rotation, 0.25);
      EXPECT_NEAR(off, std::round(off), 1e-9) << rotation << " " << width;
    }
  }
  // As in cumulet.h: +Z in the center, +X left of it. A rotation moves the image's center from +Z towards +X.
  EXPECT_NEAR(position_of(0.0), 0.5, 1e-12);
  EXPECT_NEAR(position_of(90.0), 0.25, 1e-12);
  EXPECT_NEAR(position_of(-90.0), 0.75, 1e-12);
  EXPECT_NEAR(position_of(180.0), 0.0, 1e-12);
  EXPECT_NEAR(position_of(-180.0), 0.0, 1e-12);
  EXPECT_NEAR(under(90.0, position_of(90.0)), 0.5, 1e-12);
  EXPECT_NEAR(dragged(0.0, -0.25), 90.0, 1e-12);
}

TEST(EnvironmentView, ThumbnailIsNeitherBlackNorWhite) {
  constexpr std::size_t pixels = std::size_t{Thumbnail::width} * Thumbnail::height;
  for (const float brightness : {1e-4f, 1.0f, 1e4f}) {
    std::vector<float> radiance(3 * pixels, brightness);
    radiance[0] = radiance[1] = radiance[2] = 1e7f * brightness;  // a sun
    const Thumbnail made = expose(radiance);
    ASSERT_EQ(made.rgba.size(), 4 * pixels);
    EXPECT_GT(made.rgba[0], 250) << brightness;
    EXPECT_GT(made.rgba[4], 90) << brightness;
    EXPECT_LT(made.rgba[4], 170) << brightness;
    EXPECT_EQ(made.rgba[7], 255);
  }
  const Thumbnail dark = expose(std::vector<float>(3 * pixels, 0.0f));
  EXPECT_EQ(dark.rgba[0], 0);
}

TEST(DemoModel, EnvironmentReplacesOnlyDefaultDaylight) {
  SceneOptions scene;
  scene.set_daylight();
  spell_out_defaults(scene);
  const SceneOptions day = scene;
  take_daylight(scene);
  EXPECT_EQ(scene.light.sky, CUMULET_SKY_CONSTANT);
  EXPECT_EQ(scene.light.sun_irradiance[1], 0.0f);
  EXPECT_EQ(scene.light.sky_radiance[1], 0.0f);
  give_daylight(scene);
  EXPECT_TRUE(same_scene(scene, day));
  scene.light.sun_elevation_degrees = 12.0f;
  const SceneOptions chosen = scene;
  take_daylight(scene);
  EXPECT_TRUE(same_scene(scene, chosen));
  give_daylight(scene);
  EXPECT_TRUE(same_scene(scene, chosen));
}

TEST(EmptyWindow, NamesTheKindsOfFiles) {
  EXPECT_STREQ(kind_of_file("/a/scene.JSON"), "Scene");
  EXPECT_STREQ(kind_of_file("a.glb"), "Model");
  EXPECT_STREQ(kind_of_file("a.exr"), "Environment");
  EXPECT_STREQ(kind_of_file("fluid_####.vdb"), "Volume");
}

TEST(DemoModel, DuskReplacesOnlyTheDefaultLook) {
  SceneOptions scene;
  scene.set_daylight();
  spell_out_defaults(scene);
  const SceneOptions day = scene;
  EXPECT_FALSE(give_day(scene));
  EXPECT_TRUE(take_dusk(scene));
  EXPECT_EQ(scene.light.sun_elevation_degrees, 3.0f);
  EXPECT_EQ(scene.display.tone_map, CUMULET_TONE_MAP_FILMIC);
  EXPECT_FALSE(take_dusk(scene));
  EXPECT_TRUE(give_day(scene));
  EXPECT_TRUE(same_scene(scene, day));
  for (const bool display : {false, true}) {
    SceneOptions chosen = day;
    if (display)
      chosen.display.exposure_stops = 0.5f;
    else
      chosen.light.sun_elevation_degrees = 12.0f;
    const SceneOptions before = chosen;
    EXPECT_FALSE(take_dusk(chosen));
    EXPECT_FALSE(give_day(chosen));
    EXPECT_TRUE(same_scene(chosen, before));
  }
  // Zeros are the library's defaults.
  SceneOptions unsaid;
  unsaid.set_daylight();
  EXPECT_TRUE(take_dusk(unsaid));
  EXPECT_EQ(unsaid.light.sun_elevation_degrees, 3.0f);
  EXPECT_EQ(unsaid.display.tone_map, CUMULET_TONE_MAP_FILMIC);
  SceneOptions viewed = day;
  viewed.ocio.config = "a.ocio";
  EXPECT_FALSE(take_dusk(viewed)) << "the view replaces the tone map";
  // The environment is the light.
  SceneOptions surrounded = day;
  surrounded.environment = "sky.hdr";
  EXPECT_FALSE(take_dusk(surrounded));
}

TEST(Preferences, RoundTripAndTolerateDamage) {
  const cumulet::test::Folder folder;
  const std::string path = (folder / "cumulet" / "demo.json").string();
  Preferences preferences;
  for (int i = 0; i < 20; ++i) preferences.remember("/a/" + std::to_string(i) + ".vdb");
  preferences.remember("/a/../b/15.vdb");
  preferences.remember("/a/15.vdb");
  EXPECT_EQ(preferences.recent.size(), 10u);
  Preferences folders;
  folders.remember("/a/slices/");
  folders.remember("/a/slices");
  EXPECT_EQ(folders.recent, std::vector<std::string>{"/a/slices"});
  EXPECT_EQ(folders.folder, "/a");
  folders.forget("/a/slices/");
  EXPECT_TRUE(folders.recent.empty());
  EXPECT_EQ(preferences.recent[0], "/a/15.vdb");
  EXPECT_EQ(preferences.recent[1], "/b/15.vdb");
  EXPECT_EQ(std::set<std::string>(preferences.recent.begin(), preferences.recent.end()).size(), 10u);
  preferences.style = CUMULET_NAVIGATION_BLENDER;
  preferences.width = 1000;
  save_preferences(preferences, path);
  const Preferences read = load_preferences(path);
  EXPECT_EQ(read.recent, preferences.recent);
  EXPECT_EQ(read.folder, "/a");
  EXPECT_EQ(read.style, CUMULET_NAVIGATION_BLENDER);
  EXPECT_EQ(read.width, 1000);
  for (const char* text :
       {"", "{", "[]", "3", R"({"recent": 3, "width": "x"})", R"({"recent": [1, {}], "width": -5})"}) {
    std::ofstream(path) << text;
    EXPECT_GE(load_preferences(path).width, 320) << text;
  }
  EXPECT_TRUE(load_preferences("/nowhere/demo.json").recent.empty());
  EXPECT_THROW(save_preferences(preferences, "/proc/nowhere/demo.json"), std::runtime_error);
}

TEST(DemoOptions, AcceptSceneFlagsAndAFile) {
  std::ostringstream out;
  const auto options =
      parse_demo_options({"cloud.vdb", "--density-scale", "3", "--ui-scale", "1.5", "--size", "800x600"}, out);
  ASSERT_TRUE(options.has_value());
  EXPECT_EQ(options->open, "cloud.vdb");
  EXPECT_EQ(options->scene.medium.density_scale, 3.0);
  EXPECT_EQ(options->ui_scale, 1.5);
  EXPECT_TRUE(options->sized);
  EXPECT_EQ(options->scene.sampling.samples, 256u);
  EXPECT_GT(options->scene.light.sky_radiance[2], 0.0f);
  EXPECT_FALSE(parse_demo_options({}, out)->sized);
  EXPECT_THROW(static_cast<void>(parse_demo_options({"a.vdb", "--volume", "b.vdb"}, out)), UsageError);
  EXPECT_THROW(static_cast<void>(parse_demo_options({"--ui-scale", "nan"}, out)), UsageError);
  EXPECT_THROW(static_cast<void>(parse_demo_options({"--shader-cache", ""}, out)), UsageError);
  EXPECT_THROW(static_cast<void>(parse_demo_options({"--shaders", ""}, out)), UsageError);
  EXPECT_EQ(parse_demo_options({"--shader-cache", "kept"}, out)->viewer.shader_cache, "kept");
  EXPECT_EQ(parse_demo_options({"--ocio", "a.ocio", "--ocio-view", "Film"}, out)->scene.ocio.view, "Film");
  EXPECT_THROW(static_cast<void>(parse_demo_options({"--ocio-view", "Film"}, out)), UsageError);
}

TEST(DemoModel, ModelsStandOnTheDefaultGround) {
  const auto ground_with = [](std::vector<std::string> arguments) {
    std::ostringstream out;
    const auto options = parse_demo_options(std::move(arguments), out);
    Model model;
    model.scene = options->scene;
    model.unchosen_ground = options->unchosen_ground;
    EXPECT_NE(model.scene.ground.mode, CUMULET_GROUND_NONE);
    open_surfaces(model, "town.glb");
    EXPECT_EQ(model.scene.surfaces, "town.glb");
    return model.scene.ground.mode;
  };
  EXPECT_EQ(ground_with({}), CUMULET_GROUND_BELOW);
  EXPECT_EQ(ground_with({"--ground-height", "2"}), CUMULET_GROUND_AT_HEIGHT);
  for (const char* background : {"transparent", "color"}) {
    EXPECT_EQ(ground_with({"--background", background}), CUMULET_GROUND_NONE) << "it is cut out";
    EXPECT_EQ(ground_with({"--background", background, "--ground", "below"}), CUMULET_GROUND_BELOW);
  }
  std::ostringstream out;
  EXPECT_EQ(parse_demo_options({"town.glb"}, out)->scene.ground.mode, CUMULET_GROUND_BELOW);
  EXPECT_EQ(parse_demo_options({"town.glb", "--background", "transparent"}, out)->scene.ground.mode,
            CUMULET_GROUND_NONE);
}

TEST(DemoModel, DefaultsBecomeExplicit) {
  SceneOptions scene;
  scene.grid.criterion = CUMULET_CRITERION_RANGE_MEAN;
  spell_out_defaults(scene);
  EXPECT_EQ(scene.grid.threshold, 1.0);
  SceneOptions zeros;
  spell_out_defaults(zeros);
  EXPECT_EQ(zeros.grid.criterion, CUMULET_CRITERION_TRANSMITTANCE);
  EXPECT_EQ(zeros.grid.threshold, cumulet::settings::default_threshold(CUMULET_CRITERION_TRANSMITTANCE));
  EXPECT_GT(scene.grid.max_cells, 0u);
  EXPECT_EQ(scene.medium.density_scale, 1.0);
  EXPECT_GT(scene.camera.fovy_degrees, 0.0);
  SceneOptions twice = scene;
  spell_out_defaults(twice);
  EXPECT_TRUE(same_scene(scene, twice));
}

/// Changes a setting to another value.
template <class Value>
void change(Value& value) {
  if constexpr (std::is_array_v<Value>)
    value[0] += 1;
  else if constexpr (std::is_enum_v<Value>)
    value = static_cast<Value>(static_cast<int>(value) + 1);
  else
    value += 1;
}

// The demo's defaults differ from the library's, so every group must be passed once.
TEST(GivenSettings, EachGroupIsPassedOnceThenOnChange) {
  std::ostringstream out;
  SceneOptions first = parse_demo_options({}, out)->scene;
  for (SceneOptions scene : {SceneOptions(), first}) {
    GivenSettings given;
    std::size_t groups = 0;
    for_each_group(scene, [&]<class Desc>(Desc& group) {
      ++groups;
      EXPECT_TRUE(given.take(group)) << cumulet::settings::Table<Desc>::name;
      EXPECT_FALSE(given.take(group)) << cumulet::settings::Table<Desc>::name;
      cumulet::settings::for_each<Desc>([&](const auto& setting) {
        Desc other = group;
        change(other.*setting.field);
        EXPECT_TRUE(given.take(other)) << setting.name;
        EXPECT_TRUE(given.take(group)) << setting.name;
      });
    });
    EXPECT_EQ(groups, 8U);
    cumulet_navigation_desc navigation{};
    navigation.struct_size = sizeof navigation;
    EXPECT_TRUE(given.take(navigation));
    EXPECT_FALSE(given.take(navigation));
  }
}

TEST(SavedPicture, PreviewIsNotSaved) {
  cumulet_frame_result shown{};
  EXPECT_FALSE(is_whole(shown, 0, 0)) << "there is none";
  shown.width = 640;
  shown.height = 480;
  EXPECT_TRUE(is_whole(shown, 640, 480));
  EXPECT_FALSE(is_whole(shown, 800, 480)) << "the window has grown";
  EXPECT_FALSE(is_whole(shown, 640, 481));
  shown.flags = CUMULET_RENDER_PREVIEW | CUMULET_RENDER_INCOMPLETE;
  EXPECT_FALSE(is_whole(shown, 640, 480));
  shown.flags = CUMULET_RENDER_INCOMPLETE;
  EXPECT_TRUE(is_whole(shown, 640, 480));
}

TEST(DemoModel, SceneTitleNamesItsContent) {
  SceneOptions scene;
  EXPECT_EQ(main_file(scene), "");
  scene.environment = "sky.hdr";
  EXPECT_EQ(main_file(scene), "sky.hdr");
  scene.models.push_back({"tree.glb"});
  EXPECT_EQ(main_file(scene), "tree.glb");
  scene.others.emplace_back().volume = "smoke.vdb";
  EXPECT_EQ(main_file(scene), "smoke.vdb");
  scene.surfaces = "town.glb";
  EXPECT_EQ(main_file(scene), "town.glb");
  scene.volume = "cloud.vdb";
  EXPECT_EQ(main_file(scene), "cloud.vdb");
  Model model;
  model.scene.surfaces = "/a/town.glb";
  EXPECT_TRUE(suggest_path(model, ".png").ends_with("town-001.png")) << suggest_path(model, ".png");
  // A file's name is not that of a sequence.
  model.scene.volume = "/a/fluid_data_####.vdb";
  EXPECT_TRUE(suggest_path(model, ".json").ends_with("/fluid_data-001.json") ||
              suggest_path(model, ".json") == "fluid_data-001.json")
      << suggest_path(model, ".json");
  model.scene.volume = "/a/####.vdb";
  EXPECT_TRUE(suggest_path(model, ".json").ends_with("cumulet-001.json")) << suggest_path(model, ".json");
}

TEST(DemoModel, TypingDoesNotTriggerShortcuts) {
  EXPECT_TRUE(command_of(GLFW_KEY_F, 0, false).has_value());
  EXPECT_FALSE(command_of(GLFW_KEY_F, 0, true).has_value());
  EXPECT_FALSE(command_of(GLFW_KEY_Z, modifier_ctrl, true).has_value());
  EXPECT_TRUE(command_of(GLFW_KEY_S, modifier_ctrl, true).has_value());
  EXPECT_TRUE(command_of(GLFW_KEY_F1, 0, true).has_value());
  EXPECT_FALSE(command_of(GLFW_KEY_F, modifier_ctrl, false).has_value());
}

TEST(WorkStatus, ShowsShaderCompilationWhenIdle) {
  Status status;
  status.compiled = 0.25;
  EXPECT_STREQ(work_of(status).name, "Compiling shaders");
  EXPECT_EQ(work_of(status).part, 0.25);
  EXPECT_FALSE(work_of(status).stops);
  status.work.stage = CUMULET_STAGE_REFINING;
  status.work.fraction = 0.5;
  EXPECT_STREQ(work_of(status).name, "Refining the grid");
  EXPECT_EQ(work_of(status).part, 0.5);
  EXPECT_TRUE(work_of(status).stops);
}

}  // namespace
