// What surfaces reflect: the BSDF that shaders and C++ share, by quadrature and by sampling.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "base/shared_code.hpp"
#include "surface/ggx_albedo.hpp"

namespace cumulet::core {
#include "bsdf.glsl"
}  // namespace cumulet::core

namespace {

using namespace cumulet::core;

CmSurface make_surface(vec3 base, float metallic, float roughness) {
  CmSurface s{};
  s.base_color = base;
  s.metallic = metallic;
  s.roughness = roughness;
  s.normal = vec3(0.0F, 0.0F, 1.0F);
  s.f0 = cm_dielectric_f0(1.5F, 1.0F, vec3(1.0F));
  s.specular = 1.0F;
  return s;
}

std::vector<CmSurface> all_surfaces() {
  std::vector<CmSurface> result;
  for (const float roughness : {0.2F, 0.45F, 1.0F}) {
    for (const float metallic : {0.0F, 0.4F, 1.0F}) {
      CmSurface s = make_surface({0.9F, 0.5F, 0.1F}, metallic, roughness);
      result.push_back(s);
      s.clearcoat = 0.8F;
      s.clearcoat_roughness = 0.2F;
      result.push_back(s);
      s.f0 = cm_dielectric_f0(2.4F, 0.7F, vec3(1.0F, 0.6F, 0.2F));
      s.specular = 0.7F;
      s.normal = normalize(vec3(0.4F, -0.7F, -0.3F));
      result.push_back(s);
    }
  }
  return result;
}

/// A direction and its weight; whether it carries any light.
bool sample(const CmSurface& s, vec3 wo, float u0, float u1, float u2, vec3& wi, vec3& weight) {
  wi = cm_bsdf_sample(s, wo, u0, u1, u2);
  const float pdf = cm_bsdf_pdf(s, wo, wi);
  weight = pdf > 0.0F ? cm_bsdf_eval(s, wo, wi) / pdf : vec3(0.0F);
  return weight.x + weight.y + weight.z > 0.0F;
}

/// Unit vector at a cosine and an angle about the surface's normal.
vec3 direction(const CmSurface& s, double cosine, double angle) {
  vec3 u;
  vec3 v;
  cm_frame(s.normal, u, v);
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  return u * static_cast<float>(sine * std::cos(angle)) + v * static_cast<float>(sine * std::sin(angle)) +
         s.normal * static_cast<float>(cosine);
}

/// A quadrature over the hemisphere, finer towards grazing angles: calls f(wi, solid angle).
template <class F>
void integrate(const CmSurface& s, int cosines, int angles, F&& f) {
  for (int i = 0; i < cosines; ++i) {
    for (int j = 0; j < angles; ++j) {
      const double theta = 0.5 * std::numbers::pi * (i + 0.5) / cosines;
      const double angle = 2.0 * std::numbers::pi * (j + 0.5) / angles;
      const double area = std::sin(theta) * (0.5 * std::numbers::pi / cosines) * (2.0 * std::numbers::pi / angles);
      f(direction(s, std::cos(theta), angle), area);
    }
  }
}

TEST(Frame, IsOrthonormalAndRightHanded) {
  for (const vec3 axis : {vec3(0, 0, 1), vec3(0, 0, -1), vec3(1, 0, 0), vec3(0.3F, -0.8F, -0.5F), vec3(0, 1e-9F, -1)}) {
    const vec3 w = normalize(axis);
    vec3 u;
    vec3 v;
    cm_frame(w, u, v);
    EXPECT_NEAR(dot(u, v), 0.0F, 1e-6F);
    EXPECT_NEAR(dot(u, w), 0.0F, 1e-6F);
    EXPECT_NEAR(length(u), 1.0F, 1e-6F);
    EXPECT_NEAR(length(cross(u, v) - w), 0.0F, 1e-6F);
  }
}

TEST(Bsdf, DielectricReflectanceFollowsTheExtensions) {
  EXPECT_NEAR(cm_dielectric_f0(1.5F, 1.0F, vec3(1.0F)).x, 0.04F, 1e-6F);
  EXPECT_EQ(cm_dielectric_f0(1.0F, 1.0F, vec3(1.0F)).x, 0.0F);
  EXPECT_EQ(cm_dielectric_f0(0.0F, 1.0F, vec3(1.0F)).x, 1.0F);
  EXPECT_NEAR(cm_dielectric_f0(1.5F, 0.5F, vec3(1.0F, 2.0F, 100.0F)).y, 0.04F, 1e-6F);
  EXPECT_NEAR(cm_dielectric_f0(1.5F, 0.5F, vec3(1.0F, 2.0F, 100.0F)).z, 0.5F, 1e-6F);
}

TEST(Bsdf, DensityIntegratesToOneLessTheFailedSamples) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  for (const CmSurface& s : all_surfaces()) {
    for (const double cosine : {0.9, 0.4, 0.15}) {
      const vec3 wo = direction(s, cosine, 0.7);
      double sum = 0.0;
      integrate(s, 400, 1600, [&](vec3 wi, double area) { sum += cm_bsdf_pdf(s, wo, wi) * area; });
      int failed = 0;
      const int n = 40000;
      for (int i = 0; i < n; ++i) {
        vec3 wi;
        vec3 weight;
        const float u0 = unit(random);
        const float u1 = unit(random);
        failed += sample(s, wo, u0, u1, unit(random), wi, weight) ? 0 : 1;
      }
      EXPECT_NEAR(sum, 1.0 - double(failed) / n, 8e-3) << s.roughness << ' ' << s.metallic << ' ' << cosine;
      EXPECT_LE(sum, 1.0 + 2e-3);
    }
  }
}

