#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "base/parameters.hpp"
#include "light/emitters.hpp"
#include "light/scene_lights.hpp"
#include "scene/raster_source.hpp"
#include "scene/texture_atlas.hpp"
#include "surface/bvh.hpp"
#include "surface/scene.hpp"

namespace cumulet::scene {

/// What is shown of one pose of a scene, in main memory: what paths read, and what the surface pass does. No GL.
struct ModelSource {
  surface::ScenePtr scene;
  surface::Pose pose;
  surface::Bvh bvh;
  double built_cost = 0.0;  // of the tree before it was refitted
  std::vector<light::EmissiveTriangle> emissive;
  std::vector<glm::uvec4> words;   // the tables of glsl/surface.glsl
  core::CmSurfaceTables tables{};  // where each begins
  light::SceneLights lights;
  std::shared_ptr<const TextureAtlas> atlas;
  std::shared_ptr<const RasterSource> raster;
  std::vector<glm::vec3> centres;  // of the raster's blended triangles
};

using ModelSourcePtr = std::shared_ptr<const ModelSource>;

/// Builds the BVH and the tables. Throws Error(cancelled).
ModelSourcePtr make_model_source(surface::ScenePtr scene, surface::Pose pose, Progress* progress);
/// The same scene in another pose: refits and packs anew; images stay.
ModelSourcePtr make_model_source(const ModelSource& last, surface::Pose pose, Progress* progress);

}  // namespace cumulet::scene
