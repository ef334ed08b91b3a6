#pragma once

// The kinds of lights in a scene, and the probability with which NEE samples each kind. No GL.

#include <vector>

#include "base/parameters.hpp"
#include "light/distant_lights.hpp"
#include "light/environment.hpp"
#include "light/scene_lights.hpp"

namespace cumulet::light {

/// The kinds of glsl/light/light.glsl.
enum class Kind { sky, sun, triangle, analytic_light, emissive, environment, cell };

/// The emission of a medium.
struct MediumLight {
  /// If set, a part of the rays scattered at surfaces and on the ground is aimed at the medium's box.
  bool aimed = false;
  /// Luminance per steradian of all cells that NEE may sample; 0: none.
  double power = 0.0;
  double length = 0.0;  ///< world: cube root of the volume of a uniform emitter, see scene::EmissiveSum
  double radius = 0.0;  ///< world: radius of the bounding box of the medium
};

/// Returns cosine and sine of an environment's rotation, from +Z towards +X.
glm::vec2 turn_of(const Surroundings& surroundings);

/// Returns the harmonics of an environment without its mean, before rotation; 0 for a sky.
Harmonics harmonics_of(const Surroundings& surroundings);

/// Returns the radiance of the sky, or the mean radiance of the environment that replaces it.
glm::vec3 sky_of(const DistantLights& distant, const Surroundings& surroundings);

/// Returns the irradiance of sun and sky, or of the environment that replaces the sky, on a horizontal plane that faces
/// up.
glm::vec3 level_irradiance(const DistantLights& distant, const Surroundings& surroundings);

/// A value: recomputed when a light changes.
class LightTable {
 public:
  /// All lights of a kind.
  struct Entry {
    Kind kind = Kind::sky;
    /// Probability of sampling this kind at a vertex. Probabilities sum to 1 unless there is no light. For
    /// Kind::emissive: the fraction of rays scattered at surfaces and on the ground that is aimed at the medium.
    float probability = 0.0F;
  };

  /// An environment in `surroundings` replaces the sky.
  LightTable(const DistantLights& distant, const Surroundings& surroundings, const SceneLights& scene,
             const MediumLight& medium);

  [[nodiscard]] const std::vector<Entry>& entries() const { return entries_; }
  /// Returns 0 for a kind that does not occur.
  [[nodiscard]] float probability(Kind kind) const;
  /// Returns the parameters of the kernels.
  [[nodiscard]] core::CmLights parameters() const;

 private:
  DistantLights distant_;
  Surroundings surroundings_;
  std::vector<Entry> entries_;
};

}  // namespace cumulet::light
