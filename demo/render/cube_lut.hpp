#pragma once

#include <cumulet/cumulet.h>

#include <cstdint>
#include <istream>
#include <string>
#include <vector>

namespace cumulet::demo {

/// A display LUT of a .cube file (Adobe Cube LUT Specification 1.0).
struct CubeLut {
  std::uint32_t size = 0;   ///< points per axis
  float domain_min = 0.0F;  ///< equal in all channels
  float domain_max = 1.0F;
  std::vector<float> values;  ///< 3 per point, red fastest
};

/// Reads a 3D LUT. name: for messages. Throws std::runtime_error, one line with the name and the cause.
[[nodiscard]] CubeLut read_cube_lut(std::istream& file, const std::string& name);
[[nodiscard]] CubeLut read_cube_lut(const std::string& path);

/// Returns the descriptor of a LUT, which must outlive it.
[[nodiscard]] cumulet_display_lut_desc desc_of(const CubeLut& lut, cumulet_lut_shaper shaper);

}  // namespace cumulet::demo
