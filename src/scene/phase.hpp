#pragma once

namespace cumulet::scene {

/// A phase function, as CmPhase of glsl/path/phase.glsl: a Henyey-Greenstein lobe, and a second lobe of Draine's form
/// with weight second_weight.
struct Phase {
  float anisotropy = 0.0F;
  float second_anisotropy = 0.0F;
  float second_bend = 0.0F;
  float second_weight = 0.0F;
  bool operator==(const Phase&) const = default;
  /// Whether the anisotropy of the first lobe may vary in space; not for a fitted phase function.
  [[nodiscard]] bool may_vary() const { return second_bend == 0.0F; }
};

/// Returns the phase function of water droplets in visible light: the fit of Jendersie and d'Eon, "An Approximate Mie
/// Scattering Function for Fog and Cloud Rendering" (2023). diameter: 5 to 50 micrometers.
Phase mie_phase(float diameter);

/// Returns the mean cosine of the scattering angle.
double mean_cosine(const Phase& phase);

}  // namespace cumulet::scene
