// Options of cumulet-render for analytic lights.

#include <gtest/gtest.h>

#include <fstream>
#include <settings.hpp>
#include <string>

#include "support/folder.hpp"
#include "support/render_options.hpp"

namespace {

using namespace cumulet::demo;
using cumulet::test::Arguments;
using cumulet::test::parse;
using cumulet::test::usage_error;
using cumulet::test::with;

// Compares each key with the same words in a scene file.
TEST(Options, LightFlagsMatchSceneFileLights) {
  const SceneOptions scene = parse({"--light",
                                    "rect  position=-1,.5,2e1 direction=0,-.5,1 tangent=1,0,0 color=1,0.5,.25 "
                                    "power=+300 width=2 height=.5 angle_degrees=90 blend=0.25",
                                    "--light", "point", "--light", "distant power=3 angle_degrees=0.53"})
                                 .scene;
  const SceneOptions file = parse_scene(R"({"cumulet_scene": 3, "lights": [
      {"kind": "rect", "position": [-1, 0.5, 20], "direction": [0, -0.5, 1], "tangent": [1, 0, 0],
       "color": [1, 0.5, 0.25], "power": 300, "width": 2, "height": 0.5, "angle_degrees": 90, "blend": 0.25},
      {"kind": "point"}, {"kind": "distant", "power": 3, "angle_degrees": 0.53}]})",
                                        "a.json");
  const auto same_analytic_lights = [&](const SceneOptions& other) {
    ASSERT_EQ(scene.analytic_lights.size(), other.analytic_lights.size());
    for (std::size_t i = 0; i < scene.analytic_lights.size(); ++i)
      EXPECT_TRUE(cumulet::settings::same(scene.analytic_lights[i], other.analytic_lights[i])) << i;
  };
  same_analytic_lights(file);
  EXPECT_EQ(scene.analytic_lights[0].struct_size, sizeof(cumulet_light_desc));
  same_analytic_lights(parse_scene(scene_text(scene, "a.json"), "a.json"));
  EXPECT_EQ(scene.light.sun_irradiance[0], 0.0f) << "no light but theirs";
  EXPECT_EQ(scene.light.sky, CUMULET_SKY_CONSTANT);
  EXPECT_EQ(scene.ground.mode, CUMULET_GROUND_NONE);
  EXPECT_EQ(parse({"--light", "point", "--sky-model", "3,0.3"}).scene.light.sky, CUMULET_SKY_PHYSICAL);
  EXPECT_EQ(parse({"--light", "point", "--light", "none"}).scene.light.sky, CUMULET_SKY_PHYSICAL) << "a day without";
}

TEST(Options, LightFlagsAddToTheScenesLights) {
  const cumulet::test::Folder folder;
  const std::string scene = (folder.path() / "scene.json").string();
  std::ofstream(scene) << R"({"cumulet_scene": 2, "lights": [{"kind": "spot", "power": 7}]})";
  const auto analytic_lights = [&](const Arguments& more) {
    Arguments all = {"--scene", scene};
    all.insert(all.end(), more.begin(), more.end());
    return parse(all).scene.analytic_lights;
  };
  ASSERT_EQ(analytic_lights({}).size(), 1u);
  const auto two = analytic_lights({"--light", "disk power=3"});
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0].power, 7.0f);
  EXPECT_EQ(two[1].kind, CUMULET_LIGHT_DISK);
  const auto other = analytic_lights({"--light", "none", "--light", "disk power=3"});
  ASSERT_EQ(other.size(), 1u);
  EXPECT_EQ(other[0].power, 3.0f);
}

TEST(Options, AnyWhiteSpaceSeparatesWords) {
  const auto analytic_lights = parse({"--light", "\tdisk\n  power=3\r\n\twidth=2\n"}).scene.analytic_lights;
  ASSERT_EQ(analytic_lights.size(), 1u);
  EXPECT_EQ(analytic_lights[0].kind, CUMULET_LIGHT_DISK);
  EXPECT_EQ(analytic_lights[0].power, 3.0f);
  EXPECT_EQ(analytic_lights[0].width, 2.0);
}

TEST(Options, InvalidLightGivesAOneLineError) {
  const auto light_error = [](const char* analytic_light) { return usage_error(with({"--light", analytic_light})); };
  EXPECT_EQ(light_error(""), "--light: '' is not one of point, spot, disk, rect, distant");
  EXPECT_EQ(light_error("bulb power=1"), "--light: 'bulb' is not one of point, spot, disk, rect, distant");
  EXPECT_EQ(light_error("point power 1"), "--light: 'power' is not KEY=VALUE, such as power=100");
  EXPECT_EQ(light_error("point watts=1"), "--light: lights have no setting 'watts'");
  EXPECT_EQ(light_error("point kind=spot"), "--light: lights have no setting 'kind'");
  EXPECT_EQ(light_error("point power=1 power=2"), "--light: power is given twice");
  EXPECT_EQ(light_error("point power=-1"), "--light: power: '-1' is not from 0 to 1e30");
  EXPECT_EQ(light_error("point power="), "--light: power: '' is not a finite number");
  EXPECT_EQ(light_error("point position=1,2"), "--light: position: '1,2' is not 3 numbers separated by commas");
  EXPECT_EQ(light_error("point position=1,2,1e31"), "--light: position exceeds 1e30");
  EXPECT_EQ(light_error("point color=0,0,0"), "--light: color: '0,0,0' must not be black");
  EXPECT_EQ(light_error("point color=1,-1,0"), "--light: color: '1,-1,0' has a negative number");
  EXPECT_EQ(light_error("point color=1e20,1,0 power=1e20"), "--light: power times color exceeds 1e30");
  EXPECT_EQ(light_error("disk width=0"), "--light: width: '0' is not above 0");
  EXPECT_EQ(light_error("distant angle_degrees=100"),
            "--light: angle_degrees is above 90, the maximum for a distant light");
  EXPECT_EQ(light_error("spot blend=2"), "--light: blend: '2' is not from 0 to 1");
}

}  // namespace
