// Flags of cumulet-render beside a scene file.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "options.hpp"
#include "support/folder.hpp"
#include "support/render_options.hpp"

namespace {

using namespace cumulet::demo;
using cumulet::test::Arguments;
using cumulet::test::expect_rgb;
using cumulet::test::usage_error;
using cumulet::test::with;

class SceneOption : public ::testing::Test {
 protected:
  [[nodiscard]] std::string write_scene(const std::string& text) const {
    std::string path = (folder_ / "scene.json").string();
    std::ofstream(path) << text;
    return path;
  }

 private:
  cumulet::test::Folder folder_;
};

TEST_F(SceneOption, FlagsOverrideTheSceneFileInAnyOrder) {
  const std::string path = write_scene(R"({"cumulet_scene": 1, "volume": {"file": "/a/smoke.vdb", "grid": "smoke"},
    "camera": {"eye": [0, 0, 9], "target": [0, 0, 0], "orthographic_height": 4},
    "medium": {"density_scale": 7, "anisotropy": 0.25},
    "light": {"sun": {"azimuth_degrees": 10, "elevation_degrees": 20, "irradiance": [1, 2, 3]},
              "sky": {"radiance": [4, 5, 6]}},
    "picture": {"width": 64, "height": 32, "samples": 5}, "display": {"exposure_stops": 2}})");
  std::ostringstream out;
  const auto file = parse_render_options({"--scene", path, "-o", "a.png"}, out);
  ASSERT_TRUE(file.has_value());
  EXPECT_EQ(file->scene.volume, "/a/smoke.vdb");
  EXPECT_EQ(file->scene.grid_name, "smoke");
  EXPECT_EQ(file->scene.width, 64u);
  EXPECT_EQ(file->scene.sampling.samples, 5u);
  EXPECT_EQ(file->scene.camera.orthographic_height, 4.0);
  expect_rgb(file->scene.light.sun_irradiance, 1.0f, 2.0f, 3.0f);

  const auto mixed = parse_render_options({"--density-scale", "2", "--sky", "0,0,1", "--volume", "b.vdb", "--camera",
                                           "1,0,0 0,0,0 30", "-o", "a.png", "--scene", path},
                                          out);
  ASSERT_TRUE(mixed.has_value());
  EXPECT_EQ(mixed->scene.volume, "b.vdb");
  EXPECT_EQ(mixed->scene.medium.density_scale, 2.0);
  EXPECT_FLOAT_EQ(mixed->scene.medium.anisotropy, 0.25f);
  expect_rgb(mixed->scene.light.sky_radiance, 0.0f, 0.0f, 1.0f);
  expect_rgb(mixed->scene.light.sun_irradiance, 1.0f, 2.0f, 3.0f);
  EXPECT_EQ(mixed->scene.camera.eye[0], 1.0);
  EXPECT_EQ(mixed->scene.camera.orthographic_height, 0.0);
  EXPECT_EQ(mixed->scene.display.exposure_stops, 2.0f);
}

TEST_F(SceneOption, FlagsReplaceTheViewOfOpenColorIo) {
  const std::string path = write_scene(R"({"cumulet_scene": 3, "volumes": [{"file": "/a/smoke.vdb"}],
    "display": {"ocio": {"config": "/a/show.ocio", "display": "sRGB", "view": "Film"}}})");
  const auto ocio = [&](const Arguments& more) {
    Arguments all = {"--scene", path, "-o", "a.png"};
    all.insert(all.end(), more.begin(), more.end());
    std::ostringstream out;
    return parse_render_options(all, out)->scene.ocio;
  };
  const OcioView scenes{.config = "/a/show.ocio", .display = "sRGB", .view = "Film"};
  EXPECT_EQ(ocio({}), scenes);
  EXPECT_EQ(ocio({"-o", "a.exr"}), scenes) << "is not used";
  EXPECT_EQ(ocio({"--ocio-view", "Raw"}).view, "Raw");
  EXPECT_EQ(ocio({"--ocio", "b.ocio"}), OcioView{.config = "b.ocio"}) << "its own default view";
  EXPECT_EQ(ocio({"--ocio-view", "Raw", "--ocio", "b.ocio"}), (OcioView{.config = "b.ocio", .view = "Raw"}));
  for (const Arguments& none : {Arguments{"--ocio", "none"}, {"--tone-map", "clip"}, {"--lut", "a.cube"}})
    EXPECT_EQ(ocio(none), OcioView()) << none.front();
  EXPECT_EQ(usage_error({"--scene", path, "-o", "a.png", "--ocio", "none", "--ocio-view", "Raw"}),
            "--ocio-view needs --ocio");
}

