#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "light/environment.hpp"

namespace cumulet::light {

/// Decodes an OpenEXR image as an environment: linear Rec. 709, equirectangular, the whole display window. Reads one
/// flat part of any storage and compression. The channels are R, G and B; or X, Y and Z; or Y with or without RY and
/// BY. Channels without a layer are preferred to those of a layer. Choices and conversions are listed in `remarks`.
/// Throws Error(file), one line with the path and the cause, and Error(cancelled).
EnvironmentPixels read_exr(std::vector<std::uint8_t> bytes, const std::string& path, Progress* progress);

}  // namespace cumulet::light
