#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace cumulet::image {

/// The tone map that shows an image. The filmic curve turns bright flames to pale yellow.
enum class Curve { neutral, filmic };

/// Returns the exposure that suits an image, in stops, rounded to tenths. The mean of its logarithmic luminance becomes
/// a medium gray, unless its highlights would become too dark or too bright for the curve. Returns nullopt if the image
/// is black or has no finite pixels. rgba: width x height x 4 linear values, premultiplied.
[[nodiscard]] std::optional<float> suitable_exposure(std::span<const float> rgba, std::uint32_t width,
                                                     std::uint32_t height, Curve curve);

}  // namespace cumulet::image
