#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace cumulet::image {

/// Returns the exposure that suits an image, in stops, rounded to tenths. The mean of its logarithmic luminance becomes
/// a medium gray, unless its highlights would become too dark or too bright. Returns nullopt if the image is black or
/// has no finite pixels. rgba: width x height x 4 linear values, premultiplied.
[[nodiscard]] std::optional<float> suitable_exposure(std::span<const float> rgba, std::uint32_t width,
                                                     std::uint32_t height);

}  // namespace cumulet::image
