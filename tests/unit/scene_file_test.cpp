#include "scene_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <settings.hpp>
#include <stdexcept>
#include <string>

#include "support/folder.hpp"
#include "support/scene_texts.hpp"

namespace {

using namespace cumulet::demo;
using cumulet::test::error_of;
using cumulet::test::section_error;
using cumulet::test::with;

SceneOptions full_scene() {
  SceneOptions scene;
  scene.volume = "/data/cloud.vdb";
  scene.grid_name = "density[1]";
  scene.surfaces = "/models/a b.glb";
  scene.surface_variant = "by \"night\"";
  scene.surface.time = 1.25;
  scene.surface.animation = 3;
  scene.surface.lighting = CUMULET_SURFACE_LIGHTING_DIRECT;
  scene.surface.indirect_roughness = 0.3f;
  scene.surface.double_sided = 1;
  scene.surface_camera = 2;
  scene.width = 333;
  scene.height = 222;
  scene.camera.eye[0] = 0.1;
  scene.camera.eye[1] = -2e-7;
  scene.camera.eye[2] = 1e6;
  scene.camera.target[0] = 1.0 / 3.0;
  scene.camera.up[2] = 1.0;
  scene.camera.fovy_degrees = 33.3;
  scene.camera.orthographic_height = 12.5;
  scene.medium.density_scale = 0.1;
  scene.medium.coalbedo[0] = 0.01f;
  scene.medium.coalbedo[1] = 1e-9f;
  scene.medium.coalbedo[2] = 1.0f;
  scene.medium.anisotropy = -0.85f;
  scene.medium.max_bounces = 4294967295u;
  scene.ramps[CUMULET_RAMP_DENSITY] = {{-0.5f, 0.0f}, {0.1f, 1e30f}, {3.0f, 1.0f / 3.0f}};
  scene.ramps[CUMULET_RAMP_FLAME] = {{0.0f, 2.0f}, {1.0f, 0.0f}};
  scene.color_ramps[CUMULET_RAMP_DENSITY] = {{-0.5f, 0.0f, 1.0f / 3.0f, 1.0f}, {0.1f, 1.0f, 0.0f, 1e-9f}};
  scene.color_ramps[CUMULET_RAMP_TEMPERATURE] = {{0.0f, 0.0f, 0.0f, 0.0f}, {3.0f, 1e30f, 2.0f, 0.1f}};
  scene.clip.box = {-1.0, 0.1, -2e30 / 3.0, 1.0 / 3.0, 5.0, 1e30};
  scene.clip.planes = {{1.0, 0.5, -0.1, 1.0 / 3.0}, {0.0, 0.0, -1.0, 7.0}};
  for (int i = 0; i < 3; ++i) scene.medium.emission[i] = 3.3f * static_cast<float>(i);
  scene.light.sun_azimuth_degrees = -123.4f;
  scene.light.sun_elevation_degrees = -5.6f;
  for (int i = 0; i < 3; ++i) scene.light.sun_irradiance[i] = 0.7f * static_cast<float>(i);
  for (int i = 0; i < 3; ++i) scene.light.sky_radiance[i] = 1e-3f * static_cast<float>(i);
  for (const cumulet_light_kind kind : {CUMULET_LIGHT_RECT, CUMULET_LIGHT_DISTANT}) {
    cumulet_light_desc analytic_light{};
    analytic_light.struct_size = sizeof analytic_light;
    analytic_light.kind = kind;
    analytic_light.position[1] = 0.1;
    analytic_light.direction[2] = -1.0 / 3.0;
    analytic_light.tangent[0] = 2.5;
    analytic_light.color[2] = 0.3f;
    analytic_light.power = 123.4f;
    analytic_light.width = 1.5;
    analytic_light.angle_degrees = 33.0;
    analytic_light.blend = 0.25;
    scene.analytic_lights.push_back(analytic_light);
  }
  for (std::size_t i = 0; i < 16; ++i) scene.to_world[i] = 0.1 * static_cast<double>(i);
  scene.transforms.assign(2, scene.to_world);
  scene.transforms[1][12] = -7.5;
  scene.grid.type = CUMULET_GRID_BRICKS;
  scene.grid.cells = CUMULET_CELLS_CONSTANT;
  scene.grid.criterion = CUMULET_CRITERION_RANGE_MEAN;
  scene.grid.threshold = -1.0;
  scene.grid.max_cells = 123456789;
  scene.grid.camera_adaptive = 1;
  scene.grid.pixel_size = 2.5;
  scene.sampling.samples = 7;
  scene.sampling.seed = 4000000000u;
  scene.sampling.view = CUMULET_VIEW_WIREFRAME;
  scene.display.exposure_stops = -1.1f;
  scene.display.tone_map = CUMULET_TONE_MAP_CLIP;
  scene.display.background = CUMULET_BACKGROUND_TRANSPARENT;
  return scene;
}

TEST(SceneFile, RoundTripsEverything) {
  const SceneOptions scene = full_scene();
  const SceneOptions read = parse_scene(scene_text(scene, "/elsewhere/s.json"), "/elsewhere/s.json");
  EXPECT_TRUE(same_scene(scene, read));
  // same_scene compares the written text; these compare the values too.
  EXPECT_EQ(read.volume, scene.volume);
  EXPECT_EQ(read.grid_name, scene.grid_name);
  EXPECT_EQ(read.surfaces, scene.surfaces);
  EXPECT_EQ(read.surface_variant, scene.surface_variant);
  EXPECT_EQ(read.surface_camera, scene.surface_camera);
  EXPECT_EQ(read.width, scene.width);
  EXPECT_EQ(read.height, scene.height);
  using cumulet::settings::same;
  EXPECT_TRUE(same(read.surface, scene.surface));
  EXPECT_TRUE(same(read.camera, scene.camera));
  EXPECT_TRUE(same(read.medium, scene.medium));
  EXPECT_EQ(read.ramps, scene.ramps);
  EXPECT_EQ(read.color_ramps, scene.color_ramps);
  EXPECT_EQ(read.clip, scene.clip);
  EXPECT_TRUE(same(read.light, scene.light));
  EXPECT_TRUE(std::ranges::equal(read.analytic_lights, scene.analytic_lights, same<cumulet_light_desc>));
  EXPECT_EQ(read.to_world, scene.to_world);
  EXPECT_EQ(read.transforms, scene.transforms);
  EXPECT_TRUE(same(read.grid, scene.grid));
  EXPECT_TRUE(same(read.sampling, scene.sampling));
  EXPECT_TRUE(same(read.display, scene.display));
}

TEST(SceneFile, SupportsAnyNumberOfVolumes) {
  SceneOptions scene = full_scene();
  scene.name = "the large one";
  scene.visible = false;
  SceneVolume& smoke = scene.others.emplace_back();
  smoke.volume = "/data/smoke.vdb";
  smoke.grid_name = "soot";
  smoke.up = UpAxis::z;
  smoke.name = "smoke";
  smoke.medium.anisotropy = 0.3f;
  smoke.transforms.assign(3, scene.to_world);
  smoke.ramps[CUMULET_RAMP_DENSITY] = {{0.0f, 0.0f}, {1.0f, 2.0f}};
  smoke.color_ramps[CUMULET_RAMP_FLAME] = {{0.0f, 0.0f, 1.0f, 2.0f}, {1.0f, 2.0f, 1.0f, 0.0f}};
  smoke.clip.planes = {{0.0, 1.0, 0.0, -2.5}};
  SceneVolume& fire = scene.others.emplace_back();
  fire.volume = "/elsewhere/fire.vdb";
  fire.flame_grid = "none";
  fire.medium.density_scale = 2.5;
  fire.auto_density_scale = false;
  fire.visible = false;
  fire.to_world = scene.to_world;
  const std::string text = scene_text(scene, "/data/s.json");
  EXPECT_NE(text.find("\"smoke.vdb\""), std::string::npos) << text;
  const SceneOptions read = parse_scene(text, "/data/s.json");
  EXPECT_TRUE(same_scene(scene, read)) << text;
  EXPECT_EQ(read.name, "the large one");
  EXPECT_FALSE(read.visible);
  EXPECT_TRUE(cumulet::settings::same(read.medium, scene.medium)) << "the first one's is its own";
  ASSERT_EQ(read.others.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const SceneVolume& a = scene.others[i];
    const SceneVolume& b = read.others[i];
    EXPECT_EQ(static_cast<const VolumeFile&>(a), static_cast<const VolumeFile&>(b)) << i;
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.visible, b.visible);
    EXPECT_EQ(a.transforms, b.transforms);
    EXPECT_EQ(a.ramps, b.ramps);
    EXPECT_EQ(a.color_ramps, b.color_ramps);
    EXPECT_EQ(a.clip, b.clip);
    EXPECT_EQ(a.auto_density_scale, b.auto_density_scale);
    EXPECT_EQ(a.medium.density_scale, b.medium.density_scale);
    EXPECT_EQ(a.medium.anisotropy, b.medium.anisotropy);
  }
  const auto differs = [&](auto change) {
    SceneOptions other = scene;
    change(other);
    return !same_scene(scene, other) && scene_hash(scene) != scene_hash(other);
  };
  EXPECT_TRUE(differs([](SceneOptions& s) { s.others.pop_back(); }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.others[1].visible = true; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.others[0].volume = "/data/other.vdb"; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { std::swap(s.others[0], s.others[1]); }));
  SceneOptions renamed = scene;
  renamed.others[0].name = "soot";
  EXPECT_FALSE(same_scene(scene, renamed));
  EXPECT_EQ(scene_hash(scene), scene_hash(renamed)) << "shows the same";
  EXPECT_EQ(parse_scene(scene_text(scene, "s.json", SceneFormat::first), "s.json").others.size(), 0u);
}

