#pragma once

#include <istream>
#include <string>

#include "display_lut.hpp"

namespace cumulet::demo {

/// Reads the 3D LUT of a .cube file (Adobe Cube LUT Specification 1.0), which does not name its shaper. name: for
/// messages. Throws std::runtime_error, one line with the name and the cause.
[[nodiscard]] DisplayLut read_cube_lut(std::istream& file, const std::string& name);
[[nodiscard]] DisplayLut read_cube_lut(const std::string& path);

}  // namespace cumulet::demo
