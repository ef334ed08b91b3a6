#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <optional>

#include "scene/channels.hpp"
#include "scene/phase.hpp"
#include "volume/ramp.hpp"

namespace cumulet::viewer {

/// Optical properties of a volume, from a checked descriptor.
struct Medium {
  double density_scale = 1.0;
  glm::vec3 albedo{1.0F};
  scene::Phase phase;
  std::uint32_t max_bounces = 0;
  glm::vec3 emission{0.0F};
  scene::Emission field_emission = {};  // of its emission grids
  std::uint32_t group = 0;              // light group
  bool holdout = false;

  static Medium of(const cumulet_medium_desc& d) {
    return {d.density_scale,
            1.0F - glm::make_vec3(d.coalbedo),
            phase_of(d),
            d.max_bounces,
            glm::make_vec3(d.emission),
            {d.flame_strength, glm::make_vec3(d.flame_color),
             d.temperature_scale > 0.0F ? std::optional<double>(d.temperature_scale) : std::nullopt,
             d.temperature_offset, d.blackbody, glm::make_vec3(d.blackbody_tint)},
            d.group,
            d.holdout == 1};
  }
  static scene::Phase phase_of(const cumulet_medium_desc& d) {
    switch (d.phase) {
      case CUMULET_PHASE_TWO_LOBE:
        return {d.anisotropy, d.second_anisotropy, 0.0F, d.second_weight};
      case CUMULET_PHASE_MIE:
        return scene::mie_phase(d.droplet_diameter);
      default:
        return {.anisotropy = d.anisotropy};
    }
  }
};

/// Ramps (1-D transfer functions) of grid values.
struct Ramps {
  volume::Ramp density = {};
  volume::Ramp temperature = {};
  volume::Ramp flame = {};
  volume::ColorRamp density_colors = {};
  volume::ColorRamp temperature_colors = {};
  volume::ColorRamp flame_colors = {};
};

}  // namespace cumulet::viewer
