#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace cumulet::light {

/// One channel of a picture with a sample at every `x_step`-th pixel of every `y_step`-th row, from the first on.
struct SampledPlane {
  std::uint32_t width = 0;  ///< samples
  std::uint32_t height = 0;
  std::uint32_t x_step = 1;
  std::uint32_t y_step = 1;
  std::vector<float> values;

  SampledPlane() = default;
  SampledPlane(std::uint32_t pixels, std::uint32_t rows, std::uint32_t step_x, std::uint32_t step_y)
      : width((pixels + step_x - 1) / step_x),
        height((rows + step_y - 1) / step_y),
        x_step(step_x),
        y_step(step_y),
        values(std::size_t{width} * height) {}

  /// A row of the picture, one value a pixel, interpolated linearly between samples.
  void row(std::uint32_t y, std::span<float> pixels) const;

  /// The same of chroma, where samples count by how similar the picture is there: `luminance` is the row's, and
  /// `sampled` has the luminance of the pixels with samples. So colors do not bleed across edges, as of the sun, and do
  /// not ring beside them, as by the filter of OpenEXR's RgbaInputFile.
  void row(std::uint32_t y, std::span<float> pixels, std::span<const float> luminance,
           const SampledPlane& sampled) const;
};

}  // namespace cumulet::light
