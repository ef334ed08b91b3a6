#pragma once

// Where things of a scene were a frame ago, as shaders are told: glsl/motion.glsl. No GL.

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parameters.hpp"
#include "scene/model_table.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::core {
#include "motion.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// Both go into a buffer as they are, one after the other.
struct MotionTable {
  core::CmMotionFrame frame{};
  std::vector<core::CmMotion> maps;
};

/// ray_to_world: of the space that rays are in; volumes: in the order of their table, or the only one; models: those of
/// the table, and vertices_of: where the vertices of a source begin, in words. O(volumes + models).
MotionTable make_motion(const Snapshot& snapshot, const glm::dmat4& ray_to_world, std::span<const Volume> volumes,
                        std::span<const Model> models, const ModelTable* table,
                        const std::function<std::uint32_t(const ModelSource&)>& vertices_of);

}  // namespace cumulet::scene
