#pragma once

#include <optional>

#include "frame_plan.hpp"
#include "options.hpp"

namespace cumulet::demo {

/// Sets the up axis of the volume to that of its metadata, if the options leave it open. A sequence has the axis of its
/// largest file. Prints a line on standard error if Z is up, or a hint for each volume that lies on its side.
void choose_up_axis(RenderOptions& options, const std::optional<FramePlan>& plan);

}  // namespace cumulet::demo
