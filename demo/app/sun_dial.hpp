#pragma once

namespace cumulet::demo {

/// The same direction, in (-180, 180].
[[nodiscard]] double wrap_degrees(double degrees);

/// The sky from below its zenith, seen from above: the centre is the zenith, the rim the horizon; -Z (into the
/// picture of the first view) is up, +X right. x to the right, y down, in radii.
struct DialPoint {
  double x = 0.0;
  double y = 0.0;
};
/// Degrees, as in cumulet.h: azimuth from +Z towards +X, in (-180, 180].
struct SunAngles {
  double azimuth = 0.0;
  double elevation = 0.0;
};

/// A sun below the horizon is on the rim.
[[nodiscard]] DialPoint dial_point(const SunAngles& sun);
/// Outside the rim is the horizon. In the centre the azimuth is kept: nothing else says it.
[[nodiscard]] SunAngles dial_angles(const DialPoint& point, double azimuth);
/// A step by arrow keys: sideways turns, up and down raise and lower; the elevation stays within -90 to 90.
[[nodiscard]] SunAngles dial_step(const SunAngles& sun, double turn, double raise);

}  // namespace cumulet::demo
