// The BSDF of the extended-material variant (CM_EXTENDED_BSDF, glTF extensions) that shaders and C++ share. Tested by
// quadrature, by sampling, and with closed forms in double precision.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#define CM_EXTENDED_BSDF 2
#include "support/bsdf.hpp"

namespace {

using namespace cumulet::core;

constexpr double pi = std::numbers::pi;

CmSurface make_surface(vec3 base, float metallic, float roughness, float ior = 1.5F) {
  CmSurface s{};
  s.base_color = base;
  s.metallic = metallic;
  s.roughness = roughness;
  s.alpha = vec2(cm_alpha(roughness));
  s.normal = vec3(0.0F, 0.0F, 1.0F);
  s.matte_normal = s.smooth_normal = s.geometric = s.normal;
  s.tangent = vec3(1.0F, 0.0F, 0.0F);
  s.f0 = cm_dielectric_f0(ior, 1.0F, vec3(1.0F));
  s.specular = 1.0F;
  s.film = {0.0F, 1.3F, 400.0F, 1.0F};
  return s;
}

CmSurface glass(float roughness, float eta, vec3 color = vec3(1.0F)) {
  CmSurface s = make_surface(color, 0.0F, roughness, eta > 1.0F ? eta : 1.0F / eta);
  s.transmission = 1.0F;
  s.eta = eta;
  return s;
}

CmSurface thin_wall(float roughness) {
  CmSurface s = make_surface(vec3(0.9F, 0.6F, 0.3F), 0.0F, roughness);
  s.transmission = 0.7F;
  return s;
}

CmSurface brushed(float metallic) {
  CmSurface s = make_surface({0.9F, 0.5F, 0.2F}, metallic, 0.4F);
  s.alpha.x = 0.7F;
  s.roughness = std::sqrt(std::sqrt(s.alpha.x * s.alpha.y));
  s.tangent = normalize(vec3(0.6F, 0.8F, 0.0F));
  return s;
}

CmSurface velvet(vec3 sheen, float roughness) {
  CmSurface s = make_surface(vec3(1.0F), 0.0F, 0.6F);
  s.sheen = sheen;
  s.sheen_roughness = roughness;
  return s;
}

CmSurface filmed(float metallic, float thickness) {
  CmSurface s = make_surface(vec3(0.8F), metallic, 0.4F);
  s.film = {1.0F, 1.6F, thickness, 1.0F};
  s.film_average = cm_film_average(s);
  return s;
}

struct Named {
  const char* name;
  CmSurface surface;
};

std::vector<Named> all_surfaces() {
  std::vector<Named> all{{"into glass", glass(0.3F, 1.5F, {0.9F, 0.8F, 0.7F})},
                         {"out of glass", glass(0.4F, 1.0F / 1.5F)},
                         {"thin wall", thin_wall(0.4F)},
                         {"brushed metal", brushed(1.0F)},
                         {"brushed plastic", brushed(0.0F)},
                         {"velvet", velvet({0.9F, 0.5F, 0.3F}, 0.5F)},
                         {"film on metal", filmed(1.0F, 450.0F)},
                         {"film on plastic", filmed(0.0F, 300.0F)}};
  CmSurface everything = glass(0.35F, 1.4F, {0.9F, 0.8F, 0.7F});
  everything.transmission = 0.5F;
  everything.alpha.x = 0.5F;
  everything.clearcoat = 0.6F;
  everything.clearcoat_roughness = 0.3F;
  everything.sheen = vec3(0.3F);
  everything.sheen_roughness = 0.7F;
  everything.film = {0.5F, 1.8F, 350.0F, 1.3F};
  everything.film_average = cm_film_average(everything);
  all.push_back({"everything", everything});
  return all;
}

vec3 direction(double cosine, double angle) {
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  return {static_cast<float>(sine * std::cos(angle)), static_cast<float>(sine * std::sin(angle)),
          static_cast<float>(cosine)};
}

/// A quadrature over the sphere, finer towards grazing angles: calls f(wi, solid angle).
template <class F>
void integrate(int rings, int sectors, F&& f) {
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const double theta = pi * (i + 0.5) / rings;
      f(direction(std::cos(theta), 2.0 * pi * (j + 0.5) / sectors),
        std::sin(theta) * (pi / rings) * (2.0 * pi / sectors));
    }
  }
}

