#include "sun_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cumulet::demo {
namespace {

constexpr double radians = std::numbers::pi / 180.0;
constexpr double degrees_per_hour = 15.0;
constexpr double latitude = 40.0 * radians;

/// Returns the sun at an hour angle on the path whose noon has azimuth 0.
SunAngles at_angle(double hour_angle) {
  const double west = std::sin(hour_angle);
  const double up = std::cos(hour_angle) * std::cos(latitude);
  const double south = std::cos(hour_angle) * std::sin(latitude);
  // Seen from above, azimuths grow from +Z (south) towards +X (east).
  return {std::atan2(-west, south) / radians, std::asin(up) / radians};
}

}  // namespace

SunPath SunPath::through(const SunAngles& sun, bool afternoon) {
  const double highest = std::cos(latitude);
  const double longest = (last_hour - 12.0) * degrees_per_hour * radians;
  const double up = std::clamp(std::sin(sun.elevation * radians) / highest, std::cos(longest), 1.0);
  const double hour_angle = (afternoon ? 1.0 : -1.0) * std::acos(up);
  return SunPath(wrap_degrees(sun.azimuth - at_angle(hour_angle).azimuth));
}

SunAngles SunPath::at(double hour) const {
  SunAngles sun = at_angle((hour - 12.0) * degrees_per_hour * radians);
  sun.azimuth = wrap_degrees(sun.azimuth + noon_azimuth_);
  return sun;
}

double SunPath::hour_of(const SunAngles& sun) const {
  const double azimuth = (sun.azimuth - noon_azimuth_) * radians;
  const double elevation = sun.elevation * radians;
  const double west = -std::cos(elevation) * std::sin(azimuth);
  const double south = std::cos(elevation) * std::cos(azimuth);
  // The nearest point of a great circle is the projection onto its plane.
  const double towards_noon = std::sin(elevation) * std::cos(latitude) + south * std::sin(latitude);
  const double hour = 12.0 + std::atan2(west, towards_noon) / radians / degrees_per_hour;
  return std::clamp(hour, first_hour, last_hour);
}

}  // namespace cumulet::demo
