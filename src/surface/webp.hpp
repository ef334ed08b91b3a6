#pragma once

// Private to surface/: images of EXT_texture_webp.

#include <cstdint>

#include "surface/gltf_file.hpp"
#include "surface/scene.hpp"

namespace cumulet::surface::detail {

/// Size of an image in pixels.
struct WebpSize {
  std::uint64_t width = 0;
  std::uint64_t height = 0;
};

/// Reads the header. Throws Error(file) if it is malformed, or if the image is animated.
WebpSize read_webp_size(Bytes bytes);
/// Decodes an image of the size in its header. Throws Error(file).
Image decode_webp(Bytes bytes, const WebpSize& size);

}  // namespace cumulet::surface::detail
