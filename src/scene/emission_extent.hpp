#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "scene/channels.hpp"
#include "volume/optical_depth.hpp"

namespace cumulet::scene {

/// Returns world-space points around the parts of a volume that emit visibly: at least a hundredth of its brightest
/// part. Returns nothing if nothing emits. emission: with the temperature scale that applies to the volume. O(cells).
[[nodiscard]] std::vector<glm::dvec3> emitting_points(const volume::CoarseVolume& flame,
                                                      const volume::CoarseVolume& temperature,
                                                      const Emission& emission);

}  // namespace cumulet::scene
