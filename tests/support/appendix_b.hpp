#pragma once

// Reference BRDF of glTF 2.0's appendix B and KHR_materials_clearcoat in double precision. It is written from their
// formulas and uses nothing of glsl/: D and V of GGX with alpha = roughness^2, and Schlick's Fresnel term. Only the
// coupling of layers below an interface follows bsdf.glsl, with directional albedos that are integrated here.

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

namespace cumulet::test {

/// Directions below are unit vectors away from the surface; z is along its normal.
struct RoughInterface {
  double roughness = 1.0;
  double f0 = 0.04;

  static double schlick(double f0, double cosine) { return f0 + (1.0 - f0) * std::pow(1.0 - cosine, 5.0); }
  [[nodiscard]] double density(double cosine) const {
    const double a2 = std::pow(roughness, 4.0);
    return a2 / (std::numbers::pi * std::pow(cosine * cosine * (a2 - 1.0) + 1.0, 2.0));
  }
  /// D V.
  [[nodiscard]] double lobe(glm::dvec3 o, glm::dvec3 i) const {
    const double a2 = std::pow(roughness, 4.0);
    const double v =
        0.5 / (i.z * std::sqrt(o.z * o.z * (1.0 - a2) + a2) + o.z * std::sqrt(i.z * i.z * (1.0 - a2) + a2));
    return density(glm::normalize(o + i).z) * v;
  }
  /// Directional albedo: the fraction of constant radiance reflected towards this cosine, integrated over the
  /// distribution of microfacet normals.
  [[nodiscard]] double albedo(double cosine) const {
    constexpr int n = 100;
    const double a2 = std::pow(roughness, 4.0);
    const glm::dvec3 o(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
    double sum = 0.0;
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) {
        const double u = (j + 0.5) / n;
        const double z = std::sqrt((1.0 - u) / (1.0 + (a2 - 1.0) * u));
        const double r = std::sqrt(1.0 - z * z);
        const double angle = std::numbers::pi * (k + 0.5) / n;  // both halves are equal by symmetry
        const glm::dvec3 h(r * std::cos(angle), r * std::sin(angle), z);
        const double oh = glm::dot(o, h);
        const glm::dvec3 i = 2.0 * oh * h - o;
        if (oh > 0.0 && i.z > 0.0) sum += lobe(o, i) * schlick(f0, oh) * i.z * 4.0 * oh / (density(h.z) * h.z);
      }
    }
    return sum / (n * n);
  }
};

/// The transmitted fraction of constant radiance below an interface: on the way out, on the way in, and on average.
struct Below {
  double out_of = 1.0;
  double into = 1.0;
  double average = 1.0;
};

/// 1 - weight * the cosine-weighted average of the interface's directional albedo.
inline double average_below(const RoughInterface& interface, double weight) {
  constexpr int n = 24;
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    const double cosine = (i + 0.5) / n;
    sum += interface.albedo(cosine) * 2.0 * cosine / n;
  }
  return 1.0 - weight * sum;
}

struct AppendixB {
  glm::dvec3 base{1.0};
  double metallic = 0.0;
  RoughInterface dielectric;
  double clearcoat = 0.0;
  RoughInterface coat;

  /// The BRDF for light from i scattered towards o, times the cosine of i.
  [[nodiscard]] glm::dvec3 operator()(glm::dvec3 o, glm::dvec3 i, Below dielectric_, Below coat_) const {
    const double vh = glm::dot(o, glm::normalize(o + i));
    const glm::dvec3 conducted = base + (1.0 - base) * std::pow(1.0 - vh, 5.0);
    const glm::dvec3 fresnel = glm::mix(glm::dvec3(RoughInterface::schlick(dielectric.f0, vh)), conducted, metallic);
    const double coupled = dielectric_.out_of * dielectric_.into / dielectric_.average;
    const glm::dvec3 diffuse = base * (1.0 - metallic) / std::numbers::pi * coupled;
    const double coated = clearcoat * RoughInterface::schlick(coat.f0, vh) * coat.lobe(o, i);
    return (fresnel * dielectric.lobe(o, i) * std::min(coat_.out_of, coat_.into) +
            diffuse * (coat_.out_of * coat_.into / coat_.average) + coated) *
           i.z;
  }
};

}  // namespace cumulet::test