struct Random {
  std::mt19937 engine;
  std::uniform_real_distribution<float> unit{0.0F, 1.0F};
  float operator()() { return unit(engine); }
};

struct Sampled {
  vec3 wi;
  vec3 weight;
};
Sampled sample(const CmSurface& s, vec3 wo, Random& random) {
  const float u0 = random();
  const float u1 = random();
  Sampled result{cm_bsdf_sample(s, wo, u0, u1, random()), vec3(0.0F)};
  const float pdf = cm_bsdf_pdf(s, wo, result.wi);
  if (pdf > 0.0F) result.weight = cm_bsdf_eval(s, wo, result.wi) / pdf;
  return result;
}

/// The reflected and transmitted fraction of constant radiance, and its standard error.
std::pair<dvec3, double> share(const CmSurface& s, vec3 wo, int n = 40000) {
  Random random{std::mt19937(11)};
  dvec3 sum(0.0);
  double square = 0.0;
  for (int i = 0; i < n; ++i) {
    const dvec3 weight(sample(s, wo, random).weight);
    sum += weight;
    square += weight.y * weight.y;
  }
  const dvec3 mean = sum / double(n);
  return {mean, std::sqrt(std::max(0.0, square / n - mean.y * mean.y) / n)};
}

TEST(ExtendedBsdf, PdfIntegratesToOneAndMatchesSamples) {
  constexpr int rings = 16;  // of equal solid angle
  constexpr int sectors = 12;
  for (const auto& [name, s] : all_surfaces()) {
    for (const double cosine : {0.85, 0.4}) {
      const vec3 wo = direction(cosine, 0.7);
      const auto bin_of = [&](vec3 wi) {
        const int ring = std::clamp(static_cast<int>((wi.z * 0.5F + 0.5F) * rings), 0, rings - 1);
        const double angle = std::atan2(wi.y, wi.x) / (2.0 * pi) + 0.5;
        return static_cast<std::size_t>(ring * sectors + std::min(static_cast<int>(angle * sectors), sectors - 1));
      };
      std::array<double, rings * sectors> expected{};
      std::array<int, rings * sectors> counted{};
      constexpr int n = 60000;
      double sum = 0.0;
      integrate(800, 720, [&](vec3 wi, double area) {
        const double p = cm_bsdf_pdf(s, wo, wi) * area;
        sum += p;
        expected[bin_of(wi)] += p * n;
      });
      Random random{std::mt19937(2)};
      for (int i = 0; i < n; ++i) ++counted[bin_of(sample(s, wo, random).wi)];
      // A few visible normals reflect below the surface, where no half vector is valid.
      EXPECT_NEAR(sum, 1.0, 5e-3) << name << ' ' << cosine;
      double chi2 = 0.0;
      int bins = 0;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        if (expected[i] < 10.0) continue;
        chi2 += std::pow(counted[i] - expected[i], 2) / (expected[i] + std::pow(0.004 * expected[i], 2));
        ++bins;
      }
      EXPECT_LT(chi2, bins + 5.0 * std::sqrt(2.0 * bins)) << name << ' ' << cosine;
    }
  }
}

TEST(ExtendedBsdf, SampleMeanMatchesTheIntegral) {
  for (const auto& [name, s] : all_surfaces()) {
    for (const double cosine : {0.9, 0.35}) {
      const vec3 wo = direction(cosine, 2.0);
      dvec3 quadrature(0.0);
      integrate(800, 720, [&](vec3 wi, double area) { quadrature += dvec3(cm_bsdf_eval(s, wo, wi)) * area; });
      const auto [mean, error] = share(s, wo);
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(mean[c], quadrature[c], 5.0 * error + 5e-3) << name << ' ' << cosine;
      }
    }
  }
}

