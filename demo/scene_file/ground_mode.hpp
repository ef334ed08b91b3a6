#pragma once

#include <cumulet/cumulet.h>

namespace cumulet::demo {

[[nodiscard]] constexpr bool is_shadow_catcher(cumulet_ground_mode mode) {
  return mode == CUMULET_GROUND_SHADOW_CATCHER_BELOW || mode == CUMULET_GROUND_SHADOW_CATCHER_AT_HEIGHT;
}

/// Returns true if the ground is at the lowest point of the scene.
[[nodiscard]] constexpr bool is_below(cumulet_ground_mode mode) {
  return mode == CUMULET_GROUND_BELOW || mode == CUMULET_GROUND_SHADOW_CATCHER_BELOW;
}

/// Returns true if the ground is at cumulet_ground_desc.height.
[[nodiscard]] constexpr bool is_at_height(cumulet_ground_mode mode) {
  return mode == CUMULET_GROUND_AT_HEIGHT || mode == CUMULET_GROUND_SHADOW_CATCHER_AT_HEIGHT;
}

/// Returns the mode of the same kind of ground at a height. mode: not CUMULET_GROUND_NONE.
[[nodiscard]] constexpr cumulet_ground_mode at_height(cumulet_ground_mode mode) {
  return is_shadow_catcher(mode) ? CUMULET_GROUND_SHADOW_CATCHER_AT_HEIGHT : CUMULET_GROUND_AT_HEIGHT;
}

}  // namespace cumulet::demo
