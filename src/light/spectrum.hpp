#pragma once

// Spectra of light, and what colour they have. No GL.

#include <array>
#include <cstddef>
#include <glm/glm.hpp>

namespace cumulet::light {

/// A quantity per wavelength, at 380, 390, ..., 780 nm.
using Spectrum = std::array<double, 41>;

/// Of a spectrum's sample, in nm.
constexpr double wavelength(std::size_t sample) { return 380.0 + 10.0 * static_cast<double>(sample); }

/// Linear Rec. 709 as the eye sees it: the CIE's 1931 2-degree observer, negative where the colour lies outside of what
/// red, green and blue can mix. Scaled so that its luminance is the mean of the spectrum, weighted by the eye's
/// sensitivity: the same 1 at all wavelengths has luminance 1.
glm::dvec3 rec709(const Spectrum& spectrum);

}  // namespace cumulet::light
