#pragma once

// C++ side of glsl/display/display.glsl: conversion of radiance to displayed colors.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>

#include "render/passes/display_lut.hpp"

namespace cumulet::render {

enum class ToneMap { neutral = 0, filmic = 1, clip = 2 };
enum class ColorEncoding { srgb = 0, srgb_framebuffer = 1, linear = 2, hdr = 3 };

/// How radiance is converted to a displayed color.
struct Display {
  float exposure_stops = 0.0F;
  ToneMap tone_map = ToneMap::neutral;
  bool legend = false;                  // debug view: without exposure and tone mapping
  bool transparent = false;             // premultiplied, without the background
  std::optional<glm::vec3> backdrop{};  // opaque: radiance that replaces the background
  ColorEncoding encoding = ColorEncoding::srgb;
  bool denoise = false;
  DisplayLutPtr lut{};  // replaces the tone curve, except for legends and for ColorEncoding::hdr
  bool operator==(const Display&) const = default;

  /// True if the background's radiance is part of the displayed image.
  [[nodiscard]] bool shows_background() const { return !transparent && !backdrop; }
};

/// Returns the factor on radiance.
inline float exposure_of(const Display& display) { return display.legend ? 1.0F : std::exp2(display.exposure_stops); }

/// Returns the tone curve, numbered as in glsl/display/display.glsl.
inline std::uint32_t curve_of(const Display& display) {
  if (display.encoding == ColorEncoding::hdr) return CM_TONE_MAP_NONE;
  return display.legend ? CM_TONE_MAP_CLIP : static_cast<std::uint32_t>(display.tone_map);
}

/// Returns the LUT that replaces the tone curve; null if there is none.
inline DisplayLutPtr lut_of(const Display& display) {
  return display.legend || display.encoding == ColorEncoding::hdr ? nullptr : display.lut;
}

/// Converts exposed radiance to an sRGB-encoded color by the LUT, or by the curve if the LUT is null.
inline glm::vec3 encoded_color(const glm::vec3& exposed, std::uint32_t curve, const DisplayLut* lut) {
  return lut != nullptr ? encoded_color(*lut, core::cm_exposed(exposed, 1.0F))
                        : core::cm_display(exposed, 1.0F, curve, true);
}

/// Converts premultiplied, exposed radiance to an sRGB-encoded color with straight alpha. If radiance does not exceed
/// alpha, the color is display(radiance / alpha) and alpha is unchanged. Radiance beyond that, as of emission, has no
/// straight color. The excess is treated as light from the uncovered part of the pixel, and alpha is raised until it
/// can hold the color. Over black nothing is lost.
inline glm::vec4 straight_display(const glm::vec4& exposed, std::uint32_t curve, const DisplayLut* lut = nullptr) {
  const float alpha = std::min(core::cm_displayable(exposed.w), 1.0F);
  glm::vec3 covering(0.0F);
  glm::vec3 emissive(0.0F);
  for (int c = 0; c < 3; ++c) {
    const float radiance = core::cm_displayable(exposed[c]);
    const bool glows = radiance > alpha;
    emissive[c] = glows ? radiance - alpha : 0.0F;
    if (alpha > 0.0F) covering[c] = glows ? radiance + (1.0F - alpha) : radiance / alpha;
  }
  const glm::vec3 color =
      alpha * encoded_color(covering, curve, lut) + (1.0F - alpha) * encoded_color(emissive, curve, lut);
  const float raised = std::max({alpha, color.x, color.y, color.z});
  return raised > 0.0F ? glm::vec4(color / raised, raised) : glm::vec4(0.0F);
}

/// Converts linear RGBA as of cumulet_read_linear to sRGB bytes as of cumulet_read_display: by straight_display() if
/// display.transparent, else opaque. display.encoding is ignored. bytes must be as long as linear.
inline void to_display(std::span<const float> linear, const Display& display, std::span<std::uint8_t> bytes) {
  const auto to_byte = [](float unit) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(unit, 0.0F, 1.0F) * 255.0F));
  };
  Display encoded = display;
  encoded.encoding = ColorEncoding::srgb;
  const float exposure = exposure_of(encoded);
  const std::uint32_t curve = curve_of(encoded);
  const DisplayLutPtr lut = lut_of(encoded);
  for (std::size_t i = 0; i + 4 <= linear.size(); i += 4) {
    const glm::vec3 exposed = exposure * glm::vec3(linear[i], linear[i + 1], linear[i + 2]);
    const glm::vec4 color = straight_display({exposed, display.transparent ? linear[i + 3] : 1.0F}, curve, lut.get());
    for (int c = 0; c < 4; ++c) bytes[i + static_cast<std::size_t>(c)] = to_byte(color[c]);
  }
}

}  // namespace cumulet::render
