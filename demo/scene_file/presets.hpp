#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <optional>
#include <setting.hpp>

namespace cumulet::demo {

enum class Preset { cumulus, smoke, fire, explosion, ground_fog };

inline constexpr std::array preset_choices = {
    settings::Choice{"cumulus", static_cast<int>(Preset::cumulus), "Cumulus", "Droplets that absorb nothing: white."},
    settings::Choice{"smoke", static_cast<int>(Preset::smoke), "Smoke", "Grey, a little forward."},
    settings::Choice{"fire", static_cast<int>(Preset::fire), "Fire",
                     "Bright flames by the flame and temperature grids, thin smoke."},
    settings::Choice{"explosion", static_cast<int>(Preset::explosion), "Explosion",
                     "Dark soot, and what glows in its seams."},
    settings::Choice{"ground-fog", static_cast<int>(Preset::ground_fog), "Ground fog",
                     "Small droplets: soft and pale."}};

/// Sets all of the medium but the density scale, which is the volume's. What gives off light suits volumes of some ten
/// world units.
void apply(Preset preset, cumulet_medium_desc& medium);

/// What of a volume gives off light.
struct Burning {
  double flame = 0.0;        ///< the most of its flame; 0: it has none
  double temperature = 0.0;  ///< likewise
  double size = 1.0;         ///< of its box, world
};

/// Where nothing was said of the medium of a volume that burns: the preset "explosion" for the medium's density scale;
/// with none, of fire alone, "fire". Its light is such that what burns most is as bright in its smoke as the preset's
/// is in the sample explosion, however dense or large the volume is. temperature_scale stays; it must be set.
void apply(const Burning& burning, cumulet_medium_desc& medium);

/// The preset that the medium is, whatever its density scale.
[[nodiscard]] std::optional<Preset> preset_of(const cumulet_medium_desc& medium);

}  // namespace cumulet::demo
