#pragma once

// Analytic lights (point, spot, disk, rectangle, distant) of glTF files and of the host, and glsl/light/punctual.glsl
// as C++. The raster pass and the path tracer use the same records.

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/shared_code.hpp"
#include "light/scene_lights.hpp"
#include "surface/scene.hpp"

namespace cumulet::core {
#include "light/punctual.glsl"
}  // namespace cumulet::core

namespace cumulet::light {

/// An analytic light of the host. Colors are linear Rec. 709.
struct AnalyticLight {
  enum class Kind : std::uint8_t { point, spot, disc, rectangle, sun };
  Kind kind = Kind::point;
  glm::dvec3 position{0.0};              ///< world, center; unused for a sun
  glm::dvec3 direction{0.0, -1.0, 0.0};  ///< world, unit: emission direction; unused for a point light
  glm::dvec3 across{1.0, 0.0, 0.0};  ///< world, unit, perpendicular to the direction: the axis of a rectangle's width
  glm::vec3 power{0.0F};             ///< W; for a sun, W/m2 on a plane perpendicular to it
  double width = 1.0;                ///< width of a rectangle, or diameter of a disk; world units
  double height = 1.0;               ///< height of a rectangle; world units
  double angle = 0.0;                ///< radians: full cone angle of a spot; angular diameter of a sun, < pi
  double blend = 0.0;                ///< spot: fraction of the half angle over which it falls off, 0 to 1
  std::uint32_t group = 0;           ///< light group
  bool operator==(const AnalyticLight&) const = default;
};
using AnalyticLights = std::vector<AnalyticLight>;

/// Converts a glTF light; candela and lux are used as radiometric units (surface::PunctualLight). origin: positions
/// become relative to it.
core::CmAnalyticLight analytic_light_record(const surface::PunctualLight& light, const glm::dvec3& origin);
/// Converts a light of the host. Power is defined as in Blender: a point emits power / (4 pi) per steradian, a spot the
/// same inside of its cone. A disk and a rectangle emit a radiance of power / (4 x area) on their front side.
core::CmAnalyticLight analytic_light_record(const AnalyticLight& analytic_light, const glm::dvec3& origin);

/// Returns the records of the host's lights, followed by those of the scene.
std::vector<core::CmAnalyticLight> analytic_light_records(const AnalyticLights& of_host,
                                                          std::span<const surface::PunctualLight> of_scene,
                                                          const glm::dvec3& origin);

/// Bounding ball of an object that is lit.
struct Lit {
  glm::dvec3 centre{0.0};
  double radius = 0.0;
  bool operator==(const Lit&) const = default;
};

/// Sets the probability with which next-event estimation samples each light: by the luminance of its irradiance at the
/// ball's center, or at the ball's surface if the light is inside. With several balls, probabilities are averaged. A
/// fifth of the samples is distributed uniformly, for points where the bright lights are occluded. Returns the maximum
/// total irradiance. lit: balls of radius 0 are ignored.
double share_looks(std::span<core::CmAnalyticLight> records, std::span<const Lit> lit);

/// Returns the distance of the nearest non-distant light from a ball's center, divided by the radius. Returns nullopt
/// if there is no such light or no ball.
std::optional<double> nearest_analytic_light(std::span<const core::CmAnalyticLight> records, const Lit& ball);

/// Whether equiangular sampling of lights (glsl/path/equiangular.glsl) is worth its time in a medium of this mean
/// optical depth. Measured: docs/architecture.md.
bool suits_equiangular(std::optional<double> nearest, double optical_depth);

/// Adds these lights to the counts.
void add_analytic_lights(SceneLights& lights, const AnalyticLights& analytic_lights);

}  // namespace cumulet::light
