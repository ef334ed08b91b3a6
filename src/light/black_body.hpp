#pragma once

// Black-body radiation. No GL.

#include <array>
#include <glm/glm.hpp>

namespace cumulet::light {

/// Returns the color of a black body from Planck's law: linear Rec. 709 with luminance 1. Below about 1,900 K the color
/// is outside of the Rec. 709 gamut: negative components become 0, and the luminance stays 1. kelvin: >= 100.
glm::dvec3 black_body_color(double kelvin);

/// Returns the emission of fire at this temperature per unit length, as in Blender's Principled Volume: 1e-6 sigma / pi
/// x mix(1, kelvin^4, intensity). Intensity 1 gives the Stefan-Boltzmann law; intensities near 0 give the same value at
/// all temperatures. Returns 0 below 100 K and for intensity 0.
double black_body_radiance(double kelvin, double intensity);

/// Fast combination of both functions: colors come from a table, within 0.0005 in CIE u'v'. Construction takes about a
/// millisecond.
class BlackBody {
 public:
  BlackBody();
  /// Returns black_body_color() x black_body_radiance(). Above 40,000 K the color is that of 40,000 K. Returns 0 for
  /// NaN.
  [[nodiscard]] glm::vec3 emission(float kelvin, float intensity) const;
  /// Colors from 100 K to 40,000 K, equidistant in the logarithm of the temperature.
  using Colors = std::array<glm::vec3, 1024>;
  [[nodiscard]] const Colors& colors() const { return colors_; }

 private:
  Colors colors_;
};

}  // namespace cumulet::light
