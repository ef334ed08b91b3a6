#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "light/environment.hpp"

namespace cumulet::light {

/// Decodes a Radiance image (Ward, "Real Pixels", Graphics Gems II, 1991) as an environment. Accepts any identifier
/// after "#?", all eight orientations, and rows that are flat, in old runs or in runs per channel. EXPOSURE and
/// COLORCORR are divided out; PRIMARIES and XYZE are converted to linear Rec. 709. name: for messages. Throws
/// Error(file), one line with the name and the cause, and Error(cancelled).
EnvironmentPixels read_radiance(std::span<const std::uint8_t> bytes, const std::string& name,
                                Progress* progress = nullptr);

}  // namespace cumulet::light
