#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace cumulet::image {

/// Returns how many pixels of premultiplied linear RGBA are brighter than their alpha after exposure, by more than one
/// step of 8 bits. Straight alpha, as in PNG, cannot hold such emission; cumulet_read_display raises their alpha.
[[nodiscard]] std::size_t pixels_brighter_than_alpha(std::span<const float> rgba, double exposure_stops);

/// Returns the line that reports raised alpha in a file, or "" if there are no such pixels.
[[nodiscard]] std::string raised_alpha_note(const std::string& path, std::size_t pixels);

}  // namespace cumulet::image
