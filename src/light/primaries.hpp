#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>

namespace cumulet::light {

/// CIE 1931 xy coordinates of a color space's red, green, blue and white. The default is Rec. 709.
struct Primaries {
  glm::dvec2 red{0.64, 0.33};
  glm::dvec2 green{0.30, 0.60};
  glm::dvec2 blue{0.15, 0.06};
  glm::dvec2 white{0.3127, 0.3290};
};

/// ACES2065-1 (SMPTE ST 2065-1), also called AP0.
inline constexpr Primaries aces_primaries{{0.7347, 0.2653}, {0.0, 1.0}, {0.0001, -0.077}, {0.32168, 0.33767}};

/// Returns the name of a well-known set of primaries, else "other primaries".
std::string name_of(const Primaries& primaries);

/// Whether two sets agree to three digits, the precision in files.
bool similar(const Primaries& a, const Primaries& b);

/// Returns the matrix from linear RGB of these primaries to CIE XYZ; white (1, 1, 1) has Y = 1. Returns nullopt if the
/// primaries span no color space.
std::optional<glm::dmat3> xyz_matrix(const Primaries& primaries);

/// Returns the matrix from linear RGB of these primaries to linear Rec. 709, with Bradford adaptation of white. Returns
/// nullopt if the primaries span no color space.
std::optional<glm::dmat3> rec709_matrix(const Primaries& primaries);

/// Returns the matrix from CIE XYZ to linear Rec. 709, without adaptation of the white point.
glm::dmat3 rec709_matrix_of_xyz();

/// Desaturates a color with a negative component at constant luminance until no component is negative. Leaves other
/// colors and non-finite values unchanged.
glm::vec3 into_gamut(const glm::vec3& color);

/// Converts pixels by a matrix and moves them into the Rec. 709 gamut. Returns the number of pixels that were clearly
/// outside.
std::uint64_t convert(std::span<glm::vec3> pixels, const glm::dmat3& matrix);

}  // namespace cumulet::light