TEST(Bsdf, SamplesFollowTheDensity) {
  // Chi-square over bins of equal solid angle.
  constexpr int rings = 8;
  constexpr int sectors = 12;
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  for (const CmSurface& s : all_surfaces()) {
    const vec3 wo = direction(s, 0.6, -1.1);
    vec3 u;
    vec3 v;
    cm_frame(s.normal, u, v);
    const auto bin_of = [&](vec3 wi) {
      const int ring = std::min(static_cast<int>(dot(wi, s.normal) * rings), rings - 1);
      const double angle = std::atan2(dot(wi, v), dot(wi, u)) / (2.0 * std::numbers::pi) + 0.5;
      return ring * sectors + std::min(static_cast<int>(angle * sectors), sectors - 1);
    };
    std::array<double, rings * sectors> expected{};
    std::array<int, rings * sectors> counted{};
    const int n = 60000;
    integrate(s, 900, 1200, [&](vec3 wi, double area) {
      expected[static_cast<std::size_t>(bin_of(wi))] += cm_bsdf_pdf(s, wo, wi) * area * n;
    });
    for (int i = 0; i < n; ++i) {
      vec3 wi;
      vec3 weight;
      const float u0 = unit(random);
      const float u1 = unit(random);
      if (sample(s, wo, u0, u1, unit(random), wi, weight)) ++counted[static_cast<std::size_t>(bin_of(wi))];
    }
    double chi2 = 0.0;
    int bins = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (expected[i] < 10.0) continue;
      // The quadrature's own error is some 0.3 % of a bin.
      const double variance = expected[i] + std::pow(0.003 * expected[i], 2);
      chi2 += std::pow(counted[i] - expected[i], 2) / variance;
      ++bins;
    }
    EXPECT_LT(chi2, bins + 5.0 * std::sqrt(2.0 * bins)) << s.roughness << ' ' << s.metallic << ' ' << s.clearcoat;
  }
}

