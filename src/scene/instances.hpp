#pragma once

// A scene's instances of volumes, as shaders are told of them: glsl/instance.glsl. No GL.

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/parameters.hpp"
#include "scene/march_source.hpp"
#include "scene/snapshot.hpp"
#include "scene/threaded_tree.hpp"

namespace cumulet::core {
#include "instance_table.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// One of them: a volume at a place, of a medium.
struct Instance {
  MarchSourcePtr source;  ///< not null
  glm::dmat4 place{1.0};  ///< affine, from the world that the source was made in
  core::CmGrid grid{};    ///< where the source's data are, and the box that holds them all
  core::CmMedium medium{};
  bool hidden_from_camera = false;
  std::optional<PlaceEnds> ends = {};  ///< as the place; nothing: it stands still
  GlowSum glow{};                      ///< of the source's cells
};

/// All arrays go into buffers as they are; ends behind the records.
struct InstanceTable {
  std::vector<core::CmInstance> records;  ///< in the order of the instances
  /// Where all stand as the shutter opens, then as it closes: spaces alone. Empty where nothing moves.
  std::vector<core::CmInstance> ends;
  std::vector<core::CmInstanceNode> nodes;  ///< at least one; the first's box holds all there is
  double glow_power = 0.0;                  ///< of all of them, as GlowSum has both
  double glow_length = 0.0;
};

/// Where the scene's frame begins, in the world: no farther from the middle of what is there than twice its size. Of
/// the instances alone, whatever was there before, so that the same scene is the same picture to the last bit; and
/// seldom another one while they move. Not finite where a place is not.
glm::dvec3 origin_of(std::span<const Instance> instances);

/// origin: a point of the world near the scene, where its frame begins. What is empty is never met. Throws
/// Error(invalid_argument) for a place that is not finite or makes things flat or endless, Error(unsupported) for one
/// 1e12 or more from the origin; the message counts instances from 0. O(n log n).
InstanceTable make_instances(std::span<const Instance> instances, const glm::dvec3& origin);

}  // namespace cumulet::scene