TEST(SceneFile, NumbersAreWrittenAsOneWouldTypeThem) {
  SceneOptions scene;
  scene.medium.coalbedo[0] = 0.01f;
  scene.light.sky_radiance[0] = 0.1f;
  const std::string text = scene_text(scene, "s.json");
  EXPECT_NE(text.find("0.99,"), std::string::npos) << text;
  EXPECT_EQ(text.find("0.100000"), std::string::npos) << text;
}

TEST(SceneFile, EveryDifferenceIsDetected) {
  const SceneOptions scene = full_scene();
  const auto differs = [&](auto change) {
    SceneOptions other = scene;
    change(other);
    return !same_scene(scene, other);
  };
  EXPECT_TRUE(differs([](SceneOptions& s) { s.volume += "x"; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.camera.eye[1] *= 1.0000001; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.medium.coalbedo[1] *= 2.0f; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.light.sky_radiance[2] += 1e-6f; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.grid.threshold = 0.5; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.sampling.seed = 1; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.display.exposure_stops = 0.0f; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.surface.double_sided = 0; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.analytic_lights[1].power = 1.0f; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.analytic_lights.pop_back(); }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.to_world[3] = 5.0; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.transforms[1][3] = 5.0; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.transforms.pop_back(); }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.ramps[CUMULET_RAMP_DENSITY][1][0] = 0.2f; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.ramps[CUMULET_RAMP_FLAME].clear(); }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.color_ramps[CUMULET_RAMP_DENSITY][1][2] = 0.5f; }));
  EXPECT_TRUE(differs(
      [](SceneOptions& s) { std::swap(s.color_ramps[CUMULET_RAMP_FLAME], s.color_ramps[CUMULET_RAMP_TEMPERATURE]); }));
  EXPECT_TRUE(differs([](SceneOptions& s) { (*s.clip.box)[4] = 5.5; }));
  EXPECT_TRUE(differs([](SceneOptions& s) { s.clip.planes.pop_back(); }));
  EXPECT_TRUE(
      differs([](SceneOptions& s) { std::swap(s.ramps[CUMULET_RAMP_FLAME], s.ramps[CUMULET_RAMP_TEMPERATURE]); }));
  EXPECT_FALSE(differs([](SceneOptions&) {}));
}

