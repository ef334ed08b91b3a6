#pragma once

// Private to light/: code shared by the readers of environment files.

#include <cstdint>
#include <span>
#include <string>

#include "base/progress.hpp"
#include "light/environment.hpp"
#include "light/primaries.hpp"

namespace cumulet::light {

/// The range of a load's progress during which pixels are decoded.
inline constexpr double decoded_from = 0.2;
inline constexpr double decoded_to = 0.5;

inline std::span<glm::vec3> row_of(EnvironmentPixels& pixels, std::uint32_t y) {
  return std::span(pixels.values).subspan(std::size_t{y} * pixels.width, pixels.width);
}

/// Converts an image to linear Rec. 709 by a matrix, and adds a remark. Throws Error(cancelled).
void convert_rows(EnvironmentPixels& pixels, const glm::dmat3& matrix, const std::string& from, Progress* progress);

}  // namespace cumulet::light
