// The BSDF that shaders and C++ share, tested by quadrature and by sampling.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "support/appendix_b.hpp"
#include "support/bsdf.hpp"

namespace {

using namespace cumulet::core;

CmSurface make_surface(vec3 base, float metallic, float roughness) {
  CmSurface s{};
  s.base_color = base;
  s.metallic = metallic;
  s.roughness = roughness;
  s.normal = vec3(0.0F, 0.0F, 1.0F);
  s.matte_normal = s.smooth_normal = s.normal;
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
      s.matte_normal = s.smooth_normal = s.normal;
      result.push_back(s);
    }
  }
  return result;
}

/// Samples a direction and its weight. Returns whether the sample carries any light.
bool sample(const CmSurface& s, vec3 wo, float u0, float u1, float u2, vec3& wi, vec3& weight) {
  wi = cm_bsdf_sample(s, wo, u0, u1, u2);
  const float pdf = cm_bsdf_pdf(s, wo, wi);
  weight = pdf > 0.0F ? cm_bsdf_eval(s, wo, wi) / pdf : vec3(0.0F);
  return weight.x + weight.y + weight.z > 0.0F;
}

/// Unit vector with this cosine to, and angle about, the surface's normal.
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

/// The reflected fraction of constant radiance, estimated by sampling, because smooth lobes at grazing angles are too
/// narrow for the quadrature. Its error is below 0.002 where most samples have a weight of about 1.
double reflected_share(const CmSurface& s, vec3 wo) {
  constexpr int strata = 100;
  std::mt19937 random(17);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  double sum = 0.0;
  for (int i = 0; i < strata * strata; ++i) {
    const float u0 = (static_cast<float>(i % strata) + unit(random)) / strata;
    const float u1 = (static_cast<float>(i / strata) + unit(random)) / strata;
    vec3 wi;
    vec3 weight;
    if (sample(s, wo, u0, u1, unit(random), wi, weight)) sum += weight.x;
  }
  return sum / (strata * strata);
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

TEST(Bsdf, PdfIntegratesToOneMinusFailedSamples) {
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

TEST(Bsdf, SamplesMatchThePdf) {
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
      // The quadrature's own error is about 0.3 % per bin.
      const double variance = expected[i] + std::pow(0.003 * expected[i], 2);
      chi2 += std::pow(counted[i] - expected[i], 2) / variance;
      ++bins;
    }
    EXPECT_LT(chi2, bins + 5.0 * std::sqrt(2.0 * bins)) << s.roughness << ' ' << s.metallic << ' ' << s.clearcoat;
  }
}

TEST(Bsdf, SampleWeightsAreValueOverPdfWithMeanAlbedo) {
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

TEST(Bsdf, ConservesEnergy) {
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
            EXPECT_LE(reflected_share(s, wo), clearcoat > 0.0F ? 1.01 : 1.005)
                << metallic << ' ' << clearcoat << ' ' << ior << ' ' << roughness << ' ' << cosine;
          }
        }
      }
    }
  }
}

