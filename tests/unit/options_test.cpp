#include "options.hpp"
#include "time_limit.hpp"

#include <gtest/gtest.h>

#include <aov_table.hpp>
#include <clocale>
#include <cstdint>
#include <fstream>
#include <presets.hpp>
#include <settings.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "memory.hpp"
#include "support/folder.hpp"
#include "support/render_options.hpp"

namespace {

using namespace cumulet::demo;
using cumulet::test::Arguments;
using cumulet::test::expect_rgb;
using cumulet::test::parse;
using cumulet::test::usage_error;
using cumulet::test::with;

TEST(Options, DefaultsMatchTheLibrary) {
  const RenderOptions options = parse({});
  const SceneOptions& scene = options.scene;
  EXPECT_EQ(scene.volume, "cloud.vdb");
  EXPECT_EQ(scene.grid_name, "");
  EXPECT_EQ(scene.grid.struct_size, sizeof(cumulet_grid_desc));
  EXPECT_EQ(scene.medium.struct_size, sizeof(cumulet_medium_desc));
  EXPECT_EQ(scene.light.struct_size, sizeof(cumulet_sun_sky_desc));
  EXPECT_EQ(scene.camera.struct_size, sizeof(cumulet_camera_desc));
  EXPECT_EQ(scene.sampling.struct_size, sizeof(cumulet_sampling_desc));
  EXPECT_EQ(scene.display.struct_size, sizeof(cumulet_display_desc));
  EXPECT_EQ(scene.grid.type, CUMULET_GRID_TETRAHEDRAL);
  EXPECT_EQ(scene.grid.cells, CUMULET_CELLS_LINEAR);
  EXPECT_EQ(scene.grid.threshold, 0.0);
  EXPECT_EQ(scene.grid.max_cells, 0u);
  EXPECT_EQ(scene.medium.density_scale, 0.0);
  EXPECT_EQ(scene.camera.fovy_degrees, 0.0);
  EXPECT_EQ(scene.width, 1280u);
  EXPECT_EQ(scene.height, 720u);
  EXPECT_EQ(scene.sampling.samples, 64u);
  EXPECT_EQ(options.output, "out.png");
  EXPECT_EQ(options.format, OutputFormat::png);
  EXPECT_EQ(options.backend, BackendChoice::automatic);
  EXPECT_EQ(scene.display.exposure_stops, 0.0f);
  EXPECT_EQ(scene.display.tone_map, CUMULET_TONE_MAP_NEUTRAL);
  EXPECT_EQ(options.stats, "");
  EXPECT_EQ(options.trace, "");
}

TEST(Options, ParsesEveryFlag) {
  const RenderOptions options = parse({"--grid-name",
                                       "smoke",
                                       "--size",
                                       "320x200",
                                       "--spp",
                                       "7",
                                       "--seed",
                                       "4294967295",
                                       "--camera",
                                       "1,2,3 -4,5e-1,-6 35.5",
                                       "--grid-type",
                                       "bricks",
                                       "--cells",
                                       "constant",
                                       "--criterion",
                                       "range-mean",
                                       "--threshold",
                                       "0.25",
                                       "--max-cells",
                                       "50000000",
                                       "--camera-adaptive",
                                       "on",
                                       "--pixel-size",
                                       "1.5",
                                       "--density-scale",
                                       "2.5",
                                       "--albedo",
                                       "1,0.75,0",
                                       "--anisotropy",
                                       "-0.6",
                                       "--max-bounces",
                                       "3",
                                       "--emission",
                                       "9,3,0.5",
                                       "--sun",
                                       "-30,12.5 1,2,3",
                                       "--sky",
                                       ".1,.2,.3",
                                       "--view",
                                       "steps",
                                       "--backend",
                                       "osmesa",
                                       "--exposure",
                                       "-1.5",
                                       "--tone-map",
                                       "filmic",
                                       "--stats",
                                       "s.json"});
  const SceneOptions& scene = options.scene;
  EXPECT_EQ(scene.grid_name, "smoke");
  EXPECT_EQ(scene.width, 320u);
  EXPECT_EQ(scene.height, 200u);
  EXPECT_EQ(scene.sampling.samples, 7u);
  EXPECT_EQ(scene.sampling.seed, 4294967295u);
  EXPECT_EQ(scene.sampling.view, CUMULET_VIEW_STEPS);
  EXPECT_EQ(scene.camera.eye[2], 3.0);
  EXPECT_EQ(scene.camera.target[0], -4.0);
  EXPECT_EQ(scene.camera.target[1], 0.5);
  EXPECT_EQ(scene.camera.fovy_degrees, 35.5);
  EXPECT_EQ(scene.grid.type, CUMULET_GRID_BRICKS);
  EXPECT_EQ(scene.grid.cells, CUMULET_CELLS_CONSTANT);
  EXPECT_EQ(scene.grid.criterion, CUMULET_CRITERION_RANGE_MEAN);
  EXPECT_EQ(scene.grid.threshold, 0.25);
  EXPECT_EQ(scene.grid.max_cells, 50000000u);
  EXPECT_EQ(scene.grid.camera_adaptive, 1);
  EXPECT_EQ(scene.grid.pixel_size, 1.5);
  EXPECT_EQ(scene.medium.density_scale, 2.5);
  expect_rgb(scene.medium.coalbedo, 0.0f, 0.25f, 1.0f);
  EXPECT_FLOAT_EQ(scene.medium.anisotropy, -0.6f);
  EXPECT_EQ(scene.medium.max_bounces, 3u);
  expect_rgb(scene.medium.emission, 9.0f, 3.0f, 0.5f);
  EXPECT_FLOAT_EQ(scene.light.sun_azimuth_degrees, -30.0f);
  EXPECT_FLOAT_EQ(scene.light.sun_elevation_degrees, 12.5f);
  expect_rgb(scene.light.sun_irradiance, 1.0f, 2.0f, 3.0f);
  expect_rgb(scene.light.sky_radiance, 0.1f, 0.2f, 0.3f);
  EXPECT_EQ(options.backend, BackendChoice::osmesa);
  EXPECT_EQ(scene.display.exposure_stops, -1.5f);
  EXPECT_EQ(scene.display.tone_map, CUMULET_TONE_MAP_FILMIC);
  EXPECT_EQ(options.stats, "s.json");
}

TEST(Options, ExplicitLightReplacesTheDefaultLight) {
  const RenderOptions day = parse({});
  EXPECT_GT(day.scene.light.sun_irradiance[0], 0.0f);
  EXPECT_GT(day.scene.light.sky_radiance[2], 0.0f);
  const RenderOptions sky = parse({"--sky", "1,1,1"});
  expect_rgb(sky.scene.light.sun_irradiance, 0.0f, 0.0f, 0.0f);
  const RenderOptions sun = parse({"--sun", "0,90 1,1,1"});
  expect_rgb(sun.scene.light.sky_radiance, 0.0f, 0.0f, 0.0f);
  const RenderOptions night = parse({"--sky", "0,0,0"});
  expect_rgb(night.scene.light.sky_radiance, 0.0f, 0.0f, 0.0f);
}

// Models floated above the sky's gray, without a shadow.
TEST(Options, DefaultLightShinesOnAGround) {
  const auto ground = [](std::vector<std::string> more) { return parse(std::move(more)).scene.ground.mode; };
  EXPECT_EQ(ground({}), CUMULET_GROUND_BELOW);
  EXPECT_EQ(ground({"--gltf", "m.glb"}), CUMULET_GROUND_BELOW);
  EXPECT_EQ(ground({"--gltf", "m.glb", "--ground", "none"}), CUMULET_GROUND_NONE);
  EXPECT_EQ(ground({"--gltf", "m.glb", "--background", "transparent"}), CUMULET_GROUND_NONE);
  EXPECT_EQ(ground({"--gltf", "m.glb", "--background-color", "0,0,0"}), CUMULET_GROUND_NONE);
  EXPECT_EQ(ground({"--gltf", "m.glb", "--sky", "1,1,1"}), CUMULET_GROUND_NONE);
}

TEST(Options, EnvironmentsShowShadowsOnTheirGround) {
  const auto ground = [](std::vector<std::string> more) { return parse(std::move(more)).scene.ground.mode; };
  EXPECT_EQ(ground({"--env", "a.hdr"}), CUMULET_GROUND_SHADOW_CATCHER_BELOW);
  EXPECT_EQ(ground({"--env", "a.hdr", "--ground-height", "2"}), CUMULET_GROUND_SHADOW_CATCHER_AT_HEIGHT);
  EXPECT_EQ(ground({"--env", "a.hdr", "--ground", "none"}), CUMULET_GROUND_NONE);
  EXPECT_EQ(ground({"--env", "a.hdr", "--ground", "at-height", "--ground-height", "2"}), CUMULET_GROUND_AT_HEIGHT);
  EXPECT_EQ(ground({"--env", "a.hdr", "--background", "transparent"}), CUMULET_GROUND_NONE);
  EXPECT_EQ(ground({"--ground-height", "2"}), CUMULET_GROUND_AT_HEIGHT);
  EXPECT_THROW(static_cast<void>(ground({"--env", "a.hdr", "--ground", "shadow-catcher", "--ground-height", "2"})),
               UsageError);
}

TEST(Options, SkyModelReplacesOnlyTheSun) {
  const RenderOptions clear = parse({"--sky-model", "2.5,.25", "--sun", "120,20"});
  EXPECT_EQ(clear.scene.light.sky, CUMULET_SKY_PHYSICAL);
  EXPECT_EQ(clear.scene.light.turbidity, 2.5f);
  EXPECT_EQ(clear.scene.light.ground_albedo, 0.25f);
  EXPECT_EQ(clear.scene.light.sun_azimuth_degrees, 120.0f);
  EXPECT_EQ(clear.scene.light.sun_elevation_degrees, 20.0f);
  // Without a position, the sun has the default time of day.
  const RenderOptions day = parse({"--sky-model", "3,0"});
  EXPECT_EQ(day.scene.light.sky, CUMULET_SKY_PHYSICAL);
  EXPECT_EQ(day.scene.light.sun_elevation_degrees, parse({}).scene.light.sun_elevation_degrees);
  EXPECT_EQ(parse({"--sky", "1,1,1"}).scene.light.sky, CUMULET_SKY_CONSTANT);
  EXPECT_EQ(parse({"--sun", "0,90 1,1,1"}).scene.light.sky, CUMULET_SKY_CONSTANT);
  EXPECT_EQ(parse({"--env", "a.hdr"}).scene.light.sky, CUMULET_SKY_CONSTANT);
}

TEST(Options, DefaultLightIsAClearDay) {
  const RenderOptions day = parse({});
  EXPECT_EQ(day.scene.light.sky, CUMULET_SKY_PHYSICAL);
  EXPECT_GT(day.scene.light.turbidity, 0.0f);
  const RenderOptions soft = parse({"--sun-angle", "5"});
  EXPECT_EQ(soft.scene.light.sky, CUMULET_SKY_PHYSICAL);
  EXPECT_EQ(soft.scene.light.sun_angle_degrees, 5.0f);
}

TEST(Options, FlagsOverrideAMediumPreset) {
  // Independent of the order on the command line.
  const RenderOptions preset = parse({"--flame-strength", "7", "--density-scale", "3", "--preset", "explosion"});
  const cumulet_medium_desc& medium = preset.scene.medium;
  EXPECT_EQ(medium.blackbody, 12.0F);
  EXPECT_EQ(medium.flame_strength, 7.0F);
  EXPECT_EQ(medium.density_scale, 3.0);
  EXPECT_EQ(medium.struct_size, sizeof medium);
  EXPECT_FALSE(preset_of(medium)) << "another flame";
  for (const cumulet::settings::Choice& choice : preset_choices) {
    const RenderOptions plain = parse({"--preset", choice.name});
    EXPECT_TRUE(plain.scene.auto_density_scale);
    EXPECT_EQ(preset_of(plain.scene.medium), static_cast<Preset>(choice.value)) << choice.name;
    const SceneOptions again = parse_scene(scene_text(plain.scene, "a.json"), "a.json");
    EXPECT_EQ(preset_of(again.medium), static_cast<Preset>(choice.value)) << "a scene file can say it";
  }
  EXPECT_FALSE(preset_of(SceneOptions().medium));

  // For a burning volume: the fire's brightness relative to its smoke depends neither on the density scale nor on the
  // units of the simulation.
  const auto burns = [](double scale, double flame, double temperature) {
    cumulet_medium_desc made = SceneOptions().medium;
    made.density_scale = scale;
    made.temperature_scale = 1500.0F;
    apply({.flame = flame, .temperature = temperature, .size = 10.0}, made);
    return made;
  };
  EXPECT_FLOAT_EQ(burns(9.0, 1.0, 1.2).flame_strength, 9.0F);
  EXPECT_FLOAT_EQ(burns(18.0, 2.0, 1.2).flame_strength, 9.0F);
  EXPECT_NEAR(burns(9.0, 1.0, 1.21).blackbody, 12.0F, 0.2F) << "the preset's own, on the sample";
  EXPECT_NEAR(burns(9.0, 1.0, 2.42).blackbody, 12.0F / 16.0F, 0.02F);
  EXPECT_EQ(burns(9.0, 1.0, 0.0).blackbody, 0.0F);
  EXPECT_EQ(burns(0.0, 2.0, 0.0).flame_strength, 0.8F) << "alone: by its size";
  EXPECT_EQ(burns(0.0, 2.0, 0.0).density_scale, 0.0);
  EXPECT_EQ(usage_error(with({"--preset", "steam"})),
            "--preset: 'steam' is not one of cumulus, smoke, fire, explosion, ground-fog");
}

TEST(Options, RampIsAListOfPoints) {
  using Points = cumulet::settings::RampPoints;
  const SceneOptions scene =
      parse({"--density-ramp", "0:0,.25:1e-1,3:2.5", "--temperature-ramp", "-1:0,1:2", "--flame-ramp", "none"}).scene;
  EXPECT_EQ(scene.ramps[CUMULET_RAMP_DENSITY], (Points{{0.0f, 0.0f}, {0.25f, 0.1f}, {3.0f, 2.5f}}));
  EXPECT_EQ(scene.ramps[CUMULET_RAMP_TEMPERATURE], (Points{{-1.0f, 0.0f}, {1.0f, 2.0f}}));
  EXPECT_TRUE(scene.ramps[CUMULET_RAMP_FLAME].empty());
  EXPECT_NE(usage_error(with({"--flame-ramp", "0:0,1"})).find("'1' is not a pair INPUT:OUTPUT"), std::string::npos);
  EXPECT_NE(usage_error(with({"--flame-ramp", "1:0,0:1"})).find("has a point 0:1 whose input is not above that of 1:0"),
            std::string::npos);
}

// Colors are sRGB as "#rrggbb", or three linear numbers, which may be above 1 for emission.
TEST(Options, ColorRampIsAListOfColors) {
  using Stops = cumulet::settings::ColorStops;
  const SceneOptions scene = parse({"--density-color-ramp", "0:#000000,0.5:1/0.5/.25,2:#FFffff",
                                    "--temperature-color-ramp", "-1:0/0/0,1:20/4/1e-1", "--flame-color-ramp", "none"})
                                 .scene;
  EXPECT_EQ(scene.color_ramps[CUMULET_RAMP_DENSITY],
            (Stops{{0.0f, 0.0f, 0.0f, 0.0f}, {0.5f, 1.0f, 0.5f, 0.25f}, {2.0f, 1.0f, 1.0f, 1.0f}}));
  EXPECT_EQ(scene.color_ramps[CUMULET_RAMP_TEMPERATURE], (Stops{{-1.0f, 0.0f, 0.0f, 0.0f}, {1.0f, 20.0f, 4.0f, 0.1f}}));
  EXPECT_TRUE(scene.color_ramps[CUMULET_RAMP_FLAME].empty());
  const SceneOptions gray = parse({"--flame-color-ramp", "0:#bc8000,1:#000000"}).scene;
  EXPECT_NEAR(gray.color_ramps[CUMULET_RAMP_FLAME][0][1], 0.5f, 3e-3f) << "sRGB 188 is half the light";
  EXPECT_NEAR(gray.color_ramps[CUMULET_RAMP_FLAME][0][2], 0.2159f, 1e-3f);
  for (const auto& [flag, text] : {std::pair{"--density-color-ramp", ""},
                                   {"--density-color-ramp", "0:#ff8000"},
                                   {"--density-color-ramp", "0:#ff8000,1:#ff80"},
                                   {"--density-color-ramp", "0:#ff8000,1:#ff80xx"},
                                   {"--density-color-ramp", "0:#ff8000,1:1/0.5"},
                                   {"--flame-color-ramp", "0:#ff8000,0:#ff8000"},
                                   {"--temperature-color-ramp", "0:#000000,1:1/-1/0"}}) {
    const std::string error = usage_error(with({flag, text}));
    EXPECT_EQ(error.rfind(std::string(flag) + ": ", 0), 0u) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
  EXPECT_NE(usage_error(with({"--flame-color-ramp", "0:#000000,1"})).find("'1' is not a pair INPUT:COLOR"),
            std::string::npos);
  EXPECT_NE(usage_error(with({"--flame-color-ramp", "0:#000000,1:red"})).find("'red' is not a color"),
            std::string::npos);
  EXPECT_NE(usage_error(with({"--density-color-ramp", "0:#000000,1:0/2/0"}))
                .find("has a point 1:0/2/0 whose color is not from 0 to 1"),
            std::string::npos);
}

TEST(Options, ClipIsABoxAndPlanes) {
  const auto clip = parse({"--clip-box", "-1,-2,.5,3,4,1e3", "--clip-planes", "0,1,0,-2.5  -1,0,1,0"}).scene.clip;
  EXPECT_EQ(clip.box, (cumulet::settings::ClipBox{-1.0, -2.0, 0.5, 3.0, 4.0, 1e3}));
  EXPECT_EQ(clip.planes, (std::vector<cumulet::settings::ClipPlane>{{0.0, 1.0, 0.0, -2.5}, {-1.0, 0.0, 1.0, 0.0}}));
  EXPECT_TRUE(parse({"--clip-box", "none", "--clip-planes", "none"}).scene.clip.empty());
  EXPECT_EQ(usage_error(with({"--clip-box", "0,0,1,1,1,1"})),
            "--clip-box: the box is empty: each number of its lowest corner must be below that of its highest corner");
  EXPECT_EQ(usage_error(with({"--clip-planes", "1,0,0,1 0,0,0,1"})),
            "--clip-planes: plane '0,0,0,1' has no direction: its first three numbers are 0");
  for (const char* box : {"", "0,0,0,1,1", "0,0,0,1,1,nan", "0,0,0,1e31,1,1"})
    EXPECT_TRUE(usage_error(with({"--clip-box", box})).starts_with("--clip-box: ")) << box;
  for (const char* planes : {"", "1,0,0", "1,0,0,1,1,0,0,2", "1,0,0,1e31"})
    EXPECT_TRUE(usage_error(with({"--clip-planes", planes})).starts_with("--clip-planes: ")) << planes;
  EXPECT_NE(usage_error(with({"--clip-planes", "1,0,0,1 1,0,0,1 1,0,0,1 1,0,0,1 1,0,0,1 1,0,0,1 1,0,0,1"}))
                .find("has 7 planes; it must have at most 6"),
            std::string::npos);
}

TEST(Options, ViewNames) {
  EXPECT_EQ(parse({"--view", "wireframe"}).scene.sampling.view, CUMULET_VIEW_WIREFRAME);
  EXPECT_EQ(parse({"--view", "cells"}).scene.sampling.view, CUMULET_VIEW_CELLS);
  EXPECT_EQ(parse({"--view", "density"}).scene.sampling.view, CUMULET_VIEW_DENSITY);
}

TEST(Options, SurfacesNeedNoVolume) {
  std::ostringstream out;
  const auto options = parse_render_options(
      {"--gltf", "a.glb", "--gltf-time", "1.5", "--gltf-animation", "2", "--gltf-camera", "1", "--gltf-variant",
       "by night", "--surface-lighting", "direct", "--indirect-roughness", "0.25", "-o", "a.png"},
      out);
  ASSERT_TRUE(options.has_value());
  EXPECT_EQ(options->scene.surfaces, "a.glb");
  EXPECT_EQ(options->scene.volume, "");
  EXPECT_EQ(options->scene.surface.time, 1.5);
  EXPECT_EQ(options->scene.surface.animation, 2U);
  EXPECT_EQ(options->scene.surface_variant, "by night");
  EXPECT_EQ(options->scene.surface_camera, 1);
  EXPECT_EQ(options->scene.surface.lighting, CUMULET_SURFACE_LIGHTING_DIRECT);
  EXPECT_EQ(options->scene.surface.indirect_roughness, 0.25F);
  EXPECT_EQ(options->scene.surface.double_sided, 0);
  EXPECT_EQ(parse({"--gltf", "a.glb", "--double-sided"}).scene.surface.double_sided, 1);
  EXPECT_EQ(parse({"--gltf", "a.glb", "--double-sided=off"}).scene.surface.double_sided, 0);
  EXPECT_NE(usage_error(with({"--surface-lighting", "some"})).find("direct"), std::string::npos);
  for (const char* bad : {"-0.1", "1.1", "nan", "x"}) EXPECT_NE(usage_error(with({"--indirect-roughness", bad})), "");
}

TEST(Options, ModelFlagsNeedAModel) {
  for (const char* flag : {"--gltf-time", "--gltf-animation", "--gltf-variant", "--gltf-camera"}) {
    EXPECT_EQ(usage_error(with({flag, "1"})),
              std::string(flag) + " needs a model: --gltf, or a --scene that names one");
    EXPECT_EQ(usage_error(with({flag, "1", "--gltf", "a.glb"})), "");
  }
}

TEST(Options, AThumbnailHasItsOwnDefaults) {
  const RenderOptions options = parse({"--thumbnail", "128", "-o", "/tmp/.thumbnail.X7a"});
  EXPECT_EQ(options.scene.width, 128U);
  EXPECT_EQ(options.scene.height, 128U);
  EXPECT_EQ(options.format, OutputFormat::png);
  EXPECT_EQ(options.denoise, Denoise::fast);
  EXPECT_EQ(options.scene.sampling.samples, 16U);
  ASSERT_TRUE(options.time_limit);
  EXPECT_LT(*options.time_limit, 3.0);
  ASSERT_TRUE(options.whole_seconds);
  EXPECT_LT(*options.whole_seconds, 3.0);
  EXPECT_FALSE(parse({"--thumbnail", "128", "--time-limit", "9"}).whole_seconds);
  EXPECT_NE(options.scene.grid.max_cells, 0U);
  const RenderOptions mine = parse({"--thumbnail", "64", "--spp", "3", "--denoise", "off", "--shader-cache", "here"});
  EXPECT_EQ(mine.scene.sampling.samples, 3U);
  EXPECT_EQ(mine.denoise, Denoise::off);
  EXPECT_EQ(mine.shader_cache, "here");
  EXPECT_EQ(usage_error(with({"--thumbnail", "64", "--size", "8x8"})), "--thumbnail cannot be combined with --size");
  EXPECT_NE(usage_error(with({"--thumbnail", "8"})), "");
  EXPECT_EQ(usage_error(with({"-o", "/tmp/.thumbnail.X7a"})),
            "--output: '/tmp/.thumbnail.X7a' does not end in .png, .exr or .pfm");
}

// The denoiser takes two feature rays per sample, about 0.7 of the time of the samples.
TEST(Options, ThumbnailsTakeTheTimeThatLoadingLeaves) {
  using cumulet::demo::sampling_seconds;
  EXPECT_NEAR(0.9 + 1.7 * sampling_seconds(2.6, 0.9), 2.6, 1e-9);
  EXPECT_LT(sampling_seconds(2.6, 0.9), sampling_seconds(2.6, 0.5));
  EXPECT_DOUBLE_EQ(sampling_seconds(2.6, 0.0), 1.5);   // enough for a picture of this size
  EXPECT_DOUBLE_EQ(sampling_seconds(2.6, 30.0), 0.9);  // a large file is not shown as noise
}

TEST(Options, ALutIsForPngs) {
  const RenderOptions options = parse({"--lut", "look.cube"});
  EXPECT_EQ(options.lut, "look.cube");
  EXPECT_EQ(options.lut_shaper, CUMULET_LUT_SHAPER_SRGB);
  EXPECT_EQ(parse({"--lut", "look.cube", "--lut-input", "log2"}).lut_shaper, CUMULET_LUT_SHAPER_LOG2);
  EXPECT_EQ(usage_error(with({"--lut", "look.cube", "-o", "a.exr"})), "--lut needs a .png output");
  EXPECT_EQ(usage_error(with({"--lut-input", "linear"})), "--lut-input needs --lut");
}

TEST(Options, AnOcioViewIsForPngs) {
  const RenderOptions options = parse({"--ocio", "a.ocio", "--ocio-display", "sRGB", "--ocio-view", "Film"});
  EXPECT_EQ(options.scene.ocio, (OcioView{.config = "a.ocio", .display = "sRGB", .view = "Film"}));
  EXPECT_EQ(parse({"--ocio", "a.ocio", "--ocio-input", "lin"}).scene.ocio.input, "lin");
  EXPECT_EQ(usage_error(with({"--ocio", "a.ocio", "-o", "a.exr"})), "--ocio needs a .png output");
  EXPECT_EQ(usage_error(with({"--ocio", "a.ocio", "--lut", "a.cube"})), "--ocio and --lut exclude each other");
  EXPECT_EQ(usage_error(with({"--ocio-view", "Film"})), "--ocio-view needs --ocio");
  EXPECT_EQ(usage_error(with({"--ocio", ""})), "--ocio: the file's name is empty");
}

TEST(Options, PartialImageNeedsASampleRangeAndExr) {
  const RenderOptions part = parse({"-o", "a.exr", "--spp", "32", "--first-sample", "96"});
  EXPECT_EQ(part.scene.sampling.first_sample, 96u);
  EXPECT_EQ(part.scene.sampling.samples, 32u);
  EXPECT_EQ(parse({"-o", "a.exr"}).scene.sampling.first_sample, 0u);
  const auto refused = [](Arguments more) {
    more.insert(more.end(), {"--first-sample", "0"});
    return usage_error(with(more));
  };
  EXPECT_EQ(refused({"-o", "a.png"}), "--first-sample needs an .exr output");
  EXPECT_EQ(refused({"-o", "a.exr"}), "");
  for (const Arguments& more :
       {Arguments{"--view", "cells"}, {"--denoise", "fast"}, {"--noise-target", "2"}, {"--time-limit", "2"}})
    EXPECT_NE(refused({"-o", "a.exr", more[0], more[1]}), "") << more[0];
  EXPECT_EQ(usage_error(with({"-o", "a.exr", "--spp", "6", "--first-sample", "4294967290"})), "");
  EXPECT_NE(usage_error(with({"-o", "a.exr", "--spp", "7", "--first-sample", "4294967290"})), "");
  EXPECT_NE(usage_error(with({"-o", "a.exr", "--first-sample", "-1"})), "");
}

TEST(Options, ParsesSequenceFrames) {
  const RenderOptions options = parse({"--frames", "1-5x2", "--overwrite"});
  EXPECT_EQ(options.frames, (std::vector<Moment>{1, 3, 5}));
  EXPECT_TRUE(options.overwrite);
  EXPECT_EQ(parse({"--frames=-2-2"}).frames, (std::vector<Moment>{-2, -1, 0, 1, 2}));
  EXPECT_EQ(parse({"--frames", "-2--1"}).frames, (std::vector<Moment>{-2, -1}));
  EXPECT_EQ(parse({"--frames", "-4-4x2"}).frames, (std::vector<Moment>{-4, -2, 0, 2, 4}));
  EXPECT_EQ(parse({"--frames", "-3"}).frames, (std::vector<Moment>{-3}));
  EXPECT_EQ(parse({"--frames", "1-2x0.5"}).frames, (std::vector<Moment>{1, {1, 500}, 2}));
  EXPECT_EQ(parse({"--frame-interpolation", "blend"}).scene.sequence.playback.interpolation,
            CUMULET_FRAME_INTERPOLATION_BLEND);
  EXPECT_EQ(parse({"--velocity-scale", "24"}).scene.sequence.playback.velocity_scale, 24.0);
  EXPECT_TRUE(parse({}).frames.empty());
  EXPECT_EQ(usage_error(with({"--frames", "9-1"})), "--frames: '9-1' is a descending range");
}

TEST(Options, HelpListsFileFormats) {
  std::ostringstream out;
  EXPECT_FALSE(parse_render_options({"--help"}, out).has_value());
  EXPECT_NE(out.str().find("OpenVDB or NanoVDB file (.vdb, .nvdb)"), std::string::npos) << out.str();
}

TEST(Options, NoiseAndTimeLimitsRaiseTheDefaultSampleLimit) {
  EXPECT_EQ(parse({"--noise-target", "2.5"}).scene.sampling.noise_target_percent, 2.5F);
  EXPECT_EQ(parse({"--noise-target", "2.5"}).scene.sampling.samples, 65536U);
  EXPECT_EQ(parse({"--time-limit", "0.5"}).time_limit, 0.5);
  EXPECT_EQ(parse({}).gpu_memory, 0U);
  EXPECT_EQ(parse({"--gpu-memory", "8192"}).gpu_memory, std::uint64_t{8} << 30U);
  EXPECT_EQ(parse({"--time-limit", "0.5"}).scene.sampling.samples, 65536U);
  EXPECT_EQ(parse({"--noise-target", "2.5", "--time-limit", "9", "--spp", "100"}).scene.sampling.samples, 100U);
  EXPECT_EQ(parse({"--noise-target", "0"}).scene.sampling.samples, 64U) << "which asks for nothing";
  EXPECT_EQ(parse({}).scene.sampling.samples, 64U);
  EXPECT_FALSE(parse({}).time_limit.has_value());
}

TEST(PictureMemory, InsufficientMemoryIsReportedBeforeRendering) {
  RenderOptions options = parse({"--size", "16384x16384"});
  constexpr std::uint64_t gib = std::uint64_t{1} << 30U;
  const auto warning_for = [&](std::string_view renderer, std::optional<std::uint64_t> available) -> std::string {
    try {
      check_memory(options, renderer, available);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  // Memory of a software driver is main memory.
  EXPECT_EQ(warning_for("llvmpipe (LLVM 15.0.6, 256 bits)", 15 * gib),
            "an image of 16384x16384 needs 8.0 GiB of GPU memory and 11.0 GiB of main memory: 15.0 GiB of main "
            "memory are available, and this software driver uses main memory");
  EXPECT_EQ(warning_for("NVIDIA H100", 15 * gib), "");
  EXPECT_NE(warning_for("NVIDIA H100", 10 * gib), "");
  EXPECT_EQ(warning_for("llvmpipe", 64 * gib), "");
  EXPECT_EQ(warning_for("llvmpipe", std::nullopt), "");
  options.format = OutputFormat::exr;
  options.aovs = {CUMULET_AOV_NORMAL};
  EXPECT_GT(picture_memory(options).main, 20 * gib);
  options = parse({});
  EXPECT_LT(picture_memory(options).main + picture_memory(options).gl, gib / 8);
  EXPECT_EQ(warning_for("llvmpipe", gib), "");
  EXPECT_GT(available_memory().value_or(gib), 0U);
}

TEST(Options, AovsAreAListOrAll) {
  const auto aovs_of = [](const char* text) {
    std::ostringstream out;
    return parse_render_options({"--volume", "a.vdb", "-o", "a.exr", "--aovs", text}, out)->aovs;
  };
  EXPECT_TRUE(parse({}).aovs.empty());
  EXPECT_EQ(aovs_of("depth,normal,depth"), (std::vector<cumulet_aov>{CUMULET_AOV_SURFACE_DEPTH, CUMULET_AOV_NORMAL}));
  EXPECT_EQ(aovs_of("albedo,all").size(), cumulet::settings::named_aovs.size());
  EXPECT_EQ(aovs_of("error"), std::vector<cumulet_aov>{CUMULET_AOV_ERROR});
  EXPECT_EQ(aovs_of("velocity"), std::vector<cumulet_aov>{CUMULET_AOV_VELOCITY});
  const auto has_mattes = [](const char* text) {
    std::ostringstream out;
    return parse_render_options({"--volume", "a.vdb", "-o", "a.exr", "--aovs", text}, out)->cryptomatte;
  };
  EXPECT_TRUE(aovs_of("cryptomatte").empty());
  EXPECT_TRUE(has_mattes("cryptomatte"));
  EXPECT_TRUE(has_mattes("depth,cryptomatte,normal"));
  EXPECT_TRUE(has_mattes("all"));
  EXPECT_FALSE(has_mattes("depth"));
  EXPECT_FALSE(parse({}).cryptomatte);
}

TEST(Options, NamedCriterionKeepsItsOwnThreshold) {
  const auto criterion_of = [](const std::vector<std::string>& arguments) {
    return cumulet::settings::criterion_of(parse(arguments).scene.grid);
  };
  EXPECT_EQ(criterion_of({}), CUMULET_CRITERION_TRANSMITTANCE);
  EXPECT_EQ(criterion_of({"--criterion", "deviation"}), CUMULET_CRITERION_DEVIATION);
  EXPECT_EQ(criterion_of({"--criterion", "transmittance"}), CUMULET_CRITERION_TRANSMITTANCE);
  EXPECT_EQ(criterion_of({"--criterion", "transmittance", "--threshold", "0.1"}), CUMULET_CRITERION_TRANSMITTANCE);
  EXPECT_EQ(criterion_of({"--threshold", "0.1"}), CUMULET_CRITERION_DEVIATION);  // unchanged behavior
  EXPECT_EQ(parse({"--criterion", "deviation"}).scene.grid.threshold, 0.02);
}

TEST(Options, ThresholdZeroRefinesToVoxels) { EXPECT_LT(parse({"--threshold", "0"}).scene.grid.threshold, 0.0); }

TEST(Options, NegativeValuesAreNotFlags) {
  EXPECT_FLOAT_EQ(parse({"--anisotropy", "-.5"}).scene.medium.anisotropy, -0.5f);
  EXPECT_FLOAT_EQ(parse({"--anisotropy=-.5"}).scene.medium.anisotropy, -0.5f);
  EXPECT_EQ(parse({"--camera", "-.5,0,0 1,1,1 40"}).scene.camera.eye[0], -0.5);
  EXPECT_EQ(parse({"--camera", "-5,0,0 1,1,1 40"}).scene.camera.eye[0], -5.0);
}

TEST(Options, OutputFormatFollowsTheSuffix) {
  const auto format = [](const std::string& name) {
    std::ostringstream out;
    return parse_render_options({"--volume", "v", "--output", name}, out)->format;
  };
  EXPECT_EQ(format("a.b/c.EXR"), OutputFormat::exr);
  EXPECT_EQ(format("c.pfm"), OutputFormat::pfm);
  EXPECT_NE(usage_error({"--volume", "v", "-o", "a.png/c"}), "");
}

TEST(Options, LastValueOfAFlagWins) {
  EXPECT_EQ(parse({"--spp", "1", "--spp", "2"}).scene.sampling.samples, 2u);
  EXPECT_EQ(parse({"--volume", "b.vdb"}).scene.volume, "b.vdb");
  EXPECT_EQ(parse({"--grid-type", "dense", "--grid-type", "tetrahedral"}).scene.grid.type, CUMULET_GRID_TETRAHEDRAL);
}

TEST(Options, TheDensityScaleIsAutoUnlessSaid) {
  EXPECT_TRUE(parse({}).scene.auto_density_scale);
  EXPECT_FALSE(parse({"--density-scale", "3"}).scene.auto_density_scale);
  const SceneOptions again = parse({"--density-scale", "3", "--density-scale", "auto"}).scene;
  EXPECT_TRUE(again.auto_density_scale);
  EXPECT_EQ(again.medium.density_scale, 0.0);
}

TEST(Options, UpAxisRotatesTheVolume) {
  const SceneOptions upright = parse({}).scene;
  EXPECT_EQ(volume_file(upright).to_world[0], 0.0) << "zero: as it is";
  const SceneOptions turned = parse({"--up", "z", "--grid-name", "smoke"}).scene;
  const cumulet_volume_file_desc file = volume_file(turned);
  EXPECT_STREQ(file.path, "cloud.vdb");
  EXPECT_STREQ(file.grid_name, "smoke");
  // Column 2 is the image of Z: up. Column 1 is that of Y: away from the camera.
  EXPECT_EQ(file.to_world[9], 1.0);
  EXPECT_EQ(file.to_world[6], -1.0);
  EXPECT_NE(usage_error(with({"--up", "x"})).find("--up"), std::string::npos);
}

TEST(Options, FilesNeedNoFlag) {
  std::ostringstream out;
  const auto both = parse_render_options({"cloud.VDB", "model.glb", "-o", "a.png"}, out);
  EXPECT_EQ(both->scene.volume, "cloud.VDB");
  EXPECT_EQ(both->scene.surfaces, "model.glb");
  EXPECT_GT(both->scene.light.sun_irradiance[0], 0.0f) << "daylight";
  const auto info = parse_render_options({"--info", "--json", "cloud.vdb"}, out);
  EXPECT_TRUE(info->info && info->json);
  EXPECT_NE(usage_error({"a.vdb", "b.nvdb", "-o", "a.png"}).find("b.nvdb"), std::string::npos);
  EXPECT_NE(usage_error({"a.txt", "-o", "a.png"}).find("a.txt"), std::string::npos);
  // Files are recognized by content. Flags override a scene file's settings.
  const cumulet::test::Folder folder;
  const std::string scene = (folder.path() / "scene").string();
  std::ofstream(scene) << R"({"cumulet_scene": 1, "volume": {"file": "/v.vdb", "up": "z"}, "light": {},
                              "picture": {"samples": 3}})";
  const auto read = parse_render_options({"-o", "a.png", "--spp", "5", scene}, out);
  EXPECT_EQ(read->scene.volume, "/v.vdb");
  EXPECT_EQ(read->scene.up, UpAxis::z);
  EXPECT_EQ(read->scene.sampling.samples, 5u);
  EXPECT_EQ(read->scene.light.sun_irradiance[0], 0.0f) << "the scene's own light";
  EXPECT_FALSE(read->scene.auto_density_scale) << "a scene without a scale means 1, as it always did";
}

TEST(Options, HelpAndVersionNeedNoOtherFlags) {
  std::ostringstream help;
  EXPECT_FALSE(parse_render_options({"--help"}, help).has_value());
  for (const char* flag :
       {"--volume", "--grid-type", "--sun", "--stats", "--exposure", "--view", "--scene", "--tone-map"})
    EXPECT_NE(help.str().find(flag), std::string::npos) << flag;
  std::ostringstream version;
  EXPECT_FALSE(parse_render_options({"--version"}, version).has_value());
  EXPECT_EQ(version.str(), "cumulet-render 0.2.0\n");
}

TEST(Options, NumbersAreTheSameInEveryLocale) {
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "C"}) {
    if (std::setlocale(LC_ALL, name) == nullptr) continue;
    EXPECT_EQ(parse_number("1.5"), 1.5) << name;
    EXPECT_THROW(static_cast<void>(parse_number("1,5")), UsageError) << name;
  }
  EXPECT_EQ(parse_number("+2"), 2.0);
  for (const char* text : {"", "+", "+-2", " 1", "1 ", "0x10", "nan", "1e400", "--1", "1.5.2"})
    EXPECT_THROW(static_cast<void>(parse_number(text)), UsageError) << text;
}

}  // namespace