TEST(ExtendedBsdf, IsReciprocal) {
  for (const auto& [name, s] : all_surfaces()) {
    // Transmission depends on the side. Seen from the other side, the surface has the inverse index.
    CmSurface back = s;
    if (s.eta > 0.0F) back.eta = 1.0F / s.eta;
    back.normal = back.matte_normal = back.smooth_normal = back.geometric = -s.normal;
    int through = 0;
    for (int i = 0; i < 400; ++i) {
      const double a = 0.05 + 0.9 * std::fmod(i * 0.618, 1.0);
      const double b = 0.05 + 0.9 * std::fmod(i * 0.7548, 1.0);
      const vec3 wo = direction(a, 0.3 * i);
      const vec3 up = direction(b, 0.3 * i + 0.2 * (i % 7));
      const vec3 there = cm_bsdf_eval(s, wo, up) / static_cast<float>(b);
      const vec3 again = cm_bsdf_eval(s, up, wo) / static_cast<float>(a);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(there[c], again[c], 2e-3F * there[c] + 1e-6F) << name;
      // Coat and sheen attenuate transmitted light only on the outside, so they are not reciprocal.
      if (!(s.transmission > 0.0F) || s.clearcoat > 0.0F) continue;
      const vec3 down = direction(-b, 0.3 * i + pi + 0.2 * (i % 7));
      const float index2 = s.eta > 0.0F ? s.eta * s.eta : 1.0F;
      const vec3 in = cm_bsdf_eval(s, wo, down) / static_cast<float>(b) / index2;
      const vec3 out = cm_bsdf_eval(back, down, wo) / static_cast<float>(a);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(in[c], out[c], 5e-3F * in[c] + 1e-6F) << name;
      through += in.y > 1e-3F ? 1 : 0;
    }
    if (s.transmission > 0.0F && s.clearcoat == 0.0F) {
      EXPECT_GT(through, 20) << name;
    }
  }
}

TEST(ExtendedBsdf, ClearGlassPassesTheWhiteFurnaceTest) {
  for (const float eta : {1.5F, 2.4F, 1.0F / 1.5F, 1.001F}) {
    for (const double cosine : {1.0, 0.8, 0.5, 0.3, 0.1}) {
      const auto [mean, error] = share(glass(0.0F, eta), direction(cosine, 0.3));
      EXPECT_NEAR(mean.x, 1.0, 4.0 * error + 3e-3) << eta << ' ' << cosine;
    }
  }
}

TEST(ExtendedBsdf, RoughGlassEnergyLossIsBounded) {
  for (const float eta : {1.5F, 1.0F / 1.5F, 0.0F}) {
    for (const auto& [roughness, lost] : {std::pair{0.2F, 0.04}, {0.5F, 0.21}, {1.0F, 0.70}}) {
      for (const double cosine : {1.0, 0.6, 0.2}) {
        CmSurface s = glass(roughness, eta > 0.0F ? eta : 1.5F);
        s.eta = eta;
        const auto [mean, error] = share(s, direction(cosine, 0.3));
        EXPECT_LT(mean.x, 1.0 + 4.0 * error + 3e-3) << eta << ' ' << roughness << ' ' << cosine;
        EXPECT_GT(mean.x, 1.0 - lost) << eta << ' ' << roughness << ' ' << cosine;
      }
    }
  }
}

// Smooth glass refracts by Snell's law, with Fresnel weights by Schlick, in double precision.
TEST(ExtendedBsdf, SmoothGlassFollowsSnellAndSchlick) {
  Random random{std::mt19937(4)};
  for (const double eta : {1.5, 1.0 / 1.33, 2.4}) {
    for (const double cosine : {0.95, 0.7, 0.45, 0.2}) {
      const CmSurface s = glass(0.0F, static_cast<float>(eta));
      const vec3 wo = direction(cosine, 0.9);
      const double sine = std::sqrt(1.0 - cosine * cosine) / eta;
      double through = 0.0;
      constexpr int n = 20000;
      for (int i = 0; i < n; ++i) {
        const Sampled got = sample(s, wo, random);
        if (got.wi.z > 0.0F) continue;
        through += got.weight.x / n;
        if (i % 100 == 0) {
          // The narrow lobe is a few thousandths wide.
          const dvec3 across = dvec3(wo) - dvec3(0, 0, cosine);
          const dvec3 expected = -across / length(across) * sine - dvec3(0, 0, std::sqrt(1.0 - sine * sine));
          EXPECT_GT(dot(dvec3(got.wi), expected), 0.999) << eta << ' ' << cosine;
        }
      }
      const double thin_cosine = eta > 1.0 ? cosine : std::sqrt(std::max(0.0, 1.0 - sine * sine));
      const double f0 = std::pow((eta - 1.0) / (eta + 1.0), 2.0);
      const double mirrored = sine >= 1.0 ? 1.0 : f0 + (1.0 - f0) * std::pow(1.0 - thin_cosine, 5.0);
      EXPECT_NEAR(through, 1.0 - mirrored, 0.012) << eta << ' ' << cosine;
    }
  }
}

