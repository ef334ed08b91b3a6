#pragma once

// Prefiltered environment maps: the environment convolved with GGX lobes, for rasterized reflections
// (glsl/light/prefiltered.glsl). No GL.

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "base/progress.hpp"

namespace cumulet::light {

/// Prefiltered radiance without the mean over all directions: one map per roughness, the smoothest first, in rows from
/// +Y down. Immutable and shared.
using PrefilteredEnvironment = std::vector<glm::vec4>;
using PrefilteredEnvironmentPtr = std::shared_ptr<const PrefilteredEnvironment>;

/// An equirectangular image, oriented as EnvironmentPixels.
struct PrefilterSource {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::function<void(std::uint32_t y, std::vector<glm::vec3>& row)> read;  ///< writes `width` texels; any thread
};

/// Prefilters an environment. Returns null if the source is constant except for rounding. O(texels), plus some millions
/// of products, on TBB threads; the result does not depend on their number. Reports the last twentieth of a load's
/// progress. Throws Error(cancelled).
PrefilteredEnvironmentPtr prefilter(const PrefilterSource& source, const glm::dvec3& mean,
                                    Progress* progress = nullptr);

}  // namespace cumulet::light
