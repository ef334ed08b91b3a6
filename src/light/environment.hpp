#pragma once

// Environment maps: an equirectangular image of the distant surroundings as a light. No GL.

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "base/progress.hpp"
#include "light/prefiltered_environment.hpp"

namespace cumulet::light {

/// Radiance of all directions, linear Rec. 709, rows from the top (+Y) down. The image center is at +Z; seen from
/// inside, +X is to the left of it.
struct EnvironmentPixels {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<glm::vec3> values;
  std::vector<std::string> remarks{};  ///< choices, conversions and ignored data of the reader
};

/// Spherical harmonics of radiance without the mean (order 1 and 2): coefficients of x, y, z, xy, yz, zx, xx - zz and
/// yy - zz, in the order of glsl/light/harmonics.glsl.
using Harmonics = std::array<glm::vec3, 8>;

/// An environment map with the tables for importance sampling (glsl/light/environment.glsl). Immutable and shared.
struct Environment {
  static constexpr std::uint32_t max_side = 16384;

  std::string name;  ///< for messages
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  /// One word per texel. x, y: the alias (Walker's alias method): texel i, drawn uniformly, returns itself if a random
  /// word is at most x, else texel y. Texels are sampled by luminance times the sine of the row's angle from +Y. z, w:
  /// red and green, and blue, as halves, in units of the float whose upper half is that of w.
  std::vector<glm::uvec4> words;
  glm::dvec3 mean{0.0};              ///< over all directions
  glm::dvec3 level_irradiance{0.0};  ///< on a horizontal plane that faces up (+Y)
  Harmonics harmonics{};
  PrefilteredEnvironmentPtr prefiltered;  ///< prefiltered maps for glossy reflection; null: the environment is constant
  /// Solid-angle pdf of sampling a texel, divided by the texel's luminance: 1 / (sum of weights x texel solid angle /
  /// sine). 0: the environment is black.
  float density = 0.0F;
  std::vector<std::string> remarks;  ///< choices, conversions and ignored data of the reader
  std::uint64_t replaced = 0;        ///< pixels with components not finite, negative or > 1e30, which became 0

  [[nodiscard]] std::size_t texels() const { return words.size(); }
};
using EnvironmentPtr = std::shared_ptr<const Environment>;

/// Throws Error(file), with the name first, for an image without pixels or with a side above max_side.
void check_environment_size(const std::string& name, std::int64_t width, std::int64_t height);

/// Builds the environment. O(texels), on TBB threads; the result does not depend on their number. Reports the second
/// half of a load's progress. Throws as check_environment_size() does, Error(file) with the name first if the number of
/// values differs from the number of pixels, and Error(cancelled).
EnvironmentPtr make_environment(const EnvironmentPixels& pixels, const std::string& name, Progress* progress = nullptr);

/// Returns the image at another size, rows from the top down: each pixel is the mean of the texels it covers.
std::vector<glm::vec3> pixels_of(const Environment& environment, std::uint32_t width, std::uint32_t height);

/// An environment as used in a scene.
struct Surroundings {
  EnvironmentPtr environment;     ///< null: the sky of DistantLights
  float rotation_degrees = 0.0F;  ///< about +Y, from +Z towards +X
  float strength = 1.0F;          ///< factor for its radiance
  bool operator==(const Surroundings&) const = default;
};

}  // namespace cumulet::light
