#pragma once

// Optical properties of the atmosphere of light/sky.hpp, per wavelength and height. No GL.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/glm.hpp>

#include "light/spectrum.hpp"

namespace cumulet::light::air {

// Radii of the ground and of the end of the atmosphere, and heights of its parts, in km.
inline constexpr double ground = 6360.0;
inline constexpr double top = 6460.0;
inline constexpr double air_scale_height = 8.0;
inline constexpr double aerosol_scale_height = 1.2;
inline constexpr double ozone_height = 25.0;
inline constexpr double ozone_half_width = 15.0;

inline constexpr double sun_outside = 5.0;     ///< sun's irradiance outside, equal in all color components
inline constexpr double aerosol_albedo = 0.9;  ///< single-scattering albedo of aerosols
inline constexpr double aerosol_anisotropy = 0.8;
inline constexpr double ozone_column = 300.0 * 2.687e20;  ///< 300 Dobson units, molecules per square meter

// Bins of 370 to 380, ..., 780 to 790 nm. solar_irradiance: the sun's irradiance outside of the atmosphere, W / (m^2
// nm) (ASTM G-173). ozone_cross_section: at 233 K, m^2 (Serdyuchenko et al. 2014). Each is the mean over the bin, as
// collected by Bruneton (2017).
inline constexpr std::array<double, 42> solar_irradiance = {
    1.14259, 1.01249, 1.14716, 1.72765, 1.73054, 1.6887,  1.61253, 1.91198, 2.03474, 2.02042, 2.02212,
    1.93377, 1.95809, 1.91686, 1.8298,  1.8685,  1.8931,  1.85149, 1.8504,  1.8341,  1.8345,  1.8147,
    1.78158, 1.7533,  1.6965,  1.68194, 1.64654, 1.6048,  1.52143, 1.55622, 1.5113,  1.474,   1.4482,
    1.41018, 1.36775, 1.34188, 1.31429, 1.28303, 1.26758, 1.2367,  1.2082,  1.18737};
inline constexpr std::array<double, 42> ozone_cross_section = {
    2.182e-28, 2.818e-28, 6.636e-28, 1.527e-27, 2.763e-27, 5.52e-27,  8.451e-27, 1.582e-26, 2.316e-26,
    3.669e-26, 4.924e-26, 7.752e-26, 9.016e-26, 1.48e-25,  1.602e-25, 2.139e-25, 2.755e-25, 3.091e-25,
    3.5e-25,   4.266e-25, 4.672e-25, 4.398e-25, 4.701e-25, 5.019e-25, 4.305e-25, 3.74e-25,  3.215e-25,
    2.662e-25, 2.238e-25, 1.852e-25, 1.473e-25, 1.209e-25, 9.423e-26, 7.455e-26, 6.566e-26, 5.105e-26,
    4.15e-26,  4.228e-26, 3.237e-26, 2.451e-26, 2.801e-26, 2.534e-26};

/// Returns the mean of a table over a sample of a Spectrum and the following one.
inline double at_sample(const std::array<double, 42>& bins, std::size_t sample) {
  return 0.5 * (bins[sample] + bins[sample + 1]);
}

/// Returns the optical depths of air, aerosols and ozone of the vertical column above the ground, at a sample of a
/// Spectrum.
inline glm::dvec3 column(double turbidity, std::size_t sample) {
  // Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight" (1999), after Angstrom.
  const double aerosols = std::max(0.0, 0.04608 * turbidity - 0.04586);
  const double um = 1.0e-3 * wavelength(sample);
  const double um2 = um * um;
  // Hansen and Travis, "Light Scattering in Planetary Atmospheres" (1974).
  return {0.008569 / (um2 * um2) * (1.0 + 0.0113 / um2 + 0.00013 / (um2 * um2)), aerosols * std::pow(um, -1.3),
          ozone_column * at_sample(ozone_cross_section, sample)};
}

/// Returns the densities of air, aerosols and ozone at a height, per km, as fractions of the whole column.
inline glm::dvec3 density(double height) {
  return {std::exp(-height / air_scale_height) / air_scale_height,
          std::exp(-height / aerosol_scale_height) / aerosol_scale_height,
          std::max(0.0, 1.0 - std::abs(height - ozone_height) / ozone_half_width) / ozone_half_width};
}

}  // namespace cumulet::light::air
