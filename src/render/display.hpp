#pragma once

// glsl/display.glsl as C++, and what is built on it.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "display.glsl"
}  // namespace cumulet::core

namespace cumulet::render {

enum class ToneMap { neutral = 0, filmic = 1, clip = 2 };
enum class ColourEncoding { srgb = 0, srgb_framebuffer = 1, linear = 2, hdr = 3 };

/// How radiance becomes colour.
struct Display {
  float exposure_stops = 0.0F;
  ToneMap tone_map = ToneMap::neutral;
  bool legend = false;                  // a debug view: neither exposed nor tone-mapped
  bool transparent = false;             // premultiplied, without the background
  std::optional<glm::vec3> backdrop{};  // opaque: radiance to show instead of the background
  ColourEncoding encoding = ColourEncoding::srgb;
  bool denoise = false;

  /// Whether the background's radiance is part of what is shown.
  [[nodiscard]] bool shows_background() const { return !transparent && !backdrop; }
};

/// The factor on radiance.
inline float exposure_of(const Display& display) { return display.legend ? 1.0F : std::exp2(display.exposure_stops); }

/// The curve, as display.glsl counts them.
inline std::uint32_t curve_of(const Display& display) {
  if (display.encoding == ColourEncoding::hdr) return CM_TONE_MAP_NONE;
  return display.legend ? CM_TONE_MAP_CLIP : static_cast<std::uint32_t>(display.tone_map);
}

/// Linear RGBA as cumulet_read_linear gives it to sRGB bytes as cumulet_read_display does: straight alpha, opaque
/// unless display.transparent. The encoding of display does not count. bytes is as long as linear.
inline void to_display(std::span<const float> linear, const Display& display, std::span<std::uint8_t> bytes) {
  const auto to_byte = [](float unit) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(unit, 0.0F, 1.0F) * 255.0F));
  };
  Display encoded = display;
  encoded.encoding = ColourEncoding::srgb;
  const float exposure = exposure_of(encoded);
  const std::uint32_t curve = curve_of(encoded);
  for (std::size_t i = 0; i + 4 <= linear.size(); i += 4) {
    const float alpha = display.transparent ? core::cm_displayable(linear[i + 3]) : 1.0F;
    const float scale = alpha > 0.0F ? 1.0F / std::min(alpha, 1.0F) : 0.0F;
    const glm::vec3 straight = scale * glm::vec3(linear[i], linear[i + 1], linear[i + 2]);
    const glm::vec3 colour = core::cm_display(straight, exposure, curve, true);
    for (int c = 0; c < 3; ++c) bytes[i + static_cast<std::size_t>(c)] = to_byte(colour[c]);
    bytes[i + 3] = to_byte(alpha);
  }
}

}  // namespace cumulet::render
