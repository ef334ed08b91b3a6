#include "light/chroma.hpp"

#include <algorithm>
#include <array>

namespace cumulet::light {

namespace {

/// The two samples around a pixel along one axis, with linear weights.
struct Beside {
  std::array<std::uint32_t, 2> samples{};
  std::array<float, 2> weights{};
};

Beside beside(std::uint32_t pixel, std::uint32_t step, std::uint32_t count) {
  const std::uint32_t before = pixel / step;
  const auto part = static_cast<float>(pixel % step) / static_cast<float>(step);
  return {{before, std::min(before + 1, count - 1)}, {1.0F - part, part}};
}

/// Returns 1 for equal luminances, down to nearly 0.
float similarity(float a, float b) {
  constexpr float tolerance = 1e-3F;
  const float sum = a + b;
  if (!(sum > 0.0F)) return 1.0F;
  const float difference = (a - b) / sum;
  return tolerance / (tolerance + difference * difference);
}

/// Interpolates one pixel. weight(index) is multiplied with the distance weight of a sample.
template <class Weight>
float interpolated(const SampledPlane& plane, const Beside& across, const Beside& down, const Weight& weight) {
  float sum = 0.0F;
  float weights = 0.0F;
  for (std::size_t v = 0; v < 2; ++v) {
    for (std::size_t u = 0; u < 2; ++u) {
      const float distance = down.weights[v] * across.weights[u];
      if (!(distance > 0.0F)) continue;
      const std::size_t index = std::size_t{down.samples[v]} * plane.width + across.samples[u];
      const float counts = distance * weight(index);
      sum += counts * plane.values[index];
      weights += counts;
    }
  }
  return sum / weights;
}

}  // namespace

void SampledPlane::row(std::uint32_t y, std::span<float> pixels) const {
  const Beside down = beside(y, y_step, height);
  for (std::uint32_t x = 0; x < pixels.size(); ++x) {
    pixels[x] = interpolated(*this, beside(x, x_step, width), down, [](std::size_t) { return 1.0F; });
  }
}

void SampledPlane::row(std::uint32_t y, std::span<float> pixels, std::span<const float> luminance,
                       const SampledPlane& sampled) const {
  const Beside down = beside(y, y_step, height);
  for (std::uint32_t x = 0; x < pixels.size(); ++x) {
    pixels[x] = interpolated(*this, beside(x, x_step, width), down,
                             [&](std::size_t index) { return similarity(luminance[x], sampled.values[index]); });
  }
}

}  // namespace cumulet::light
