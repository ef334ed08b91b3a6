#pragma once

#include "sun_dial.hpp"

namespace cumulet::demo {

/// The sun's path on a day at the equinox, at 40 degrees of latitude: it rises at 6:00, is 50 degrees high at 12:00 and
/// sets at 18:00.
/// Formula: the horizontal coordinates of a star of declination 0, for example J. Meeus, Astronomical Algorithms,
/// chapter 13.
class SunPath {
 public:
  static constexpr double first_hour = 5.5;
  static constexpr double last_hour = 18.5;

  /// noon_azimuth: direction of the sun at 12:00, in degrees.
  explicit SunPath(double noon_azimuth) : noon_azimuth_(noon_azimuth) {}
  /// Returns the path through a sun, in its morning or its afternoon. A sun that is higher than the path's noon, or
  /// lower than its ends, has the azimuth of a point of the path.
  [[nodiscard]] static SunPath through(const SunAngles& sun, bool afternoon);

  /// Returns the sun at an hour from 0 to 24.
  [[nodiscard]] SunAngles at(double hour) const;
  /// Returns the hour at which the path is nearest to a sun, from first_hour to last_hour.
  [[nodiscard]] double hour_of(const SunAngles& sun) const;

 private:
  double noon_azimuth_;
};

}  // namespace cumulet::demo
