#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace cumulet::demo {

/// Thumbnail of an environment map for the panel, in the orientation of the file: +Y at the top, its center in the
/// middle.
struct Thumbnail {
  static constexpr std::uint32_t width = 256;
  static constexpr std::uint32_t height = 128;
  std::vector<std::uint8_t> rgba;  // sRGB, opaque, first pixel at the top left
};
using ThumbnailPtr = std::shared_ptr<const Thumbnail>;

/// Converts linear radiance, 3 floats per pixel, with an exposure for the typical brightness; suns are ignored.
[[nodiscard]] Thumbnail expose(std::span<const float> radiance);
/// Returns null if there is no environment.
[[nodiscard]] ThumbnailPtr make_thumbnail(const cumulet_environment* environment);

// The view shows world directions: +Z is in the middle and +X a quarter of the width left of it, as in an environment
// without rotation.

/// Returns the texture coordinate at the view's left edge. The texture repeats.
[[nodiscard]] double left_edge(double rotation_degrees);
/// Returns the rotation after a drag by `width`, in units of the view's width: the image follows the pointer. The
/// result is in (-180, 180].
[[nodiscard]] double dragged(double rotation_degrees, double width);
/// Returns the horizontal position of a direction, 0 to 1.
[[nodiscard]] double position_of(double azimuth_degrees);

}  // namespace cumulet::demo
