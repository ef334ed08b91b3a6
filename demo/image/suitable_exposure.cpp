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
constexpr double dimmest_highlight = 0.6;  // exposed luminance of the highlights
constexpr double brightest_highlight = 2.0;
constexpr double highlights = 0.97;  // quantile
constexpr double darkest = 1e-3;     // of the highlights; darker blocks count as that
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

}  // namespace

std::optional<float> suitable_exposure(std::span<const float> rgba, std::uint32_t width, std::uint32_t height) {
  std::vector<double> luminances = block_luminances(rgba, width, height);
  if (luminances.empty()) return std::nullopt;
  std::ranges::sort(luminances);
  const double highlight =
      luminances[static_cast<std::size_t>(highlights * static_cast<double>(luminances.size() - 1))];
  // A small flame before a black background has darker quantiles.
  const double bright = highlight > darkest * luminances.back() ? highlight : luminances.back();
  if (!(bright > 0.0)) return std::nullopt;
  double logs = 0.0;
  for (const double luminance : luminances) logs += std::log2(std::max(luminance, darkest * bright));
  const double middle = std::log2(gray) - logs / static_cast<double>(luminances.size());
  const double stops =
      std::clamp(middle, std::log2(dimmest_highlight / bright), std::log2(brightest_highlight / bright));
  return static_cast<float>(std::round(10.0 * std::clamp(stops, -max_stops, max_stops)) / 10.0);
}

}  // namespace cumulet::image
