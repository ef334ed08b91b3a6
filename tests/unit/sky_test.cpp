// The sky of a clear day: what everybody sees, and what has been measured of it.

#include "light/sky.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/luminance.hpp"

namespace {

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
double bright(const vec3& colour) { return luminance(dvec3(colour)); }

TEST(Sky, IsBlueAboveAndBrighterAtTheHorizon) {
  const Sky noon = sky(2.0, 60.0);
  const vec3 zenith = noon.radiance({0.0, 1.0, 0.0});
  EXPECT_GT(zenith.b, 1.5F * zenith.g);
  EXPECT_GT(zenith.g, 1.2F * zenith.r);
  const vec3 low = noon.radiance(direction(2.0, 90.0));
  EXPECT_GT(bright(low), 1.5 * bright(zenith));
  EXPECT_LT(low.b / low.r, 0.6F * zenith.b / zenith.r);
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

// Straight through air alone: by Rayleigh's optical depths of 0.065 at 605 nm, 0.097 at 550 and 0.22 at 450, and
// ozone's of 0.04, 0.03 and 0.
TEST(Sky, AirLetsThroughWhatIsMeasured) {
  const vec3 through = sky(1.0, 90.0).sun_irradiance() / 5.0F;
  EXPECT_NEAR(through.r, 0.91, 0.02);
  EXPECT_NEAR(through.g, 0.88, 0.02);
  EXPECT_NEAR(through.b, 0.80, 0.02);
  // A clear day's, with aerosols: 0.7 to 0.8.
  EXPECT_NEAR(bright(sky(2.5, 90.0).sun_irradiance()) / 5.0, 0.75, 0.05);
}

// Of a clear day at noon the sky gives 0.1 to 0.2 of what the sun gives.
TEST(Sky, ShareOfTheSkyIsMeasuredOnes) {
  const Sky noon = sky(2.0, 60.0, 0.2);
  const double share = bright(noon.sky_irradiance()) / bright(noon.sun_irradiance());
  EXPECT_GT(share, 0.1);
  EXPECT_LT(share, 0.2);
}

TEST(Sky, MakesNoLight) {
  for (double elevation = 5.0; elevation <= 90.0; elevation += 17.0) {
    const Sky black = sky(1.0, elevation, 0.0);
    const double sine = std::sin(elevation * std::numbers::pi / 180.0);
    const vec3 falls = black.sky_irradiance() + black.sun_irradiance() * static_cast<float>(sine);
    EXPECT_LT(bright(falls), 5.0 * sine) << elevation;
    EXPECT_GT(bright(falls), 0.5 * 5.0 * sine) << elevation;
  }
}

TEST(Sky, IsTheSameOnBothSidesOfTheSun) {
  const dvec3 to_sun = direction(30.0, 65.0);
  const Sky turned({}, to_sun);
  const Sky straight({}, direction(30.0, 0.0));
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

TEST(Sky, HazeTakesFromTheSunAndGivesToTheSky) {
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

TEST(Sky, TheGroundSendsBackItsShare) {
  const Sky noon = sky(3.0, 40.0, 0.5);
  const double sine = std::sin(40.0 * std::numbers::pi / 180.0);
  const vec3 falls = noon.sky_irradiance() + noon.sun_irradiance() * static_cast<float>(sine);
  const vec3 back = noon.radiance(direction(-20.0, 10.0));
  EXPECT_LT(glm::distance(back, falls * static_cast<float>(0.5 / std::numbers::pi)), 1.0e-5F * glm::length(back));
  EXPECT_EQ(sky(3.0, 40.0, 0.0).radiance(direction(-20.0, 10.0)), vec3(0.0F));
  EXPECT_GT(bright(noon.sky_irradiance()), bright(sky(3.0, 40.0, 0.0).sky_irradiance()));
}

TEST(Sky, GetsDarkAfterSunsetAndIsNeverBroken) {
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

TEST(Sky, TheSameTwice) {
  const Sky one = sky(3.0, 12.0);
  const Sky two = sky(3.0, 12.0);
  for (double e = -5.0; e <= 90.0; e += 5.0) {
    EXPECT_EQ(one.radiance(direction(e, 3.0 * e)), two.radiance(direction(e, 3.0 * e)));
  }
}

}  // namespace