TEST(SceneFile, DuplicateKeysAreRejected) {
  EXPECT_EQ(error_of(R"({"cumulet_scene": 1, "cumulet_scene": 1})"), "dir/s.json: cumulet_scene: is given twice");
  EXPECT_EQ(error_of(R"({"cumulet_scene": 1, "picture": {"width": 8, "height": 8, "width": 9}})"),
            "dir/s.json: picture.width: is given twice");
  EXPECT_EQ(error_of(R"({"cumulet_scene": 1, "light": {"sun": {"irradiance": [1, 1, 1], "irradiance": [2, 2, 2]}}})"),
            "dir/s.json: light.sun.irradiance: is given twice");
  // The same key in two objects is not a duplicate.
  EXPECT_EQ(error_of(R"({"cumulet_scene": 1, "volume": {"file": "a.vdb"}, "surfaces": {"file": "a.glb"}})"), "");
}

TEST(SceneFile, LongJsonErrorsAreCutBetweenCharacters) {
  std::string letters;
  for (int i = 0; i < 300; ++i) letters += "\u00e9";  // two bytes in UTF-8
  for (const char* const first : {"", "a"}) {
    const std::string line = error_of(std::string("{\"") + first + letters);
    EXPECT_TRUE(line.ends_with("\u00e9...")) << line;
  }
}

TEST(SceneFile, MissingKeysHaveDefaults) {
  const SceneOptions read = parse_scene(R"({"cumulet_scene": 1})", "s.json");
  SceneOptions day;
  day.set_daylight_of_version_1();
  day.auto_density_scale = false;  // the default 1 of version 1 files never changes
  EXPECT_TRUE(same_scene(read, day));
  EXPECT_EQ(read.grid.threshold, 0.0);
  EXPECT_EQ(read.grid.max_cells, 0u);
  EXPECT_EQ(read.camera.fovy_degrees, 0.0);
  const SceneOptions dark = parse_scene(with(R"("light": {})"), "s.json");
  EXPECT_EQ(dark.light.sky_radiance[2], 0.0f);
}

TEST(SceneFile, NamedCriterionKeepsItsOwnThreshold) {
  const SceneOptions deviation = parse_scene(with(R"("grid": {"criterion": "deviation"})"), "s.json");
  EXPECT_EQ(cumulet::settings::criterion_of(deviation.grid), CUMULET_CRITERION_DEVIATION);
  const SceneOptions zeros = parse_scene(with(R"("grid": {})"), "s.json");
  EXPECT_EQ(cumulet::settings::criterion_of(zeros.grid), CUMULET_CRITERION_TRANSMITTANCE);
  EXPECT_EQ(cumulet::settings::criterion_of(parse_scene(with(R"("grid": {"threshold": 0.02})"), "s.json").grid),
            CUMULET_CRITERION_DEVIATION);
}

TEST(SceneFile, DaylightLightsTheDefaultCamerasView) {
  SceneOptions day;
  day.set_daylight();
  // From the front, the side and above: the default camera looks from +Z and slightly above.
  EXPECT_GE(std::abs(day.light.sun_azimuth_degrees), 40.0f);
  EXPECT_LE(std::abs(day.light.sun_azimuth_degrees), 70.0f);
  EXPECT_GE(day.light.sun_elevation_degrees, 30.0f);
  EXPECT_LE(day.light.sun_elevation_degrees, 50.0f);
  // A matte white surface that faces the sun is about as bright as the screen; one in the shade has a tenth of that.
  const auto luminance = [](const float(&rgb)[3]) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; };
  const double lit = luminance(day.light.sun_irradiance) / std::numbers::pi;
  const double shade = luminance(day.light.sky_radiance);
  EXPECT_NEAR(lit + shade, 1.4, 0.2);
  EXPECT_GT(lit, 10.0 * shade);
}

