#include "jobs/built.hpp"

namespace cumulet::viewer {

namespace {

// Maximum ratio of opacities for which a grid refined by opacity can be reused.
constexpr double max_opacity_ratio = 2.0;

bool apart(double a, double b) { return a > max_opacity_ratio * b || b > max_opacity_ratio * a; }

}  // namespace

bool suits(const BuildSettings& made, const BuildSettings& wanted) {
  BuildSettings alike = made;
  alike.refine.density_scale = wanted.refine.density_scale;
  alike.refine.anisotropy = wanted.refine.anisotropy;
  if (alike != wanted) return false;
  const grid::RefineSettings& a = made.refine;
  const grid::RefineSettings& b = wanted.refine;
  if (wanted.march != scene::March::tet || b.criterion != grid::Criterion::transmittance) return true;
  return !apart(a.density_scale, b.density_scale) &&
         !apart(grid::hiding(a.density_scale, a.anisotropy), grid::hiding(b.density_scale, b.anisotropy));
}

std::uint64_t Built::bytes() const {
  // Voxel sources share the volume's data.
  const std::uint64_t read = source && source->volume && volume ? source->volume->bytes() : 0;
  const std::uint64_t statistics = source && source->statistics && volume ? source->statistics->bytes() : 0;
  const std::uint64_t channels = source && volume ? source->channels.bytes() : 0;
  const std::uint64_t lattice = source && source->plan && volume ? source->plan->lattice->bytes() : 0;
  return (volume ? volume->bytes() : 0) + (source ? source->bytes() : 0) - read - statistics - channels - lattice;
}

bool Built::serves(const BuildSettings& wanted) const {
  BuildSettings made = settings;
  if (!moves) made.shutter_seconds = wanted.shutter_seconds;
  return suits(made, wanted);
}

}  // namespace cumulet::viewer
