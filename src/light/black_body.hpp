#pragma once

// The light of hot things. No GL.

#include <array>
#include <glm/glm.hpp>

namespace cumulet::light {

/// Of a black body: linear Rec. 709 of luminance 1, from Planck's law. Below some 1,900 K its colour is redder than
/// Rec. 709 can mix: what is negative becomes 0, and the luminance stays 1. kelvin: 100 or above.
glm::dvec3 black_body_colour(double kelvin);

/// How much light fire of this temperature sends out per unit length, as Blender's Principled Volume has it: the
/// Stefan-Boltzmann law at intensity 1, the same at all temperatures near 0: 1e-6 sigma / pi x mix(1, kelvin^4,
/// intensity). Nothing below 100 K, nor at intensity 0.
double black_body_radiance(double kelvin, double intensity);

/// Both, fast: colours from a table, within 0.0005 in CIE u'v'. A value; made once, in about a millisecond.
class BlackBody {
 public:
  BlackBody();
  /// black_body_colour() x black_body_radiance(); above 40,000 K the colour stays. NaN: nothing.
  [[nodiscard]] glm::vec3 emission(float kelvin, float intensity) const;
  /// From 100 K to 40,000 K, evenly in the temperature's logarithm.
  using Colours = std::array<glm::vec3, 1024>;
  [[nodiscard]] const Colours& colours() const { return colours_; }

 private:
  Colours colours_;
};

}  // namespace cumulet::light
