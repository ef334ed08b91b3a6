#include "render/pacing/dispatch_results.hpp"

#include <cmath>

namespace cumulet::render {

ErrorSums& ErrorSums::operator+=(const ErrorSums& other) {
  squared += other.squared;
  brightness += other.brightness;
  pixels += other.pixels;
  return *this;
}

std::optional<double> ErrorSums::noise() const {
  if (pixels <= 0.0 || !std::isfinite(squared) || !std::isfinite(brightness)) return std::nullopt;
  return brightness > 0.0 ? std::sqrt(squared * pixels) / brightness : 0.0;
}

}  // namespace cumulet::render