TEST(SceneFile, TheDensityScaleIsSavedAsItWasFound) {
  SceneOptions scene;
  const auto again = [&] { return parse_scene(scene_text(scene, "s.json"), "s.json"); };
  EXPECT_TRUE(again().auto_density_scale) << "nothing loaded yet";
  scene.medium.density_scale = 12.5;
  EXPECT_FALSE(again().auto_density_scale);
  EXPECT_EQ(again().medium.density_scale, 12.5);
  scene.up = UpAxis::z;
  EXPECT_EQ(again().up, UpAxis::z);
  EXPECT_FALSE(same_scene(scene, SceneOptions()));
}

TEST(SceneFile, PathsAreRelativeToTheSceneFile) {
  EXPECT_EQ(parse_scene(with(R"("volume": {"file": "a/cloud.vdb"})"), "dir/s.json").volume, "dir/a/cloud.vdb");
  EXPECT_EQ(parse_scene(with(R"("volume": {"file": "/a/cloud.vdb"})"), "dir/s.json").volume, "/a/cloud.vdb");
  SceneOptions scene;
  scene.volume = "/p/a/cloud.vdb";
  EXPECT_NE(scene_text(scene, "/p/s.json").find("\"a/cloud.vdb\""), std::string::npos);
  EXPECT_NE(scene_text(scene, "/q/s.json").find("\"/p/a/cloud.vdb\""), std::string::npos);
  EXPECT_EQ(parse_scene(scene_text(scene, "/p/s.json"), "/p/s.json").volume, "/p/a/cloud.vdb");
  scene.volume = "/p/a//b/../cloud.vdb";
  EXPECT_NE(scene_text(scene, "/p/s.json").find("\"a/cloud.vdb\""), std::string::npos) << "in normal form";
}

