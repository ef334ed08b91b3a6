// Views of OpenColorIO as display LUTs, compared with closed forms between their points.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <ocio_lut.hpp>
#include <random>
#include <stdexcept>
#include <string>

#include "render/passes/display_lut.hpp"
#include "support/folder.hpp"

namespace {

using cumulet::demo::bake_ocio_view;
using cumulet::demo::DisplayLut;
using cumulet::demo::ocio_displays;
using cumulet::demo::OcioDisplay;
using cumulet::demo::OcioDisplays;
using cumulet::demo::OcioView;

/// Linear Rec. 709 of ACES2065-1 by the Bradford transform, as published with ACES.
const std::string aces_to_rec709 =
    "!<MatrixTransform> {matrix: [2.5216861867, -1.1341309882, -0.3875551985, 0, -0.2764799142, 1.3727190877, "
    "-0.0962391735, 0, -0.0153780649, -0.1529753359, 1.1683534008, 0, 0, 0, 0, 1]}";
const std::string nothing = "!<MatrixTransform> {}";

/// A configuration with two displays. The second exchanges red and blue and doubles them. rec709: the transform from
/// the reference space to linear Rec. 709, which is the space with the given name.
std::string config_text(const std::string& name, const std::string& rec709, const std::string& role = "") {
  const std::string encode =
      "        - !<ExponentWithLinearTransform> {gamma: [2.4, 2.4, 2.4, 1], offset: [0.055, 0.055, 0.055, 0], "
      "direction: "
      "inverse}\n";
  const std::string exchange =
      "        - !<MatrixTransform> {matrix: [0, 0, 2, 0, 0, 1, 0, 0, 2, 0, 0, 0, 0, 0, 0, 1]}\n";
  const std::string group = "    from_scene_reference: !<GroupTransform>\n      children:\n        - " + rec709 + "\n";
  return "ocio_profile_version: 2\nroles:\n  default: reference\n" + role +
         "displays:\n"
         "  Plain:\n"
         "    - !<View> {name: Encoded, colorspace: encoded}\n"
         "    - !<View> {name: Linear, colorspace: " +
         name +
         "}\n"
         "  Other:\n"
         "    - !<View> {name: Exchanged, colorspace: exchanged}\n"
         "colorspaces:\n"
         "  - !<ColorSpace>\n    name: reference\n"
         "  - !<ColorSpace>\n    name: " +
         name + "\n" + group + "  - !<ColorSpace>\n    name: encoded\n" + group + encode +
         "  - !<ColorSpace>\n    name: exchanged\n" + group + exchange + encode;
}

class OcioLut : public ::testing::Test {
 protected:
  [[nodiscard]] std::string write(const std::string& text) const {
    std::string file = (folder_ / "config.ocio").string();
    std::ofstream(file) << text;
    return file;
  }

