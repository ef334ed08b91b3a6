#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "light/environment.hpp"

namespace cumulet::light {

/// Decodes an OpenEXR picture as an environment: linear Rec. 709, latitude and longitude, all of its display window.
/// It reads one flat part of any storage and compression, of channels R, G and B, or X, Y and Z, or Y with or without
/// RY and BY, without a layer if there are such, else of one layer. What it had to choose or convert is in `remarks`.
/// Throws Error(file), one line with the path and the cause, and Error(cancelled).
EnvironmentPixels read_exr(std::vector<std::uint8_t> bytes, const std::string& path, Progress* progress);

}  // namespace cumulet::light