TEST(Bsdf, SampleWeightsAreEvalOverDensityAndTheirMeanIsTheAlbedo) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  for (const CmSurface& s : all_surfaces()) {
    const vec3 wo = direction(s, 0.4, 2.0);
    dvec3 quadrature(0.0);
    integrate(s, 800, 800, [&](vec3 wi, double area) { quadrature += dvec3(cm_bsdf_eval(s, wo, wi)) * area; });
    dvec3 mean(0.0);
    dvec3 square(0.0);
    const int n = 40000;
    for (int i = 0; i < n; ++i) {
      vec3 wi;
      vec3 weight;
      const float u0 = unit(random);
      const float u1 = unit(random);
      if (!sample(s, wo, u0, u1, unit(random), wi, weight)) continue;
      ASSERT_GT(dot(wi, s.normal), 0.0F);
      ASSERT_NEAR(length(wi), 1.0F, 1e-5F);
      mean += dvec3(weight) / double(n);
      square += dvec3(weight * weight) / double(n);
    }
    for (int c = 0; c < 3; ++c) {
      const double noise = std::sqrt(std::max(0.0, square[c] - mean[c] * mean[c]) / n);
      EXPECT_NEAR(mean[c], quadrature[c], 5.0 * noise + 6e-3) << s.roughness << ' ' << s.metallic << ' ' << s.clearcoat;
    }
  }
}

TEST(Bsdf, IsReciprocal) {
  for (const CmSurface& s : all_surfaces()) {
    for (int i = 0; i < 50; ++i) {
      const double a = 0.05 + 0.9 * std::fmod(i * 0.618, 1.0);
      const double b = 0.05 + 0.9 * std::fmod(i * 0.7548, 1.0);
      const vec3 wo = direction(s, a, 0.3 * i);
      const vec3 wi = direction(s, b, 1.7 * i);
      const vec3 there = cm_bsdf_eval(s, wo, wi) / static_cast<float>(b);
      const vec3 back = cm_bsdf_eval(s, wi, wo) / static_cast<float>(a);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(there[c], back[c], 1e-3F * there[c] + 1e-6F);
    }
  }
}

TEST(Bsdf, NeverReflectsMoreThanComesIn) {
  for (const float metallic : {0.0F, 0.5F, 1.0F}) {
    for (const float clearcoat : {0.0F, 1.0F}) {
      for (const float ior : {1.0F, 1.5F, 2.5F}) {
        for (const float roughness : {0.15F, 0.3F, 0.5F, 0.75F, 1.0F}) {
          CmSurface s = make_surface(vec3(1.0F), metallic, roughness);
          s.f0 = cm_dielectric_f0(ior, 1.0F, vec3(1.0F));
          s.clearcoat = clearcoat;
          s.clearcoat_roughness = 0.3F;
          for (const double cosine : {1.0, 0.8, 0.5, 0.3, 0.15, 0.05}) {
            const vec3 wo = direction(s, cosine, 0.3);
            double sum = 0.0;
            integrate(s, 500, 500, [&](vec3 wi, double area) { sum += cm_bsdf_eval(s, wo, wi).x * area; });
            EXPECT_LE(sum, 1.003) << metallic << ' ' << clearcoat << ' ' << ior << ' ' << roughness << ' ' << cosine;
          }
        }
      }
    }
  }
}

TEST(Bsdf, WhiteWithoutInterfaceReflectsAll) {
  CmSurface s = make_surface(vec3(1.0F), 0.0F, 0.5F);
  s.f0 = vec3(0.0F);
  s.specular = 0.0F;
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  for (int i = 0; i < 1000; ++i) {
    const vec3 wo = direction(s, 0.02 + 0.97 * unit(random), unit(random) * 6.0);
    vec3 wi;
    vec3 weight;
    const float u0 = unit(random);
    const float u1 = unit(random);
    ASSERT_TRUE(sample(s, wo, u0, u1, unit(random), wi, weight));
    EXPECT_NEAR(weight.x, 1.0F, 2e-6F);
    EXPECT_NEAR(cm_bsdf_eval(s, wo, wi).x, dot(wi, s.normal) / std::numbers::pi_v<float>, 1e-6F);
  }
  EXPECT_EQ(cm_bsdf_albedo(s, s.normal, vec2(0.9F, 0.1F), vec2(0.0F)), vec3(1.0F));
}

