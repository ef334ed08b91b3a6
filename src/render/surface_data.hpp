#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "gl/objects.hpp"
#include "gl/word_heap.hpp"
#include "light/emitters.hpp"
#include "light/scene_lights.hpp"
#include "render/march_data.hpp"
#include "render/parameters.hpp"
#include "render/raster_source.hpp"
#include "surface/bvh.hpp"
#include "surface/scene.hpp"

namespace cumulet::render {

/// Images packed into layers of one size, each placed once: glsl/surface.glsl wraps and filters by itself.
struct TextureAtlas {
  struct Place {
    glm::uvec2 corner{0U};
    glm::uvec2 size{0U};
    std::uint32_t layer = 0;
  };
  std::uint32_t edge = 1;  // of a layer
  std::uint32_t layers = 0;
  std::vector<Place> places;  // of each image
  /// Of each image, what is put there where that is not the image itself.
  std::vector<std::vector<std::uint8_t>> smaller;
};

/// Shelves of falling height. largest: the widest layer the driver takes; images beyond it are halved until they fit.
TextureAtlas pack_atlas(const std::vector<surface::Image>& images, std::uint32_t largest);

/// What the path tracer needs of one pose of a scene, in main memory. No GL.
struct SurfaceSource {
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

/// Builds the BVH and the tables. Throws Error(cancelled).
std::shared_ptr<const SurfaceSource> make_surface_source(surface::ScenePtr scene, surface::Pose pose,
                                                         Progress* progress);
/// The same scene in another pose: refits and packs anew; images stay.
std::shared_ptr<const SurfaceSource> make_surface_source(const SurfaceSource& last, surface::Pose pose,
                                                         Progress* progress);

/// What paths read of a SurfaceSource on the GPU. All calls need the context current and a StateGuard around.
class SurfaceData {
 public:
  /// Plans how it comes to GL: it is whole when all steps are done, and they may not outlive it. Images are shared with
  /// `last` (may be null) where the scene is the same. Throws Error(unsupported).
  static std::unique_ptr<SurfaceData> plan(const gl::FunctionsPtr& gl, const gl::Limits& limits, gl::WordHeap& heap,
                                           Upload& upload, const SurfaceSource& source, const SurfaceData* last);
  void bind(const gl::Functions& gl) const;
  [[nodiscard]] const core::CmSurfaceTables& tables() const { return tables_; }
  [[nodiscard]] const light::SceneLights& lights() const { return lights_; }
  /// What it is of, to tell one from another.
  [[nodiscard]] const surface::Scene* scene() const { return scene_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  gl::WordHeap::Span words_;
  std::shared_ptr<gl::Object> atlas_;
  const surface::Scene* scene_ = nullptr;
  core::CmSurfaceTables tables_{};
  light::SceneLights lights_;
  std::uint64_t bytes_ = 0;
};

}  // namespace cumulet::render
