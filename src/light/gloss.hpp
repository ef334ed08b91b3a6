#pragma once

// What GGX lobes see of all that is far away (glsl/gloss.glsl). No GL.

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

namespace cumulet::light {

/// Beyond the mean over all directions: texels of each roughness, the smoothest first, in rows from +Y down. Immutable,
/// and shared.
using Gloss = std::vector<glm::vec4>;
using GlossPtr = std::shared_ptr<const Gloss>;

/// Radiance at another size, as pixels_of() has it.
using PixelsOf = std::function<std::vector<glm::vec3>(std::uint32_t width, std::uint32_t height)>;

/// O(1): some millions of products, on TBB's threads, the same by any number of them.
GlossPtr make_gloss(const PixelsOf& pixels, const glm::dvec3& mean);

}  // namespace cumulet::light
