#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/shared_code.hpp"
#include "light/emitters.hpp"
#include "scene/place.hpp"
#include "scene/raster_source.hpp"
#include "scene/texture_atlas.hpp"
#include "surface/bvh.hpp"
#include "surface/scene.hpp"

namespace cumulet::scene {

/// How a mesh deforms while the shutter is open: its triangles, and the boxes of its tree, go straight from one end to
/// the other. Words: of the model's.
struct MeshEnds {
  struct End {
    std::uint32_t nodes = 0;  ///< where each of its tables begins: those of the mesh's own tree, fitted to this end
    std::uint32_t records = 0;
    std::uint32_t vertices = 0;  ///< of the whole model
  };
  End open;
  End close;
  glm::dvec3 low{0.0};  ///< bounds of both ends
  glm::dvec3 high{0.0};
};

/// Triangles that stand together, with a tree of their own: those that are posed in the model's own world, or a
/// prototype's. Words: of the model's.
struct ModelMesh {
  std::uint32_t first_triangle = 0;
  std::uint32_t triangle_count = 0;
  surface::Bvh bvh;
  double built_cost = 0.0;               ///< of the tree before it was refitted
  std::vector<glm::dmat4> placings{1};   ///< to the model's own world
  std::optional<std::size_t> prototype;  ///< of the scene; nothing: it counts from the pose's origin
  std::uint32_t nodes = 0;               ///< where each of its tables begins
  std::uint32_t records = 0;
  std::uint32_t triangles = 0;
  std::uint32_t emitters = 0;
  std::uint32_t emitter_count = 0;
  double flux = 0.0;                    ///< as light::EmitterTable has it, in its own space
  std::optional<MeshEnds> ends;         ///< nothing: it does not deform
  std::vector<PlaceEnds> placing_ends;  ///< of each placing; empty: all stand still
};

/// What is shown of one pose of a scene, in main memory: what paths read, and what the surface pass does. No GL.
struct ModelSource {
  surface::ScenePtr scene;
  surface::Pose pose;
  std::vector<ModelMesh> meshes;  ///< those that have triangles
  std::vector<light::EmissiveTriangle> emissive;
  std::vector<glm::uvec4> words;  ///< the tables of glsl/surface.glsl, but for textures
  std::uint32_t vertices = 0;     ///< where those begin that all meshes share
  std::uint32_t materials = 0;
  bool rich = false;  ///< it shows materials that need CM_RICH (glsl/ggx.glsl)
  std::shared_ptr<const TextureImages> images;
  std::shared_ptr<const RasterSource> raster;
  std::vector<glm::vec3> centres;  ///< of the raster's blended triangles
};

using ModelSourcePtr = std::shared_ptr<const ModelSource>;

/// The box that all triangles of a tree are in, low and high; empty, low above high, where there are none.
std::pair<glm::dvec3, glm::dvec3> box_of(const surface::Bvh& bvh);

/// Builds the BVH and the tables. ends: of the shutter; nothing: it stands still. In between vertices and placings go
/// straight; what is there, and all but that, is the pose's. Throws Error(cancelled).
ModelSourcePtr make_model_source(surface::ScenePtr scene, surface::Pose pose, Progress* progress,
                                 const std::optional<surface::PoseEnds>& ends = std::nullopt);
/// The same scene in another pose: refits and packs anew; images stay.
ModelSourcePtr make_model_source(const ModelSource& last, surface::Pose pose, Progress* progress,
                                 const std::optional<surface::PoseEnds>& ends = std::nullopt);

}  // namespace cumulet::scene
