// The random numbers and the phase function that shaders and C++ share.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "phase.glsl"
#include "random.glsl"
}  // namespace cumulet::core

namespace {

using namespace cumulet::core;

TEST(Phase, IntegratesToOneAndHasMeanCosineG) {
  for (const float g : {-0.9F, -0.5F, 0.0F, 0.3F, 0.85F, 0.95F}) {
    double sum = 0.0;
    double mean = 0.0;
    const int n = 400000;
    for (int i = 0; i < n; ++i) {
      const double cosine = -1.0 + 2.0 * (i + 0.5) / n;
      const double p = cm_phase(g, static_cast<float>(cosine)) * 2.0 * std::numbers::pi * 2.0 / n;
      sum += p;
      mean += p * cosine;
    }
    EXPECT_NEAR(sum, 1.0, 1e-3) << g;
    EXPECT_NEAR(mean, g, 1e-3) << g;
  }
}

TEST(Phase, SamplingFollowsTheDensity) {
  // Evenly spread u, bin by bin against the density.
  for (const float g : {-0.7F, 0.0F, 5e-4F, 2e-3F, 0.4F, 0.9F}) {
    const int n = 200000;
    std::array<double, 20> expected{};
    std::array<double, 20> got{};
    for (int i = 0; i < n; ++i) {
      const float cosine = cm_phase_cosine(g, (static_cast<float>(i) + 0.5F) / static_cast<float>(n));
      ASSERT_GE(cosine, -1.0F);
      ASSERT_LE(cosine, 1.0F);
      got[static_cast<std::size_t>(std::min(19.0F, (cosine + 1.0F) * 10.0F))] += 1.0 / n;
      const double c = -1.0 + 2.0 * (i + 0.5) / n;
      expected[static_cast<std::size_t>(std::min(19.0, (c + 1.0) * 10.0))] +=
          cm_phase(g, static_cast<float>(c)) * 4.0 * std::numbers::pi / n;
    }
    for (std::size_t b = 0; b < 20; ++b) EXPECT_NEAR(got[b], expected[b], 2e-3) << "g " << g << " bin " << b;
  }
}

TEST(Phase, DirectionsAreUnitAndAtTheirCosine) {
  uint state = 1;
  for (int i = 0; i < 20000; ++i) {
    vec3 w = normalize(vec3(cm_random(state, 7), cm_random(state, 7), cm_random(state, 7)) * 2.0F - 1.0F);
    if (i % 10 == 0) w = vec3(0.0F, 0.0F, i % 20 == 0 ? 1.0F : -1.0F);
    const float cosine = 2.0F * cm_random(state, 7) - 1.0F;
    const vec3 d = cm_around(w, cosine, 6.2831853F * cm_random(state, 7));
    EXPECT_NEAR(length(d), 1.0F, 1e-5F);
    EXPECT_NEAR(dot(d, w), cosine, 2e-5F);
  }
}

TEST(Random, IsUniformAndUncorrelated) {
  const int n = 1 << 20;
  uint state = 12345;
  double sum = 0.0;
  double square = 0.0;
  double serial = 0.0;
  float last = 0.5F;
  for (int i = 0; i < n; ++i) {
    const float u = cm_random(state, 99991);
    ASSERT_GE(u, 0.0F);
    ASSERT_LT(u, 1.0F);
    sum += u;
    square += double(u) * u;
    serial += (u - 0.5) * (last - 0.5);
    last = u;
  }
  EXPECT_NEAR(sum / n, 0.5, 4.0 * std::sqrt(1.0 / 12.0 / n));
  EXPECT_NEAR(square / n, 1.0 / 3.0, 4.0 * std::sqrt(4.0 / 45.0 / n));
  EXPECT_NEAR(serial / n, 0.0, 4.0 / 12.0 / std::sqrt(double(n)));
}

TEST(Random, NeighbouringPixelsAndSamplesAreIndependent) {
  // First numbers of the streams of a row of pixels, and of one pixel's samples.
  for (const bool samples : {false, true}) {
    const uint n = 1 << 18;
    double sum = 0.0;
    double serial = 0.0;
    float last = 0.5F;
    for (uint i = 0; i < n; ++i) {
      const uvec3 h = cm_hash3(samples ? uvec3(5, i, 1) : uvec3(i, 5, 1));
      uint state = h.x;
      const float u = cm_random(state, h.y | 1U);
      sum += u;
      serial += (u - 0.5) * (last - 0.5);
      last = u;
    }
    EXPECT_NEAR(sum / n, 0.5, 4.0 * std::sqrt(1.0 / 12.0 / n));
    EXPECT_NEAR(serial / n, 0.0, 4.0 / 12.0 / std::sqrt(double(n)));
  }
}

TEST(Random, DepthIsExponential) {
  const int n = 1 << 20;
  uint state = 77;
  double sum = 0.0;
  double square = 0.0;
  for (int i = 0; i < n; ++i) {
    const double depth = cm_random_depth(state, 3);
    ASSERT_GE(depth, 0.0);
    sum += depth;
    square += depth * depth;
  }
  EXPECT_NEAR(sum / n, 1.0, 4.0 / std::sqrt(double(n)));
  EXPECT_NEAR(square / n, 2.0, 4.0 * std::sqrt(20.0 / n));
}

}  // namespace
