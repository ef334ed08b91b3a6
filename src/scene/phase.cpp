#include "scene/phase.hpp"

#include <cmath>

namespace cumulet::scene {

Phase mie_phase(float diameter) {
  const double d = diameter;
  const double g_forward = std::exp(-0.0990567 / (d - 1.67154));
  const double g_draine = std::exp(-2.20679 / (d + 3.91029) - 0.428934);
  const double alpha = std::exp(3.62489 - 8.29288 / (d + 5.52825));
  const double share = std::exp(-0.599085 / (d - 0.641583) - 0.665888);
  return {static_cast<float>(g_forward), static_cast<float>(g_draine), static_cast<float>(alpha),
          static_cast<float>(share)};
}

double mean_cosine(const Phase& phase) {
  const double g = phase.second_anisotropy;
  const double bend = phase.second_bend;
  const double second = g * (1.0 + bend * (3.0 + 2.0 * g * g) / 5.0) / (1.0 + bend * (1.0 + 2.0 * g * g) / 3.0);
  return (1.0 - phase.second_weight) * double{phase.anisotropy} + phase.second_weight * second;
}

}  // namespace cumulet::scene
