// Tone curves and encodings of the shaders, as C++, compared with those of the PNG writer.

#include "render/passes/display.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "image.hpp"

namespace {

using cumulet::render::ColorEncoding;
using cumulet::render::Display;
using cumulet::render::ToneMap;
namespace core = cumulet::core;
namespace image = cumulet::image;
namespace render = cumulet::render;

TEST(Display, NeutralAgreesWithThePngWriter) {
  std::mt19937 random(1);
  std::lognormal_distribution<float> radiance(-0.5F, 2.0F);
  for (int i = 0; i < 100000; ++i) {
    glm::vec3 c(radiance(random), radiance(random), radiance(random));
    if (i % 5 == 0) c.y = 0.0F;
    if (i % 7 == 0) c = glm::vec3(c.x);
    const std::array<float, 3> expected = image::tone_map_neutral({c.x, c.y, c.z});
    const glm::vec3 got = core::cm_display(c, 1.0F, CM_TONE_MAP_NEUTRAL, false);
    for (int k = 0; k < 3; ++k) {
      ASSERT_NEAR(got[k], std::min(expected[static_cast<std::size_t>(k)], 1.0F), 1e-6F);
      ASSERT_GE(got[k], 0.0F);
    }
  }
}

TEST(Display, EncodesAsSrgb) {
  for (int i = 0; i <= 4096; ++i) {
    const float x = static_cast<float>(i) / 4096.0F;
    EXPECT_NEAR(core::cm_srgb_encode(x), image::srgb_encode(x), 1e-6F);
  }
  EXPECT_NEAR(core::cm_srgb_encode(0.18F), 0.46135613F, 1e-6F);  // IEC 61966-2-1
}

TEST(Display, CurvesRiseFromBlackToWhite) {
  for (const std::uint32_t curve : {CM_TONE_MAP_NEUTRAL, CM_TONE_MAP_FILMIC, CM_TONE_MAP_CLIP}) {
    EXPECT_EQ(core::cm_display(glm::vec3(0.0F), 1.0F, curve, true), glm::vec3(0.0F));
    float last = -1.0F;
    for (float x = 1e-4F; x < 1e8F; x *= 1.1F) {
      const float y = core::cm_display(glm::vec3(x), 1.0F, curve, false).x;
      EXPECT_GE(y, last - 1e-6F) << x;
      EXPECT_LE(y, 1.0F);
      last = y;
    }
    EXPECT_NEAR(last, 1.0F, 1e-3F) << curve;
  }
  // Narkowicz's formula at one point.
  EXPECT_NEAR(core::cm_display(glm::vec3(0.5F), 1.0F, CM_TONE_MAP_FILMIC, false).x,
              0.5 * (2.51 * 0.5 + 0.03) / (0.5 * (2.43 * 0.5 + 0.59) + 0.14), 1e-6);
}

TEST(Display, OutOfRangeValuesAreBlackOrWhite) {
  const float infinite = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const std::uint32_t curve : {CM_TONE_MAP_NEUTRAL, CM_TONE_MAP_FILMIC, CM_TONE_MAP_CLIP}) {
    EXPECT_EQ(core::cm_display(glm::vec3(nan), 1.0F, curve, true), glm::vec3(0.0F));
    EXPECT_EQ(core::cm_display(glm::vec3(-1.0F), 1.0F, curve, true), glm::vec3(0.0F));
    EXPECT_NEAR(core::cm_display(glm::vec3(infinite), 1.0F, curve, true).x, 1.0F, 1e-6F);
  }
}

TEST(Display, ReadbackBytesMatchTheTarget) {
  const std::vector<float> linear{0.2F, 0.1F, 0.05F, 0.5F, 0.0F, 0.0F, 0.0F, 0.0F, 4.0F, 0.02F, 0.0F, 1.0F};
  const auto byte = [](float unit) { return static_cast<int>(std::lround(255.0F * unit)); };
  std::vector<std::uint8_t> bytes(linear.size());
  Display display;
  display.tone_map = ToneMap::clip;
  display.exposure_stops = 1.0F;
  display.encoding = ColorEncoding::hdr;  // ignored
  render::to_display(linear, display, bytes);
  EXPECT_EQ(bytes[0], byte(image::srgb_encode(0.4F)));
  EXPECT_EQ(bytes[1], byte(image::srgb_encode(0.2F)));
  EXPECT_EQ(bytes[3], 255);
  EXPECT_EQ(bytes[7], 255);
  EXPECT_EQ(bytes[8], 255);
  display.transparent = true;  // straight alpha: 0.2 / 0.5
  render::to_display(linear, display, bytes);
  EXPECT_EQ(bytes[0], byte(image::srgb_encode(0.8F)));
  EXPECT_EQ(bytes[3], 128);
  EXPECT_EQ(bytes[4], 0);
  EXPECT_EQ(bytes[7], 0);
  display.transparent = false;  // a legend's colors are not changed
  display.legend = true;
  render::to_display(linear, display, bytes);
  EXPECT_EQ(bytes[0], byte(image::srgb_encode(0.2F)));
  EXPECT_EQ(bytes[8], 255);
}

}  // namespace
