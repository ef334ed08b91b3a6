#pragma once

#include <cstdint>
#include <span>

#include "surface/scene.hpp"

namespace cumulet::light {

/// Statistics of the lights of a scene at one moment. Flux is the luminance of the total emitted power.
struct SceneLights {
  std::uint32_t analytic_lights = 0;  ///< number of lights, of glTF files and of the host
  std::uint32_t triangles = 0;        ///< emissive triangles; the maximum over all records of the model table
  double analytic_light_flux = 0.0;
  double analytic_lights_arrive = 0.0;  ///< luminance of the lights' irradiance at lit objects (light::share_looks)
  double triangle_flux = 0.0;
  double cross_section = 0.0;  ///< cross-section of the scene's bounding sphere, which catches distant light
};

/// Returns the statistics of these lights, for a scene with a bounding sphere of that radius.
SceneLights scene_lights(std::span<const surface::PunctualLight> analytic_lights, double radius);

}  // namespace cumulet::light
