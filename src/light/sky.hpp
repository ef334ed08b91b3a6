#pragma once

// Physical model of a clear sky, computed from properties of the atmosphere: no images, no fitted tables. No GL.

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "light/environment.hpp"

namespace cumulet::light {

/// Parameters of the sky other than the sun's position.
struct SkyModel {
  double turbidity = 3.0;      ///< Linke's, 1 to 10: 1 air without aerosols, 2 very clear, 3 clear, 6 hazy
  double ground_albedo = 0.3;  ///< 0 to 1; the ground lights the air and is visible below the horizon
  bool operator==(const SkyModel&) const = default;
};

/// The atmosphere of a model and its multiple scattering: the part of a sky that is independent of the sun's position,
/// and takes most of the time.
class Atmosphere;
using AtmospherePtr = std::shared_ptr<const Atmosphere>;

/// A sky and its sun, seen from the ground at sea level. Single scattering is exact within quadrature, in 21 wavelength
/// bands. Multiple scattering is by Hillaire, "A Scalable and Production Ready Sky and Atmosphere Rendering Technique"
/// (2020); the forward peak of aerosols counts as not scattered in it (delta-Eddington). The luminance is within 6 % of
/// a path tracer's on average; 15 % in the last degrees above the horizon under a low sun. Colors are linear Rec. 709,
/// clipped to the gamut. White and unit are the sun's light outside of the atmosphere: there its irradiance is 5 in all
/// three components (about 27 klx to 1). At noon it is about 4 on the ground.
///
/// A value. Construction takes about 50 ms on two cores, on TBB threads; the result is bit-identical for any number of
/// them.
class Sky {
 public:
  /// to_sun: unit, +Y up; any direction, also below the horizon.
  Sky(const SkyModel& model, const glm::dvec3& to_sun);
  Sky(const Atmosphere& atmosphere, const glm::dvec3& to_sun);

  /// Returns the radiance from a direction (unit), without the sun's disk. Below the horizon: light reflected by the
  /// ground.
  [[nodiscard]] glm::vec3 radiance(const glm::dvec3& direction) const;
  /// Returns the irradiance of the sun's disk on a plane perpendicular to it. At sunrise and sunset only the part above
  /// the horizon counts.
  [[nodiscard]] const glm::vec3& sun_irradiance() const { return sun_irradiance_; }
  /// Returns the irradiance of the sky without the sun, on the ground.
  [[nodiscard]] const glm::vec3& sky_irradiance() const { return sky_irradiance_; }

 private:
  // Light that reaches the ground from a direction: single scattering by air and by aerosols, both before the phase
  // functions, and multiple scattering.
  struct Scattered {
    glm::vec3 air{0.0F};
    glm::vec3 aerosols{0.0F};
    glm::vec3 more{0.0F};
  };
  static constexpr std::size_t rows = 48;     // elevations, from the horizon up, denser near the horizon
  static constexpr std::size_t columns = 25;  // azimuths, from the sun's to the opposite

  [[nodiscard]] Scattered scattered(double elevation, double azimuth) const;

  glm::dvec3 to_sun_;
  std::vector<Scattered> table_;
  glm::vec3 sun_irradiance_{0.0F};
  glm::vec3 sky_irradiance_{0.0F};
  glm::vec3 ground_radiance_{0.0F};
};

/// Parameters of an image's physical sky; the sun's azimuth only rotates it.
struct Day {
  SkyModel model;
  double sun_elevation_degrees = 90.0;
  bool above_alone = false;  ///< below the horizon it is black (covered by other objects), so that NEE avoids it
  bool operator==(const Day&) const = default;
};

/// The result of a physical sky that lights a scene.
struct Daylight {
  Day day;
  AtmospherePtr atmosphere;  ///< of day.model
  glm::vec3 sun_irradiance{0.0F};
  EnvironmentPtr surroundings;  ///< everything except the sun, 512 x 256; the sun is at azimuth 0, +Z
};

/// Computes the daylight. Takes less than half of the time if `last` (may be null) has the same model.
Daylight make_daylight(const Day& day, const Daylight* last = nullptr);

}  // namespace cumulet::light
