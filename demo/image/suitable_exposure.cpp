#include "suitable_exposure.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "luminance.hpp"

namespace cumulet::image {
namespace {

constexpr std::uint32_t blocks_across = 24;  // few, so that the noise of the first samples is averaged
constexpr double gray = 0.18;
constexpr double darkest = 1e-3;           // of the highlights; darker blocks count as that
constexpr double dimmest_highlight = 0.6;  // exposed luminance of the highlights
constexpr double dim_quantile = 0.97;      // of the blocks

/// The exposed luminance that the highlights may have, and their quantile of the blocks.
struct Limit {
  double luminance = 0.0;
  double quantile = 0.0;
};

// Above the second limit the filmic curve turns orange flames to pale yellow. Fires are small, and the glare around the
// sun is still smaller.
Limit limit_of(Curve curve) { return curve == Curve::filmic ? Limit{1.2, 0.98} : Limit{2.0, 0.97}; }

constexpr double max_stops = 20.0;

/// Returns the mean luminances of square blocks of the image, without those that are not finite.
std::vector<double> block_luminances(std::span<const float> rgba, std::uint32_t width, std::uint32_t height) {
  const std::uint32_t side = std::max(1U, width / blocks_across);
  std::vector<double> luminances;
  for (std::uint32_t y0 = 0; y0 < height; y0 += side) {
    for (std::uint32_t x0 = 0; x0 < width; x0 += side) {
      double sum = 0.0;
      const std::uint32_t y1 = std::min(height, y0 + side);
      const std::uint32_t x1 = std::min(width, x0 + side);
      for (std::uint32_t y = y0; y < y1; ++y) {
        for (std::uint32_t x = x0; x < x1; ++x) sum += luminance(rgba.subspan(4 * (std::size_t{y} * width + x), 3));
      }
      if (std::isfinite(sum)) luminances.push_back(sum / ((y1 - y0) * (x1 - x0)));
    }
  }
  return luminances;
}

/// Returns the highlight of sorted luminances. A small flame before black has darker quantiles.
double highlight(const std::vector<double>& luminances, double quantile) {
  const double found = luminances[static_cast<std::size_t>(quantile * static_cast<double>(luminances.size() - 1))];
  return found > darkest * luminances.back() ? found : luminances.back();
}

}  // namespace

std::optional<float> suitable_exposure(std::span<const float> rgba, std::uint32_t width, std::uint32_t height,
                                       Curve curve) {
  std::vector<double> luminances = block_luminances(rgba, width, height);
  if (luminances.empty()) return std::nullopt;
  std::ranges::sort(luminances);
  const double dim = highlight(luminances, dim_quantile);
  const Limit limit = limit_of(curve);
  const double bright = highlight(luminances, limit.quantile);
  if (!(dim > 0.0)) return std::nullopt;
  double logs = 0.0;
  for (const double luminance : luminances) logs += std::log2(std::max(luminance, darkest * dim));
  const double middle = std::log2(gray) - logs / static_cast<double>(luminances.size());
  // Where both limits exclude each other, nothing burns out.
  const double stops =
      std::min(std::max(middle, std::log2(dimmest_highlight / dim)), std::log2(limit.luminance / bright));
  return static_cast<float>(std::round(10.0 * std::clamp(stops, -max_stops, max_stops)) / 10.0);
}

}  // namespace cumulet::image