TEST(Bsdf, MatchesGltfAppendixBInDoublePrecision) {
  using cumulet::test::AppendixB;
  using cumulet::test::Below;
  constexpr std::array<double, 4> out{0.95, 0.6, 0.25, 0.08};
  constexpr std::array<double, 4> in{0.9, 0.5, 0.2, 0.05};
  // Indexed by the positions in `out` and `in`.
  const auto all_below = [&](const cumulet::test::RoughInterface& interface, double weight) {
    std::array<std::array<Below, 4>, 4> result{};
    const double average = average_below(interface, weight);
    for (std::size_t o = 0; o < 4; ++o) {
      const double out_of = 1.0 - weight * interface.albedo(out[o]);
      for (std::size_t i = 0; i < 4; ++i) result[o][i] = {out_of, 1.0 - weight * interface.albedo(in[i]), average};
    }
    return result;
  };
  AppendixB reference;
  reference.base = {0.9, 0.5, 0.1};
  for (const auto& [clearcoat, clearcoat_roughness] : {std::pair{0.0, 1.0}, {0.6, 0.3}, {1.0, 0.7}}) {
    reference.clearcoat = clearcoat;
    reference.coat.roughness = clearcoat_roughness;
    const auto below_coat = all_below(reference.coat, clearcoat);
    for (const double roughness : {0.25, 0.5, 0.8, 1.0}) {
      for (const double ior : {1.5, 2.0}) {
        reference.dielectric = {roughness, std::pow((ior - 1.0) / (ior + 1.0), 2.0)};
        const auto below = all_below(reference.dielectric, 1.0);
        for (const double metallic : {0.0, 0.4, 1.0}) {
          reference.metallic = metallic;
          CmSurface s = make_surface({0.9F, 0.5F, 0.1F}, static_cast<float>(metallic), static_cast<float>(roughness));
          s.f0 = cm_dielectric_f0(static_cast<float>(ior), 1.0F, vec3(1.0F));
          s.clearcoat = static_cast<float>(clearcoat);
          s.clearcoat_roughness = static_cast<float>(clearcoat_roughness);
          for (std::size_t k = 0; k < 64; ++k) {
            const double c_o = out[k / 4 % 4];
            const double c_i = in[k % 4];
            const double angle = std::array{0.1, 1.2, 2.4, 3.1}[k / 16];
            const dvec3 o(std::sqrt(1.0 - c_o * c_o), 0.0, c_o);
            const double sine = std::sqrt(1.0 - c_i * c_i);
            const dvec3 i(sine * std::cos(angle), sine * std::sin(angle), c_i);
            const dvec3 expected = reference(o, i, below[k / 4 % 4][k % 4], below_coat[k / 4 % 4][k % 4]);
            const vec3 got = cm_bsdf_eval_local(s, 1.0F, static_cast<float>(i.z), vec3(o), vec3(i));
            for (int c = 0; c < 3; ++c) {
              EXPECT_NEAR(got[c], expected[c], 0.01 * expected[c] + 1e-5)
                  << roughness << ' ' << ior << ' ' << c_o << ' ' << c_i << ' ' << angle << ' ' << metallic << " coat "
                  << clearcoat << ' ' << clearcoat_roughness;
            }
          }
        }
      }
    }
  }
}

// White furnace test: a white dielectric of any roughness and index, with or without a coat, is as bright as its
// environment.
TEST(Bsdf, PassesTheWhiteFurnaceTestFromEveryAngle) {
  for (const float clearcoat : {0.0F, 1.0F}) {
    for (const float ior : {1.0F, 1.5F, 2.5F}) {
      for (const float roughness : {0.15F, 0.3F, 0.5F, 0.75F, 1.0F}) {
        CmSurface s = make_surface(vec3(1.0F), 0.0F, roughness);
        s.f0 = cm_dielectric_f0(ior, 1.0F, vec3(1.0F));
        s.clearcoat = clearcoat;
        s.clearcoat_roughness = 0.3F;
        for (const double cosine : {1.0, 0.8, 0.5, 0.3, 0.15, 0.05, 0.02}) {
          const vec3 wo = direction(s, cosine, 0.3);
          // Under a coat, the coupling of the lobes is approximate.
          EXPECT_NEAR(reflected_share(s, wo), 1.0, clearcoat > 0.0F ? 0.02 : 0.005)
              << clearcoat << ' ' << ior << ' ' << roughness << ' ' << cosine;
        }
      }
    }
  }
}

std::vector<std::pair<vec3, vec3>> normals_and_viewers(vec3 geometric) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> unit(-1.0F, 1.0F);
  std::vector<std::pair<vec3, vec3>> result;
  while (result.size() < 20000) {
    const vec3 n(unit(random), unit(random), unit(random));
    vec3 wo(unit(random), unit(random), unit(random));
    if (result.size() % 3 == 0) wo -= geometric * (dot(wo, geometric) - 1e-3F * std::abs(unit(random)));
    if (dot(n, n) < 0.01F || dot(wo, wo) < 0.01F) continue;
    if (dot(normalize(wo), geometric) > 0.0F && dot(n, geometric) > 0.0F)
      result.emplace_back(normalize(n), normalize(wo));
  }
  return result;
}