TEST(SceneFile, ErrorsNameTheFileTheKeyAndTheCause) {
  struct Case {
    const char* section;
    const char* key;
  };
  for (const Case& c :
       {Case{R"("medium": {"density": 1})", "medium.density"},
        Case{R"("colour": {})", "colour"},
        Case{R"("medium": [])", "medium"},
        Case{R"("medium": {"density_scale": 0})", "medium.density_scale"},
        Case{R"("volume": {"up": "x"})", "volume.up"},
        Case{R"("medium": {"density_scale": "1"})", "medium.density_scale"},
        Case{R"("medium": {"density_scale": null})", "medium.density_scale"},
        Case{R"("medium": {"albedo": [1, 1]})", "medium.albedo"},
        Case{R"("medium": {"albedo": [1, 1, 1.01]})", "medium.albedo"},
        Case{R"("medium": {"albedo": [1, 1, "1"]})", "medium.albedo"},
        Case{R"("medium": {"anisotropy": 1})", "medium.anisotropy"},
        Case{R"("medium": {"anisotropy": 0.9999999999})", "medium.anisotropy"},
        Case{R"("medium": {"max_bounces": 1.5})", "medium.max_bounces"},
        Case{R"("medium": {"max_bounces": -1})", "medium.max_bounces"},
        Case{R"("medium": {"max_bounces": 4294967296})", "medium.max_bounces"},
        Case{R"("light": {"sun": {"elevation_degrees": 91}})", "light.sun.elevation_degrees"},
        Case{R"("light": {"sun": {"irradiance": [1, -1, 1]}})", "light.sun.irradiance"},
        Case{R"("light": {"sky": {"radiance": [1, 1e31, 1]}})", "light.sky.radiance"},
        Case{R"("camera": {"eye": [1, 2, 3]})", "camera.target"},
        Case{R"("camera": {"target": [1, 2, 3]})", "camera.eye"},
        Case{R"("camera": {"eye": [1, 2, 3], "target": [1, 2, 3]})", "camera.target"},
        Case{R"("camera": {"up": [0, 0, 0]})", "camera.up"},
        Case{R"("camera": {"fovy_degrees": 180})", "camera.fovy_degrees"},
        Case{R"("grid": {"march": "fast"})", "grid.march"},
        Case{R"("grid": {"march": 1})", "grid.march"},
        Case{R"("grid": {"threshold": -1})", "grid.threshold"},
        Case{R"("grid": {"max_cells": 0})", "grid.max_cells"},
        Case{R"("grid": {"camera_adaptive": 1})", "grid.camera_adaptive"},
        Case{R"("picture": {"width": 0})", "picture.width"},
        Case{R"("picture": {"height": 99999})", "picture.height"},
        Case{R"("display": {"exposure_stops": 65})", "display.exposure_stops"},
        Case{R"("display": {"tone_map": "aces"})", "display.tone_map"},
        Case{R"("medium": {"density_ramp": 3})", "medium.density_ramp: is not a list of points"},
        Case{R"("medium": {"flame_ramp": [[0, 1]]})", "medium.flame_ramp: has 1 point; it must have 0 or 2"},
        Case{R"("medium": {"flame_ramp": [[0, 1], [1]]})", "medium.flame_ramp: has a point that is not two numbers"},
        Case{R"("medium": {"density_ramp": [[0, 1], [1, "1"]]})", "medium.density_ramp: is not a number"},
        Case{R"("medium": {"density_ramp": [[0.1, 1], [0.10000000001, 1]]})",
             "medium.density_ramp: has a point 0.1:1 whose input is not above that of 0.1:1"},
        Case{R"("medium": {"temperature_ramp": [[1, 1], [0, 0]]})",
             "medium.temperature_ramp: has a point 0:0 whose input is not above that of 1:1"},
        Case{R"("medium": {"temperature_ramp": [[0, 1], [1, -1]]})",
             "medium.temperature_ramp: has a point 1:-1 whose output is not from 0 to 1e30"},
        Case{R"("medium": {"temperature_ramp": [[0, 1], [1e300, 1]]})",
             "medium.temperature_ramp: has a point inf:1 whose input is not from -1e30 to 1e30"},
        Case{R"("medium": {"density_color_ramp": {}})", "medium.density_color_ramp: is not a list of points"},
        Case{R"("medium": {"flame_color_ramp": [[0, 0, 0, 1], [1, 1]]})",
             "medium.flame_color_ramp: has a point that is not four numbers"},
        Case{R"("medium": {"flame_color_ramp": [[0, 0, 0, 1], [1, 1, "1", 1]]})",
             "medium.flame_color_ramp: is not a number"},
        Case{R"("medium": {"temperature_color_ramp": [[0, 0, 0, 1]]})",
             "medium.temperature_color_ramp: has 1 point; it must have 0 or 2"},
        Case{R"("medium": {"density_color_ramp": [[0, 0, 0, 1], [1, 1, 2, 1]]})",
             "medium.density_color_ramp: has a point 1:1/2/1 whose color is not from 0 to 1"},
        Case{R"("volume": {"file": 3})", "volume.file"},
        Case{R"("volume": {"file": "a\u0000b"})", "volume.file"}}) {
    const std::string error = error_of(with(c.section));
    EXPECT_EQ(error.rfind(std::string("dir/s.json: ") + c.key, 0), 0u) << c.section << " -> " << error;
  }
  for (const char* text : {"", "{", "[]", "1", "nonsense", R"({"cumulet_scene": 1,})", R"({"cumulet_scene": 0})", "{}",
                           R"({"cumulet_scene": "1"})", R"({"medium": {"density_scale": 1e999}})", "\xff\xfe"})
    EXPECT_EQ(error_of(text).rfind("dir/s.json: ", 0), 0u) << text;
  EXPECT_EQ(error_of(with(R"("col\nour": {})")).find('\n'), std::string::npos);
  // Extreme nesting gives an error, not a stack overflow.
  EXPECT_NE(error_of(std::string(500000, '[')), "");
}

TEST(SceneFile, VersionTwoMatchesVersionOne) {
  SceneOptions scene = full_scene();
  const std::string first = scene_text(scene, "s.json", SceneFormat::first);
  // Equal except for settings that version 1 does not have.
  EXPECT_FALSE(same_scene(parse_scene(first, "s.json"), scene));
  scene.analytic_lights.clear();
  scene.to_world = {};
  scene.transforms.clear();
  scene.clip = {};
  EXPECT_EQ(first.rfind("{\n  \"cumulet_scene\": 1,\n  \"volume\"", 0), 0u) << first;
  EXPECT_TRUE(same_scene(parse_scene(first, "s.json"), scene));
  const std::string second = scene_text(scene, "s.json", SceneFormat::second);
  EXPECT_EQ(second.rfind("{\n  \"cumulet_scene\": 2,\n  \"volumes\": [", 0), 0u) << second;
  EXPECT_TRUE(same_scene(parse_scene(second, "s.json"), scene));
}

