#pragma once

#include <cstdint>
#include <span>

#include "surface/scene.hpp"

namespace cumulet::light {

/// What there is of a scene's own lights at a moment. Flux: the luminance of all that they send out.
struct SceneLights {
  std::uint32_t lamps = 0;      ///< glTF's and the host's
  std::uint32_t triangles = 0;  ///< emissive; of several models, of the one that has most
  double lamp_flux = 0.0;
  double lamps_arrive = 0.0;  ///< luminance of what arrives of them where they light (light::share_looks)
  double triangle_flux = 0.0;
  double cross_section = 0.0;  ///< of the scene's bounding sphere: what it takes of a distant light
};

/// Those lamps, in a scene whose bounding sphere has that radius.
SceneLights scene_lights(std::span<const surface::PunctualLight> lamps, double radius);

}  // namespace cumulet::light
