#pragma once

// An equirectangular picture of all that is far away, as a light. No GL.

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "base/progress.hpp"
#include "light/gloss.hpp"

namespace cumulet::light {

/// Radiance of all directions, linear Rec. 709, rows from the top (+Y) down; the middle is at +Z and +X left of it, as
/// seen from within.
struct EnvironmentPixels {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<glm::vec3> values;
  std::vector<std::string> remarks{};  ///< what a reader had to choose, convert or ignore
};

/// What radiance of all directions has beyond its mean: coefficients of x, y, z, xy, yz, zx, xx - zz and yy - zz, in
/// the order of glsl/harmonics.glsl.
using Harmonics = std::array<glm::vec3, 8>;

/// The picture with what it takes to look for light in it (glsl/environment.glsl). Immutable, and shared.
struct Environment {
  static constexpr std::uint32_t max_side = 16384;

  std::string name;  ///< for messages
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  /// One a texel. x: texel i, drawn evenly, stands for itself where a random word is at most x, y: else for this texel
  /// (Walker's alias method, as of light::EmitterTable), by luminance times the sine of the row's angle from +Y; z, w:
  /// red and green, blue as halves in units of the float whose upper half is w's.
  std::vector<glm::uvec4> words;
  glm::dvec3 mean{0.0};  ///< over all directions
  Harmonics harmonics{};
  GlossPtr gloss;  ///< null: nothing beyond the mean
  /// Of looks by solid angle, over a texel's weight by the sine: the weights' sum times a texel's solid angle by the
  /// sine, inverted. 0: there is no light.
  float density = 0.0F;
  std::vector<std::string> remarks;  ///< what its reader had to choose, convert or ignore
  std::uint64_t replaced = 0;        ///< pixels that were not finite, negative or above 1e30, where that counts as 0

  [[nodiscard]] std::size_t texels() const { return words.size(); }
};
using EnvironmentPtr = std::shared_ptr<const Environment>;

/// Throws Error(file) that begins with the name for a picture without pixels, or of a side above max_side.
void check_environment_size(const std::string& name, std::int64_t width, std::int64_t height);

/// O(texels), on TBB's threads, the same by any number of them; the second half of a load's progress. Throws as
/// check_environment_size does, Error(file) that begins with the name for another number of values than pixels, and
/// Error(cancelled).
EnvironmentPtr make_environment(const EnvironmentPixels& pixels, const std::string& name, Progress* progress = nullptr);

/// It at another size, rows from the top down: each pixel the mean of the texels in its place.
std::vector<glm::vec3> pixels_of(const Environment& environment, std::uint32_t width, std::uint32_t height);

/// How a scene is surrounded by one.
struct Surroundings {
  EnvironmentPtr environment;     ///< null: by the sky of DistantLights
  float rotation_degrees = 0.0F;  ///< about +Y, from +Z towards +X
  float strength = 1.0F;          ///< times its radiance
  bool operator==(const Surroundings&) const = default;
};

}  // namespace cumulet::light
