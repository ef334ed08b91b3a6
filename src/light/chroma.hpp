#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace cumulet::light {

/// A subsampled channel of an image: a sample at every `x_step`-th pixel of every `y_step`-th row, starting at 0.
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

  /// Interpolates a row of the image linearly between samples, one value per pixel.
  void row(std::uint32_t y, std::span<float> pixels) const;

  /// Interpolates a row of chroma with luminance-guided weights (joint bilateral upsampling). `luminance` is the row's;
  /// `sampled` has the luminance at the chroma samples. Colors therefore do not bleed across edges, for example of the
  /// sun. They also do not ring beside edges, unlike those of OpenEXR's RgbaInputFile.
  void row(std::uint32_t y, std::span<float> pixels, std::span<const float> luminance,
           const SampledPlane& sampled) const;
};

}  // namespace cumulet::light
