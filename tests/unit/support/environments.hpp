#pragma once

// Environments of computed pixels.

#include <cmath>
#include <numbers>

#include "light/environment.hpp"
#include "light/environment_file.hpp"
#include "support/gl_viewer.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace cumulet::test {

inline constexpr double pi = std::numbers::pi;

inline light::EnvironmentPtr environment_of(std::uint32_t width, std::uint32_t height,
                                            const std::function<glm::vec3(std::uint32_t, std::uint32_t)>& radiance) {
  light::EnvironmentPixels pixels{width, height, {}};
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) pixels.values.push_back(radiance(x, y));
  }
  return light::make_environment(pixels, "test");
}

inline glm::vec3 direction(double azimuth, double down) {
  return {std::sin(down) * std::sin(azimuth), std::cos(down), std::sin(down) * std::cos(azimuth)};
}

}  // namespace cumulet::test