TEST(SceneFile, VersionThreeMatchesVersionTwo) {
  // Every key and value that version 3 renamed.
  const SceneOptions second = parse_scene(R"({"cumulet_scene": 2,
      "volumes": [
        {"file": "a.vdb", "places": [{"translate": [1, 2, 3]}, {}],
         "medium": {"phase": "two-lobe", "second_share": 0.25}},
        {"file": "b.####.vdb", "places": [{"scale": [2, 2, 2]}], "medium": {"second_share": 0.75},
         "sequence": {"between": "blend"}}],
      "sequence": {"between": "advect"},
      "models": [{"file": "m.glb", "light": "shadows"}],
      "environment": {"sun": {"azimuth_degrees": 10, "irradiance": [1, 2, 3], "group": 2},
                      "sky": {"radiance": [0.1, 0.2, 0.3], "group": 1},
                      "file": "e.hdr", "rotation_degrees": 30, "strength": 2},
      "lights": [{"kind": "point", "power": 1}, {"kind": "spot", "power": 2}, {"kind": "disc", "power": 3},
                 {"kind": "rectangle", "across": [0, 0, 1], "power": 4}, {"kind": "sun", "power": 5}],
      "ground": {"place": "at-height", "height": -3},
      "grid": {"march": "brick", "build": "gpu"}})",
                                          "dir/s.json");
  const SceneOptions third = parse_scene(R"({"cumulet_scene": 3,
      "volumes": [
        {"file": "a.vdb", "transforms": [{"translate": [1, 2, 3]}, {}],
         "medium": {"phase": "two-lobe", "second_weight": 0.25}},
        {"file": "b.####.vdb", "transforms": [{"scale": [2, 2, 2]}], "medium": {"second_weight": 0.75},
         "sequence": {"interpolation": "blend"}}],
      "sequence": {"interpolation": "advect"},
      "models": [{"file": "m.glb", "lighting": "direct"}],
      "sun_sky": {"sun": {"azimuth_degrees": 10, "irradiance": [1, 2, 3], "group": 2},
                  "sky": {"radiance": [0.1, 0.2, 0.3], "group": 1}},
      "environment": {"file": "e.hdr", "rotation_degrees": 30, "strength": 2},
      "lights": [{"kind": "point", "power": 1}, {"kind": "spot", "power": 2}, {"kind": "disk", "power": 3},
                 {"kind": "rect", "tangent": [0, 0, 1], "power": 4}, {"kind": "distant", "power": 5}],
      "ground": {"mode": "at-height", "height": -3},
      "grid": {"type": "bricks", "build_device": "gpu"}})",
                                         "dir/s.json");
  EXPECT_TRUE(same_scene(second, third));
  EXPECT_EQ(scene_hash(second), scene_hash(third));
  EXPECT_EQ(third.transforms, second.transforms);
  ASSERT_EQ(third.transforms.size(), 2U);
  EXPECT_EQ(third.transforms[0][13], 2.0);
  EXPECT_EQ(third.others[0].transforms, second.others[0].transforms);
  EXPECT_EQ(third.medium.second_weight, 0.25F);
  EXPECT_EQ(third.others[0].medium.second_weight, 0.75F);
  EXPECT_EQ(third.sequence, second.sequence);
  EXPECT_EQ(third.sequence.playback.interpolation, CUMULET_FRAME_INTERPOLATION_ADVECT);
  EXPECT_EQ(third.others[0].sequence.playback.interpolation, CUMULET_FRAME_INTERPOLATION_BLEND);
  EXPECT_EQ(third.surface.lighting, CUMULET_SURFACE_LIGHTING_DIRECT);
  EXPECT_EQ(third.light.sun_irradiance[1], 2.0F);
  EXPECT_EQ(third.environment, "dir/e.hdr");
  using cumulet::settings::same;
  EXPECT_TRUE(same(second.light, third.light));
  EXPECT_TRUE(same(second.environment_settings, third.environment_settings));
  EXPECT_TRUE(std::ranges::equal(second.analytic_lights, third.analytic_lights, same<cumulet_light_desc>));
  ASSERT_EQ(third.analytic_lights.size(), 5U);
  EXPECT_EQ(third.analytic_lights[3].tangent[2], 1.0);
  EXPECT_EQ(third.analytic_lights[4].kind, CUMULET_LIGHT_DISTANT);
  EXPECT_EQ(third.ground.mode, CUMULET_GROUND_AT_HEIGHT);
  EXPECT_EQ(third.grid.type, CUMULET_GRID_BRICKS);
  EXPECT_EQ(third.grid.build_device, CUMULET_BUILD_GPU);
  // Each version is written with its own names, and read again.
  for (const SceneFormat format : {SceneFormat::second, SceneFormat::third}) {
    const std::string text = scene_text(third, "dir/s.json", format);
    EXPECT_TRUE(same_scene(parse_scene(text, "dir/s.json"), third)) << text;
  }
  const std::string text = scene_text(third, "dir/s.json");
  EXPECT_EQ(text.rfind("{\n  \"cumulet_scene\": 3,\n  \"volumes\": [", 0), 0U) << text;
  for (const char* old :
       {"places", "between", "second_share", "\"light\"", "across", "march", "\"build\"", "disc", "brick\""})
    EXPECT_EQ(text.find(old), std::string::npos) << old;
}

