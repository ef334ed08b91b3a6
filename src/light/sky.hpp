#pragma once

// The sky of a clear day, from what is known of the air: no pictures, no fitted tables. No GL.

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "light/environment.hpp"

namespace cumulet::light {

/// What the sky depends on beside the sun's place.
struct SkyModel {
  double turbidity = 3.0;      ///< Linke's, 1 to 10: 1 air without aerosols, 2 very clear, 3 clear, 6 hazy
  double ground_albedo = 0.3;  ///< 0 to 1: what the ground sends back, to the air and below the horizon
  bool operator==(const SkyModel&) const = default;
};

/// The air of a model, and light in it: what of a sky does not depend on where the sun stands, and most of its time.
class Atmosphere;
using AtmospherePtr = std::shared_ptr<const Atmosphere>;

/// A sky and its sun, seen from the ground at sea level. Light that was scattered once is exact within quadrature, in
/// 21 bands of wavelength; the rest is by Hillaire, "A Scalable and Production Ready Sky and Atmosphere Rendering
/// Technique" (2020). Colours are linear Rec. 709, what that cannot mix clipped. White and unit are the sun's light
/// outside of the atmosphere: there its irradiance is 5 in all three (some 27 klx to 1), so that at noon it is about 4
/// on the ground.
///
/// A value; made in some 50 ms of two cores, on TBB's threads, bit for bit the same by any number of them.
class Sky {
 public:
  /// to_sun: unit, +Y up; anywhere, also below the horizon.
  Sky(const SkyModel& model, const glm::dvec3& to_sun);
  Sky(const Atmosphere& atmosphere, const glm::dvec3& to_sun);

  /// From a direction (unit), without the sun's disc. Below the horizon: what the lit ground sends back.
  [[nodiscard]] glm::vec3 radiance(const glm::dvec3& direction) const;
  /// Of the sun's disc, on a plane that faces it; at its rise and set of the part that is above the horizon.
  [[nodiscard]] const glm::vec3& sun_irradiance() const { return sun_irradiance_; }
  /// Of the sky without the sun, on the ground.
  [[nodiscard]] const glm::vec3& sky_irradiance() const { return sky_irradiance_; }

 private:
  // What reaches the ground from a direction, before phase functions: light scattered once by air and by aerosols, and
  // all that was scattered more often.
  struct Scattered {
    glm::vec3 air{0.0F};
    glm::vec3 aerosols{0.0F};
    glm::vec3 more{0.0F};
  };
  static constexpr std::size_t rows = 48;     // of elevation, the horizon first, closer together there
  static constexpr std::size_t columns = 25;  // of azimuth from the sun's, to its opposite

  [[nodiscard]] Scattered scattered(double elevation, double azimuth) const;

  glm::dvec3 to_sun_;
  std::vector<Scattered> table_;
  glm::vec3 sun_irradiance_{0.0F};
  glm::vec3 sky_irradiance_{0.0F};
  glm::vec3 ground_radiance_{0.0F};
};

/// What a picture's physical sky depends on; its azimuth only turns it.
struct Day {
  SkyModel model;
  double sun_elevation_degrees = 90.0;
  bool above_alone = false;  ///< below the horizon it is dark: something else is there, and looks go where light is
  bool operator==(const Day&) const = default;
};

/// Of a sky what a picture is lit by.
struct Daylight {
  Day day;
  AtmospherePtr atmosphere;  ///< of its model
  glm::vec3 sun_irradiance{0.0F};
  EnvironmentPtr surroundings;  ///< all but the sun, 512 x 256; the sun is at azimuth 0, +Z
};

/// As Sky's constructor; in less than half of the time where the last (may be null) is of the same model.
Daylight make_daylight(const Day& day, const Daylight* last = nullptr);

}  // namespace cumulet::light
