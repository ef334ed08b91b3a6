// The random numbers and the phase function that shaders and C++ share.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/shared_code.hpp"
#include "scene/phase.hpp"

namespace cumulet::core {
#include "common/random.glsl"
#include "path/phase.glsl"
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
      const double p = cm_henyey_greenstein(g, static_cast<float>(cosine)) * 2.0 * std::numbers::pi * 2.0 / n;
      sum += p;
      mean += p * cosine;
    }
    EXPECT_NEAR(sum, 1.0, 1e-3) << g;
    EXPECT_NEAR(mean, g, 1e-3) << g;
  }
}

TEST(Phase, SamplesMatchThePdf) {
  // Evenly spread u, compared bin by bin with the pdf.
  for (const float g : {-0.7F, 0.0F, 5e-4F, 2e-3F, 0.4F, 0.9F}) {
    const int n = 200000;
    std::array<double, 20> expected{};
    std::array<double, 20> got{};
    for (int i = 0; i < n; ++i) {
      const float cosine = cm_henyey_greenstein_cosine(g, (static_cast<float>(i) + 0.5F) / static_cast<float>(n));
      ASSERT_GE(cosine, -1.0F);
      ASSERT_LE(cosine, 1.0F);
      got[static_cast<std::size_t>(std::min(19.0F, (cosine + 1.0F) * 10.0F))] += 1.0 / n;
      const double c = -1.0 + 2.0 * (i + 0.5) / n;
      expected[static_cast<std::size_t>(std::min(19.0, (c + 1.0) * 10.0))] +=
          cm_henyey_greenstein(g, static_cast<float>(c)) * 4.0 * std::numbers::pi / n;
    }
    for (std::size_t b = 0; b < 20; ++b) EXPECT_NEAR(got[b], expected[b], 2e-3) << "g " << g << " bin " << b;
  }
}

CmPhase phase_of(const cumulet::scene::Phase& p) {
  return {p.anisotropy, p.second_anisotropy, p.second_bend, p.second_weight};
}

// Mixtures: quadrature of the phase function in double precision, compared with samples of evenly spread u. The droplet
// lobe is a few degrees wide, so bins are uniform in the square root of 1 - cosine.
TEST(Phase, MixturesIntegrateToOneAndMatchSamples) {
  const auto bin_of = [](double cosine) {
    return std::min(29, static_cast<int>(30.0 * std::sqrt((1.0 - cosine) / 2.0)));
  };
  for (const cumulet::scene::Phase& made :
       {cumulet::scene::Phase{0.8F, -0.4F, 0.0F, 0.3F}, cumulet::scene::Phase{0.5F, 0.0F, 0.0F, 1.0F},
        cumulet::scene::mie_phase(5.0F), cumulet::scene::mie_phase(20.0F), cumulet::scene::mie_phase(50.0F)}) {
    const CmPhase phase = phase_of(made);
    SCOPED_TRACE(testing::Message() << phase.anisotropy << ' ' << phase.second_anisotropy << ' ' << phase.second_bend);
    std::array<double, 30> expected{};
    std::array<double, 30> got{};
    double sum = 0.0;
    const int n = 1000000;
    for (int i = 0; i < n; ++i) {
      const double r = (i + 0.5) / n;  // the square root of (1 - cosine) / 2
      const double cosine = 1.0 - 2.0 * r * r;
      const double p = cm_phase(phase, static_cast<float>(cosine)) * 2.0 * std::numbers::pi * 4.0 * r / n;
      expected[static_cast<std::size_t>(bin_of(cosine))] += p;
      sum += p;
      const float sampled = cm_phase_cosine(phase, (static_cast<float>(i) + 0.5F) / static_cast<float>(n));
      ASSERT_GE(sampled, -1.0F);
      ASSERT_LE(sampled, 1.0F);
      got[static_cast<std::size_t>(bin_of(sampled))] += 1.0 / n;
    }
    EXPECT_NEAR(sum, 1.0, 2e-3);
    for (std::size_t b = 0; b < 30; ++b) EXPECT_NEAR(got[b], expected[b], 2e-3) << b;
  }
}

// The fit's published values for 20 micrometers (Jendersie and d'Eon 2023), and Draine's mean cosine g (1 + bend (3 + 2
// g^2) / 5) / (1 + bend (1 + 2 g^2) / 3).
TEST(Phase, DropletsScatterForward) {
  const cumulet::scene::Phase made = cumulet::scene::mie_phase(20.0F);
  EXPECT_NEAR(made.anisotropy, 0.99461, 1e-4);
  EXPECT_NEAR(made.second_anisotropy, 0.59378, 1e-4);
  EXPECT_NEAR(made.second_bend, 27.113, 1e-2);
  EXPECT_NEAR(made.second_weight, 0.49818, 1e-4);
  const CmPhase phase = phase_of(made);
  double mean = 0.0;
  const int n = 200000;
  for (int i = 0; i < n; ++i) mean += cm_phase_cosine(phase, (static_cast<float>(i) + 0.5F) / n) / double(n);
  const double g = made.second_anisotropy;
  const double a = made.second_bend;
  const double draine = g * (1.0 + a * (3.0 + 2.0 * g * g) / 5.0) / (1.0 + a * (1.0 + 2.0 * g * g) / 3.0);
  EXPECT_NEAR(mean, (1.0 - made.second_weight) * made.anisotropy + made.second_weight * draine, 1e-3);
}

