#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "light/environment.hpp"

namespace cumulet::light {

/// Decodes a Radiance picture (Ward, "Real Pixels", Graphics Gems II, 1991) as an environment: any identifier after
/// "#?", all eight orientations, rows that are flat, in old runs or in runs a channel. EXPOSURE and COLORCORR are
/// divided out, PRIMARIES and XYZE converted to linear Rec. 709. The name is for messages. Throws Error(file), one line
/// with the name and the cause, and Error(cancelled).
EnvironmentPixels read_radiance(std::span<const std::uint8_t> bytes, const std::string& name,
                                Progress* progress = nullptr);

}  // namespace cumulet::light