TEST(ExtendedBsdf, ThinWallsTransmitWhatTheyDoNotReflect) {
  for (const double cosine : {1.0, 0.6, 0.2}) {
    CmSurface s = make_surface({1.0F, 0.5F, 0.25F}, 0.0F, 0.0F);
    s.transmission = 1.0F;
    const vec3 wo = direction(cosine, 0.3);
    const vec3 passes = cm_bsdf_passes(s, wo);
    const double f = 0.04 + 0.96 * std::pow(1.0 - cosine, 5.0);
    EXPECT_NEAR(passes.x, 1.0 - f, 1e-5);
    EXPECT_NEAR(passes.z, 0.25 * (1.0 - f), 1e-5);
    const auto [mean, error] = share(s, wo);
    EXPECT_NEAR(mean.x + passes.x, 1.0, 4.0 * error + 2e-3) << cosine;
    s.alpha = vec2(0.1F);
    EXPECT_EQ(cm_bsdf_passes(s, wo), vec3(0.0F));
    s.alpha = vec2(CM_MIN_ALPHA);
    s.eta = 1.5F;
    EXPECT_EQ(cm_bsdf_passes(s, wo), vec3(0.0F));
  }
}

// White furnace tests: white under sheen and under a thin film.
TEST(ExtendedBsdf, WhiteUnderSheenPassesTheWhiteFurnaceTest) {
  for (const float roughness : {0.2F, 0.5F, 1.0F}) {
    for (const double cosine : {1.0, 0.6, 0.3, 0.1}) {
      const auto [mean, error] = share(velvet(vec3(1.0F), roughness), direction(cosine, 0.3));
      // The base's attenuation is the smaller of those for the two directions, so some energy is lost.
      EXPECT_NEAR(mean.x, 1.0, 4.0 * error + 0.03) << roughness << ' ' << cosine;
    }
  }
}

TEST(ExtendedBsdf, WhiteUnderAThinFilmPassesTheWhiteFurnaceTest) {
  for (const float thickness : {0.0F, 200.0F, 550.0F}) {
    for (const double cosine : {1.0, 0.6, 0.3}) {
      CmSurface s = filmed(0.0F, thickness);
      s.base_color = vec3(1.0F);
      const auto [mean, error] = share(s, direction(cosine, 0.3));
      // The diffuse lobe is weighted by the film's largest channel.
      EXPECT_LT(std::max({mean.x, mean.y, mean.z}), 1.0 + 4.0 * error + 0.03) << thickness << ' ' << cosine;
      EXPECT_GT(std::max({mean.x, mean.y, mean.z}), 1.0 - 4.0 * error - 0.03) << thickness << ' ' << cosine;
    }
  }
}

TEST(ExtendedBsdf, SheenAlbedoIsTheIntegral) {
  for (const float roughness : {0.25F, 0.6F, 1.0F}) {
    for (const double cosine : {0.9, 0.4, 0.1}) {
      const vec3 wo = direction(cosine, 0.0);
      double sum = 0.0;
      integrate(1600, 720, [&](vec3 wi, double area) {
        if (wi.z > 0.0F) sum += double{cm_sheen(roughness, wo, wi, normalize(wo + wi))} * area;
      });
      EXPECT_NEAR(cm_sheen_albedo(roughness, static_cast<float>(cosine)), sum, 0.01) << roughness << ' ' << cosine;
      EXPECT_LE(sum, 1.02);
    }
  }
}