TEST(Bsdf, BentNormalsReflectAboveTheSurface) {
  const vec3 g = normalize(vec3(0.3F, -0.2F, 0.9F));
  int bent_ones = 0;
  for (const auto& [n, wo] : normals_and_viewers(g)) {
    const vec3 bent = cm_bend_normal(n, g, wo);
    EXPECT_NEAR(length(bent), 1.0F, 1e-5F);
    EXPECT_GT(dot(bent, wo), 0.0F);
    EXPECT_GT(dot(bent, g), 0.0F);
    EXPECT_GE(dot(reflect(-wo, bent), g), std::min(0.01F, 0.9F * dot(wo, g)) - 1e-4F);
    // The normal is bent only as far as needed; a valid one is unchanged.
    if (dot(reflect(-wo, n), g) > 0.01F) {
      EXPECT_EQ(bent, n);
    } else {
      ++bent_ones;
      const vec3 near = cm_bend_normal(normalize(n + vec3(1e-4F)), g, wo);
      EXPECT_LT(length(near - bent), 0.1F);  // continuous
    }
  }
  EXPECT_GT(bent_ones, 3000);
}

TEST(Bsdf, BentNormalsConserveEnergy) {
  const vec3 g(0.0F, 0.0F, 1.0F);
  const auto all = normals_and_viewers(g);
  for (std::size_t i = 0; i < all.size(); i += 400) {
    for (const float roughness : {0.1F, 0.6F}) {
      CmSurface s = make_surface(vec3(1.0F), 0.0F, roughness);
      s.normal = cm_bend_normal(all[i].first, g, all[i].second);
      s.matte_normal = s.smooth_normal = all[i].first;
      EXPECT_NEAR(reflected_share(s, all[i].second), 1.0, 0.005) << dot(s.normal, all[i].second);
    }
  }
}

TEST(Bsdf, BentNormalsDoNotAffectDiffuseReflection) {
  const vec3 g(0.0F, 0.0F, 1.0F);
  const auto all = normals_and_viewers(g);
  int bent = 0;
  for (std::size_t i = 0; i < all.size(); i += 97) {
    const auto [normal, wo] = all[i];
    CmSurface s = make_surface(vec3(1.0F), 0.0F, 0.5F);
    s.f0 = vec3(0.0F);
    s.specular = 0.0F;
    s.normal = cm_bend_normal(normal, g, wo);
    s.matte_normal = s.smooth_normal = normal;
    bent += dot(s.normal, normal) < 0.999F ? 1 : 0;
    for (const vec3 to : {normal, g, normalize(normal + vec3(0.5F, 0.2F, 0.0F))}) {
      const float cosine = std::max(dot(normal, to), 0.0F);
      EXPECT_NEAR(cm_bsdf_eval(s, wo, to).x, cosine / std::numbers::pi_v<float>, 1e-5F);
      EXPECT_NEAR(cm_bsdf_pdf(s, wo, to), cosine / std::numbers::pi_v<float>, 1e-5F);
    }
  }
  EXPECT_GT(bent, 10);
}

