#include "light/black_body.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "base/luminance.hpp"
#include "light/spectrum.hpp"

namespace cumulet::light {

namespace {

constexpr double coldest = 100.0;
constexpr double hottest = 40000.0;
constexpr float log_range = 5.99146455F;  // log(hottest / coldest)

}  // namespace

glm::dvec3 black_body_color(double kelvin) {
  // Planck's law divided by its value at 555 nm: for cold bodies the unnormalized values would underflow.
  constexpr double second_constant = 1.438776877e7;  // h c / k, nm K
  const double reference = second_constant / (555.0 * kelvin);
  Spectrum spectrum{};
  for (std::size_t i = 0; i < spectrum.size(); ++i) {
    const double x = second_constant / (wavelength(i) * kelvin);
    // (e^r - 1) / (e^x - 1)
    const double ratio = std::exp(reference - x) * std::expm1(-reference) / std::expm1(-x);
    spectrum[i] = std::pow(555.0 / wavelength(i), 5.0) * ratio;
  }
  const glm::dvec3 color = glm::max(rec709(spectrum), glm::dvec3(0.0));
  return color / luminance(color);
}

double black_body_radiance(double kelvin, double intensity) {
  if (!(kelvin >= coldest) || !(intensity > 0.0)) return 0.0;
  constexpr double stefan_boltzmann = 5.670373e-8;
  const double fourth = kelvin * kelvin * kelvin * kelvin;
  return 1.0e-6 * stefan_boltzmann / std::numbers::pi * (1.0 + intensity * (fourth - 1.0));
}

BlackBody::BlackBody() {
  const auto steps = static_cast<double>(colors_.size() - 1);
  for (std::size_t i = 0; i < colors_.size(); ++i) {
    const double kelvin = coldest * std::pow(hottest / coldest, static_cast<double>(i) / steps);
    colors_[i] = glm::vec3(black_body_color(kelvin));
  }
}

glm::vec3 BlackBody::emission(float kelvin, float intensity) const {
  const double radiance = black_body_radiance(kelvin, intensity);
  if (!(radiance > 0.0)) return glm::vec3(0.0F);
  const auto steps = static_cast<float>(colors_.size() - 1);
  const float along = std::log(kelvin / static_cast<float>(coldest)) / log_range;
  const float at = steps * std::min(along, 1.0F);
  const std::size_t first = std::min(static_cast<std::size_t>(at), colors_.size() - 2);
  const glm::vec3 color = glm::mix(colors_[first], colors_[first + 1], at - static_cast<float>(first));
  return static_cast<float>(radiance) * color;
}

}  // namespace cumulet::light
