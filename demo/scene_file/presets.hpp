#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <optional>
#include <setting.hpp>

namespace cumulet::demo {

enum class Preset { cumulus, smoke, fire, explosion, ground_fog };

inline constexpr std::array preset_choices = {
    settings::Choice{"cumulus", static_cast<int>(Preset::cumulus), "Cumulus",
                     "Water droplets without absorption: white."},
    settings::Choice{"smoke", static_cast<int>(Preset::smoke), "Smoke",
                     "Gray smoke, as Blender's Principled Volume by default."},
    settings::Choice{"fire", static_cast<int>(Preset::fire), "Fire",
                     "Bright flames from the flame and temperature grids, thin smoke."},
    settings::Choice{"explosion", static_cast<int>(Preset::explosion), "Explosion",
                     "Dark soot with emission from its seams."},
    settings::Choice{"ground-fog", static_cast<int>(Preset::ground_fog), "Ground fog",
                     "Small water droplets: soft and pale."}};

/// Sets all of the medium except the density scale, which belongs to the volume. The emission suits volumes of about
/// ten world units.
void apply(Preset preset, cumulet_medium_desc& medium);

/// Properties of a burning volume that determine its emission.
struct Burning {
  double flame = 0.0;        ///< maximum of the flame grid; 0: no flame grid
  double temperature = 0.0;  ///< maximum of the temperature grid; 0: no temperature grid
  double size = 1.0;         ///< diagonal of the bounding box, world units
};

/// Sets the default medium of a burning volume: the preset "explosion" with the medium's density scale, or "fire" if
/// that scale is 0. The emission is scaled so that the hottest part is as bright as with the preset in the sample
/// explosion, for any density and size. temperature_scale is kept and must be set.
void apply(const Burning& burning, cumulet_medium_desc& medium);

/// Returns the preset that the medium equals, ignoring its density scale; nullopt if there is none.
[[nodiscard]] std::optional<Preset> preset_of(const cumulet_medium_desc& medium);

}  // namespace cumulet::demo
