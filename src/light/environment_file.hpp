#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "light/environment.hpp"

namespace cumulet::light {

/// Reads a Radiance .hdr or an OpenEXR picture (told apart by content; R, G and B, or Y alone, of the layer without a
/// name); the first half of a load's progress. Throws Error(file), one line with the path and the cause, and
/// Error(cancelled).
EnvironmentPixels read_environment(const std::string& path, Progress* progress = nullptr);
/// The same of a Radiance file's bytes; name stands for the path.
EnvironmentPixels read_radiance(std::span<const std::uint8_t> bytes, const std::string& name,
                                Progress* progress = nullptr);
/// Both halves.
EnvironmentPtr open_environment(const std::string& path, Progress* progress = nullptr);

}  // namespace cumulet::light
