// The physical clear-day sky, compared with well-known properties and published measurements.

#include "light/sky.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/luminance.hpp"
#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using cumulet::luminance;
using cumulet::light::Sky;
using cumulet::light::SkyModel;
using glm::dvec3;
using glm::vec3;

// Azimuth from +Z towards +X.
dvec3 direction(double elevation, double azimuth) {
  const double e = elevation * std::numbers::pi / 180.0;
  const double a = azimuth * std::numbers::pi / 180.0;
  return {std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e)};
}
Sky sky(double turbidity, double elevation, double albedo = 0.3) {
  return {{turbidity, albedo}, direction(elevation, 0.0)};
}
double bright(const vec3& color) { return luminance(dvec3(color)); }

TEST(Sky, IsBlueAboveAndBrighterAtTheHorizon) {
  const Sky noon = sky(2.0, 60.0);
  const vec3 zenith = noon.radiance({0.0, 1.0, 0.0});
  EXPECT_GT(zenith.b, 1.5F * zenith.g);
  EXPECT_GT(zenith.g, 1.2F * zenith.r);
  const vec3 low = noon.radiance(direction(2.0, 90.0));
  EXPECT_GT(bright(low), 1.5 * bright(zenith));
  // The path tracer of sky_transport_test gives 0.62 of the zenith's ratio.
  EXPECT_LT(low.b / low.r, 0.65F * zenith.b / zenith.r);
}

TEST(Sky, TheSunSetsRed) {
  const vec3 high = sky(2.0, 60.0).sun_irradiance();
  const vec3 low = sky(2.0, 3.0).sun_irradiance();
  EXPECT_LT(high.r, 1.4F * high.b);
  EXPECT_GT(low.r, 2.0F * low.g);
  EXPECT_GT(low.g, 5.0F * low.b);
  EXPECT_LT(bright(low), 0.2 * bright(high));
  EXPECT_EQ(sky(2.0, -0.3).sun_irradiance(), vec3(0.0F));
}

// Vertically through clean air: Rayleigh optical depths of 0.065 at 605 nm, 0.097 at 550 and 0.22 at 450, and ozone's
// of 0.04, 0.03 and 0.
TEST(Sky, TransmittanceMatchesMeasurements) {
  const vec3 through = sky(1.0, 90.0).sun_irradiance() / 5.0F;
  EXPECT_NEAR(through.r, 0.91, 0.02);
  EXPECT_NEAR(through.g, 0.88, 0.02);
  EXPECT_NEAR(through.b, 0.80, 0.02);
  // On a clear day with aerosols: 0.7 to 0.8.
  EXPECT_NEAR(bright(sky(2.5, 90.0).sun_irradiance()) / 5.0, 0.75, 0.05);
}

// On a clear day at noon, the sky gives 0.1 to 0.2 of the sun's irradiance.
TEST(Sky, DiffuseFractionMatchesMeasurements) {
  const Sky noon = sky(2.0, 60.0, 0.2);
  const double share = bright(noon.sky_irradiance()) / bright(noon.sun_irradiance());
  EXPECT_GT(share, 0.1);
  EXPECT_LT(share, 0.2);
}

TEST(Sky, ConservesEnergy) {
  for (double elevation = 5.0; elevation <= 90.0; elevation += 17.0) {
    const Sky black = sky(1.0, elevation, 0.0);
    const double sine = std::sin(elevation * std::numbers::pi / 180.0);
    const vec3 falls = black.sky_irradiance() + black.sun_irradiance() * static_cast<float>(sine);
    EXPECT_LT(bright(falls), 5.0 * sine) << elevation;
    EXPECT_GT(bright(falls), 0.5 * 5.0 * sine) << elevation;
  }
}

TEST(Sky, IsSymmetricAboutTheSun) {
  const dvec3 to_sun = direction(30.0, 65.0);
  const Sky turned(SkyModel{}, to_sun);
  const Sky straight(SkyModel{}, direction(30.0, 0.0));
  for (double elevation = 1.0; elevation < 90.0; elevation += 11.0) {
    for (double away = 0.0; away <= 180.0; away += 13.0) {
      const vec3 left = turned.radiance(direction(elevation, 65.0 - away));
      const vec3 right = turned.radiance(direction(elevation, 65.0 + away));
      const vec3 other = straight.radiance(direction(elevation, away));
      EXPECT_LT(glm::distance(left, right), 1.0e-4F * glm::length(left));
      EXPECT_LT(glm::distance(left, other), 1.0e-4F * glm::length(left));
    }
  }
}

TEST(Sky, HazeMovesLightFromTheSunToTheSky) {
  double sun = 5.0;
  double from_sky = 0.0;
  for (double turbidity = 1.0; turbidity <= 10.0; turbidity += 1.0) {
    const Sky noon = sky(turbidity, 60.0);
    EXPECT_LT(bright(noon.sun_irradiance()), sun) << turbidity;
    EXPECT_GT(bright(noon.sky_irradiance()), from_sky) << turbidity;
    sun = bright(noon.sun_irradiance());
    from_sky = bright(noon.sky_irradiance());
  }
}