TEST(SceneFile, VersionThreeErrorsNameTheNewKey) {
  const auto third = [](const std::string& sections) { return error_of(R"({"cumulet_scene": 3, )" + sections + "}"); };
  struct Case {
    const char* section;
    const char* key;
    const char* now;
  };
  for (const Case& c :
       {Case{R"("light": {})", "light", "sun_sky"}, Case{R"("volume": {})", "volume", "volumes[0]"},
        Case{R"("medium": {})", "medium", "volumes[0].medium"}, Case{R"("surfaces": {})", "surfaces", "models[0]"},
        Case{R"("environment": {"sun": {}})", "environment.sun", "sun_sky.sun"},
        Case{R"("environment": {"sky": {}})", "environment.sky", "sun_sky.sky"},
        Case{R"("grid": {"march": "dense"})", "grid.march", "grid.type"},
        Case{R"("grid": {"build": "cpu"})", "grid.build", "grid.build_device"},
        Case{R"("ground": {"place": "none"})", "ground.place", "ground.mode"},
        Case{R"("sequence": {"between": "none"})", "sequence.between", "sequence.interpolation"},
        Case{R"("volumes": [{}, {"file": "b.vdb", "places": []}])", "volumes[1].places", "volumes[1].transforms"},
        Case{R"("volumes": [{"medium": {"second_share": 1}}])", "volumes[0].medium.second_share",
             "volumes[0].medium.second_weight"},
        Case{R"("volumes": [{}, {"file": "b.vdb", "sequence": {"between": "none"}}])", "volumes[1].sequence.between",
             "volumes[1].sequence.interpolation"},
        Case{R"("models": [{"file": "a.glb", "light": "none"}])", "models[0].light", "models[0].lighting"},
        Case{R"("lights": [{"kind": "point"}, {"kind": "rect", "across": [1, 0, 0]}])", "lights[1].across",
             "lights[1].tangent"}}) {
    EXPECT_EQ(third(c.section), std::string("dir/s.json: ") + c.key + ": there is no such setting: it is now " + c.now);
  }
  EXPECT_EQ(third(R"("grid": {"marsh": "dense"})"), "dir/s.json: grid.marsh: there is no such setting");
  EXPECT_EQ(third(R"("grid": {"type": "tet"})"), "dir/s.json: grid.type: 'tet' is now 'tetrahedral'");
  EXPECT_EQ(third(R"("grid": {"type": "fast"})"),
            "dir/s.json: grid.type: 'fast' is not one of tetrahedral, dense, bricks");
  EXPECT_EQ(third(R"("lights": [{"kind": "disc"}])"), "dir/s.json: lights[0].kind: 'disc' is now 'disk'");
  // Versions 1 and 2 keep their names.
  EXPECT_EQ(section_error(R"("grid": {"type": "dense"})"), "dir/s.json: grid.type: there is no such setting");
  EXPECT_EQ(section_error(R"("grid": {"march": "bricks"})"),
            "dir/s.json: grid.march: 'bricks' is not one of tet, dense, brick");
  EXPECT_EQ(section_error(R"("sun_sky": {})"), "dir/s.json: sun_sky: there is no such setting");
}

