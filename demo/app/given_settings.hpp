#pragma once

#include <cumulet/cumulet.h>

#include <optional>
#include <settings.hpp>
#include <tuple>

namespace cumulet::demo {

/// The last settings that were passed to a viewer. The demo's defaults differ from the library's, so each descriptor is
/// passed once in any case, and later only when it changes.
class GivenSettings {
 public:
  /// Returns true if the descriptor must be passed to the viewer, and records it as passed.
  template <class Desc>
  [[nodiscard]] bool take(const Desc& desc) {
    auto& last = std::get<std::optional<Desc>>(last_);
    if (last && settings::same(*last, desc)) return false;
    last = desc;
    return true;
  }

 private:
  std::tuple<std::optional<cumulet_medium_desc>, std::optional<cumulet_ground_desc>,
             std::optional<cumulet_sun_sky_desc>, std::optional<cumulet_environment_settings_desc>,
             std::optional<cumulet_sampling_desc>, std::optional<cumulet_display_desc>,
             std::optional<cumulet_grid_desc>, std::optional<cumulet_surface_settings_desc>,
             std::optional<cumulet_navigation_desc>>
      last_;
};

}  // namespace cumulet::demo
