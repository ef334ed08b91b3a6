#pragma once

// Table of the models of a scene for shaders: glsl/surface/model.glsl. No GL.

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
#include "surface/model_table.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// Offsets of a source's tables, in words of their page.
struct ModelWords {
  std::uint32_t first = 0;
  std::uint32_t textures = 0;
};

/// The model, mesh and instance of a record.
struct ModelPart {
  std::uint32_t model = 0;
  std::uint32_t mesh = 0;
  std::uint32_t instance = 0;  // index within the mesh
};

/// Records and nodes are copied to buffers unchanged. A scene without triangles has one record, which no ray hits.
struct ModelTable {
  std::vector<core::CmModel> records;  ///< one for each instance of each mesh
  /// Follow the records in the buffer: the transforms at shutter open, then at shutter close, and for deforming meshes
  /// the tables at that end. Empty if nothing moves.
  std::vector<core::CmModel> ends;
  std::vector<core::CmInstanceNode> nodes;              ///< at least one
  std::vector<ModelPart> parts;                         ///< of the records, in their order
  std::vector<surface::PunctualLight> analytic_lights;  ///< lights of all models, in world space
  std::vector<std::uint32_t> analytic_light_groups;     ///< light group of each of them
  light::SceneLights lights;
  glm::dvec3 low{0.0};  ///< bounds of all triangles; both are 0 if there are none
  glm::dvec3 high{0.0};

  /// Returns the index of the record that contains this triangle number.
  [[nodiscard]] std::size_t record_of(std::uint32_t triangle) const;
};

/// Transforms a model's light to world space. Its intensity is unchanged. to_world: from the space of its position.
surface::PunctualLight transformed(surface::PunctualLight light, const glm::dmat4& to_world);

/// World bounds of a model's triangles; `any` is false if it has none.
struct ModelBounds {
  glm::dvec3 low{0.0};
  glm::dvec3 high{0.0};
  bool any = false;
};
ModelBounds bounds_of(const ModelSource& source, const glm::dmat4& to_world);

/// Whether the transform is usable for a model: finite, not singular, and within float range.
bool can_stand(const glm::dmat4& to_world);

/// Builds the table. words: returns the offsets of a source. Throws Error(invalid_argument) for a transform that is not
/// finite, is singular or scales too far. Throws Error(unsupported) for a model that reaches 1e12 or more from the
/// world origin. Also throws it for more than 2^32 triangles, counted once per instance. Messages count models from 0.
/// O(n log n).
ModelTable make_model_table(std::span<const Model> models, const std::function<ModelWords(const ModelSource&)>& words);

}  // namespace cumulet::scene
