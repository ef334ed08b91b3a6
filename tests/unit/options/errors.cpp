// Usage errors, and old spellings of flags.

#include <gtest/gtest.h>

#include <aov_table.hpp>
#include <settings.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "options.hpp"
#include "support/folder.hpp"
#include "support/render_options.hpp"

namespace {

using namespace cumulet::demo;
using cumulet::test::Arguments;
using cumulet::test::parse;
using cumulet::test::usage_error;
using cumulet::test::with;

TEST(Options, UsageErrorsAreOneLineAndNameTheFlag) {
  const std::vector<Arguments> wrong = {{"--size", "640"},
                                        {"--size", "0x10"},
                                        {"--size", "10x10x10"},
                                        {"--size", "99999x1"},
                                        {"--size", "-1x1"},
                                        {"--size", "1x"},
                                        {"--spp", "0"},
                                        {"--spp", "-3"},
                                        {"--spp", "1.5"},
                                        {"--spp", "4294967296"},
                                        {"--spp", "1 "},
                                        {"--noise-target", "-1"},
                                        {"--noise-target", "101"},
                                        {"--noise-target", "little"},
                                        {"--noise-target", "nan"},
                                        {"--time-limit", "0"},
                                        {"--time-limit", "-3"},
                                        {"--time-limit", "soon"},
                                        {"--gpu-memory", "0"},
                                        {"--gpu-memory", "2G"},
                                        {"--time-limit", "inf"},
                                        {"--seed", "x"},
                                        {"--seed", "4294967296"},
                                        {"--camera", "0,0,0"},
                                        {"--camera", "0,0,0 0,0,0 40"},
                                        {"--camera", "0,0,1 0,0,0 0"},
                                        {"--camera", "0,0,1 0,0,0 180"},
                                        {"--camera", "0,0,nan 0,0,0 40"},
                                        {"--camera", "0,0 0,0,0 40"},
                                        {"--grid-type", "fast"},
                                        {"--aovs", "all"},  // with a .png
                                        {"--aovs", "cryptomatte"},
                                        {"--grid-type", ""},
                                        {"--cells", "Linear"},
                                        {"--criterion", "best"},
                                        {"--threshold", "-1"},
                                        {"--threshold", "inf"},
                                        {"--max-cells", "0"},
                                        {"--max-cells", "-1"},
                                        {"--camera-adaptive", "1"},
                                        {"--pixel-size", "0"},
                                        {"--density-scale", "0"},
                                        {"--density-scale", "-2"},
                                        {"--density-scale", "1e999"},
                                        {"--albedo", "1,1"},
                                        {"--albedo", "1,1,1.1"},
                                        {"--albedo", "1,1,-.1"},
                                        {"--albedo", "1,,1"},
                                        {"--anisotropy", "1"},
                                        {"--anisotropy", "-1"},
                                        {"--anisotropy", "0.99999999999"},
                                        {"--max-bounces", "-1"},
                                        {"--density-ramp", ""},
                                        {"--density-ramp", "0:0"},
                                        {"--density-ramp", "0:0,1:nan"},
                                        {"--density-ramp", "0:0;1:1"},
                                        {"--temperature-ramp", "0:0,0:1"},
                                        {"--flame-ramp", "0:0,1:-1"},
                                        {"--flame-ramp", "0:0,1:1e39"},
                                        {"--sun", "60 1,1,1"},
                                        {"--sun", "60,91 1,1,1"},
                                        {"--sun", "60,40"},
                                        {"--sun", "60,40 1,1,-1"},
                                        {"--sky", "1"},
                                        {"--sky", "1,1,1e39"},
                                        {"--sky-model", "3"},
                                        {"--sky-model", "0.5,0.3"},
                                        {"--sky-model", "3,1.5"},
                                        {"--sky-model", "3,0.3", "--sky", "1,1,1"},
                                        {"--sky-model", "3,0.3", "--env", "a.hdr"},
                                        {"--view", "nice"},
                                        {"--backend", "glx"},
                                        {"--exposure", "1,5"},
                                        {"--exposure", "65"},
                                        {"--tone-map", "aces"},
                                        {"--stats", ""},
                                        {"--trace", ""},
                                        {"--shader-cache", ""},
                                        {"--spp"},
                                        {"--volume", ""}};
  for (const Arguments& arguments : wrong) {
    Arguments all = {"-o", "out.png"};
    if (arguments[0] != "--volume") all.insert(all.end(), {"--volume", "cloud.vdb"});
    all.insert(all.end(), arguments.begin(), arguments.end());
    EXPECT_NE(usage_error(all).find(arguments[0]), std::string::npos) << arguments[0] << ' ' << arguments.back();
  }
  EXPECT_NE(usage_error({"-o", "a.png"}).find("--volume"), std::string::npos);
  EXPECT_NE(usage_error({"--volume", "a.vdb"}).find("--output"), std::string::npos);
  EXPECT_NE(usage_error(with({"--bogus"})).find("--bogus"), std::string::npos);
  EXPECT_NE(usage_error(with({"stray"})).find("stray"), std::string::npos);
  EXPECT_NE(usage_error(with({"--json"})).find("--info"), std::string::npos);
  EXPECT_NE(usage_error(with({"--stats", "out.png"})), "");
  EXPECT_NE(usage_error(with({"--trace", "out.png"})), "");
  EXPECT_NE(usage_error(with({"--trace", "s.json", "--stats", "s.json"})), "");
}

// Flags and values of earlier versions are accepted, and reported once each.
TEST(Options, OldFlagsAreAccepted) {
  struct Case {
    Arguments old;
    Arguments now;
    std::string expected;
  };
  const std::string start = "cumulet-render: ";
  for (const Case& c :
       {Case{{"--march", "dense"}, {"--grid-type", "dense"}, "--march is now --grid-type\n"},
        Case{{"--march=dense", "--march", "dense"}, {"--grid-type", "dense"}, "--march is now --grid-type\n"},
        Case{{"--grid-type", "brick"}, {"--grid-type", "bricks"}, "--grid-type brick is now --grid-type bricks\n"},
        Case{{"--grid-type", "tet"}, {}, "--grid-type tet is now --grid-type tetrahedral\n"},
        Case{{"--build", "gpu"}, {"--build-device", "gpu"}, "--build is now --build-device\n"},
        Case{{"--lamp", "point power=3"}, {"--light", "point power=3"}, "--lamp is now --light\n"},
        Case{{"--light", "disc power=3"}, {"--light", "disk power=3"}, "--light disc is now --light disk\n"},
        Case{{"--light", "rect power=3 across=0,0,1"},
             {"--light", "rect power=3 tangent=0,0,1"},
             "--light across is now --light tangent\n"},
        Case{{"--surface-light", "direct"},
             {"--surface-lighting", "direct"},
             "--surface-light is now --surface-lighting\n"},
        Case{{"--surface-lighting", "none"},
             {"--surface-lighting", "rasterized"},
             "--surface-lighting none is now --surface-lighting rasterized\n"},
        Case{{"--second-share", "0.25"}, {"--second-weight", "0.25"}, "--second-share is now --second-weight\n"},
        Case{{"--between", "blend"}, {"--frame-interpolation", "blend"}, "--between is now --frame-interpolation\n"}}) {
    testing::internal::CaptureStderr();
    const SceneOptions old = parse(c.old).scene;
    EXPECT_EQ(testing::internal::GetCapturedStderr(), start + c.expected);
    testing::internal::CaptureStderr();
    const SceneOptions now = parse(c.now).scene;
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_TRUE(same_scene(old, now)) << c.expected;
  }
  testing::internal::CaptureStderr();
  EXPECT_EQ(parse({"--settled", "frames.txt"}).sequence_cache, "frames.txt");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), start + "--settled is now --sequence-cache\n");
  // Help does not list them.
  std::ostringstream help;
  EXPECT_FALSE(parse_render_options({"--help"}, help).has_value());
  for (const char* old :
       {"--march", "--build ", "--lamp", "--surface-light ", "--second-share", "--between", "--settled"})
    EXPECT_EQ(help.str().find(old), std::string::npos) << old;
}

}  // namespace
