#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/shared_code.hpp"
#include "light/emitters.hpp"
#include "scene/instance_transform.hpp"
#include "scene/raster_source.hpp"
#include "scene/texture_atlas.hpp"
#include "surface/bvh.hpp"
#include "surface/scene.hpp"

namespace cumulet::scene {

/// Deformation of a mesh while the shutter is open: its vertices and the boxes of its BVH move linearly from one end to
/// the other. Offsets are in words of the model.
struct MeshEnds {
  struct End {
    std::uint32_t nodes = 0;  ///< offset of each table: those of the mesh's own BVH, refitted to this end
    std::uint32_t records = 0;
    std::uint32_t vertices = 0;  ///< of the whole model
  };
  End open;
  End close;
  glm::dvec3 low{0.0};  ///< bounds of both ends
  glm::dvec3 high{0.0};
};

/// Triangles with a common BVH: those posed in the model's own world space, or those of a prototype. Offsets are in
/// words of the model.
struct ModelMesh {
  std::uint32_t first_triangle = 0;
  std::uint32_t triangle_count = 0;
  surface::Bvh bvh;
  double built_cost = 0.0;                ///< cost of the BVH when it was built, before refits
  std::vector<glm::dmat4> transforms{1};  ///< transforms to the model's own world space
  std::optional<std::size_t> prototype;   ///< index in the scene; empty: positions are relative to the pose's origin
  std::uint32_t nodes = 0;                ///< offset of each table
  std::uint32_t records = 0;
  std::uint32_t triangles = 0;
  std::uint32_t emitters = 0;
  std::uint32_t emitter_count = 0;
  double flux = 0.0;                                  ///< as in light::EmitterTable, in the mesh's own space
  std::optional<MeshEnds> ends;                       ///< empty: it does not deform
  std::vector<ShutterTransforms> shutter_transforms;  ///< of each instance; empty: none moves
};

/// Everything that is rendered of one pose of a scene, in main memory: the tables for paths and for the surface pass.
/// No GL.
struct ModelSource {
  surface::ScenePtr scene;
  surface::Pose pose;
  std::vector<ModelMesh> meshes;  ///< meshes that have triangles
  std::vector<light::EmissiveTriangle> emissive;
  std::vector<glm::uvec4> words;  ///< the tables of glsl/surface/surface.glsl, except textures
  std::uint32_t vertices = 0;     ///< offset of the vertices, which all meshes share
  std::uint32_t materials = 0;
  surface::BsdfVariant bsdf = surface::BsdfVariant::basic;  ///< that all visible materials need
  bool clear_surfaces = false;                              ///< some visible triangles are surface::may_be_clear()
  std::shared_ptr<const TextureImages> images;
  std::shared_ptr<const RasterSource> raster;
  std::vector<glm::vec3> centres;  ///< centers of the raster's blended triangles
};

using ModelSourcePtr = std::shared_ptr<const ModelSource>;

/// Returns the bounding box of the tree's triangles as (low, high); low is above high if there are none.
std::pair<glm::dvec3, glm::dvec3> box_of(const surface::Bvh& bvh);

/// Builds the BVH and the tables. ends: the poses at shutter open and close; empty: nothing moves. In between, vertices
/// and instances move linearly. Visibility and everything else come from `pose`. Throws Error(cancelled).
ModelSourcePtr make_model_source(surface::ScenePtr scene, surface::Pose pose, Progress* progress,
                                 const std::optional<surface::PoseEnds>& ends = std::nullopt);
/// Updates to another pose of the same scene: refits the BVH and packs the tables again; images are shared.
ModelSourcePtr make_model_source(const ModelSource& last, surface::Pose pose, Progress* progress,
                                 const std::optional<surface::PoseEnds>& ends = std::nullopt);

}  // namespace cumulet::scene
