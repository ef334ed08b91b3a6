#include "sun_dial.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cumulet::demo {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

}  // namespace

double wrap_degrees(double degrees) {
  const double turned = std::remainder(degrees, 360.0);
  return turned <= -180.0 ? turned + 360.0 : turned;
}

DialPoint dial_point(const SunAngles& sun) {
  const double radius = std::clamp(1.0 - sun.elevation / 90.0, 0.0, 1.0);
  return {radius * std::sin(sun.azimuth * degree), radius * std::cos(sun.azimuth * degree)};
}

SunAngles dial_angles(const DialPoint& point, double azimuth) {
  const double radius = std::hypot(point.x, point.y);
  constexpr double centre = 1e-3;
  if (radius > centre) azimuth = wrap_degrees(std::atan2(point.x, point.y) / degree);
  return {azimuth, 90.0 * (1.0 - std::min(radius, 1.0))};
}

SunAngles dial_step(const SunAngles& sun, double turn, double raise) {
  return {wrap_degrees(sun.azimuth + turn), std::clamp(sun.elevation + raise, -90.0, 90.0)};
}

}  // namespace cumulet::demo
