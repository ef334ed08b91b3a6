#pragma once

#include <cumulet/cumulet.h>

#include <optional>

namespace cumulet::demo {

/// Whether a medium is the default but for its density scale, which is the volume's.
[[nodiscard]] bool is_unsaid(const cumulet_medium_desc& medium);

/// Kelvin where the volume's temperature is 1, for a medium that does not say; nothing where it has no temperature
/// above 0.
[[nodiscard]] std::optional<float> temperature_scale_of(const cumulet_volume* volume);

/// What a volume that burns is first shown with, at the density scale that suits it, where nothing is said of its
/// medium: demo::apply(Burning). Nothing if it does not burn: flames do, and what is as hot as they are at
/// plain.temperature_scale.
[[nodiscard]] std::optional<cumulet_medium_desc> medium_of_fire(const cumulet_volume* volume,
                                                                const cumulet_medium_desc& plain);

}  // namespace cumulet::demo
