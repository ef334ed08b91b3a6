#include "light/cube_map.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/progress_part.hpp"

namespace cumulet::light {

namespace {

using glm::vec2;
using glm::vec3;

struct FacePoint {
  std::uint32_t face = 0;
  vec2 at{0.0F};  ///< from -1 to 1: right, down
};

/// Projects a direction to a cube face (ImfEnvmap.h).
FacePoint project(const vec3& w) {
  const vec3 size = glm::abs(w);
  if (size.x >= size.y && size.x >= size.z) {
    return {w.x > 0.0F ? 0U : 1U, vec2(w.x > 0.0F ? w.z : -w.z, -w.y) / size.x};
  }
  if (size.y >= size.z) return {w.y > 0.0F ? 2U : 3U, vec2(w.x, w.y > 0.0F ? -w.z : w.z) / size.y};
  return {w.z > 0.0F ? 4U : 5U, vec2(w.z > 0.0F ? -w.x : w.x, -w.y) / size.z};
}

vec3 bilinear(const CubeMap& cube, const FacePoint& point) {
  const std::uint32_t last = cube.side - 1;
  const vec2 position = (glm::clamp(point.at, -1.0F, 1.0F) * 0.5F + 0.5F) * static_cast<float>(last);
  const auto x = std::min(static_cast<std::uint32_t>(position.x), last);
  const auto y = std::min(static_cast<std::uint32_t>(position.y), last);
  const vec2 part = position - vec2(static_cast<float>(x), static_cast<float>(y));
  const auto texel = [&](std::uint32_t column, std::uint32_t row) {
    const std::size_t whole_row = std::size_t{point.face} * cube.side + std::min(row, last);
    return cube.values[whole_row * cube.side + std::min(column, last)];
  };
  return glm::mix(glm::mix(texel(x, y), texel(x + 1, y), part.x),
                  glm::mix(texel(x, y + 1), texel(x + 1, y + 1), part.x), part.y);
}

}  // namespace

EnvironmentPixels resample(const CubeMap& cube, Progress* progress) {
  EnvironmentPixels pixels;
  pixels.width = 4 * cube.side;
  pixels.height = 2 * cube.side;
  resize(pixels.values, std::size_t{pixels.width} * pixels.height, progress);
  // Sampling points per texel and axis, so that no texel of the cube is missed.
  const std::uint32_t points = cube.side <= 512 ? 4 : 2;
  std::vector<vec2> level;  // sine and cosine of each point's azimuth
  level.reserve(std::size_t{pixels.width} * points);
  for (std::uint32_t i = 0; i < pixels.width * points; ++i) {
    const double azimuth = 2.0 * std::numbers::pi * (0.5 - (i + 0.5) / (double{1} * pixels.width * points));
    level.emplace_back(std::sin(azimuth), std::cos(azimuth));
  }
  const ProgressPart part(progress, 0.5, 0.5, 1);
  tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, pixels.height), [&](const auto& range) {
    for (std::uint32_t y = range.begin(); y != range.end(); ++y) {
      part.check();
      for (std::uint32_t x = 0; x < pixels.width; ++x) {
        vec3 sum(0.0F);
        for (std::uint32_t v = 0; v < points; ++v) {
          const double down = std::numbers::pi * (y * points + v + 0.5) / (double{1} * pixels.height * points);
          const auto sine = static_cast<float>(std::sin(down));
          const auto cosine = static_cast<float>(std::cos(down));
          for (std::uint32_t u = 0; u < points; ++u) {
            const vec2& azimuth = level[std::size_t{x} * points + u];
            sum += bilinear(cube, project({sine * azimuth.x, cosine, sine * azimuth.y}));
          }
        }
        pixels.values[std::size_t{y} * pixels.width + x] = sum / static_cast<float>(points * points);
      }
    }
  });
  return pixels;
}

}  // namespace cumulet::light
