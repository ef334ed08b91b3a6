#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <vector>

namespace cumulet::demo {

/// A display LUT that owns its colors.
struct DisplayLut {
  std::uint32_t size = 0;  ///< points per axis
  cumulet_lut_shaper shaper = CUMULET_LUT_SHAPER_SRGB;
  float domain_min = 0.0F;  ///< equal in all channels
  float domain_max = 1.0F;
  std::vector<float> values;  ///< 3 per point, red fastest
};

/// Returns the descriptor of a LUT, which must outlive it.
[[nodiscard]] inline cumulet_display_lut_desc desc_of(const DisplayLut& lut) {
  cumulet_display_lut_desc desc{};
  desc.struct_size = sizeof desc;
  desc.values = lut.values.data();
  desc.value_count = lut.values.size();
  desc.size = lut.size;
  desc.shaper = lut.shaper;
  desc.domain_min = lut.domain_min;
  desc.domain_max = lut.domain_max;
  return desc;
}

}  // namespace cumulet::demo