TEST(Phase, SampledDirectionsAreUnitWithTheirCosine) {
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
  // First numbers of the streams of a row of pixels, and of the samples of one pixel.
  for (const bool samples : {false, true}) {
    const uint n = 1 << 18;
    double sum = 0.0;
    double serial = 0.0;
    float last = 0.5F;
    for (uint i = 0; i < n; ++i) {
      uint state = cm_hash3(samples ? uvec3(5, i, 1) : uvec3(i, 5, 1)).x;
      const float u = cm_random(state, cm_hash3(samples ? uvec3(5, 7, 1) : uvec3(i, 7, 1)).x | 1U);
      sum += u;
      serial += (u - 0.5) * (last - 0.5);
      last = u;
    }
    EXPECT_NEAR(sum / n, 0.5, 4.0 * std::sqrt(1.0 / 12.0 / n));
    EXPECT_NEAR(serial / n, 0.0, 4.0 / 12.0 / std::sqrt(double(n)));
  }
}

TEST(Random, FreeFlightDepthIsExponential) {
  const int n = 1 << 20;
  uint state = 77;
  double sum = 0.0;
  double square = 0.0;
  for (int i = 0; i < n; ++i) {
    const double depth = cm_free_depth(cm_random(state, 3));
    ASSERT_GE(depth, 0.0);
    sum += depth;
    square += depth * depth;
  }
  EXPECT_NEAR(sum / n, 1.0, 4.0 / std::sqrt(double(n)));
  EXPECT_NEAR(square / n, 2.0, 4.0 * std::sqrt(20.0 / n));
}

}  // namespace

// (0,2)-sequence: any 2^k points that start at a multiple of 2^k have one point in each box of area 2^-k, for every box
// shape.
TEST(LowDiscrepancyPair, StratifiesFromAnyAlignedStart) {
  for (const uint pixel : {1U, 77U, 0x9e3779b9U}) {
    for (const uint set : {0U, 1U, 6U}) {
      for (int k = 0; k <= 8; ++k) {
        const uint count = 1U << k;
        for (const uint from : {0U, count, 5U * count, 65536U}) {
          for (int across = 0; across <= k; ++across) {
            std::vector<int> found(count);
            for (uint i = 0; i < count; ++i) {
              const vec2 u = cm_even_pair(from + i, pixel, set);
              const uint column = static_cast<uint>(u.x * static_cast<float>(1U << across));
              const uint row = static_cast<uint>(u.y * static_cast<float>(1U << (k - across)));
              ++found.at((row << across) + column);
            }
            ASSERT_TRUE(std::ranges::all_of(found, [](int n) { return n == 1; })) << count << " from " << from;
          }
        }
      }
    }
  }
}

// Over pixels, the points are as random as independent numbers, and sets are independent of each other.
TEST(LowDiscrepancyPair, IsUniformOverPixelsAndIndependentBetweenSets) {
  const uint n = 1U << 18;
  for (const uint number : {0U, 1U, 6U, 1000U}) {
    dvec2 sum(0.0);
    dvec2 square(0.0);
    double within = 0.0;
    dvec2 between(0.0);
    double serial = 0.0;
    vec2 last(0.5F);
    for (uint pixel = 0; pixel < n; ++pixel) {
      const uint stream = cm_hash3(uvec3(pixel, 0x5bd1e995U, 1)).x | 1U;
      const vec2 a = cm_even_pair(number, stream, 4);
      const vec2 b = cm_even_pair(number, stream, 5);
      ASSERT_TRUE(all(greaterThanEqual(a, vec2(0.0F))) && all(lessThan(a, vec2(1.0F))));
      sum += a;
      square += dvec2(a) * dvec2(a);
      within += (a.x - 0.5) * (a.y - 0.5);
      between += dvec2((a.x - 0.5) * (b.x - 0.5), (a.y - 0.5) * (b.x - 0.5));
      serial += (a.x - 0.5) * (last.x - 0.5);
      last = a;
    }
    const double noise = std::sqrt(1.0 / double(n));
    for (int i = 0; i < 2; ++i) {
      EXPECT_NEAR(sum[i] / n, 0.5, 4.0 * noise / std::sqrt(12.0));
      EXPECT_NEAR(square[i] / n, 1.0 / 3.0, 4.0 * noise * std::sqrt(4.0 / 45.0));
      EXPECT_NEAR(between[i] / n, 0.0, 4.0 / 12.0 * noise);
    }
    EXPECT_NEAR(within / n, 0.0, 4.0 / 12.0 * noise);
    EXPECT_NEAR(serial / n, 0.0, 4.0 / 12.0 * noise);
  }
}
