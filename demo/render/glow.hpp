#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace cumulet::demo {

/// How many pixels of premultiplied linear RGBA are brighter than their alpha once exposed, by more than a byte shows:
/// straight alpha, as PNG has it, cannot hold them.
[[nodiscard]] std::size_t glowing_pixels(std::span<const float> rgba, double exposure_stops);

/// The line that says so of a file; "" where there are none.
[[nodiscard]] std::string glow_note(const std::string& path, std::size_t pixels);

}  // namespace cumulet::demo
