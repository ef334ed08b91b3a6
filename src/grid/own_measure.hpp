#pragma once

#include "grid/refine_settings.hpp"

namespace cumulet::grid {

/// Parameters of the refinement criterion for a field, as passed to shaders.
struct OwnMeasure {
  float scale = 0.0F;
  float own_hiding = 0.0F;
  float floor = 0.0F;  ///< criteria not above it count as 0
  bool linear = false;
  bool two_way = true;  ///< two-way transmittance (density) instead of one-way (emission)
  Criterion criterion = Criterion::transmittance;
};

}  // namespace cumulet::grid
