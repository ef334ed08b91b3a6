#pragma once

namespace cumulet::scene {

/// A phase function, as CmPhase of glsl/phase.glsl: a Henyey-Greenstein lobe, and a share of the light in a second lobe
/// that is bent as Draine's is.
struct Phase {
  float anisotropy = 0.0F;
  float second_anisotropy = 0.0F;
  float second_bend = 0.0F;
  float second_share = 0.0F;
  bool operator==(const Phase&) const = default;
  /// Whether the first lobe's anisotropy may be another from place to place: not of a fit.
  [[nodiscard]] bool may_vary() const { return second_bend == 0.0F; }
};

/// Of water droplets in visible light, by the fit of Jendersie and d'Eon, "An Approximate Mie Scattering Function for
/// Fog and Cloud Rendering" (2023). diameter: 5 to 50 micrometres.
Phase mie_phase(float diameter);

/// The mean cosine between the directions before and after.
double mean_cosine(const Phase& phase);

}  // namespace cumulet::scene
