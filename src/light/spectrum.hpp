#pragma once

// Spectra of light and their colors. No GL.

#include <array>
#include <cstddef>
#include <glm/glm.hpp>

namespace cumulet::light {

/// A quantity per wavelength, at 380, 390, ..., 780 nm.
using Spectrum = std::array<double, 41>;

/// Returns the wavelength of a spectrum's sample, in nm.
constexpr double wavelength(std::size_t sample) { return 380.0 + 10.0 * static_cast<double>(sample); }

/// Returns the linear Rec. 709 color for the CIE 1931 2-degree observer; components are negative if the color is
/// outside of the gamut. Its luminance is the mean of the spectrum, weighted by the eye's sensitivity: a spectrum of 1
/// at all wavelengths has luminance 1.
glm::dvec3 rec709(const Spectrum& spectrum);

}  // namespace cumulet::light
