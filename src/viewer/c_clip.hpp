#pragma once

// A host's clip of a volume.

#include "cumulet/cumulet.h"
#include "scene/snapshot.hpp"

namespace cumulet::c_abi {

/// Returns the planes of a clip and of its box; none for NULL. Throws Error(invalid_argument) for an invalid clip.
[[nodiscard]] scene::ClipPlanes clip_planes_of(const cumulet_clip_desc* desc);

}  // namespace cumulet::c_abi
