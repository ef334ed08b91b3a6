#pragma once

namespace cumulet::demo {

/// Returns the same angle in (-180, 180].
[[nodiscard]] double wrap_degrees(double degrees);

/// A point of the sun dial, which shows the sky from above: the zenith is the center, the horizon is the rim. -Z (the
/// initial viewing direction) is up, +X is right. x is to the right, y down, in units of the radius.
struct DialPoint {
  double x = 0.0;
  double y = 0.0;
};
/// Angles in degrees, as in cumulet.h: azimuth from +Z towards +X, in (-180, 180].
struct SunAngles {
  double azimuth = 0.0;
  double elevation = 0.0;
};

/// Returns the position of the sun; below the horizon it is on the rim.
[[nodiscard]] DialPoint dial_point(const SunAngles& sun);
/// Returns the angles of a point. Outside the rim the elevation is 0. In the center, where the azimuth is undefined,
/// `azimuth` is kept.
[[nodiscard]] SunAngles dial_angles(const DialPoint& point, double azimuth);
/// Returns the angles after a step with the arrow keys: left and right change the azimuth, up and down the elevation,
/// which is clamped to -90 to 90.
[[nodiscard]] SunAngles dial_step(const SunAngles& sun, double turn, double raise);

}  // namespace cumulet::demo
