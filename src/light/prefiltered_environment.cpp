#include "light/prefiltered_environment.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/progress_part.hpp"
#include "base/shared_code.hpp"

namespace cumulet::core {
#include "light/prefiltered.glsl"
#include "surface/ggx.glsl"
}  // namespace cumulet::core

namespace cumulet::light {

namespace {

using glm::vec3;

constexpr int width = core::CM_PREFILTERED_WIDTH;
constexpr int height = core::CM_PREFILTERED_HEIGHT;

vec3 direction(int x, int y) {
  const double azimuth = 2.0 * std::numbers::pi * (0.5 - (x + 0.5) / width);
  const double down = std::numbers::pi * (y + 0.5) / height;
  return {std::sin(down) * std::sin(azimuth), std::cos(down), std::sin(down) * std::cos(azimuth)};
}

/// A GGX lobe viewed along the normal, tabulated over the sine of half the angle to its center.
class Lobe {
 public:
  explicit Lobe(float roughness) {
    const float alpha = core::cm_alpha(roughness);
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      const float half_sine = static_cast<float>(i) / (entries - 1);
      const float cosine = 1.0F - 2.0F * half_sine * half_sine;
      if (cosine <= 0.0F) continue;
      const vec3 h(half_sine, 0.0F, std::sqrt(1.0F - half_sine * half_sine));
      const vec3 wi(std::sqrt(1.0F - cosine * cosine), 0.0F, cosine);
      weights_.at(i) = core::cm_ggx(alpha, vec3(0.0F, 0.0F, 1.0F), wi, h);
    }
  }
  [[nodiscard]] float operator()(float cosine) const {
    const float position = std::sqrt(std::max(0.0F, 0.5F - 0.5F * cosine)) * (entries - 1);
    const auto low = std::min(static_cast<std::size_t>(position), weights_.size() - 2);
    return glm::mix(weights_[low], weights_[low + 1], position - static_cast<float>(low));
  }

 private:
  static constexpr int entries = 4096;
  std::array<float, entries> weights_{};
};

/// The source without its mean, averaged over cells of the size of a result texel.
struct Cells {
  std::vector<vec3> w;                             // directions of the cell centers
  std::array<float, height> area{};                // area of a cell, per row
  std::vector<std::array<vec3, 2 * width>> light;  // rows, each stored twice, so that rotated lobes wrap around
};

/// Returns a row of cells: means over the solid angle that each cell covers.
std::array<glm::dvec3, width> row_of(const PrefilterSource& source, int y, const ProgressPart& part) {
  const auto turn = [](std::uint64_t at, std::uint64_t of) {
    return std::cos(std::numbers::pi * static_cast<double>(at) / static_cast<double>(of));
  };
  const std::uint64_t top = std::uint64_t(y) * source.height;
  const std::uint64_t bottom = top + source.height;
  const std::uint64_t rows = std::uint64_t{source.height} * height;
  const double area = turn(top, rows) - turn(bottom, rows);
  std::array<glm::dvec3, width> means{};
  std::vector<vec3> texels(source.width);
  for (std::uint64_t v = top / height; v * height < bottom; ++v) {
    part.check();
    source.read(static_cast<std::uint32_t>(v), texels);
    // A texel that overlaps two cells contributes to each in proportion.
    const double share =
        (turn(std::max(top, v * height), rows) - turn(std::min(bottom, (v + 1) * height), rows)) / area;
    for (std::size_t x = 0; x < width; ++x) {
      const std::uint64_t left = x * source.width;
      const std::uint64_t right = left + source.width;
      glm::dvec3 sum(0.0);
      for (std::uint64_t u = left / width; u * width < right; ++u) {
        const std::uint64_t within = std::min(right, (u + 1) * width) - std::max(left, u * width);
        sum += static_cast<double>(within) * glm::dvec3(texels[u]);
      }
      means.at(x) += share / source.width * sum;
    }
  }
  return means;
}

Cells cells_of(const PrefilterSource& source, const glm::dvec3& mean, ProgressPart& part) {
  Cells cells;
  cells.light.resize(height);
  for (int y = 0; y < height; ++y) {
    const double edge = std::numbers::pi / height;
    cells.area.at(static_cast<std::size_t>(y)) = static_cast<float>(std::cos(edge * y) - std::cos(edge * (y + 1)));
    for (int x = 0; x < width; ++x) cells.w.push_back(direction(x, y));
  }
  tbb::parallel_for(0, height, [&](int y) {
    const std::array<glm::dvec3, width> means = row_of(source, y, part);
    auto& row = cells.light[static_cast<std::size_t>(y)];
    for (std::size_t x = 0; x < row.size(); ++x) row.at(x) = vec3(means.at(x % width) - mean);
    part.add(1);
  });
  return cells;
}

bool even(const Cells& cells, const glm::dvec3& mean) {
  const double rounding = std::numeric_limits<float>::epsilon() * std::max(mean.x, std::max(mean.y, mean.z));
  return std::ranges::all_of(cells.light, [&](const auto& row) {
    return std::ranges::all_of(row, [&](const vec3& light) {
      return glm::all(glm::lessThanEqual(glm::abs(glm::dvec3(light)), glm::dvec3(rounding)));
    });
  });
}

/// Filters a row: its lobes are rotations of one lobe about +Y, so they share the weights.
std::array<vec3, width> seen(const Cells& cells, const Lobe& lobe, int y) {
  const vec3 middle = cells.w[static_cast<std::size_t>(y) * width];
  std::array<vec3, width> sums{};
  float all = 0.0F;
  for (std::size_t v = 0; v < height; ++v) {
    for (std::size_t u = 0; u < width; ++u) {
      const float cosine = glm::dot(cells.w[v * width + u], middle);
      if (cosine <= 0.0F) continue;
      const float weight = cells.area.at(v) * lobe(cosine);
      all += weight;
      const vec3* const light = &cells.light[v].at(u);
      for (std::size_t x = 0; x < width; ++x) sums[x] += weight * light[x];
    }
  }
  for (vec3& sum : sums) sum /= all;
  return sums;
}

}  // namespace

PrefilteredEnvironmentPtr prefilter(const PrefilterSource& source, const glm::dvec3& mean, Progress* progress) {
  constexpr std::size_t texels = std::size_t{width} * height;
  ProgressPart part(progress, 0.95, 1.0, core::CM_PREFILTERED_LEVELS * height);
  const Cells cells = cells_of(source, mean, part);
  if (even(cells, mean)) return nullptr;
  auto prefiltered = std::make_shared<PrefilteredEnvironment>();
  prefiltered->reserve(core::CM_PREFILTERED_LEVELS * texels);
  // The smoothest level is not filtered.
  for (const auto& row : cells.light) {
    for (std::size_t x = 0; x < width; ++x) prefiltered->emplace_back(row.at(x), 0.0F);
  }
  for (int level = 1; level < core::CM_PREFILTERED_LEVELS; ++level) {
    const Lobe lobe(static_cast<float>(level) / (core::CM_PREFILTERED_LEVELS - 1));
    const std::size_t first = prefiltered->size();
    prefiltered->resize(first + texels);
    tbb::parallel_for(0, height, [&](int y) {
      const std::array<vec3, width> row = seen(cells, lobe, y);
      for (std::size_t x = 0; x < width; ++x)
        (*prefiltered)[first + static_cast<std::size_t>(y) * width + x] = glm::vec4(row.at(x), 0.0F);
      part.add(1);
    });
  }
  return prefiltered;
}

}  // namespace cumulet::light
