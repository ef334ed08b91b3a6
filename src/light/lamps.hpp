#pragma once

// Lamps, glTF's and the host's, and glsl/punctual.glsl as C++: the raster pass and the path tracer take the same
// records.

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/shared_code.hpp"
#include "light/scene_lights.hpp"
#include "surface/scene.hpp"

namespace cumulet::core {
#include "punctual.glsl"
}  // namespace cumulet::core

namespace cumulet::light {

/// A lamp of the host's. Colours are linear Rec. 709.
struct Lamp {
  enum class Kind : std::uint8_t { point, spot, disc, rectangle, sun };
  Kind kind = Kind::point;
  glm::dvec3 position{0.0};              ///< world, of its middle; not of a sun
  glm::dvec3 direction{0.0, -1.0, 0.0};  ///< world, unit: where it shines; not of a point
  glm::dvec3 across{1.0, 0.0, 0.0};      ///< world, unit, upright to the direction: a rectangle's width is along it
  glm::vec3 power{0.0F};                 ///< W; of a sun W/m2 on a plane that faces it
  double width = 1.0;                    ///< of a rectangle, or a disc's diameter; world units
  double height = 1.0;                   ///< of a rectangle
  double angle = 0.0;       ///< radians: the whole cone of a spot; what a sun's disc covers of the sky, less than pi
  double blend = 0.0;       ///< of a spot: the part of the half angle over which it dims, from 0 to 1
  std::uint32_t group = 0;  ///< of lights
  bool operator==(const Lamp&) const = default;
};
using Lamps = std::vector<Lamp>;

/// What glTF says in candela and lux is taken as radiant (surface::PunctualLight). origin: what positions count from.
core::CmLamp lamp_record(const surface::PunctualLight& light, const glm::dvec3& origin);
/// Power as Blender's lamps have it: a point sends out power / (4 pi) a steradian, a spot the same inside of its cone,
/// a disc and a rectangle power / (4 x area) of radiance on the side where they shine.
core::CmLamp lamp_record(const Lamp& lamp, const glm::dvec3& origin);

/// Of the host's, then of the scene's.
std::vector<core::CmLamp> lamp_records(const Lamps& of_host, std::span<const surface::PunctualLight> of_scene,
                                       const glm::dvec3& origin);

/// A ball of what lamps may light.
struct Lit {
  glm::dvec3 centre{0.0};
  double radius = 0.0;
  bool operator==(const Lit&) const = default;
};

/// How likely paths look for each: by the luminance of what arrives on a plane that faces it, at the middle of what is
/// lit or, of one within, at its rim; of several the mean of their shares. A fifth of the looks goes to all alike, for
/// places where the bright ones are in shadow. Returns what arrives of all. lit: those of no radius do not count.
double share_looks(std::span<core::CmLamp> records, std::span<const Lit> lit);

/// How far the nearest lamp that stands somewhere is from the middle of a ball, over its radius. Nothing where there is
/// none, or no ball.
std::optional<double> nearest_lamp(std::span<const core::CmLamp> records, const Lit& ball);

/// Whether looks for lamps from points that flights have passed (glsl/equiangular.glsl) are worth their time in a
/// medium of this mean optical depth. Measured: docs/architecture.md.
bool suits_equiangular(std::optional<double> nearest, double optical_depth);

/// Counts these, too.
void add_lamps(SceneLights& lights, const Lamps& lamps);

}  // namespace cumulet::light
