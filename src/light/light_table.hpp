#pragma once

// Which lights there are, and how likely paths look for each kind: one selection over all of them. No GL.

#include <vector>

#include "base/parameters.hpp"
#include "light/distant_lights.hpp"
#include "light/environment.hpp"
#include "light/scene_lights.hpp"

namespace cumulet::light {

/// The kinds of glsl/light.glsl.
enum class Kind { sky, sun, triangle, lamp, glow, environment, cell };

/// What there is of a medium's own light.
struct MediumLight {
  /// Flights that surfaces send off are aimed at its box: it falls on surfaces.
  bool aimed = false;
  /// Luminance a steradian of all that looks may find; 0: none.
  double power = 0.0;
  double length = 0.0;  ///< world: the cube root of the volume that would give off as much, were it even
  double radius = 0.0;  ///< world: of the box that it is in
};

/// Cosine and sine of what an environment is turned by, from +Z towards +X.
glm::vec2 turn_of(const Surroundings& surroundings);

/// What an environment is beyond its mean, before it is turned; of a sky nothing.
Harmonics harmonics_of(const Surroundings& surroundings);

/// The sky's radiance; the mean over all directions of an environment that is there instead.
glm::vec3 sky_of(const DistantLights& distant, const Surroundings& surroundings);

/// A value: made anew when a light changes.
class LightTable {
 public:
  /// All the lights of a kind.
  struct Entry {
    Kind kind = Kind::sky;
    /// Of what is looked for at a vertex, the share that these are; their shares sum to 1, or there is no light. Of
    /// glow: the share of flights that surfaces send off towards it.
    float chance = 0.0F;
  };

  /// Surroundings with an environment are there instead of the sky.
  LightTable(const DistantLights& distant, const Surroundings& surroundings, const SceneLights& scene,
             const MediumLight& medium);

  [[nodiscard]] const std::vector<Entry>& entries() const { return entries_; }
  /// 0 for a kind that is not there.
  [[nodiscard]] float chance(Kind kind) const;
  /// What kernels are told.
  [[nodiscard]] core::CmLights parameters() const;

 private:
  DistantLights distant_;
  Surroundings surroundings_;
  std::vector<Entry> entries_;
};

}  // namespace cumulet::light