TEST_F(SceneOption, OnlyOptionsOfTheLookSetTheLook) {
  const auto by_default = [](const Arguments& more) {
    std::ostringstream out;
    return parse_render_options(with(more), out)->default_look;
  };
  EXPECT_TRUE(by_default({}));
  EXPECT_TRUE(by_default({"--spp", "4", "--preset", "fire", "--background", "transparent"}));
  for (const Arguments& given : {Arguments{"--sun", "65,40 1,1,1"},
                                 {"--sky", "0,0,0"},
                                 {"--sky-model", "2.5,0.3"},
                                 {"--env", "a.hdr"},
                                 {"--exposure", "0"},
                                 {"--tone-map", "neutral"},
                                 {"--light", "point power=1"},
                                 {"--ocio", "a.ocio"}})
    EXPECT_FALSE(by_default(given)) << given.front();
}

TEST_F(SceneOption, SelectsACameraOfTheScene) {
  const std::string path = write_scene(R"({"cumulet_scene": 2, "volumes": [{"file": "/a/smoke.vdb"}],
    "models": [{"file": "/a/m.glb", "camera": 3}], "camera": "front", "cameras": [
      {"name": "front", "eye": [0, 0, 9], "target": [0, 0, 0], "fovy_degrees": 30},
      {"name": "the side", "eye": [9, 0, 0], "target": [0, 0, 0], "lens_radius": 0.5}]})");
  const auto options = [&](const Arguments& more) {
    Arguments all = {"--scene", path, "-o", "a.png"};
    all.insert(all.begin(), more.begin(), more.end());
    std::ostringstream out;
    return parse_render_options(all, out)->scene;
  };
  EXPECT_EQ(options({}).camera.eye[2], 9.0);
  EXPECT_EQ(options({}).surface_camera, 3) << "the model's comes before the scene's";
  const SceneOptions side = options({"--scene-camera", "the side"});
  EXPECT_EQ(side.camera.eye[0], 9.0);
  EXPECT_EQ(side.camera.lens_radius, 0.5);
  EXPECT_EQ(side.camera.fovy_degrees, 0.0);
  EXPECT_EQ(side.surface_camera, -1) << "but not before one that is asked for";
  EXPECT_EQ(options({"--gltf-camera", "2", "--scene-camera", "the side"}).surface_camera, 2);
  const SceneOptions moved = options({"--camera", "1,0,0 0,0,0 30", "--scene-camera", "the side"});
  EXPECT_EQ(moved.camera.eye[0], 1.0);
  EXPECT_EQ(moved.camera.lens_radius, 0.5);
  std::ostringstream out;
  const auto loose = parse_render_options({path, "--scene-camera", "the side", "-o", "a.png"}, out);
  EXPECT_EQ(loose->scene.camera.eye[0], 9.0) << "of a scene without a flag";
  EXPECT_EQ(usage_error({"--scene", path, "-o", "a.png", "--scene-camera", "side"}),
            R"(--scene-camera: no camera "side"; the scene has "front", "the side")");
  EXPECT_EQ(usage_error(with({"--scene-camera", "side"})), R"(--scene-camera: no camera "side"; the scene has none)");
}

TEST_F(SceneOption, NeedsAVolumeInTheSceneOrAsAFlag) {
  const std::string path = write_scene(R"({"cumulet_scene": 1})");
  EXPECT_NE(usage_error({"--scene", path, "-o", "a.png"}).find("--volume"), std::string::npos);
  std::ostringstream out;
  EXPECT_GT(parse_render_options({"--scene", path, "-o", "a.png", "--volume", "v"}, out)->scene.light.sky_radiance[2],
            0.0f);
}

TEST_F(SceneOption, InvalidFileIsNotAUsageError) {
  std::ostringstream out;
  const std::string path = write_scene("{");
  for (const std::string& name : {path, std::string("/nowhere/scene.json")}) {
    try {
      static_cast<void>(parse_render_options({"--scene", name, "-o", "a.png"}, out));
      ADD_FAILURE() << name;
    } catch (const UsageError& error) {
      ADD_FAILURE() << error.what();
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
}

}  // namespace