 private:
  cumulet::test::Folder folder_;
};

std::string refusal(const OcioView& view) {
  try {
    static_cast<void>(bake_ocio_view(view));
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

float encoded(float linear) { return cumulet::core::cm_srgb_encode(std::clamp(linear, 0.0F, 1.0F)); }

/// Returns the greatest difference between the LUT and a function of radiance, in steps of 8 bits, at random colors.
double greatest_error(const DisplayLut& from, const std::function<glm::vec3(glm::vec3)>& wanted) {
  cumulet::render::DisplayLut lut{.shaper = static_cast<cumulet::render::LutShaper>(from.shaper),
                                  .domain = {from.domain_min, from.domain_max},
                                  .size = static_cast<int>(from.size),
                                  .points = {}};
  for (std::size_t i = 0; i < from.values.size(); i += 3)
    lut.points.emplace_back(from.values[i], from.values[i + 1], from.values[i + 2]);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> stops(-14.0F, 6.0F);
  double error = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const glm::vec3 radiance(std::exp2(stops(random)), std::exp2(stops(random)), std::exp2(stops(random)));
    const glm::vec3 difference = glm::abs(cumulet::render::encoded_color(lut, radiance) - wanted(radiance));
    error = std::max({error, 255.0 * difference.x, 255.0 * difference.y, 255.0 * difference.z});
  }
  return error;
}

TEST_F(OcioLut, DefaultViewIsThatOfTheConfiguration) {
  const DisplayLut lut = bake_ocio_view({.config = write(config_text("lin_rec709", nothing))});
  ASSERT_EQ(lut.values.size(), 3U * lut.size * lut.size * lut.size);
  const double error =
      greatest_error(lut, [](glm::vec3 c) { return glm::vec3(encoded(c.x), encoded(c.y), encoded(c.z)); });
  EXPECT_LT(error, 0.5);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(lut.values[static_cast<std::size_t>(c)], 0.0F) << "black stays black";
}

TEST_F(OcioLut, DisplayAndViewAreChosen) {
  const std::string config = write(config_text("lin_rec709", nothing));
  const auto exchanged = [](glm::vec3 c) { return glm::vec3(encoded(2.0F * c.z), encoded(c.y), encoded(2.0F * c.x)); };
  EXPECT_LT(greatest_error(bake_ocio_view({.config = config, .display = "Other"}), exchanged), 1.0);
  const auto linear = [](glm::vec3 c) { return glm::min(c, glm::vec3(1.0F)); };
  const DisplayLut view = bake_ocio_view({.config = config, .display = "Plain", .view = "Linear"});
  EXPECT_LT(greatest_error(view, linear), 1.5);
}

// Radiance enters a configuration of ACES as linear Rec. 709: by a space's name, by the role, or as the user says.
TEST_F(OcioLut, RadianceIsLinearRec709) {
  const auto plain = [](glm::vec3 c) { return glm::vec3(encoded(c.x), encoded(c.y), encoded(c.z)); };
  const std::string by_name = write(config_text("Utility - Linear - sRGB", aces_to_rec709));
  EXPECT_LT(greatest_error(bake_ocio_view({.config = by_name}), plain), 0.5);
  const std::string role = "  aces_interchange: reference\n";
  const std::string by_role = write(config_text("working", aces_to_rec709, role));
  EXPECT_LT(greatest_error(bake_ocio_view({.config = by_role}), plain), 0.5);
  EXPECT_GT(greatest_error(bake_ocio_view({.config = by_role, .input = "reference"}), plain), 20.0);
  // "linear" may have other primaries than Rec. 709: the role is used before it.
  std::string note;
  const std::string role_and_linear = write(config_text("linear", nothing, role));
  EXPECT_GT(greatest_error(bake_ocio_view({.config = role_and_linear}, &note), plain), 20.0);
  EXPECT_EQ(note, "--ocio " + role_and_linear + ": radiance enters by the color space 'aces_interchange'");
  const std::string linear = write(config_text("linear", aces_to_rec709));
  EXPECT_LT(greatest_error(bake_ocio_view({.config = linear}, &note), plain), 0.5);
  EXPECT_EQ(note, "--ocio " + linear + ": radiance enters by the color space 'linear'");
  note.clear();
  static_cast<void>(bake_ocio_view({.config = linear, .input = "linear"}, &note));
  EXPECT_EQ(note, "");
  const std::string unknown = write(config_text("working", aces_to_rec709));
  EXPECT_LT(greatest_error(bake_ocio_view({.config = unknown, .input = "working"}), plain), 0.5);
  EXPECT_EQ(refusal({.config = unknown}),
            "--ocio " + unknown + ": it names no color space of linear Rec. 709: choose one by --ocio-input");
}

TEST_F(OcioLut, DisplaysAreListed) {
  const std::string config = write(config_text("lin_rec709", nothing));
  const OcioDisplays displays = ocio_displays(config);
  EXPECT_EQ(displays.config, config);
  ASSERT_EQ(displays.displays.size(), 2U);
  EXPECT_EQ(displays.default_display, "Plain");
  const OcioDisplay* const plain = displays.find("");
  ASSERT_NE(plain, nullptr);
  EXPECT_EQ(plain->name, "Plain");
  EXPECT_EQ(plain->views, (std::vector<std::string>{"Encoded", "Linear"}));
  EXPECT_EQ(plain->default_view, "Encoded");
  EXPECT_EQ(displays.find("Other")->views, std::vector<std::string>{"Exchanged"});
  EXPECT_EQ(displays.find("none"), nullptr);
  EXPECT_EQ(displays.color_spaces, (std::vector<std::string>{"reference", "lin_rec709", "encoded", "exchanged"}));
  for (const std::string& wrong : {std::string("no such.ocio"), write("ocio_profile_version: 2\n")}) {
    try {
      static_cast<void>(ocio_displays(wrong));
      ADD_FAILURE() << wrong;
    } catch (const std::runtime_error& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with("--ocio " + wrong + ": ")) << error.what();
    }
  }
}

TEST_F(OcioLut, RefusalsNameTheChoices) {
  const std::string config = write(config_text("lin_rec709", nothing));
  const std::string begin = "--ocio " + config + ": ";
  EXPECT_EQ(refusal({.config = config, .display = "plain"}),
            begin + "--ocio-display: 'plain' is not one of Plain, Other");
  EXPECT_EQ(refusal({.config = config, .view = "Exchanged"}),
            begin + "--ocio-view: 'Exchanged' of the display 'Plain' is not one of Encoded, Linear");
  EXPECT_EQ(refusal({.config = config, .input = "red"}), begin + "--ocio-input: it has no color space 'red'");
  const auto begins = [](const OcioView& view) { return refusal(view).starts_with("--ocio " + view.config + ": "); };
  EXPECT_TRUE(begins({.config = "no such.ocio"}));
  EXPECT_TRUE(begins({.config = write("ocio_profile_version: 2\ndisplays: [")}));
  EXPECT_TRUE(begins({.config = write("ocio_profile_version: 2\n")}));
  EXPECT_TRUE(begins({.config = write(config_text("lin_rec709", "!<FileTransform> {src: no_such.cube}"))}));
}

}  // namespace
