// The sun's path over a day in cumulet-demo.

#include <gtest/gtest.h>

#include <cmath>

#include "sun_path.hpp"

namespace {

using namespace cumulet::demo;

TEST(SunPathTest, RisesIsHighestAtNoonAndSets) {
  const SunPath path(0.0);  // noon in the direction of +Z
  EXPECT_NEAR(path.at(6.0).elevation, 0.0, 1e-9);
  EXPECT_NEAR(path.at(6.0).azimuth, 90.0, 1e-9) << "in the east, +X";
  EXPECT_NEAR(path.at(12.0).elevation, 50.0, 1e-9);
  EXPECT_NEAR(path.at(12.0).azimuth, 0.0, 1e-9);
  EXPECT_NEAR(path.at(18.0).elevation, 0.0, 1e-9);
  EXPECT_NEAR(path.at(18.0).azimuth, -90.0, 1e-9);
  // sin(elevation) = cos(40 degrees) cos(45 degrees), tan(azimuth) = tan(45 degrees) / sin(40 degrees)
  EXPECT_NEAR(path.at(15.0).elevation, 32.797, 1e-3);
  EXPECT_NEAR(path.at(15.0).azimuth, -57.268, 1e-3);
}

TEST(SunPathTest, HoursAreThoseOfTheirSuns) {
  for (const double noon : {0.0, 77.0, -170.0}) {
    const SunPath path(noon);
    for (double hour = SunPath::first_hour; hour <= SunPath::last_hour; hour += 0.5)
      EXPECT_NEAR(path.hour_of(path.at(hour)), hour, 1e-9) << noon;
  }
}

TEST(SunPathTest, PassesThroughASunInTheMorningOrTheAfternoon) {
  for (const bool afternoon : {false, true}) {
    for (const SunAngles sun : {SunAngles{30.0, 35.0}, SunAngles{-120.0, 5.0}, SunAngles{179.0, 49.0}}) {
      const SunPath path = SunPath::through(sun, afternoon);
      const double hour = path.hour_of(sun);
      EXPECT_EQ(hour > 12.0, afternoon);
      EXPECT_NEAR(path.at(hour).elevation, sun.elevation, 1e-6);
      EXPECT_NEAR(std::remainder(path.at(hour).azimuth - sun.azimuth, 360.0), 0.0, 1e-6);
    }
  }
}

TEST(SunPathTest, AHighSunIsNoonAndALowOneTheEnd) {
  EXPECT_NEAR(SunPath::through({10.0, 80.0}, true).at(12.0).azimuth, 10.0, 1e-6);
  const SunPath low = SunPath::through({10.0, -60.0}, true);
  EXPECT_NEAR(low.at(SunPath::last_hour).azimuth, 10.0, 1e-6);
}

}  // namespace
