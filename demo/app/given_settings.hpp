#pragma once

#include <cumulet/cumulet.h>

#include <optional>
#include <settings.hpp>
#include <tuple>

namespace cumulet::demo {

/// The groups of settings that a viewer was given last. The demo's defaults are not the library's: so a viewer is given
/// each group once, even if it is the demo's default, and then only what has changed.
class GivenSettings {
 public:
  /// Whether the viewer is still to be given this. From now on it counts as given.
  template <class Desc>
  [[nodiscard]] bool take(const Desc& desc) {
    auto& last = std::get<std::optional<Desc>>(last_);
    if (last && settings::same(*last, desc)) return false;
    last = desc;
    return true;
  }

 private:
  std::tuple<std::optional<cumulet_medium_desc>, std::optional<cumulet_ground_desc>, std::optional<cumulet_light_desc>,
             std::optional<cumulet_environment_settings_desc>, std::optional<cumulet_sampling_desc>,
             std::optional<cumulet_display_desc>, std::optional<cumulet_grid_desc>,
             std::optional<cumulet_surface_settings_desc>, std::optional<cumulet_navigation_desc>>
      last_;
};

}  // namespace cumulet::demo