TEST(SceneFile, VersionTwoErrorsNameTheKeyPath) {
  const std::string start = "dir/s.json: ";
  EXPECT_EQ(section_error(R"("volumes": [{}, {}])"), start + "volumes[1].file: is missing");
  EXPECT_EQ(section_error(R"("volumes": [{}, {"file": ""}])"), start + "volumes[1].file: is empty");
  EXPECT_EQ(section_error(R"("volumes": [{}, {"file": "a.vdb"}, 7])"), start + "volumes[2] is not an object");
  EXPECT_EQ(section_error(R"("volumes": [{}, {"file": "a.vdb", "medium": {"albedo": 1}}])"),
            start + "volumes[1].medium.albedo: is not three numbers");
  EXPECT_EQ(section_error(R"("volumes": [{}, {"file": "a.vdb", "medium": {"x": 1}}])"),
            start + "volumes[1].medium.x: there is no such setting");
  EXPECT_EQ(section_error(R"("volumes": [{}, {"file": "a.vdb", "medium": {"max_bounces": 3}}])"),
            start + "volumes[1].medium.max_bounces: can only be set for the first volume and applies to all");
  EXPECT_EQ(section_error(R"("volumes": [{}, {"file": "a.vdb", "places": [7]}])"),
            start + "volumes[1].places[0]: is neither 16 numbers nor an object");
  EXPECT_EQ(section_error(R"("models": [{}, {}, {}])"), start + "models[1].file: is missing");
  EXPECT_EQ(section_error(R"("models": [{}, {"file": ""}])"), start + "models[1].file: is empty");
  EXPECT_EQ(section_error(R"("models": [{}, {"file": "a.glb", "light": "none"}])"),
            start + "models[1].light: there is no such setting");
  EXPECT_EQ(section_error(R"("models": [{"file": "a.glb", "translate": [1, 2]}])"),
            start + "models[0].translate: is not three numbers");
  EXPECT_EQ(section_error(R"("models": [{"file": "a.glb", "visible": false, "camera": 0}])"),
            start + "models[0].camera: is only supported for a model without transform and name");
  EXPECT_EQ(section_error(R"("models": [{"shadow_only": true}])"), start + "models[0].file: is missing");
  EXPECT_EQ(
      section_error(R"("models": [{}, {"file": "a.glb", "scale": [1, 0, 1]}])").rfind(start + "models[1].scale: ", 0),
      0U);
  EXPECT_EQ(section_error(R"("volumes": {})"), start + "volumes: is not a list");
  EXPECT_EQ(section_error(R"("volumes": [3])"), start + "volumes[0] is not an object");
  EXPECT_EQ(section_error(R"("volumes": [{"visible": 0}])"), start + "volumes[0].visible: is neither true nor false");
  EXPECT_EQ(section_error(R"("volumes": [{"medium": {"albedo": 1}}])"),
            start + "volumes[0].medium.albedo: is not three numbers");
  EXPECT_EQ(section_error(R"("volumes": [{"medium": {"density_ramp": [[1, 0], [0, 1]]}}])"),
            start + "volumes[0].medium.density_ramp: has a point 0:1 whose input is not above that of 1:0");
  EXPECT_EQ(section_error(R"("volumes": [{"medium": {"x": 1}}])"),
            start + "volumes[0].medium.x: there is no such setting");
  EXPECT_EQ(section_error(R"("volumes": [{"to_world": [1]}])"), start + "volumes[0].to_world: is not 16 numbers");
  EXPECT_EQ(section_error(R"("volumes": [{"clip": {"box": [0, 0, 0, 1, 1]}}])"),
            start + "volumes[0].clip.box: is not six numbers");
  EXPECT_EQ(section_error(R"("volumes": [{"clip": {"planes": [[1, 0, 0, 2], [0, 0, 0, 1]]}}])"),
            start + "volumes[0].clip.planes[1]: has no direction: its first three numbers are 0");
  EXPECT_EQ(section_error(R"("volumes": [{"clip": {"sphere": 1}}])"),
            start + "volumes[0].clip.sphere: there is no such setting");
  EXPECT_EQ(section_error(R"("volumes": [{"scale": [1, 0, 1]}])"), start + "volumes[0].scale: 0 is not above 0");
  EXPECT_EQ(section_error(R"("volumes": [{"to_world": [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1], "scale": [1, 1, 1]}])"),
            start + "volumes[0].to_world: cannot be combined with translate, rotate_degrees or scale");
  EXPECT_EQ(section_error(R"("volumes": [{"places": {}}])"), start + "volumes[0].places: is not a list");
  EXPECT_EQ(section_error(R"("volumes": [{"places": []}])"),
            start + "volumes[0].places: is empty: remove it for a single instance");
  EXPECT_EQ(section_error(R"("volumes": [{"places": [{}, [1]]}])"), start + "volumes[0].places[1]: is not 16 numbers");
  EXPECT_EQ(section_error(R"("volumes": [{"places": [7]}])"),
            start + "volumes[0].places[0]: is neither 16 numbers nor an object");
  EXPECT_EQ(section_error(R"("volumes": [{"places": [{"scale": [1, 0, 1]}]}])"),
            start + "volumes[0].places[0].scale: 0 is not above 0");
  EXPECT_EQ(section_error(R"("volumes": [{"places": [{"move": 1}]}])"),
            start + "volumes[0].places[0].move: there is no such setting");
  EXPECT_EQ(section_error(R"("volume": {})"), start + "volume: there is no such setting");
  EXPECT_EQ(section_error(R"("light": {})"), start + "light: there is no such setting");
  EXPECT_EQ(section_error(R"("models": [{"light": "x"}])").rfind(start + "models[0].light: ", 0), 0u);
  EXPECT_EQ(section_error(R"("environment": {"sun": {"irradiance": 1}})"),
            start + "environment.sun.irradiance: is not three numbers");
  EXPECT_EQ(section_error(R"("lights": 1)"), start + "lights: is not a list");
  EXPECT_EQ(section_error(R"("lights": [{}])"), start + "lights[0].kind: is missing");
  EXPECT_EQ(section_error(R"("lights": [{"kind": "point"}, 1])"), start + "lights[1] is not an object");
  EXPECT_EQ(section_error(R"("lights": [{"kind": "cube"}])"),
            start + "lights[0].kind: 'cube' is not one of point, spot, disc, rectangle, sun");
  EXPECT_EQ(section_error(R"("lights": [{"kind": "point", "watts": 1}])"),
            start + "lights[0].watts: there is no such setting");
  EXPECT_EQ(section_error(R"("lights": [{"kind": "point", "power": -1}])"),
            start + "lights[0].power: -1 is not from 0 to 1e30");
  EXPECT_EQ(section_error(R"("lights": [{"kind": "sun", "angle_degrees": 91}])"),
            start + "lights[0].angle_degrees: is above 90, the maximum for a distant light");
  EXPECT_EQ(section_error(R"("lights": [{"kind": "point", "position": [0, 1e31, 0]}])"),
            start + "lights[0].position: exceeds 1e30");
  EXPECT_EQ(section_error(R"("lights": [{"kind": "point", "color": [1e20, 1, 1], "power": 1e20}])"),
            start + "lights[0].power: times color exceeds 1e30");
  EXPECT_EQ(error_of(R"({"cumulet_scene": 4})"),
            start + "cumulet_scene: version 4 is not supported: this program reads 1 to 3");
  EXPECT_EQ(error_of(with(R"("lights": [])")), start + "lights: there is no such setting");
}

TEST(SceneFile, FilesAreWrittenAtomically) {
  const cumulet::test::Folder folder;
  const std::string path = (folder / "scene.json").string();
  save_scene(full_scene(), path);
  EXPECT_TRUE(same_scene(load_scene(path), full_scene()));
  EXPECT_THROW(static_cast<void>(load_scene("/nowhere/s.json")), std::runtime_error);
  EXPECT_THROW(save_scene(full_scene(), "/nowhere/s.json"), std::runtime_error);
  std::ofstream(path) << std::string(2 << 20, ' ');
  EXPECT_THROW(static_cast<void>(load_scene(path)), std::runtime_error);
}

}  // namespace
