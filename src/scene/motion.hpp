#pragma once

// Motion vectors: the transforms of a scene in the previous frame, for shaders (glsl/features/motion.glsl). No GL.

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parameters.hpp"
#include "scene/model_table.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::core {
#include "features/motion.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// Both are copied to one buffer unchanged, `maps` after `frame`.
struct MotionTable {
  core::CmMotionFrame frame{};
  std::vector<core::CmMotion> maps;
};

/// ray_to_world: from the space of rays. volumes: in the order of their table, or the only volume. models: those of the
/// table. vertices_of: returns the offset of a source's vertices, in words. O(volumes + models).
MotionTable make_motion(const Snapshot& snapshot, const glm::dmat4& ray_to_world, std::span<const Volume> volumes,
                        std::span<const Model> models, const ModelTable* table,
                        const std::function<std::uint32_t(const ModelSource&)>& vertices_of);

}  // namespace cumulet::scene
