#pragma once

#include <cumulet/cumulet.h>

#include <optional>

namespace cumulet::demo {

/// Returns true if all fields except the density scale have their default values.
[[nodiscard]] bool is_unsaid(const cumulet_medium_desc& medium);

/// Returns the kelvin of the temperature value 1, for a medium that does not set temperature_scale. Returns nullopt if
/// the volume has no temperature above 0.
[[nodiscard]] std::optional<float> temperature_scale_of(const cumulet_volume* volume);

/// Returns the default medium of a burning volume: `plain` with demo::apply(Burning) and the suggested density scale.
/// Returns nullopt if the volume does not burn. A volume burns if it has a flame grid, or if its maximum temperature,
/// scaled by plain.temperature_scale, is that of a flame.
[[nodiscard]] std::optional<cumulet_medium_desc> medium_of_fire(const cumulet_volume* volume,
                                                                const cumulet_medium_desc& plain);

/// Reads a file of which a grid has the name of a temperature or a flame, and shows it in the viewer with the medium of
/// medium_of_fire, or with `plain` and the suggested density scale if it does not burn. The medium is set before the
/// grid is built for it, so the grid is built once. file.log receives notes. Returns false and changes nothing if no
/// grid has such a name, and if the volume cannot be read or is empty, which loading through the viewer reports.
[[nodiscard]] bool show_fire(cumulet_viewer* viewer, const cumulet_volume_file_desc& file,
                             const cumulet_medium_desc& plain);

}  // namespace cumulet::demo
