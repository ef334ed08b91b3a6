#pragma once

// The models of a scene, as shaders are told of them: glsl/model.glsl. No GL.

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <utility>
#include <vector>

#include "light/scene_lights.hpp"
#include "scene/model_source.hpp"
#include "scene/snapshot.hpp"
#include "scene/threaded_tree.hpp"

namespace cumulet::core {
#include "model_table.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// Where a source's tables are, in words of the page that they are in.
struct ModelWords {
  std::uint32_t first = 0;
  std::uint32_t textures = 0;
};

/// Which part of which model a record is of.
struct ModelPart {
  std::uint32_t model = 0;
  std::uint32_t mesh = 0;
  std::uint32_t placing = 0;  // of that
};

/// Records and nodes go into buffers as they are; of a scene without triangles there is one record, which nothing
/// meets.
struct ModelTable {
  std::vector<core::CmModel> records;  ///< one for each place of each mesh
  /// Behind them: where all stand as the shutter opens, then as it closes, and the tables of those that deform as they
  /// are then. Empty where nothing moves.
  std::vector<core::CmModel> ends;
  std::vector<core::CmInstanceNode> nodes;    ///< at least one
  std::vector<ModelPart> parts;               ///< of the records
  std::vector<surface::PunctualLight> lamps;  ///< of all models, where they stand
  std::vector<std::uint32_t> lamp_groups;     ///< of these, each one's group of lights
  light::SceneLights lights;
  glm::dvec3 low{0.0};  ///< of all triangles; of none both are 0
  glm::dvec3 high{0.0};

  /// The record that has a triangle of this number.
  [[nodiscard]] std::size_t record_of(std::uint32_t triangle) const;
};

/// A model's lamp, placed in the world. Its intensity stays. to_world: from where its position counts.
surface::PunctualLight placed(surface::PunctualLight light, const glm::dmat4& to_world);

/// World bounds of a model's triangles; nothing where it has none.
struct ModelBounds {
  glm::dvec3 low{0.0};
  glm::dvec3 high{0.0};
  bool any = false;
};
ModelBounds bounds_of(const ModelSource& source, const glm::dmat4& to_world);

/// Whether a model may have that place: affine, and neither flat nor endless as floats go.
bool can_stand(const glm::dmat4& to_world);

/// words: of each source. Throws Error(invalid_argument) for a place that is not finite or makes things flat or
/// endless, Error(unsupported) for one 1e12 or more from the origin of the world, and for more than 2^32 triangles,
/// each counted wherever it stands; the message counts models from 0. O(n log n).
ModelTable make_model_table(std::span<const Model> models, const std::function<ModelWords(const ModelSource&)>& words);

}  // namespace cumulet::scene
