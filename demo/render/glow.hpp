#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace cumulet::demo {

/// Counts pixels of premultiplied linear RGBA whose exposed color exceeds their alpha by more than 1/255. Straight
/// alpha, as in PNG, cannot represent them.
[[nodiscard]] std::size_t glowing_pixels(std::span<const float> rgba, double exposure_stops);

/// Returns a warning about these pixels for the file; "" if `pixels` is 0.
[[nodiscard]] std::string glow_note(const std::string& path, std::size_t pixels);

}  // namespace cumulet::demo
