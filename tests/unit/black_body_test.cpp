// Colors of black bodies compared with published ones, and their brightness.

#include "light/black_body.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "../../demo/app/kelvin.hpp"
#include "base/luminance.hpp"

namespace {

using cumulet::light::black_body_color;
using cumulet::light::black_body_radiance;
using cumulet::light::BlackBody;

glm::dvec2 uv_of_xy(double x, double y) { return glm::dvec2(4.0 * x, 9.0 * y) / (-2.0 * x + 12.0 * y + 3.0); }

// CIE 1976 u'v' of linear Rec. 709.
glm::dvec2 uv_of(const glm::dvec3& c) {
  const double x = 0.4123908 * c.r + 0.3575843 * c.g + 0.1804808 * c.b;
  const double y = 0.2126390 * c.r + 0.7151687 * c.g + 0.0721923 * c.b;
  const double z = 0.0193308 * c.r + 0.1191948 * c.g + 0.9505322 * c.b;
  return glm::dvec2(4.0 * x, 9.0 * y) / (x + 15.0 * y + 3.0 * z);
}

// Published chromaticities of the Planckian locus.
struct Published {
  double kelvin;
  double x;
  double y;
};
constexpr std::array<Published, 4> locus = {
    {{2000.0, 0.52669, 0.41331}, {2856.0, 0.44757, 0.40745}, {6500.0, 0.3135, 0.3237}, {10000.0, 0.28063, 0.28828}}};

TEST(BlackBody, ColorsFollowPlancksLaw) {
  for (const Published& p : locus) {
    EXPECT_LT(glm::distance(uv_of(black_body_color(p.kelvin)), uv_of_xy(p.x, p.y)), 0.0005) << p.kelvin << " K";
  }
}

TEST(BlackBody, ColorsHaveLuminanceOne) {
  for (double kelvin = 100.0; kelvin < 1.0e5; kelvin *= 1.1) {
    const glm::dvec3 color = black_body_color(kelvin);
    EXPECT_NEAR(cumulet::luminance(color), 1.0, 1.0e-9) << kelvin << " K";
    EXPECT_GE(std::min({color.r, color.g, color.b}), 0.0) << kelvin << " K";
  }
}

// At 1500 K (x = 0.58568, y = 0.39323) blue is negative. It is clipped to 0, and the ratio of red to green stays.
TEST(BlackBody, OutOfGamutColorsAreClipped) {
  EXPECT_GT(black_body_color(1930.0).b, 0.0);
  EXPECT_EQ(black_body_color(1800.0).b, 0.0);
  const glm::dvec3 clipped = black_body_color(1500.0);
  const glm::dvec3 xyz = glm::dvec3(0.58568, 0.39323, 1.0 - 0.58568 - 0.39323) / 0.39323;
  const double red = glm::dot(glm::dvec3(3.2404542, -1.5371385, -0.4985314), xyz);
  const double green = glm::dot(glm::dvec3(-0.9692660, 1.8760108, 0.0415560), xyz);
  EXPECT_EQ(clipped.b, 0.0);
  EXPECT_NEAR(clipped.g / clipped.r, green / red, 0.002 * green / red);
  EXPECT_EQ(black_body_color(500.0).g, 0.0);
}

// Radiance of 1 unit of length in Blender 3.4.1 (tests/bench/results/cycles_material.csv), whose colors are a fit.
TEST(BlackBody, AgreesWithCycles) {
  struct Measured {
    double kelvin;
    glm::dvec3 radiance;
  };
  constexpr std::array<Measured, 7> cycles = {{{1000.0, {0.0830514, 0.000704686, 0.0}},
                                               {1500.0, {0.298278, 0.0396611, 0.0}},
                                               {2000.0, {0.727782, 0.186802, 0.00589502}},
                                               {3000.0, {2.58896, 1.23434, 0.397987}},
                                               {6500.0, {33.5899, 31.7052, 33.3555}},
                                               {10000.0, {157.28, 179.578, 258.2}},
                                               {12000.0, {309.26, 372.218, 586.224}}}};
  for (const Measured& m : cycles) {
    const glm::dvec3 ours = black_body_color(m.kelvin) * black_body_radiance(m.kelvin, 1.0);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(ours[i], m.radiance[i], 0.011 * m.radiance[i]) << m.kelvin << " K, " << i;
  }
}

TEST(BlackBody, RadianceFollowsStefanBoltzmann) {
  const double constant = 1.0e-6 * 5.670373e-8 / std::numbers::pi;
  EXPECT_DOUBLE_EQ(black_body_radiance(2000.0, 1.0), constant * 1.6e13);
  EXPECT_DOUBLE_EQ(black_body_radiance(2000.0, 0.25), constant * (0.75 + 0.25 * 1.6e13));
  EXPECT_EQ(black_body_radiance(2000.0, 0.0), 0.0);
  EXPECT_EQ(black_body_radiance(99.0, 1.0), 0.0);
}

TEST(BlackBody, TableInterpolationIsAccurate) {
  const BlackBody table;
  for (double kelvin = 101.0; kelvin < 39999.0; kelvin *= 1.0173) {
    const glm::dvec3 fast(table.emission(static_cast<float>(kelvin), 0.7F));
    EXPECT_LT(glm::distance(uv_of(fast), uv_of(black_body_color(kelvin))), 0.0005) << kelvin << " K";
    EXPECT_NEAR(cumulet::luminance(fast) / black_body_radiance(kelvin, 0.7), 1.0, 1.0e-5) << kelvin << " K";
  }
}

TEST(BlackBody, InvalidTemperaturesEmitNothing) {
  const BlackBody table;
  for (const float kelvin : {-300.0F, 0.0F, 99.0F, std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_EQ(table.emission(kelvin, 1.0F), glm::vec3(0.0F)) << kelvin;
  }
  EXPECT_EQ(table.emission(1500.0F, 0.0F), glm::vec3(0.0F));
  const glm::vec3 hot = table.emission(1.0e6F, 1.0F);
  EXPECT_TRUE(std::isfinite(hot.r) && hot.b > hot.r);
}

// The demo has a table, because programs see the public headers only.
TEST(BlackBody, ColorsOfLightsInTheDemoAgree) {
  using namespace cumulet::demo;
  for (double kelvin = min_kelvin; kelvin <= max_kelvin; kelvin *= 1.0173) {
    const Rgb shown = color_of_kelvin(kelvin);
    const glm::dvec3 exact = black_body_color(kelvin);
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(static_cast<double>(shown[static_cast<std::size_t>(i)]), exact[i], 0.003) << kelvin << " K";
    const auto found = nearest_kelvin({3.0F * shown[0], 3.0F * shown[1], 3.0F * shown[2]});
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->kelvin, kelvin, 0.002 * kelvin);
    EXPECT_LT(found->distance, 5e-4F) << "the rounding of the table";
  }
  const auto white = nearest_kelvin({1.0F, 1.0F, 1.0F});
  ASSERT_TRUE(white);
  EXPECT_NEAR(white->kelvin, 6500.0, 200.0);
  EXPECT_GT(white->distance, 5e-3F) << "daylight is no black body";
  EXPECT_FALSE(nearest_kelvin({0.0F, 0.0F, 0.0F}));
}

}  // namespace