TEST(Bsdf, SmoothWhiteMetalIsAMirror) {
  CmSurface s = make_surface(vec3(1.0F), 1.0F, 0.0F);
  s.normal = normalize(vec3(-0.2F, 0.9F, 0.4F));
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  for (int i = 0; i < 1000; ++i) {
    const vec3 wo = direction(s, 0.1 + 0.89 * unit(random), unit(random) * 6.0);
    vec3 wi;
    vec3 weight;
    const float u0 = unit(random);
    const float u1 = unit(random) * 0.99F;
    ASSERT_TRUE(sample(s, wo, u0, u1, unit(random), wi, weight));
    EXPECT_NEAR(weight.x, 1.0F, 1e-3F);
    EXPECT_GT(dot(wi, reflect(-wo, s.normal)), 0.9995F);
  }
}

TEST(Bsdf, NothingComesFromBelow) {
  for (const CmSurface& s : all_surfaces()) {
    const vec3 above = direction(s, 0.5, 0.0);
    const vec3 below = direction(s, -0.3, 1.0);
    EXPECT_EQ(cm_bsdf_eval(s, above, below), vec3(0.0F));
    EXPECT_EQ(cm_bsdf_eval(s, below, above), vec3(0.0F));
    EXPECT_EQ(cm_bsdf_pdf(s, above, below), 0.0F);
    vec3 wi;
    vec3 weight(1.0F);
    EXPECT_FALSE(sample(s, below, 0.5F, 0.5F, 0.5F, wi, weight));
    EXPECT_EQ(weight, vec3(0.0F));
  }
}

TEST(Bsdf, ExtremesStayFinite) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  for (const float roughness : {0.0F, 1.0F}) {
    for (const float metallic : {0.0F, 1.0F}) {
      for (const float f0 : {0.0F, 1.0F}) {
        CmSurface s = make_surface(vec3(1.0F), metallic, roughness);
        s.f0 = vec3(f0);
        s.clearcoat = 1.0F;
        for (const double cosine : {1.0, 1e-2, 1e-4, 1e-7}) {
          const vec3 wo = direction(s, cosine, 0.0);
          for (int i = 0; i < 2000; ++i) {
            vec3 wi;
            vec3 weight;
            const float u0 = i % 3 == 0 ? 0.0F : unit(random);
            const float u1 = i % 5 == 0 ? 0.99999994F : unit(random);
            sample(s, wo, u0, u1, unit(random), wi, weight);
            ASSERT_TRUE(std::isfinite(weight.x) && weight.x >= 0.0F && weight.x < 30.0F)
                << roughness << ' ' << metallic << ' ' << f0 << ' ' << cosine << ' ' << weight.x;
            ASSERT_TRUE(std::isfinite(wi.x + wi.y + wi.z));
          }
        }
      }
    }
  }
}

TEST(Bsdf, AlbedoByTheTableIsTheIntegral) {
  constexpr int size = 32;
  const std::vector<vec2> table = cumulet::surface::make_ggx_albedo_table(size);
  for (const std::size_t row : {8U, 14U, 22U, 31U}) {
    for (const float metallic : {0.0F, 1.0F}) {
      CmSurface s = make_surface({0.9F, 0.5F, 0.1F}, metallic, static_cast<float>(row) / (size - 1));
      s.clearcoat = 0.5F;
      s.clearcoat_roughness = s.roughness;
      for (const std::size_t column : {30U, 18U, 9U, 4U}) {
        const vec3 wo = direction(s, (static_cast<double>(column) + 0.5) / size, 0.0);
        dvec3 sum(0.0);
        integrate(s, 600, 900, [&](vec3 wi, double area) { sum += dvec3(cm_bsdf_eval(s, wo, wi)) * area; });
        const vec2 lobe = table[row * size + column];
        const vec3 albedo = cm_bsdf_albedo(s, wo, lobe, lobe);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(albedo[c], sum[c], 0.05) << row << ' ' << metallic << ' ' << column;
        s.clearcoat = 0.0F;
        dvec3 bare(0.0);
        integrate(s, 600, 900, [&](vec3 wi, double area) { bare += dvec3(cm_bsdf_eval(s, wo, wi)) * area; });
        const vec3 bare_albedo = cm_bsdf_albedo(s, wo, lobe, lobe);
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(bare_albedo[c], bare[c], 0.015) << row << ' ' << metallic << ' ' << column;
        s.clearcoat = 0.5F;
      }
    }
  }
}

}  // namespace