TEST(Bsdf, TheTerminatorOfMappedNormalsIsSoft) {
  CmSurface s = make_surface(vec3(0.7F), 0.0F, 0.5F);
  s.f0 = vec3(0.0F);
  s.specular = 0.0F;
  const vec3 wo = s.smooth_normal;
  for (const double tilt : {0.0, 0.05, 0.45, 1.0, 1.5, 2.0}) {
    s.normal = s.matte_normal = vec3(static_cast<float>(std::sin(tilt)), 0.0F, static_cast<float>(std::cos(tilt)));
    double last = 0.0;
    double lost = 0.0;
    double all = 0.0;
    CmSurface flat = s;
    flat.matte_normal = flat.smooth_normal = s.normal;
    const vec3 from = tilt < 1.5 ? wo : s.normal;
    // Light that rises over the smooth surface on the side to which the normal leans.
    for (int i = -50; i < 300; ++i) {
      const double angle = i * 0.005;
      const vec3 wi(static_cast<float>(std::cos(angle)), 0.0F, static_cast<float>(std::sin(angle)));
      const double lit = cm_bsdf_eval(s, from, wi).x;
      EXPECT_LE(lit, cm_bsdf_eval(flat, from, wi).x + 1e-6);
      if (tilt < 1.5) {
        EXPECT_LT(std::abs(lit - last), 0.05) << tilt << ' ' << angle;
      }
      if (angle <= 0.0) {
        EXPECT_EQ(lit, 0.0);
      }
      last = lit;
    }
    integrate(flat, 300, 300, [&](vec3 wi, double area) {
      all += cm_bsdf_eval(flat, from, wi).x * area;
      lost += (cm_bsdf_eval(flat, from, wi).x - cm_bsdf_eval(s, from, wi).x) * area;
    });
    const double c = std::cos(tilt);
    const double bound =
        tilt == 0.0 ? 0.0 : (tilt == 0.05 ? 0.02 : (tilt == 0.45 ? 0.145 : 0.5 - 0.5 * std::min(c, 0.0)));
    EXPECT_LE(lost, bound * all + 1e-4) << tilt;
  }
}

TEST(Bsdf, WhiteDiffuseReflectsEverything) {
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
  EXPECT_EQ(cm_bsdf_albedo(s, s.normal), vec3(1.0F));
}

TEST(Bsdf, SmoothWhiteMetalIsAMirror) {
  CmSurface s = make_surface(vec3(1.0F), 1.0F, 0.0F);
  s.normal = normalize(vec3(-0.2F, 0.9F, 0.4F));
  s.matte_normal = s.smooth_normal = s.normal;
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

TEST(Bsdf, DirectionsBelowTheSurfaceHaveZeroValue) {
  for (const CmSurface& s : all_surfaces()) {
    const vec3 above = direction(s, 0.5, 0.0);
    const vec3 below = direction(s, -0.3, 1.0);
    EXPECT_EQ(cm_bsdf_eval(s, above, below), vec3(0.0F));
    EXPECT_EQ(cm_bsdf_eval(s, below, above), vec3(0.0F));
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

TEST(Bsdf, TabulatedAlbedoMatchesTheIntegral) {
  for (const float roughness : {0.25F, 0.46F, 0.72F, 1.0F}) {
    for (const float metallic : {0.0F, 1.0F}) {
      CmSurface s = make_surface({0.9F, 0.5F, 0.1F}, metallic, roughness);
      s.clearcoat = 0.5F;
      s.clearcoat_roughness = s.roughness;
      for (const double cosine : {0.95, 0.58, 0.3, 0.14}) {
        const vec3 wo = direction(s, cosine, 0.0);
        dvec3 sum(0.0);
        integrate(s, 600, 900, [&](vec3 wi, double area) { sum += dvec3(cm_bsdf_eval(s, wo, wi)) * area; });
        const vec3 albedo = cm_bsdf_albedo(s, wo);
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(albedo[c], sum[c], 0.05) << roughness << ' ' << metallic << ' ' << cosine;
        }
        s.clearcoat = 0.0F;
        dvec3 bare(0.0);
        integrate(s, 600, 900, [&](vec3 wi, double area) { bare += dvec3(cm_bsdf_eval(s, wo, wi)) * area; });
        const vec3 bare_albedo = cm_bsdf_albedo(s, wo);
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(bare_albedo[c], bare[c], 0.008) << roughness << ' ' << metallic << ' ' << cosine;
        }
        s.clearcoat = 0.5F;
      }
    }
  }
}

}  // namespace
