#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "light/environment.hpp"

namespace cumulet::light {

/// Reads a Radiance .hdr or an OpenEXR picture (told apart by content; R, G and B, or Y alone, of the layer without a
/// name). Throws Error(file), one line with the path and the cause.
EnvironmentPixels read_environment(const std::string& path);
/// The same of a Radiance file's bytes; name stands for the path.
EnvironmentPixels read_radiance(std::span<const std::uint8_t> bytes, const std::string& name);

}  // namespace cumulet::light