// By the extension's formulas: alpha along the direction is mix(alpha, 1, strength^2); D and G of Heitz.
TEST(ExtendedBsdf, BrushedMetalMatchesTheAnisotropyExtension) {
  const CmSurface s = brushed(1.0F);
  const dvec3 t(s.tangent);
  const dvec3 b = cross(dvec3(0, 0, 1), t);
  const double ax = s.alpha.x;
  const double ay = s.alpha.y;
  for (int i = 0; i < 60; ++i) {
    const dvec3 o(direction(0.15 + 0.8 * std::fmod(i * 0.618, 1.0), 0.5 * i));
    const dvec3 in(direction(0.15 + 0.8 * std::fmod(i * 0.7548, 1.0), 1.3 * i));
    const dvec3 h = normalize(o + in);
    const double d =
        1.0 / (pi * ax * ay * std::pow(std::pow(dot(h, t) / ax, 2) + std::pow(dot(h, b) / ay, 2) + h.z * h.z, 2));
    const auto masked = [&](const dvec3& w) { return length(dvec3(ax * dot(w, t), ay * dot(w, b), w.z)); };
    const double v = 0.5 / (in.z * masked(o) + o.z * masked(in));
    const double f = std::pow(1.0 - dot(o, h), 5.0);
    const vec3 got = cm_bsdf_eval(s, vec3(o), vec3(in));
    for (int c = 0; c < 3; ++c) {
      const double expected = (s.base_color[c] + (1.0 - s.base_color[c]) * f) * d * v * in.z;
      EXPECT_NEAR(got[c], expected, 1e-3 * expected + 1e-6);
    }
  }
}

// Airy's sum over all inner reflections, integrated over wavenumbers in double precision. rest: upper bound of the
// series' terms beyond the second.
dvec3 airy(double film_ior, double thickness, double base_f0, double cosine, double& rest) {
  const double sine2 = (1.0 - cosine * cosine) / (film_ior * film_ior);
  const double inner = std::sqrt(1.0 - sine2);
  const auto schlick = [](double n, double m, double c) {
    const double f0 = std::pow((n - m) / (n + m), 2.0);
    return f0 + (1.0 - f0) * std::pow(1.0 - c, 5.0);
  };
  const double base_ior = (1.0 + std::sqrt(base_f0)) / (1.0 - std::sqrt(base_f0));
  const double r12 = -std::sqrt(schlick(film_ior, 1.0, cosine));
  const double r23 = (base_ior < film_ior ? 1.0 : -1.0) * std::sqrt(schlick(base_ior, film_ior, inner));
  struct Curve {
    double value, middle, spread;
    int row;
  };
  constexpr std::array<Curve, 4> curves{{{5.4856e-13, 1.6810e6, 4.3278e9, 0},
                                         {9.7470e-14, 2.2399e6, 4.5282e9, 0},
                                         {4.4201e-13, 1.7953e6, 9.3046e9, 1},
                                         {5.2481e-13, 2.2084e6, 6.6121e9, 2}}};
  dvec3 xyz(0.0);
  dvec3 white(0.0);
  const double ways = 2.0 * film_ior * thickness * 1e-9 * inner;
  for (const Curve& curve : curves) {
    // Their exponent is that of a Gaussian of twice the spread.
    const double deviation = std::sqrt(2.0 * curve.spread);
    constexpr int steps = 4000;
    for (int i = 0; i < steps; ++i) {
      const double z = (i + 0.5) / steps * 12.0 - 6.0;
      const double k = 2.0 * pi * (curve.middle + z * deviation);
      const double weight = curve.value * std::sqrt(2.0 * pi * curve.spread) * std::exp(-0.5 * z * z) /
                            std::sqrt(2.0 * pi) * 12.0 / steps / 1.0685e-7;
      const std::complex<double> turn = std::polar(1.0, k * ways);
      const std::complex<double> all = (r12 + r23 * turn) / (1.0 + r12 * r23 * turn);
      xyz[curve.row] += weight * std::norm(all);
      white[curve.row] += weight;
    }
  }
  // A term that does not depend on the wavenumber is white, whatever the white point of the curves.
  const double both = r12 * r12 * r23 * r23;
  const double even = r12 * r12 + std::pow(1.0 - r12 * r12, 2.0) * r23 * r23 / (1.0 - both);
  rest = 2.0 * (1.0 - r12 * r12) * std::pow(both, 1.5) / (1.0 - std::sqrt(both));
  const dvec3 uneven = xyz - even * white;
  return dvec3(even) + dvec3(3.2404542 * uneven.x - 1.5371385 * uneven.y - 0.4985314 * uneven.z,
                             -0.9692660 * uneven.x + 1.8760108 * uneven.y + 0.0415560 * uneven.z,
                             0.0556434 * uneven.x - 0.2040259 * uneven.y + 1.0572252 * uneven.z);
}