TEST(Sky, GroundReflectsByItsAlbedo) {
  const Sky noon = sky(3.0, 40.0, 0.5);
  const double sine = std::sin(40.0 * std::numbers::pi / 180.0);
  const vec3 falls = noon.sky_irradiance() + noon.sun_irradiance() * static_cast<float>(sine);
  const vec3 back = noon.radiance(direction(-20.0, 10.0));
  EXPECT_LT(glm::distance(back, falls * static_cast<float>(0.5 / std::numbers::pi)), 1.0e-5F * glm::length(back));
  EXPECT_EQ(sky(3.0, 40.0, 0.0).radiance(direction(-20.0, 10.0)), vec3(0.0F));
  EXPECT_GT(bright(noon.sky_irradiance()), bright(sky(3.0, 40.0, 0.0).sky_irradiance()));
}

TEST(Sky, DarkensAfterSunsetAndStaysFinite) {
  double before = 1.0e9;
  for (double elevation = 0.0; elevation >= -90.0; elevation -= 6.0) {
    const Sky dusk({10.0, 1.0}, direction(elevation, 0.0));
    const double now = bright(dusk.sky_irradiance());
    EXPECT_LE(now, before) << elevation;
    before = now;
    for (double e = -90.0; e <= 90.0; e += 10.0) {
      for (double a = 0.0; a < 360.0; a += 45.0) {
        const vec3 c = dusk.radiance(direction(e, a));
        EXPECT_TRUE(std::min({c.r, c.g, c.b}) >= 0.0F && std::max({c.r, c.g, c.b}) < 100.0F) << elevation;
      }
    }
  }
  EXPECT_LT(before, 1.0e-9);
}

TEST(Sky, SunDirectionDoesNotRecomputeTheAtmosphere) {
  const SkyModel clear{2.0, 0.3};
  const light::Daylight morning = light::make_daylight({clear, 10.0});
  const light::Daylight noon = light::make_daylight({clear, 60.0}, &morning);
  EXPECT_EQ(noon.atmosphere, morning.atmosphere);
  const light::Daylight alone = light::make_daylight({clear, 60.0});
  EXPECT_EQ(noon.sun_irradiance, alone.sun_irradiance);
  EXPECT_EQ(noon.surroundings->words, alone.surroundings->words);
  const SkyModel haze{6.0, 0.3};
  const light::Daylight hazy = light::make_daylight({haze, 60.0}, &noon);
  EXPECT_NE(hazy.atmosphere, noon.atmosphere);
  EXPECT_EQ(hazy.surroundings->words, light::make_daylight({haze, 60.0}).surroundings->words);
}

TEST(Sky, IsDeterministic) {
  const Sky one = sky(3.0, 12.0);
  const Sky two = sky(3.0, 12.0);
  for (double e = -5.0; e <= 90.0; e += 5.0) {
    EXPECT_EQ(one.radiance(direction(e, 3.0 * e)), two.radiance(direction(e, 3.0 * e)));
  }
}

class SkyRendering : public test::ViewerTest {};
CUMULET_ON_BACKENDS(SkyRendering);

// The same seed and samples, so that two images with the same light have no random difference.
TEST_P(SkyRendering, SkyModelMatchesItsEnvironmentImage) {
  const SkyModel model{.turbidity = 2.0, .ground_albedo = 0.4};
  const Sky day(model, direction(25.0, 40.0));
  // The values 7 are ignored with a physical sky.
  const viewer::Light physical{40.0F, 25.0F, vec3(7.0F), vec3(7.0F), model};
  const viewer::Light sun{40.0F, 25.0F, day.sun_irradiance(), vec3(0.0F)};  // of angle 0, as the other sun
  const auto still = make();
  still->set_volume(test::make_volume(glm::ivec3(20), glm::ivec3(0), [](const glm::ivec3& p) {
    return glm::length(vec3(p) - 9.5F) < 9.0F ? 1.0F : 0.0F;
  }));
  still->set_camera(test::camera_at({9.5, 9.5, 60.0}, {9.5, 9.5, 9.5}, 25.0));
  still->set_medium({0.15, vec3(0.9F), {0.3F}, 0});
  // Paths differ, because sampling probabilities depend on the texels' brightness relative to the mean.
  const auto seen = [&] { return dvec3(test::render(*still, {24, 24, 512, 1}).mean()); };
  const auto expect_same = [](const dvec3& a, const dvec3& b) {
    EXPECT_LT(glm::distance(a, b), 4e-3 * glm::length(b));
  };

  still->set_light(physical);
  const dvec3 whole = seen();
  light::EnvironmentPixels pixels{512, 256, {}};
  for (std::uint32_t y = 0; y < pixels.height; ++y) {
    for (std::uint32_t x = 0; x < pixels.width; ++x)
      pixels.values.push_back(
          day.radiance(direction(90.0 - 180.0 * (y + 0.5) / 256.0, 180.0 - 360.0 * (x + 0.5) / 512.0)));
  }
  still->set_light(sun);
  still->viewer().set_environment(light::make_environment(pixels, "a picture of it"));
  expect_same(seen(), whole);

  // A host's environment replaces the sky, and the sun stays.
  still->viewer().set_environment(light::make_environment({1, 1, {vec3(0.0F)}}, "black"));
  const dvec3 alone = seen();
  still->set_light(physical);
  expect_same(seen(), alone);
  EXPECT_GT(whole.b, 1.2 * alone.b);
  still->viewer().set_environment(nullptr);
  expect_same(seen(), whole);

  // Orientation of the sky in the image.
  const dvec3 away = glm::normalize(dvec3(0.3, 0.2, 1.0));
  still->set_camera(test::camera_at({9.5, 9.5, 60.0}, dvec3(9.5, 9.5, 60.0) + away, 0.5));
  const dvec3 background = seen();
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(background[c] / day.radiance(away)[c], 1.0, 5e-3) << c;
}

}  // namespace
