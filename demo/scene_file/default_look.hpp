#pragma once

#include <optional>

#include "scene_file.hpp"

namespace cumulet::demo {

/// Exposure of take_dusk, in stops.
inline constexpr float dusk_exposure = 1.0F;
/// Smaller corrections of a default exposure are left out, in stops.
inline constexpr float exposure_tolerance = 0.5F;

// In these functions, fields that are 0 equal the library's defaults.

/// Removes the default daylight when an environment is opened, because that contains a sun. Sets it again when the
/// environment is removed and there is no other sun or sky.
void take_daylight(SceneOptions& scene);
void give_daylight(SceneOptions& scene);
/// Returns true if neither the user nor a scene file has set the exposure. measured: the exposure that was set by auto
/// exposure, in stops, also below.
[[nodiscard]] bool is_default_exposure(const SceneOptions& scene, std::optional<float> measured);
/// Sets dusk light with the filmic tone map and a matching exposure, in which flames look bright, if the scene has the
/// default daylight and display and no view of OpenColorIO. Returns true if it did.
bool take_dusk(SceneOptions& scene, std::optional<float> measured = std::nullopt);
/// Sets the default daylight and display again if the scene has those of take_dusk. Returns true if it did.
bool give_day(SceneOptions& scene, std::optional<float> measured = std::nullopt);

}  // namespace cumulet::demo