TEST(ExtendedBsdf, ThinFilmMatchesAirySummation) {
  for (const double ior : {1.3, 1.8}) {
    for (const double thickness : {120.0, 350.0, 800.0}) {
      for (const double f0 : {0.04, 0.3, 0.7}) {
        for (const double cosine : {1.0, 0.6, 0.25}) {
          const CmFilm film{1.0F, static_cast<float>(ior), static_cast<float>(thickness), 1.0F};
          const vec3 got = cm_film_fresnel(film, vec3(static_cast<float>(f0)), static_cast<float>(cosine));
          double rest = 0.0;
          const dvec3 expected = clamp(airy(ior, thickness, f0, cosine, rest), 0.0, 1.0);
          for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(got[c], expected[c], 2e-3 + rest) << ior << ' ' << thickness << ' ' << f0 << ' ' << cosine;
          }
        }
      }
    }
  }
}

TEST(ExtendedBsdf, ThinFilmOfZeroThicknessHasNoEffect) {
  for (const float f0 : {0.04F, 0.5F}) {
    CmSurface s = make_surface(vec3(1.0F), 0.0F, 0.4F);
    s.f0 = vec3(f0);
    const vec3 bare = cm_base_fresnel(s, 0.7F);
    s.film = {1.0F, 1.8F, 0.0F, 1.0F};
    EXPECT_EQ(cm_base_fresnel(s, 0.7F), bare);
    s.film.thickness = 200.0F;
    EXPECT_NE(cm_base_fresnel(s, 0.7F), bare);
  }
}

TEST(Dispersion, FollowsCauchyByTheAbbeNumber) {
  // Abbe's number is (n_d - 1) / (n_F - n_C).
  for (const double abbe : {20.0, 55.0, 9.8}) {
    const auto n = [&](double wavelength) {
      return double{cm_cauchy(1.5F, static_cast<float>(20.0 / abbe), static_cast<float>(wavelength))};
    };
    EXPECT_NEAR(n(587.6), 1.5, 1e-4);
    EXPECT_NEAR(0.5 / (n(486.1) - n(656.3)), abbe, 0.01 * abbe);
  }
  EXPECT_EQ(cm_cauchy(1.5F, 0.0F, 450.0F), 1.5F);
  EXPECT_EQ(cm_cauchy(1.5F, 1e18F, 450.0F), 1e4F);
  EXPECT_EQ(cm_cauchy(1.5F, 100.0F, 660.0F), 1.0F);
}

TEST(Dispersion, KeepsWhiteWhite) {
  dvec3 mean(0.0);
  constexpr int n = 30000;
  std::array<int, 5> counts{};
  for (int i = 0; i < n; ++i) {
    const float wavelength = cm_wavelength((static_cast<float>(i) + 0.5F) / n);
    ASSERT_GE(wavelength, 402.0F);
    ASSERT_LE(wavelength, 673.0F);
    mean += dvec3(cm_wavelength_color(wavelength)) / double(n);
    // Triangular distributions: half of each is within 1 - 1/sqrt(2) of its half width.
    const float off = std::abs(wavelength - 611.0F);
    if (i < n / 3 && off < 62.0F * (1.0F - std::sqrt(0.5F))) ++counts[0];
  }
  EXPECT_NEAR(counts[0], n / 6, n / 300);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean[c], 1.0, 2e-3);
}

TEST(ExtendedBsdf, ExtremesStayFinite) {
  Random random{std::mt19937(6)};
  for (const float roughness : {0.0F, 1.0F}) {
    for (const float eta : {0.0F, 1.001F, 0.999F, 1e4F, 1e-4F, 1.5F}) {
      for (const double cosine : {1.0, 1e-2, 1e-4, 1e-7}) {
        CmSurface s = glass(roughness, eta > 0.0F ? eta : 1.5F);
        s.eta = eta;
        s.sheen = vec3(1.0F);
        s.sheen_roughness = roughness;
        s.film = {1.0F, 1e4F, 1e9F, 1.0F};
        s.film_average = cm_film_average(s);
        s.alpha.x = 1.0F;
        for (int i = 0; i < 500; ++i) {
          const Sampled got = sample(s, direction(cosine, 0.0), random);
          ASSERT_TRUE(std::isfinite(got.weight.x) && got.weight.x >= 0.0F)
              << roughness << ' ' << eta << ' ' << cosine << ' ' << got.weight.x;
          ASSERT_TRUE(std::isfinite(got.wi.x + got.wi.y + got.wi.z));
        }
      }
    }
  }
}

}  // namespace
