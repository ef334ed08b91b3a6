#pragma once

#include <cstdint>

#include "gl/api.hpp"
#include "render/passes/display.hpp"
#include "render/passes/frame_target.hpp"

namespace cumulet::render {

/// Format of a target's draw buffer 0. bits 0: the driver does not report it, as for some default framebuffers.
struct TargetFormat {
  int bits = 0;  ///< of red
  bool is_float = false;
  bool is_srgb = false;
  bool operator==(const TargetFormat&) const = default;
};

/// Returns the internal format of a texture that can be copied to such a target without a visible difference.
[[nodiscard]] GLenum copy_format(const TargetFormat& format, ColorEncoding encoding);
/// format: one that copy_format() returns.
[[nodiscard]] std::uint64_t bytes_per_texel(GLenum format);

/// Checks that a picture with this encoding can be drawn correctly to the target. The framebuffer must exist and be
/// complete. Its color attachment must store fractions of red, green and blue, have one layer, be as large as the frame
/// and suit the encoding. A depth attachment must exist if depth is written. Throws Error(invalid_argument), which
/// names the cause. Binds the framebuffer for drawing. Queries driver state only, so it never waits for the device.
[[nodiscard]] TargetFormat check_target(const gl::Functions& gl, const FrameTarget& target, ColorEncoding encoding);

}  // namespace cumulet::render
