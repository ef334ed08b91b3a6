#pragma once

// Table of the volume instances of a scene for shaders: glsl/traversal/instance.glsl. No GL.

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/parameters.hpp"
#include "scene/march_source.hpp"
#include "scene/snapshot.hpp"
#include "scene/threaded_tree.hpp"

namespace cumulet::core {
#include "traversal/instance_table.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

inline constexpr std::size_t max_clip_planes = 14;

/// A volume instance: a source, its transform and its medium.
struct Instance {
  MarchSourcePtr source;      ///< not null
  glm::dmat4 transform{1.0};  ///< affine transform from the world space of the source
  core::CmGrid grid{};        ///< where the source's data are, and the bounding box of all of them
  core::CmMedium medium{};
  bool hidden_from_camera = false;
  std::optional<ShutterTransforms> ends = {};  ///< transforms at shutter open and close; empty: it does not move
  EmissiveSum emissive{};                      ///< emission of the source's cells
  ClipPlanes clip = {};                        ///< at most max_clip_planes
};

/// The arrays are copied to buffers unchanged; `ends` follows `records`.
struct InstanceTable {
  std::vector<core::CmInstance> records;  ///< in the order of the instances
  /// Transforms of all instances at shutter open, then at shutter close; only the spaces are set. Empty if nothing
  /// moves.
  std::vector<core::CmInstance> ends;
  /// At least one; the box of the first contains all others. Clip records follow the tree's nodes.
  std::vector<core::CmInstanceNode> nodes;
  double emissive_power = 0.0;  ///< of all instances; see EmissiveSum for both
  double emissive_length = 0.0;
};

/// Returns the origin of the scene's frame in world space, at most twice the scene size from its center. It depends
/// only on the instances, not on earlier origins, so that the same scene renders bit-identically. It rarely changes
/// while instances move. Not finite if a transform is not.
glm::dvec3 origin_of(std::span<const Instance> instances);

/// Builds the table. origin: a world point near the scene, the origin of its frame. Rays never hit an instance with an
/// empty box. Throws Error(invalid_argument) for a transform that is not finite, is singular or scales too far. Throws
/// Error(unsupported) for an instance that reaches 1e12 or more from the origin. Messages count instances from 0. O(n
/// log n).
InstanceTable make_instances(std::span<const Instance> instances, const glm::dvec3& origin);

}  // namespace cumulet::scene
