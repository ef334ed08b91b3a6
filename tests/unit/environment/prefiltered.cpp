// Environments that are prefiltered for rasterized surfaces.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>
#include <vector>

#include "base/error.hpp"
#include "light/environment.hpp"
#include "scene/raster_source.hpp"
#include "support/environments.hpp"
#include "support/gl_viewer.hpp"
#include "support/refusal.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace cumulet::core {
#include "light/prefiltered.glsl"
#include "surface/ggx.glsl"
}  // namespace cumulet::core

namespace {

using namespace cumulet;
using glm::dvec3;
using glm::vec3;
using test::direction;
using test::environment_of;
using test::pi;

// Prefiltered value of a texel, with the mean added.
double prefiltered_at(const light::Environment& environment, int level, int x, int y) {
  const auto i = std::size_t(level * core::CM_PREFILTERED_HEIGHT + y) * core::CM_PREFILTERED_WIDTH + std::size_t(x);
  return environment.mean.y + environment.prefiltered->at(i).y;
}

// Near the poles a texel's solid angle varies strongly inside its row.
TEST(PrefilteredEnvironment, SmallLightNearAPoleIsWeightedBySolidAngle) {
  constexpr std::uint32_t columns = 512;
  constexpr std::uint32_t rows = 256;
  constexpr std::uint32_t column = 100;
  for (const std::uint32_t row : {2U, 14U, rows - 1 - 2U}) {  // 1.8 and 10 degrees from a pole
    const auto environment = environment_of(
        columns, rows, [&](std::uint32_t x, std::uint32_t y) { return vec3(x == column && y == row ? 1e4F : 0.0F); });
    ASSERT_NE(environment->prefiltered, nullptr);
    const auto lobe = [](double cosine) {
      if (cosine <= 0.0) return 0.0;
      const double half = std::sqrt(0.5 - 0.5 * cosine);
      return double(core::cm_ggx(core::cm_alpha(1.0F), vec3(0.0F, 0.0F, 1.0F),
                                 vec3(std::sqrt(1.0 - cosine * cosine), 0.0F, cosine),
                                 vec3(half, 0.0F, std::sqrt(1.0 - half * half))));
    };
    for (const int x : {0, 17, 40}) {
      for (int up = 0; up < 8; ++up) {
        const int y = row < rows / 2 ? up : core::CM_PREFILTERED_HEIGHT - 1 - up;
        const vec3 middle = direction(2.0 * pi * (0.5 - (x + 0.5) / core::CM_PREFILTERED_WIDTH),
                                      pi * (y + 0.5) / core::CM_PREFILTERED_HEIGHT);
        double light = 0.0;
        double all = 0.0;
        for (std::uint32_t i = 0; i < columns * rows; ++i) {
          const double down = pi * (std::floor(double(i) / columns) + 0.5) / rows;
          const vec3 w = direction(2.0 * pi * (0.5 - (i % columns + 0.5) / columns), down);
          const double weight = std::sin(down) * lobe(glm::dot(w, middle));
          all += weight;
          if (i == row * columns + column) light = 1e4 * weight;
        }
        const double expected = light / all;
        EXPECT_NEAR(prefiltered_at(*environment, core::CM_PREFILTERED_LEVELS - 1, x, y), expected, 0.03 * expected)
            << row << ' ' << x << ' ' << y;
      }
    }
  }
}

// Weighted by the solid angle of the cells, for images of any size.
TEST(PrefilteredEnvironment, SharpestLevelKeepsTheMeanRadiance) {
  for (const auto& [columns, rows] : {std::pair(100U, 37U), std::pair(256U, 128U), std::pair(5U, 3U)}) {
    std::mt19937 random(3);
    const auto environment = environment_of(columns, rows, [&](auto, auto) { return vec3(float(random() % 1000)); });
    double mean = 0.0;
    for (int y = 0; y < core::CM_PREFILTERED_HEIGHT; ++y) {
      const double edge = pi / core::CM_PREFILTERED_HEIGHT;
      const double area = (std::cos(edge * y) - std::cos(edge * (y + 1))) / (2.0 * core::CM_PREFILTERED_WIDTH);
      for (int x = 0; x < core::CM_PREFILTERED_WIDTH; ++x) mean += area * prefiltered_at(*environment, 0, x, y);
    }
    EXPECT_NEAR(mean / environment->mean.y, 1.0, 1e-5) << columns;
  }
}

TEST(PrefilteredEnvironment, IsNotBuiltForUniformOrBlackSkies) {
  for (const float value : {0.0F, 0.3F, 1e30F})
    EXPECT_EQ(environment_of(100, 37, [&](auto, auto) { return vec3(value, 0.5F * value, 0.0F); })->prefiltered,
              nullptr)
        << value;
  EXPECT_NE(environment_of(100, 37, [](auto x, auto) { return vec3(x == 3 ? 0.301F : 0.3F); })->prefiltered, nullptr);
}

TEST(PrefilteredEnvironment, CanBeCancelledBetweenRows) {
  Progress progress;
  std::atomic<int> rows = 0;
  const auto read = [&](std::uint32_t, std::vector<vec3>& row) {
    std::ranges::fill(row, vec3(1.0F));
    if (++rows == 100) progress.cancel();
  };
  EXPECT_THROW(light::prefilter({64, 16384, read}, dvec3(0.5), &progress), Error);
  EXPECT_LT(rows, 16384 / 2);
  rows = 0;
  Progress whole;
  const auto steps = [&](std::uint32_t y, std::vector<vec3>& row) { std::ranges::fill(row, vec3(float(y % 2))); };
  EXPECT_NE(light::prefilter({64, 48, steps}, dvec3(0.5), &whole), nullptr);
  EXPECT_DOUBLE_EQ(whole.fraction(), 1.0);
}

}  // namespace
