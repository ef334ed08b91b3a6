#include "straight_alpha.hpp"

#include <algorithm>
#include <cmath>

namespace cumulet::image {

std::size_t pixels_brighter_than_alpha(std::span<const float> rgba, double exposure_stops) {
  constexpr float byte = 1.0F / 255.0F;
  const auto exposure = static_cast<float>(std::exp2(exposure_stops));
  std::size_t pixels = 0;
  for (std::size_t i = 0; i + 4 <= rgba.size(); i += 4) {
    const float peak = std::max({rgba[i], rgba[i + 1], rgba[i + 2]}) * exposure;
    const float alpha = std::max(rgba[i + 3], 0.0F);
    if (alpha < 1.0F - byte && peak > alpha + byte) ++pixels;
  }
  return pixels;
}

std::string raised_alpha_note(const std::string& path, std::size_t pixels) {
  if (pixels == 0) return {};
  return path + ": " + std::to_string(pixels) + (pixels == 1 ? " pixel is" : " pixels are") +
         " brighter than straight alpha in a PNG allows: alpha is increased there and hides more of the background "
         "(use .exr to keep color and alpha)";
}

}  // namespace cumulet::image
