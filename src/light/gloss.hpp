#pragma once

// What GGX lobes see of all that is far away (glsl/gloss.glsl). No GL.

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "base/progress.hpp"

namespace cumulet::light {

/// Beyond the mean over all directions: texels of each roughness, the smoothest first, in rows from +Y down. Immutable,
/// and shared.
using Gloss = std::vector<glm::vec4>;
using GlossPtr = std::shared_ptr<const Gloss>;

/// An equirectangular picture, as EnvironmentPixels has it.
struct GlossSource {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::function<void(std::uint32_t y, std::vector<glm::vec3>& row)> read;  ///< writes `width` texels, on any thread
};

/// Null where there is nothing beyond the mean but rounding. O(texels), beside some millions of products, on TBB's
/// threads, the same by any number of them; the last twentieth of a load's progress. Throws Error(cancelled).
GlossPtr make_gloss(const GlossSource& source, const glm::dvec3& mean, Progress* progress = nullptr);

}  // namespace cumulet::light
