#pragma once

#include <cstdint>

#include "gl/api.hpp"
#include "render/display.hpp"

namespace cumulet::render {

struct FrameTarget;

/// What a target stores at its draw buffer 0. bits 0: the driver does not say, as of some default framebuffers.
struct TargetFormat {
  int bits = 0;  ///< of red
  bool is_float = false;
  bool is_srgb = false;
  bool operator==(const TargetFormat&) const = default;
};

/// The internal format of a texture from which such a target can be copied without a visible difference.
[[nodiscard]] GLenum copy_format(const TargetFormat& format, ColourEncoding encoding);
/// Of the formats that copy_format gives.
[[nodiscard]] std::uint64_t bytes_per_texel(GLenum format);

/// Checks that a picture with this encoding can be right in a target: that there is a framebuffer, complete, with a
/// color attachment that stores fractions of red, green and blue, with one layer, as large as the frame, with depth if
/// that is to be written, and of a format that suits the encoding. Throws Error(invalid_argument), which names the
/// cause. Binds the framebuffer for drawing. Asks for state of the driver, never for what the device has done.
[[nodiscard]] TargetFormat check_target(const gl::Functions& gl, const FrameTarget& target, ColourEncoding encoding);

}  // namespace cumulet::render
