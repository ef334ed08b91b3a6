#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace cumulet::demo {

/// An environment as it looks, to be turned in the panel: as the file has it, +Y at the top, its middle in the middle.
struct Thumbnail {
  static constexpr std::uint32_t width = 256;
  static constexpr std::uint32_t height = 128;
  std::vector<std::uint8_t> rgba;  // sRGB, opaque, first pixel top left
};
using ThumbnailPtr = std::shared_ptr<const Thumbnail>;

/// Of linear radiance, 3 floats a pixel: exposed so that most of it is neither black nor white, suns left aside.
[[nodiscard]] Thumbnail expose(std::span<const float> radiance);
/// Null for none.
[[nodiscard]] ThumbnailPtr make_thumbnail(const cumulet_environment* environment);

// The view is of the world: +Z is in the middle, +X a quarter left of it, as in an environment that is not turned.

/// What of the picture's width is at the view's left edge, where it is repeated.
[[nodiscard]] double left_edge(double rotation_degrees);
/// After a drag by a part of the view's width: what was under the pointer still is. In (-180, 180].
[[nodiscard]] double dragged(double rotation_degrees, double width);
/// Where a direction is, in parts of the width, from 0 to 1.
[[nodiscard]] double place_of(double azimuth_degrees);

}  // namespace cumulet::demo
