// The exposure that the programs derive from an image.

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <default_look.hpp>
#include <limits>
#include <suitable_exposure.hpp>
#include <vector>

#include "model.hpp"

namespace {

using namespace cumulet::demo;
using cumulet::image::Curve;
using cumulet::image::suitable_exposure;

constexpr std::uint32_t width = 96;
constexpr std::uint32_t height = 72;

/// Returns a gray image whose upper part has another luminance.
std::vector<float> picture(float upper, float lower, double part) {
  std::vector<float> rgba;
  for (std::uint32_t i = 0; i < width * height; ++i) {
    const float value = i < part * width * height ? upper : lower;
    rgba.insert(rgba.end(), {value, value, value, 1.0f});
  }
  return rgba;
}

float stops_of(const std::vector<float>& rgba, Curve curve = Curve::filmic) {
  const auto stops = suitable_exposure(rgba, width, height, curve);
  EXPECT_TRUE(stops.has_value());
  return stops.value_or(0.0f);
}

TEST(AutoExposure, MiddleBecomesGray) {
  // The mean of the logarithms is that of 0.18 x 2^-3.
  const float bright = 0.18f * std::exp2(-1.0f);
  const float dark = 0.18f * std::exp2(-5.0f);
  EXPECT_NEAR(stops_of(picture(bright, dark, 0.5)), 3.0f, 0.051f);
}

TEST(AutoExposure, FollowsTheLuminance) {
  const float once = stops_of(picture(0.5f, 0.02f, 0.4));
  for (const float factor : {0.01f, 0.25f, 8.0f, 1000.0f})
    EXPECT_NEAR(stops_of(picture(0.5f * factor, 0.02f * factor, 0.4)), once - std::log2(factor), 0.11f) << factor;
}

TEST(AutoExposure, HighlightsStayInRange) {
  const float glow = stops_of(picture(10.0f, 1e-4f, 0.2));
  EXPECT_NEAR(10.0f * std::exp2(glow), 1.2f, 0.1f) << "not burned out";
  const float cloud = stops_of(picture(10.0f, 1e-4f, 0.2), Curve::neutral);
  EXPECT_NEAR(10.0f * std::exp2(cloud), 2.0f, 0.1f) << "clouds stay white";
  const float snow = stops_of(picture(3.0f, 3.0f, 0.5));
  EXPECT_NEAR(3.0f * std::exp2(snow), 0.6f, 0.05f) << "not gray";
}

/// Sets the first pixels of the first rows to this luminance.
void add_flame(std::vector<float>& rgba, float value, std::uint32_t columns, std::uint32_t rows) {
  for (std::uint32_t y = 0; y < rows; ++y)
    for (std::uint32_t i = 0; i < columns * 4; ++i) rgba[4 * std::size_t{y} * width + i] = value;
}

// Flames that cover 2.8 % of an image became pale yellow, because only larger ones counted.
TEST(AutoExposure, SmallFlameAtDuskCounts) {
  std::vector<float> rgba = picture(0.02f, 0.02f, 0.5);
  add_flame(rgba, 0.5f, 48, 4);
  EXPECT_NEAR(0.5f * std::exp2(stops_of(rgba)), 1.2f, 0.1f);
}

TEST(AutoExposure, SmallFlameBeforeBlackCounts) {
  std::vector<float> rgba = picture(0.0f, 0.0f, 0.5);
  add_flame(rgba, 4.0f, 8, 4);
  const float stops = stops_of(rgba);
  EXPECT_NEAR(4.0f * std::exp2(stops), 1.2f, 0.1f);
}

TEST(AutoExposure, BlackImageHasNone) {
  EXPECT_FALSE(suitable_exposure(picture(0.0f, 0.0f, 0.5), width, height, Curve::neutral));
  EXPECT_FALSE(suitable_exposure({}, 0, 0, Curve::neutral));
  std::vector<float> rgba = picture(0.5f, 0.1f, 0.5);
  const float stops = stops_of(rgba);
  rgba[4 * 1000] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NEAR(stops_of(rgba), stops, 0.11f);
  for (float& value : rgba) value = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(suitable_exposure(rgba, width, height, Curve::neutral));
}

TEST(AutoExposure, KeepsAnExposureThatWasSet) {
  SceneOptions scene;
  scene.set_daylight();
  spell_out_defaults(scene);
  EXPECT_TRUE(is_default_exposure(scene, std::nullopt));
  scene.display.exposure_stops = 1.5f;
  EXPECT_FALSE(is_default_exposure(scene, std::nullopt));
  EXPECT_TRUE(is_default_exposure(scene, 1.5f));
  // A burning volume gets dusk light in place of the measured exposure, and another measured one with it.
  EXPECT_FALSE(take_dusk(scene));
  EXPECT_TRUE(take_dusk(scene, 1.5f));
  EXPECT_TRUE(is_default_exposure(scene, std::nullopt)) << "that of dusk";
  scene.display.exposure_stops = 2.5f;
  EXPECT_FALSE(give_day(scene));
  EXPECT_TRUE(give_day(scene, 2.5f));
  EXPECT_EQ(scene.display.exposure_stops, 0.0f);
}

}  // namespace
