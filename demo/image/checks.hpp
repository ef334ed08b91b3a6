#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "image.hpp"

namespace cumulet::image {

/// The maximum width and height of an image, here and in cumulet.h. A header with a larger size is damaged or hostile.
inline constexpr std::int64_t max_side = 16384;

[[noreturn]] inline void fail(const std::string& path, const std::string& cause) {
  throw std::runtime_error(path + ": " + cause);
}

inline void check_size(const std::string& path, std::int64_t width, std::int64_t height) {
  if (width < 1 || height < 1 || width > max_side || height > max_side)
    fail(path, "the image size " + std::to_string(width) + "x" + std::to_string(height) + " is not supported");
}

/// Checks the size. A number of pixels that does not match the size is a bug of the caller (std::logic_error).
inline void check_image(const std::string& path, const Image& image) {
  check_size(path, image.width, image.height);
  if (image.rgba.size() != std::size_t{4} * image.width * image.height)
    throw std::logic_error(path + ": an image's size and its pixels disagree");
}

}  // namespace cumulet::image
