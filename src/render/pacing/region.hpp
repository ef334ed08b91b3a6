#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>

namespace cumulet::render {

/// A rectangle of a picture's pixels, counted from the top left.
struct PixelBox {
  glm::uvec2 first{0U};
  glm::uvec2 size{0U};
  bool operator==(const PixelBox&) const = default;
  [[nodiscard]] std::uint64_t area() const { return std::uint64_t{size.x} * size.y; }
  [[nodiscard]] bool holds(glm::uvec2 pixel) const {
    return glm::all(glm::greaterThanEqual(pixel, first)) && glm::all(glm::lessThan(pixel, first + size));
  }
};

/// Render region (crop window): a part of a picture, in fractions of it from the upper left corner. An extent of 0
/// reaches to the end.
struct Region {
  glm::vec2 corner{0.0F};
  glm::vec2 extent{0.0F};
  bool operator==(const Region&) const = default;

  [[nodiscard]] bool is_whole() const { return *this == Region{}; }
  /// Returns the pixels whose centers the region contains, at least one, plus `margin` pixels on each side. size: of
  /// the picture, not 0.
  [[nodiscard]] PixelBox pixels(glm::uvec2 size, std::uint32_t margin = 0) const {
    PixelBox box;
    for (int axis = 0; axis < 2; ++axis) {
      // The tolerance makes an edge shared by two regions fall between the same two centers for both, even with
      // rounding of floats.
      constexpr double rounding = 2e-3;  // pixels
      const auto before = [&](double edge) {
        const double middles = std::ceil(edge * size[axis] - 0.5 - rounding);
        return static_cast<std::uint32_t>(std::clamp(middles, 0.0, double(size[axis])));
      };
      const double low = corner[axis];
      const double high = extent[axis] > 0.0F ? low + double(extent[axis]) : 1.0;
      const std::uint32_t first = std::min(before(low), size[axis] - 1U);
      const std::uint32_t last = std::max(before(high), first + 1U);
      box.first[axis] = first - std::min(first, margin);
      box.size[axis] = std::min(last + margin, size[axis]) - box.first[axis];
    }
    return box;
  }
};

}  // namespace cumulet::render
